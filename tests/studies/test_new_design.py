"""A design projected onto a kit that wasn't made for it."""

from __future__ import annotations

import numpy as np
import pytest

from kop_exudyn.io.datasets import load_designs
from kop_exudyn.kit.cluster import cluster
from kop_exudyn.kit.groups import ElementGroup
from kop_exudyn.kit.parts import Assignment
from kop_exudyn.search.settings import StageSettings
from lib.new_design import changed_parameters, project_design

STAGES = StageSettings(relaxed_steps=4, path_steps=2, reassignments=1)


@pytest.fixture(scope="module")
def found(repository):
    """The third small design on a kit of the first one, with a weak and a strong w_c."""
    first, second, third = load_designs(repository / "models" / "small")
    kit = cluster(first.groups, first.parameters, {"linear": 6, "angular": 3}).kit
    return {factor: project_design(third, kit, factor, STAGES) for factor in (1e-2, 1e2)}


def test_a_strong_weight_brings_elements_to_their_parts(found):
    weak, strong = found[1e-2], found[1e2]
    for kind in ("linear", "angular"):
        assert strong["relaxed"]["tightness"][kind] < 0.2 * weak["relaxed"]["tightness"][kind]
    assert weak["relaxed"]["fit"]["max_percent"] < strong["relaxed"]["fit"]["max_percent"]


def test_the_direct_state_is_the_same_and_changes_count_from_it(found):
    weak, strong = found[1e-2], found[1e2]
    assert weak["direct"]["objective"] == pytest.approx(strong["direct"]["objective"], rel=1e-9)
    for result in found.values():
        assert result["direct"]["changes"] == 0 and len(result["direct"]["changed"]) == 0
        assert result["reassigned"]["objective"] <= result["built"]["objective"]
        for state in ("built", "reassigned"):
            changes = result[state]["changes"]
            assert changes <= len(result[state]["changed"]) <= 2 * changes
    assert strong["built"]["changes"] > 0


def test_changed_places_are_those_of_the_elements():
    groups = (
        ElementGroup("linear", np.array([[0, 1], [2, 3]])),
        ElementGroup("angular", np.array([[4], [5]])),
    )
    before = Assignment(
        groups, (np.array([0, 0]), np.array([0, 0])), (np.array([0, 0]), np.array([0, 1])), 6
    )
    after = Assignment(
        groups, (np.array([0, 1]), np.array([0, 0])), (np.array([0, 0]), np.array([1, 1])), 6
    )
    assert changed_parameters(before, after).tolist() == [2, 3, 4]
    assert changed_parameters(before, before).tolist() == []
