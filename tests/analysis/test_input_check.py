"""Checks of inputs: designs of known sizes, shares that add up, and what is said of them."""

import dataclasses

import numpy as np
import pytest

from kop_exudyn.analysis.input_check import DesignCheck, check_designs, harmonised
from kop_exudyn.files.json_files import read_json
from kop_exudyn.io.designs import load_design
from kop_exudyn.structures.base import design_from_dict, rescaled

PARTS = {"linear": 4, "angular": 3}


@pytest.fixture(scope="module")
def file(repository):
    return repository / "models" / "small" / "01_sinh.json"


@pytest.fixture(scope="module")
def small(file):
    return load_design(file)


def other(file, name, scale):
    return design_from_dict(rescaled(read_json(file), scale) | {"name": name}, str(file))


def test_a_rescaled_design_is_brought_back(file, small):
    larger = other(file, "larger", 1.15)
    sizes, before, after = harmonised([small, larger], PARTS, (0.8, 1.25))
    assert sizes["small sinh"] == 1.0
    assert sizes["larger"] == pytest.approx(1 / 1.15, rel=0.02)
    assert after < 0.5 * before
    within = harmonised([small, larger], PARTS, (0.95, 1.0))[0]
    assert 0.95 * (1 - 1e-12) <= within["larger"] <= 1.0


def test_what_is_said_of_designs_that_do_not_suit_each_other(file, small):
    designs = [small, other(file, "same", 1.0), other(file, "twice", 2.0)]
    checks = check_designs(designs, PARTS, scales=(0.8, 1.25))
    assert [check.name for check in checks] == ["small sinh", "same", "twice"]
    for name, total in (("elements_percent", 100), ("energy_percent", 100)):
        assert sum(getattr(check, name) for check in checks) == pytest.approx(total)
    first, same, twice = checks
    assert first.failed is None and not first.problems and first.max_percent < 0.1
    # the smaller ones are alike: without one of them the other is served as before, or worse
    assert twice.others_gain_percent > 50 > first.others_gain_percent
    assert twice.length_ratio == pytest.approx(2.0) and first.length_ratio < 1
    assert "divide its curves into 2 times as many pieces" in twice.advice[0]
    assert twice.best_scale == pytest.approx(0.8) and twice.scale_gain_percent > 5
    dearest = twice.expensive[0]
    # numbered as in assembly plans: from 1, one group after the other
    rows = [row for g in small.groups for row in g.indices]
    factor = 2.0 if dearest.kind == "linear" else 1.0
    np.testing.assert_allclose(
        dearest.parameters, factor * small.parameters[rows[dearest.number - 1]], rtol=1e-6
    )


def test_one_design_alone_has_no_others(small):
    (check,) = check_designs([small], PARTS)
    assert (check.energy_percent, check.length_ratio) == (pytest.approx(100), None)
    assert check.advice == [] and check.to_dict()["problems"] == []


def test_problems_in_words():
    fine = DesignCheck("one", None, 0.5, 0.1, utilisation={"deployed": 0.9, "rest": None})
    assert fine.problems == []
    stressed = dataclasses.replace(fine, utilisation={"deployed": 1.25}, max_percent=2.0)
    assert "is 2 % off its own target" in stressed.problems[0]
    assert "125 % of the elastic limit (deployed)" in stressed.problems[1]
    assert "80 % of it would just do" in stressed.problems[1]
    fitted = dataclasses.replace(stressed, fitted_percent=0.4)
    assert "could bring that to 0.4 %" in fitted.problems[0]
    assert DesignCheck("two", failed="why").problems == ["doesn't open: why"]
