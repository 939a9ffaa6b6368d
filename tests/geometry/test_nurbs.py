"""Points on B-splines, against circles, polynomials and scipy's own evaluation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from kop_exudyn.errors import InputError
from kop_exudyn.geometry.nurbs import spline_points

CIRCLE = np.array(
    [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)], float
)
KNOTS = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
WEIGHTS = np.where(np.arange(9) % 2, np.sqrt(0.5), 1.0)


def flat(points):
    return np.column_stack([points, np.zeros(len(points))])


def test_a_rational_circle_is_round():
    x = spline_points(flat(CIRCLE), KNOTS, 2, WEIGHTS, 1e-5)
    assert np.hypot(*x[:, :2].T) == pytest.approx(1, abs=1e-14)
    steps = np.linalg.norm(np.diff(x, axis=0), axis=1)
    assert (steps**2 / 8).max() < 1e-5  # the sag of a chord of the unit circle
    assert steps.max() > 1e-3  # and no more points than that needs


def test_without_weights_it_is_not_round():
    x = spline_points(flat(CIRCLE), KNOTS, 2, None, 1e-5)
    assert np.ptp(np.hypot(*x[:, :2].T)) > 0.05


def test_degree_one_has_its_corners_alone():
    x = spline_points(flat(CIRCLE[:4]), [0, 0, 1, 2, 3, 3], 1, None, 1e-9)
    assert np.array_equal(x, flat(CIRCLE[:4]))


def test_a_part_begins_and_ends_where_it_should():
    whole = spline_points(flat(CIRCLE), KNOTS, 2, WEIGHTS, 1e-5)
    part = spline_points(flat(CIRCLE), KNOTS, 2, WEIGHTS, 1e-5, (1.0, 3.0))
    assert part[0] == pytest.approx([0, 1, 0], abs=1e-12)
    assert part[-1] == pytest.approx([0, -1, 0], abs=1e-12)
    assert len(part) < len(whole)


@settings(max_examples=40, deadline=None)
@given(st.integers(2, 5), st.integers(0, 10_000), st.booleans())
def test_sags_are_kept(degree, seed, periodic):
    """Against scipy's evaluation between the points, at other parameters."""
    rng = np.random.default_rng(seed)
    control = rng.normal(size=(degree + 4, 3))
    m = len(control)
    inner = np.sort(rng.uniform(0, 1, m - degree - 1))
    ends = [0.0] * (degree + 1), [1.0] * (degree + 1)
    t = np.arange(m + degree + 1.0) if periodic else np.concatenate([ends[0], inner, ends[1]])
    x = spline_points(control, t, degree, None, 1e-3)
    fine = BSpline(t, control, degree)(np.linspace(t[degree], np.nextafter(t[m], 0), 2000))
    a, along = x[:-1], np.diff(x, axis=0)
    share = np.einsum("nmk,mk->nm", fine[:, None] - a, along) / np.sum(along**2, axis=1)
    nearest = a + np.clip(share, 0, 1)[..., None] * along
    away = np.linalg.norm(fine[:, None] - nearest, axis=2).min(axis=1)
    assert away.max() < 2e-3
    assert x[0] == pytest.approx(fine[0]) and x[-1] == pytest.approx(fine[-1])


@pytest.mark.parametrize(
    "knots, degree, weights, between, message",
    [
        (KNOTS[1:], 2, None, None, "has 11 knots with 9 control points and degree 2: expected 12"),
        (KNOTS, 0, None, None, "has degree 0"),
        (KNOTS, 9, None, None, "more of them are needed"),
        (KNOTS[::-1], 2, None, None, "knots that increase"),
        ([*KNOTS[:-1], np.nan], 2, None, None, "knots that increase"),
        ([0] * 12, 2, None, None, "knots that increase"),
        (KNOTS, 2, [1.0] * 8, None, "positive weight"),
        (KNOTS, 2, [0.0] * 9, None, "positive weight"),
        (KNOTS, 2, None, (-1.0, 2.0), "begins at -1 and ends at 2, its knots go from 0 to 4"),
        (KNOTS, 2, None, (2.0, 2.0), "begins at 2"),
    ],
)
def test_what_does_not_fit_is_refused(knots, degree, weights, between, message):
    with pytest.raises(InputError, match=message):
        spline_points(flat(CIRCLE), knots, degree, weights, 1e-3, between)
