"""Kits for sweeps: what they tell, and what starting from a neighbouring kit is worth."""

from __future__ import annotations

import numpy as np
import pytest

from kop_exudyn.io.datasets import load_designs
from kop_exudyn.kit.parts import Assignment, Kit
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.settings import StageSettings
from lib.kit_search import find_kit

STAGES = StageSettings(
    schedule=(1e4, 1e6),
    relaxed_steps=6,
    round_steps=6,
    reassignments=1,
    path_steps=3,
    restarts=5,
    effort="quick",
    levelling=0,
    requirements=Requirements(samples=2),
)


@pytest.fixture(scope="module")
def designs(repository):
    return load_designs(repository / "models" / "small")[1:]


@pytest.fixture(scope="module")
def large(designs):
    return find_kit(designs, {"linear": 6, "angular": 2}, STAGES)


def test_the_elements_are_what_the_kit_realises(designs, large):
    kit = Kit.from_dict(large["kit"])
    assert kit.sizes == {"angular": 2, "linear": 6}
    offset = len(designs[0].parameters)
    groups = [
        group.shifted(n * offset) for n, design in enumerate(designs) for group in design.groups
    ]
    q = np.concatenate(large["realised"])
    assignment = Assignment.from_dict(large["assignment"], groups, len(q), kit)
    assert np.allclose(assignment.matrix(kit) @ kit.vector, q)
    counts = assignment.pieces(kit)
    for kind in kit.sizes:
        assert (
            np.sum([pieces[kind] for pieces in large["pieces"]], axis=0).tolist()
            == counts[kind].tolist()
        )
    for design, pieces in zip(designs, large["pieces"]):
        assert sum(map(sum, pieces.values())) == design.n_elements


def test_what_a_smaller_kit_can_do_a_larger_one_can_as_well(designs, large):
    """Down from a larger kit, and up again: the larger one begins where the smaller one ended, and
    is found with fewer solves than one from scratch."""
    parts = {"linear": 3, "angular": 2}
    scratch = find_kit(designs, parts, STAGES)
    fewer = find_kit(designs, parts, STAGES, large["realised"])
    more = find_kit(designs, {"linear": 5, "angular": 2}, STAGES, fewer["realised"])
    assert more["objective"] < fewer["objective"]
    assert large["objective"] < min(fewer["objective"], scratch["objective"])
    assert more["equilibria"] < scratch["equilibria"]
    assert all(design["stable"] for design in fewer["designs"])


def test_starting_from_a_kit_of_the_same_size_loses_nothing(designs, large):
    again = find_kit(designs, {"linear": 6, "angular": 2}, STAGES, large["realised"])
    assert again["objective"] <= large["objective"] * (1 + 1e-6)
