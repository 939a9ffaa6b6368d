"""Slit parts in the search: elements slide in their parts, which cost, and both are optimised."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize
from support.zigzags import zigzags

from kop_exudyn.errors import InputError
from kop_exudyn.io.datasets import load_designs
from kop_exudyn.kit.kinds import part_kind
from kop_exudyn.kit.part_costs import PartCosts
from kop_exudyn.kit.parts import Kit
from kop_exudyn.search.dataset import Dataset
from kop_exudyn.search.job import described_job
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.problems import AssignedProblem
from kop_exudyn.search.reassign import LocalModel, best_parts, improved, keep_parts
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings, StageSettings
from kop_exudyn.search.sliding import best_in_boxes
from kop_exudyn.search.stages import Stages
from kop_exudyn.search.weights import Weights
from kop_exudyn.structures.serving import served_by

STAGES = StageSettings(
    schedule=(1e3, 1e4),
    relaxed_steps=8,
    round_steps=8,
    reassignments=1,
    leaps=0,
    path_steps=2,
    levelling=0,
    effort="quick",
    requirements=Requirements.none(),
)
SETTINGS = JobSettings(jobs=1, stages=STAGES, baselines=False)


@pytest.fixture(scope="module")
def stages():
    designs = served_by(zigzags(), {"slit": 2, "angular": 2})
    with DesignPool(designs, 1) as pool:
        pool.prepare()
        dataset = Dataset.of_pool(pool, Weights.suiting(designs))
        yield Stages(dataset, {"slit": 2, "angular": 2}, STAGES)


@pytest.fixture(scope="module")
def direct(stages):
    return stages.direct()


def outside(result) -> float:
    """By how much the furthest element of a stage's designs lies outside of its part."""
    q = np.concatenate([design.q for design in result.designs])
    return float(np.abs(q - result.assignment.realise(result.kit, q)).max())


@given(st.integers(0, 10_000), st.integers(1, 2), st.booleans())
def test_the_best_place_in_a_box_is_found(seed, k, definite):
    rng = np.random.default_rng(seed)
    low = rng.normal(size=(3, k))
    high = low + rng.random((3, k))
    root = rng.normal(size=(k, k))
    block = root @ root.T if definite else root + root.T
    slope = rng.normal(size=k)

    def value(d):
        return d @ slope + 0.5 * d @ block @ d

    steps, gains = best_in_boxes(low, high, slope, block)
    for a, b, step, gain in zip(low, high, steps, gains):
        assert np.all((step >= a) & (step <= b)) and gain == pytest.approx(value(step), abs=1e-12)
        for start in (a, b, 0.5 * (a + b)):
            found = minimize(value, start, bounds=list(zip(a, b)))
            assert gain <= found.fun + 1e-9


def test_limits_take_from_the_slit():
    kind = part_kind("slit")
    limited = kind.limited(np.array([[1.0, 2.0, 0.9], [1.0, 2.0, 0.1]]))
    assert np.allclose(limited, [[1, 2, 0.5], [1, 2, 0.1]])
    assert np.all(limited @ kind.limits.T <= 1e-15)
    linear = np.array([[1.0, 2.0]])
    assert np.array_equal(part_kind("linear").limited(linear), linear)


def test_linear_elements_are_made_of_slit_parts_where_a_kit_has_no_others():
    designs = zigzags()
    same = served_by(designs, {"linear": 2, "angular": 1})
    assert all(a is b for a, b in zip(same, designs))
    slit = served_by(designs, {"slit": 2, "angular": 1})
    assert [g.kind for g in slit[0].groups] == ["slit", "angular"]
    assert [g.kind for g in designs[0].groups] == ["linear", "angular"]
    assert np.array_equal(slit[1].parameters, designs[1].parameters)
    with pytest.raises(InputError, match="parts.slit: linear elements are made of linear parts or"):
        served_by(designs, {"slit": 2, "linear": 1})


def test_searches_without_slits_are_described_as_before():
    for parts, known in (({"linear": 2}, False), ({"slit": 2}, True)):
        job = described_job(zigzags(), parts, None, SETTINGS)
        assert ("slit_cost" in job["stages"]) is known


def test_costs_are_those_of_the_projection_at_every_weight(stages):
    kit = Kit({"angular": [0.1, 0.2], "slit": [[0.3, 0.4, 0.02], [0.3, 0.35, 0.05]]})
    q, scale = stages.q0, stages.projection.scales["slit"]
    expected = 0.5 * 1e-3 * stages.dataset.weights.fit * np.mean([0.02**2, 0.05**2]) / scale**2
    assert stages.costs.value(kit) == pytest.approx(expected, rel=1e-12)
    flat = kit.with_vector(np.where(kit.vector < 0.06, 0, kit.vector))
    for weight in (1.0, 1e4):
        paid, free = (
            stages.projection.with_weight(weight, stages.costs.at_weight(weight)) for _ in range(2)
        )
        assignment = paid.assign(q, kit).assignment
        own = paid.energy(q, kit, assignment)
        free = stages.projection.with_weight(weight, {"slit": (0, 0, 0)})
        assert own - free.energy(q, kit, assignment) == pytest.approx(expected, rel=1e-6)
    assert stages.costs.value(flat) == 0 and PartCosts().value(kit) == 0


