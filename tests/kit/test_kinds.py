"""Kinds of parts: what they realise, their canonical forms and bounds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kop_exudyn.errors import InputError
from kop_exudyn.kit.kinds import Variants, kind_names, part_kind

NAMES = ["angular", "cell", "linear", "slit"]


def test_discovered_kinds():
    assert kind_names() == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_canonical_form_realises_the_same_elements(name):
    kind = part_kind(name)
    part = np.arange(kind.n_parameters, 0, -1.0)[None]
    for variants in kind.variants.values():
        realised, again = (
            np.einsum("vek,k->ve", variants.matrices, p[0]) for p in (part, kind.canonical(part))
        )
        assert sorted(map(tuple, realised)) == sorted(map(tuple, again))
        assert len(variants.names) == len(variants.matrices)
    np.testing.assert_array_equal(kind.canonical(kind.canonical(part)), kind.canonical(part))


@pytest.mark.parametrize("name", NAMES)
def test_lifted_part_realises_the_element(name):
    kind = part_kind(name)
    for size, variants in kind.variants.items():
        elements = np.random.default_rng(1).uniform(1, 2, (4, size))
        for near in (None, np.full((4, kind.n_parameters), 0.3)):
            parts = variants.lift(elements, near)
            for element, part in zip(elements, parts):
                assert np.abs(variants.residuals(element[None], part[None])[0, 0, 0]).max() < 1e-14


def test_end_element_keeps_the_other_side():
    variants = part_kind("linear").variants_of(1)
    np.testing.assert_allclose(variants.lift(np.array([[3.0]])), [[3, 3]])
    np.testing.assert_allclose(variants.lift(np.array([[3.0]]), np.array([[1.0, 2.0]])), [[3, 2]])


@given(st.floats(-3, 8), st.floats(0, 3))
def test_slit_part_realises_an_interval(length, slit):
    variants = part_kind("slit").variants_of(1)
    residual = variants.residuals(np.array([[length]]), np.array([[1.0, 2.0, slit]]))[0, 0, :, 0]
    for side, low in enumerate((1.0, 2.0)):
        expected = min(length - low, 0) + max(length - low - slit, 0)
        assert residual[side] == pytest.approx(expected, abs=1e-14)


def test_contact_is_the_linear_form_of_the_residual():
    variants = part_kind("slit").variants_of(2)
    rng = np.random.default_rng(2)
    elements, parts, variant = (
        rng.uniform(0, 4, (50, 2)),
        rng.uniform(0, 2, (50, 3)),
        rng.integers(0, 2, 50),
    )
    rows, active = variants.contact(elements, variant, parts)
    linear = np.where(active, elements - np.einsum("nek,nk->ne", rows, parts), 0)
    rows = np.arange(50)
    np.testing.assert_allclose(
        linear, variants.residuals(elements, parts)[rows, rows, variant], atol=1e-14
    )
    assert 0 < active.sum() < active.size


def test_scale_is_the_median_length_or_one():
    assert part_kind("linear").scale(np.array([1.0, 2.0, 9.0])) == 2
    assert part_kind("angular").scale(np.array([0.1, -0.2])) == 1


def test_bounds_are_narrowed_and_must_leave_something():
    lower, upper = part_kind("angular").bounds({"angular": (-1, 0.5)})
    assert (lower[0], upper[0]) == (0, 0.5)
    with pytest.raises(InputError, match="no part lies"):
        part_kind("linear").bounds({"linear": (3, 2)})
    for unusable in ((0, [1, 2, 3]), (0, "a"), (1,), (0, 1, 2)):
        with pytest.raises(InputError, match="a lower and an upper"):
            part_kind("linear").bounds({"linear": unusable})
    with pytest.raises(InputError, match="no part lies"):
        part_kind("linear").bounds({"linear": (np.nan, 2)})


def test_bad_kinds():
    with pytest.raises(InputError, match="unknown kind"):
        part_kind("curved")
    with pytest.raises(InputError, match="have 1, 2 parameters"):
        part_kind("linear").variants_of(3)
    with pytest.raises(ValueError, match="diagonal"):
        Variants(("sum",), [[[1, 1]]])
