"""Parameters that belong to no element: the optimisation moves them, no part has to realise
them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from support.settings import FEW_ERRORS

from kop_exudyn.kit.cluster import cluster
from kop_exudyn.search.dataset import Dataset
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.problems import AssignedProblem
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings, StageSettings
from kop_exudyn.search.weights import Weights
from kop_exudyn.sqp.problem import Point
from kop_exudyn.structures.base import Design, design_from_dict
from kop_exudyn.structures.umbrella.generator import design_on_surface, height_field, hexagon_patch
from kop_exudyn.structures.umbrella.layout import BaseMesh

EDGE = 30 + 3 * np.sqrt(3)


def mesh(name: str, bend: float, pinned: bool):
    vertices, faces = height_field(lambda x, y: -(x**2 + bend * y**2) / 500, 600.0, 16)
    data = design_on_surface(name, BaseMesh(*hexagon_patch(1, EDGE)), vertices, faces)
    return design_from_dict(data | ({"pins": {"joints": [0, 2, 4]}} if pinned else {}))


@pytest.fixture(scope="module")
def designs():
    return [mesh("pinned", 0.6, True), mesh("free", 0.2, False), mesh("pinned too", -0.3, True)]


@pytest.fixture(scope="module")
def outcome(designs):
    stages = StageSettings(
        schedule=(1e3, 1e4),
        relaxed_steps=4,
        assigned_steps=4,
        round_steps=4,
        reassignments=1,
        path_steps=2,
        levelling=0,
        requirements=FEW_ERRORS,
    )
    return optimize_kit(
        designs, {"cell": 3}, settings=JobSettings(jobs=1, baselines=False, stages=stages)
    )


def test_the_problem_over_parts_has_them_as_variables(designs):
    with DesignPool(designs, 1) as pool:
        pool.prepare()
        dataset = Dataset.of_pool(pool, Weights())
        assert dataset.free.tolist() == [*range(12, 21), *range(45, 54)]
        found = cluster(dataset.groups, dataset.parameters, {"cell": 3})
        problem = AssignedProblem(dataset, found.kit, found.assignment)
        x = problem.variables(dataset.parameters)
        assert problem.n == 6 + 18
        q = problem.matrix @ x
        assert np.array_equal(q[dataset.free], dataset.parameters[dataset.free])
        assert np.array_equal(problem.kit_of(x).vector, found.kit.vector)
        assert np.array_equal(problem.free_of(x), dataset.parameters[dataset.free])
        assert np.allclose(
            problem.lower[6:], np.concatenate([designs[0].lower[12:], designs[2].lower[12:]])
        )
        assert np.allclose(problem.scale[6:15], designs[0].free_scale)

        point: Point = problem.evaluate(x, None)
        gradient = problem.derivatives(point).gradient
        direction = np.cos(np.arange(problem.n))
        ahead, back = (problem.evaluate(x + h * direction, point).value for h in (1e-3, -1e-3))
        assert (ahead - back) / 2e-3 == pytest.approx(gradient @ direction, rel=1e-4)


def test_every_stage_moves_them_and_only_elements_become_parts(designs, outcome):
    direct, relaxed, assigned = (outcome.stages[name] for name in ("direct", "relaxed", "assigned"))
    for n in (0, 2):
        start = designs[n].parameters[12:]
        assert np.array_equal(direct.designs[n].q[12:], start)
        for stage in (relaxed, assigned):
            moved = stage.designs[n].q[12:] - start
            assert 1e-3 < np.abs(moved).max() <= designs[n].pins.reach
    realised = assigned.assignment.matrix(assigned.kit) @ assigned.kit.vector
    q = np.concatenate([e.q for e in assigned.designs])
    elements = np.setdiff1d(np.arange(len(q)), [*range(12, 21), *range(45, 54)])
    assert np.allclose(q[elements], realised[elements], rtol=1e-12)
    assert assigned.value < direct.value


def test_pinned_joints_follow_in_the_results(designs, outcome):
    for n in (0, 2):
        final = outcome.stages["assigned"].designs[n]
        joints = final.equilibria["deployed"].state.positions[designs[n].joints[[0, 2, 4]]]
        assert np.allclose(joints, final.q[12:].reshape(3, 3), atol=1e-6)
        assert final.confirmations["deployed"].moved < 1e-6


def test_designs_without_groups_are_all_free():
    design = SimpleNamespace(groups=[], parameters=np.zeros(4))
    assert Design.free.fget(design).tolist() == [0, 1, 2, 3]