def test_the_problem_has_the_elements_in_slits_as_variables(stages, direct):
    problem = stages.assigned_problem(direct, range(2))
    q = np.concatenate([design.q for design in direct.designs])
    x = problem.variables(q)
    assert problem.n == 2 + 6 + 16 and len(problem.sliding) == 16
    assert np.allclose(problem.matrix @ x, q, atol=1e-14)
    assert problem.constraints.violation(x) < 1e-12
    # out of its slit at either end, and slits longer than half of their sides
    for change in ({8: -0.1}, {8: 0.1}, {4: 0.3, 7: 0.3}):
        off = x.copy()
        for place, by in change.items():
            off[place] += by
        assert problem.constraints.violation(off) > 1e-3
    point = problem.evaluate(x, None)
    assert point.value == pytest.approx(direct.value, rel=1e-9)
    gradient = problem.derivatives(point).gradient
    assert np.allclose(gradient, problem.first_derivatives(point).gradient, atol=1e-9)
    direction = np.cos(np.arange(problem.n)) * problem.scale
    errors = []
    for h in (4e-4, 1e-4):
        ahead, back = (problem.evaluate(x + s * direction, point).value for s in (h, -h))
        slope = (ahead - back) / (2 * h)
        errors.append(abs(slope - gradient @ direction))
    assert errors[1] < errors[0] / 12 and errors[1] < 1e-3 * abs(slope), errors
    without = gradient.copy()
    without[:8] -= problem.costs.curvature(direct.kit) * direct.kit.vector
    assert slope != pytest.approx(without @ direction, rel=1e-3)


def test_bounds_on_sides_hold_beside_the_longest_slit(stages, direct):
    bounds = {"slit": (np.array([0.25, 0.25, -np.inf]), np.inf)}
    problem = AssignedProblem(stages.dataset, direct.kit, direct.assignment, bounds)
    x = problem.variables(np.concatenate([design.q for design in direct.designs]))
    kit = Kit({"angular": direct.kit["angular"], "slit": [[0.3, 0.4, 0.01], [0.4, 0.4, 0.049]]})
    x[:8] = kit.vector
    rows = [n for n, name in enumerate(problem.constraints.names) if name.startswith("limit")]
    values = (problem.constraints.A @ x - problem.constraints.lower)[rows]
    assert values.min() == pytest.approx(0.3 - 0.049 - 0.25, abs=1e-12)


def test_elements_get_the_part_in_which_they_have_the_best_place(stages, direct):
    dataset = stages.dataset
    derivatives = dataset.derivatives(direct.evaluations, hessian=True)
    scales = dataset.split(dataset.scales())
    model = LocalModel.of(derivatives, dataset.design_weights, scales, 1e-3)
    problem = stages.assigned_problem(direct, range(2))
    x = problem.variables(np.concatenate(model.base))
    for move in (keep_parts, best_parts):
        moved = move(problem, x, model)
        assert (problem.constraints.violation(moved) < 1e-7) and (
            np.array_equal(moved[:8], x[:8]) is (move is keep_parts)
        )
        alone = model.values(dataset.split(problem.matrix @ moved)).sum() + problem.cost(moved)
        found = improved(problem, model, move_parts=move)
        assert found.total <= alone - problem.cost(x) + 1e-9 and found.total < 0
        end = problem.reassigned(found.assignment)
        end.kit = found.kit
        q = end.matrix @ np.append(found.kit.vector, found.free)
        assert np.abs(q - found.assignment.realise(found.kit, q)).max() < 1e-8
        assert found.changes == found.assignment.changes(problem.assignment)


@pytest.fixture(scope="module")
def found(repository):
    designs = load_designs(repository / "models" / "small", 2)
    return {
        kind: optimize_kit(designs, {kind: 4, "angular": 3}, settings=SETTINGS)
        for kind in ("linear", "slit")
    }


def test_four_slit_parts_beat_four_plain_ones(found):
    """In the same objective: that of the slit kit has the slits' cost in it."""
    plain, slit = (found[kind].stages["assigned"] for kind in ("linear", "slit"))
    assert slit.value < 0.8 * plain.value
    assert slit.kit.sizes == {"angular": 3, "slit": 4} and slit.kit["slit"][:, 2].max() > 1e-4
    for name in ("direct", "assigned"):
        stage = found["slit"].stages[name]
        assert outside(stage) < 1e-9
        assert np.all(part_kind("slit").limits @ stage.kit["slit"].T <= 1e-9)
        own = sum(e.value for e in stage.evaluations)
        assert stage.value > own and stage.value - own < 0.5 * stage.value
    assert slit.value < found["slit"].stages["direct"].value
    lengths = np.concatenate([e.q for e in slit.evaluations])
    assert outside(found["slit"].stages["relaxed"]) > 1e-6, "relaxed elements are no parts yet"
    assert np.isfinite(lengths).all()


def test_a_design_slides_in_the_parts_of_a_kit_that_exists(found, repository):
    kit = found["slit"].kit
    designs = load_designs(repository / "models" / "small", 2)[1:]
    result = optimize_kit(designs, kit=kit, settings=SETTINGS)
    assigned = result.stages["assigned"]
    assert np.array_equal(assigned.kit.vector, kit.vector) and outside(assigned) < 1e-9
    assert assigned.value < result.at_parts.value
