"""Fabrication errors: sensitivities against re-solved equilibria, on a C-shell of four by four
rods."""

from copy import copy
from dataclasses import replace

import numpy as np
import pytest

from kop_exudyn.analysis.tolerance import (
    predicted_displacements,
    predicted_spread,
    robustness,
    sampled_spread,
    shares_by_kind,
)
from kop_exudyn.errors import InputError, SimulationFailure
from kop_exudyn.search import objective
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.search.tolerance import (
    Tolerance,
    joint_jacobian,
    relative_tolerance,
    sample_spread,
    usual_tolerance,
)
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.units import Units

SMALL = Tolerance(length=1e-4, angle=1e-4)  # of spans of 1


@pytest.fixture(scope="module")
def built():
    lines = [[[-0.2, y], [2.2, y]] for y in (0.0, 1.0, 2.0)] + [
        [[x, -0.2], [x, 2.2]] for x in (0.0, 1.0, 2.0)
    ]
    design = design_from_dict(
        {
            "format": "kop_exudyn/design",
            "version": 1,
            "class": "c_shell",
            "name": "grid",
            "material": {"young": 2100.0, "poisson": 0.35},
            "section": {"type": "rectangle", "width": 0.02, "height": 0.01},
            "curves": [{"type": "polyline", "points": points} for points in lines],
            "crossings": "find",
            "free_ends": False,
            "rod_offset": 0.0,
            "opening": {"angle": 0.6, "side": "up"},
            "elements_per_piece": 2,
        }
    )
    objective = DesignObjective(design)
    return design, objective.judge(design.parameters, dict(objective.reference.equilibria))


def test_small_errors_agree_with_the_sensitivities(built):
    design, evaluation = built
    samples = sample_spread(design, evaluation, SMALL, 12, seed=3)
    moved = np.stack([sample.displacements for sample in samples])
    difference = np.abs(moved - predicted_displacements(design, evaluation, samples)).max()
    assert difference < 0.02 * np.abs(moved).max()
    first_order = predicted_spread(design, evaluation, SMALL)
    sampled = sampled_spread(samples, evaluation.fit.size)
    # a dozen samples' own spread
    assert sampled.rms_percent == pytest.approx(first_order.rms_percent, rel=0.35)


def test_a_share_of_the_samples_is_confirmed(built, monkeypatch):
    """The others aren't, and say so; one that Exudyn refuses is a failure with its reason."""
    design, evaluation = built
    samples = sample_spread(design, evaluation, SMALL, 5, seed=3, confirmed=0.4)
    assert [sample.confirmed for sample in samples] == [True, False, True, False, False]

    def refused(*arguments, **options):
        raise SimulationFailure("Exudyn refuses the state")

    monkeypatch.setattr(objective, "confirm", refused)
    samples = sample_spread(design, evaluation, SMALL, 5, seed=3, confirmed=0.4)
    assert [sample.failed is None for sample in samples] == [False, True, False, True, True]
    assert "Exudyn refuses" in samples[0].failed


def test_the_linear_prediction_is_second_order_accurate(built):
    design, evaluation = built

    def error(factor):
        samples = sample_spread(design, evaluation, SMALL.scaled(factor), 3, seed=1)
        moved = np.stack([sample.displacements for sample in samples])
        return np.abs(moved - predicted_displacements(design, evaluation, samples)).max()

    assert 3.0 < error(16) / error(8) < 5.0


def test_spread_is_linear_in_the_tolerance_and_shared_by_kind(built):
    design, evaluation = built
    once, twice = (predicted_spread(design, evaluation, SMALL.scaled(k)) for k in (1, 2))
    assert np.allclose(twice.joints, 2 * once.joints) and once.worst_percent >= once.rms_percent > 0
    shares = shares_by_kind(design, evaluation, SMALL)
    assert set(shares) == {group.kind for group in design.groups} and sum(
        shares.values()
    ) == pytest.approx(1)
    assert shares_by_kind(design, evaluation, replace(SMALL, angle=0))["linear"] == pytest.approx(1)


def test_rigid_motions_are_no_displacement(built):
    design, evaluation = built
    J = joint_jacobian(design, evaluation)
    assert np.abs(J.reshape(-1, 3, J.shape[1]).sum(axis=0)).max() < 1e-9 * np.abs(J).max()


def test_failures_are_samples(built):
    design, evaluation = built
    samples = sample_spread(design, evaluation, Tolerance(length=5.0, angle=0.0), 2)
    assert all(sample.failed and sample.displacements is None for sample in samples)
    with pytest.raises(SimulationFailure):
        sampled_spread(samples, 1.0)


def test_bad_tolerances_are_named():
    with pytest.raises(InputError, match="length"):
        Tolerance(length=-1.0, angle=0.0)


def test_robustness_is_plain_and_tells_agreement_and_failures(built):
    design, evaluation = built
    found = robustness(design, evaluation, relative_tolerance(design, 1e-4, 1e-4), (1, 30), 4)
    small, large = found["sizes"]
    lengths = [
        design.parameters[group.indices].ravel()
        for group in design.groups
        if group.kind == "linear"
    ]
    assert found["length"] == 1e-4 * np.median(np.concatenate(lengths))
    assert 5 * small["linear_error"] < large["linear_error"] < 0.1 and small["failed"] == 0
    assert large["predicted_rms_percent"] == pytest.approx(30 * small["predicted_rms_percent"])
    assert len(found["joints_percent"]) == len(design.joints)
    assert robustness(design, evaluation, Tolerance(5.0, 0.0), (1,), 2)["sizes"][0]["failed"] == 2


def test_samples_that_snapped_are_counted_and_not_compared_with_the_prediction(built, monkeypatch):
    design, evaluation = built
    tolerance = relative_tolerance(design, 1e-4, 1e-4)
    (kept,) = robustness(design, evaluation, tolerance, (1,), 2)["sizes"]
    monkeypatch.setattr("kop_exudyn.search.tolerance.snapped", lambda *arguments: True)
    # nothing is taken to be where its sensitivities say, so that every sample is led back
    monkeypatch.setattr("kop_exudyn.search.tolerance.SAME_STATE", -1.0)
    (lost,) = robustness(design, evaluation, tolerance, (1,), 2)["sizes"]
    assert kept["snapped"] == 0 and lost["snapped"] == 2
    assert "linear_error" in kept and "linear_error" not in lost
    assert lost["sampled_rms_percent"] == kept["sampled_rms_percent"]


def test_what_ends_where_it_is_predicted_is_not_led_back(built, monkeypatch):
    def never(*arguments):
        raise AssertionError

    monkeypatch.setattr("kop_exudyn.search.tolerance.snapped", never)
    design, evaluation = built
    assert not any(s.snapped for s in sample_spread(design, evaluation, SMALL, 2))


def test_usual_errors_are_a_fifth_of_a_millimetre_at_least(built):
    design, _ = built
    lengths = np.concatenate(
        [design.parameters[g.indices].ravel() for g in design.groups if g.kind == "linear"]
    )
    unnamed = usual_tolerance(design)
    assert unnamed.length == pytest.approx(1e-3 * np.median(lengths))
    assert unnamed.angle == pytest.approx(np.radians(0.1))
    for unit, expected in (("mm", 0.2), ("m", 1e-3 * np.median(lengths))):
        other = copy(design)
        other.units = Units(unit)
        assert usual_tolerance(other).length == pytest.approx(expected)
