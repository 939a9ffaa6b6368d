"""Slit parts on small C-shells: slits cost fidelity nothing, and what they gain falls with their
price."""

from __future__ import annotations

import numpy as np
import pytest

from kop_exudyn.io.datasets import load_designs
from kop_exudyn.kit.cluster import cluster
from kop_exudyn.kit.groups import ElementGroup
from kop_exudyn.kit.projection import Projection
from lib.slits import distances, slit_kit


@pytest.fixture(scope="module")
def designs(repository):
    return load_designs(repository / "models" / "small", 2)


def test_slits_trade_their_length_for_projection_energy(designs):
    plain, dear, cheap = (
        slit_kit(designs, 3, penalty, restarts=4, path_steps=2) for penalty in (None, 0.1, 1e-3)
    )
    energies = [found["projection_energy"] for found in (plain, dear, cheap)]
    assert energies[0] > energies[1] > energies[2] > 0
    assert max(plain["slits"]) == 0 < np.mean(dear["slits"]) < np.mean(cheap["slits"])
    deviations = [
        max(design["fit"]["max_percent"] for design in found["designs"]) for found in (plain, cheap)
    ]
    assert deviations[1] < 0.5 * deviations[0]
    assert all(design["stable"] for design in cheap["designs"])


def test_as_long_slits_as_needed_change_nothing(designs):
    found = slit_kit(designs, 1, 1e-9, restarts=1, path_steps=1)
    assert found["projection_energy"] < 1e-6 and found["largest_percent"] < 0.1
    for design in found["designs"]:
        assert design["energy_ratio"] == pytest.approx(1, abs=1e-3)


def test_the_energy_is_that_of_the_projection(designs):
    q = designs[0].parameters
    groups = [
        ElementGroup(group.kind, group.indices)
        for group in designs[0].groups
        if group.kind == "linear"
    ]
    found = cluster(groups, q, {"linear": 2})
    projection = Projection.of_inputs(groups, q)
    realised = found.assignment.realise(found.kit, q)
    figures = distances(q, realised, found.assignment, projection.scales["linear"])
    assert figures["projection_energy"] == pytest.approx(
        projection.energy(q, found.kit, found.assignment), rel=1e-12
    )
    assert figures["rms_percent"] < figures["largest_percent"]
