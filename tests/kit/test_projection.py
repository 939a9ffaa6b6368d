"""Projection energy: value, derivatives and minimisation over parts and assignment."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.kit.cluster import cluster
from kop_exudyn.kit.groups import ElementGroup
from kop_exudyn.kit.projection import Projection

RNG = np.random.default_rng(3)
# the last entry belongs to no element
Q = np.concatenate([RNG.uniform(1, 3, 40), RNG.uniform(-1, 1, 15), [5.0]])


def groups(kind="linear"):
    return [
        ElementGroup(kind, np.arange(30).reshape(15, 2)),
        ElementGroup(kind, np.arange(30, 40)[:, None]),
        ElementGroup("angular", np.arange(40, 55)[:, None]),
    ]


@pytest.fixture(params=["linear", "slit"])
def problem(request):
    elements = groups(request.param)
    projection = Projection.of_inputs(elements, Q, weight=7.0)
    kit = cluster(elements, Q, {request.param: 3, "angular": 2}, restarts=3).kit
    return projection, projection.minimise(Q, kit)


def slopes(remainders, steps):
    return np.diff(np.log(remainders)) / np.diff(np.log(steps))


def test_value_by_hand():
    found = cluster(groups(), Q, {"linear": 3, "angular": 2})
    projection = Projection.of_inputs(groups(), Q)
    realised = found.assignment.matrix(found.kit) @ found.kit.vector
    squares = (Q - realised) ** 2
    by_hand = (
        0.5 * squares[:40].sum() / 25 / np.median(Q[:40]) ** 2 + 0.5 * squares[40:55].sum() / 15
    )
    assert projection.energy(Q, found.kit, found.assignment) == pytest.approx(by_hand, rel=1e-13)
    assert sum(found.energy.values()) == pytest.approx(by_hand, rel=1e-13)
    tightness = projection.tightness(Q, found.kit, found.assignment)
    assert sum(n * t**2 / n for n, t in zip((25, 15), tightness.values())) == pytest.approx(
        2 * by_hand, rel=1e-13
    )


def test_minimised_energy_has_the_gradient_and_reduced_hessian(problem):
    projection, best = problem
    direction = np.random.default_rng(1).normal(size=len(Q))
    gradient = projection.gradient(Q, best.kit, best.assignment)
    hessian = projection.hessian(Q, best.kit, best.assignment).reduced()
    steps = np.array([1e-4, 1e-5])
    first, second = [], []
    for h in steps:
        moved = projection.minimise(Q + h * direction, best.kit)
        assert moved.assignment.changes(best.assignment) == 0
        change = moved.energy - best.energy - h * gradient @ direction
        first.append(abs(change))
        second.append(abs(change - 0.5 * h**2 * direction @ hessian @ direction))
    assert slopes(first, steps) == pytest.approx(2, abs=0.05)
    assert max(second) < 1e-12 * best.energy + 1e-6 * min(first)  # quadratic for a fixed assignment


def part_gradient(projection, q, kit, assignment):
    """(n_p,) derivative in the parts. The energy is quadratic in them as long as no element comes
    to the end of an interval: central differences are exact but for rounding."""
    p, h = kit.vector, 1e-3
    sides = (
        [projection.energy(q, kit.with_vector(p + s * e), assignment) for s in (h, -h)]
        for e in np.eye(len(p))
    )
    return np.array([(ahead - back) / (2 * h) for ahead, back in sides])


def test_gradient_in_the_parts_vanishes_at_the_minimum(problem):
    projection, best = problem
    gradient = part_gradient(projection, Q, best.kit, best.assignment)
    lower, _ = best.kit.bounds()
    assert np.abs(gradient[best.kit.vector > lower]).max() < 1e-9
    assert np.all(gradient > -1e-9)


def test_lifted_hessian_is_exact(problem):
    projection, best = problem
    rng = np.random.default_rng(4)
    # Away from the minimum, where elements may touch the end of an interval and the energy has no
    # second derivative.
    n_p, assignment = len(best.kit.vector), best.assignment
    kit = best.kit.with_vector(best.kit.vector + rng.uniform(0.01, 0.02, n_p))
    dq, dp = 1e-5 * rng.normal(size=len(Q)), 1e-5 * rng.normal(size=len(kit.vector))
    step, other = np.concatenate([dq, dp]), kit.with_vector(kit.vector + dp)
    gradient, moved = (
        np.concatenate(
            [
                projection.gradient(q, parts, assignment),
                part_gradient(projection, q, parts, assignment),
            ]
        )
        for q, parts in ((Q, kit), (Q + dq, other))
    )
    hessian = projection.hessian(Q, kit, assignment).lifted()
    change = projection.energy(Q + dq, other, assignment) - projection.energy(Q, kit, assignment)
    assert change == pytest.approx(
        gradient @ step + 0.5 * step @ (hessian @ step), rel=1e-8, abs=1e-14
    )
    np.testing.assert_allclose(moved - gradient, hessian @ step, atol=1e-12)


def test_reduced_hessian_is_identity_minus_mean():
    elements = [ElementGroup("angular", np.arange(4)[:, None])]
    q = np.array([0.5, -0.6, 0.7, 2.0])
    projection = Projection.of_inputs(elements, q, weight=4.0)
    best = projection.minimise(q, cluster(elements, q, {"angular": 2}).kit)
    signs = np.array([1, -1, 1, 0.0])
    expected = np.diag([1, 1, 1, 0.0]) - np.outer(signs, signs) / 3
    np.testing.assert_allclose(
        projection.hessian(q, best.kit, best.assignment).reduced(), expected, atol=1e-14
    )


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 1000), st.floats(1e-3, 1e3))
def test_units_weight_and_outsiders(seed, unit):
    q = np.random.default_rng(seed).uniform(1, 3, 41)
    kit = cluster(groups()[:2], q, {"linear": 3}, restarts=1, seed=seed).kit
    one = Projection.of_inputs(groups()[:2], q).minimise(q, kit)
    scaled = Projection.of_inputs(groups()[:2], unit * q, weight=2.0)
    other = scaled.minimise(unit * q, kit.with_vector(unit * kit.vector))
    assert other.energy == pytest.approx(2 * one.energy, rel=1e-9)
    assert scaled.gradient(unit * q, other.kit, other.assignment)[40] == 0
    np.testing.assert_allclose(other.kit.vector, unit * one.kit.vector, rtol=1e-9)


def test_warm_start_keeps_the_order_of_the_parts():
    kit = cluster(groups(), Q, {"linear": 3, "angular": 2}).kit
    shuffled = type(kit)({"linear": kit["linear"][::-1, ::-1], "angular": kit["angular"][::-1]})
    best = Projection.of_inputs(groups(), Q).minimise(Q, shuffled)
    np.testing.assert_allclose(best.kit.vector, shuffled.vector, rtol=1e-12)


def test_fixed_kit_only_reassigns():
    kit = cluster(groups(), Q, {"linear": 3, "angular": 2}).kit
    projection = Projection.of_inputs(groups(), Q)
    moved = Q + 0.3 * np.sin(np.arange(len(Q)))
    fixed, free = projection.assign(moved, kit), projection.minimise(moved, kit)
    np.testing.assert_array_equal(fixed.kit.vector, kit.vector)
    assert free.energy < fixed.energy


def test_user_bounds_hold_the_parts():
    projection = Projection.of_inputs(groups(), Q, bounds={"linear": (1.5, 2.5)})
    best = projection.minimise(Q, cluster(groups(), Q, {"linear": 5, "angular": 2}).kit)
    assert best.kit["linear"].min() >= 1.5 and best.kit["linear"].max() <= 2.5


def test_empty_groups_are_harmless():
    none = np.empty((0, 2), dtype=int)
    empty = [ElementGroup("linear", none), *groups(), ElementGroup("cell", none)]
    sizes = {"linear": 3, "angular": 2}
    found, without = cluster(empty, Q, sizes), cluster(groups(), Q, sizes)
    best = Projection.of_inputs(empty, Q).minimise(Q, found.kit)
    assert best.energy == Projection.of_inputs(groups(), Q).minimise(Q, without.kit).energy
    assert [len(part) for part in best.assignment.part] == [0, 15, 10, 15, 0]
    np.testing.assert_array_equal(
        best.assignment.matrix(best.kit).toarray(), without.assignment.matrix(without.kit).toarray()
    )
    projection = Projection.of_inputs(empty, Q)
    assert set(projection.tightness(Q, best.kit, best.assignment)) == {"linear", "angular"}
