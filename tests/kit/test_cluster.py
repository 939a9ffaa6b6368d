"""Clustering: against brute force, its invariances, and degenerate inputs."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.errors import InputError
from kop_exudyn.kit.assign import nearest
from kop_exudyn.kit.cluster import best_parts, cluster, lloyd, swapped
from kop_exudyn.kit.elements import collect
from kop_exudyn.kit.groups import ElementGroup


def linear_problem(n_full, n_end, seed=0, low=1.0, high=3.0):
    q = np.random.default_rng(seed).uniform(low, high, 2 * n_full + n_end)
    groups = [ElementGroup("linear", np.arange(2 * n_full).reshape(-1, 2))]
    if n_end:
        groups.append(ElementGroup("linear", np.arange(2 * n_full, len(q))[:, None]))
    return groups, q


def brute_force(groups, q, m):
    """Least energy over every labelling with parts and variants, each with its least-squares
    parts."""
    scale = np.median(np.abs(q))
    elements = [(index, group.indices.shape[1]) for group in groups for index in group.indices]
    best = np.inf
    for labels in itertools.product(range(2 * m), repeat=len(elements)):
        matrix = np.zeros((len(q), 2 * m))
        for (index, size), label in zip(elements, labels):
            part, variant = divmod(label, 2)
            for i, row in enumerate(index):
                side = variant if size == 1 else (i + variant) % 2
                matrix[row, 2 * part + side] = 1
        p = np.linalg.lstsq(matrix, q, rcond=None)[0]
        best = min(best, 0.5 * np.sum((q - matrix @ p) ** 2) / len(elements) / scale**2)
    return best


@pytest.mark.parametrize(
    "n_full, n_end, m, seed", [(4, 0, 2, 0), (3, 1, 2, 1), (2, 3, 2, 2), (0, 4, 1, 3), (5, 1, 1, 4)]
)
def test_tiny_problems_reach_the_optimum(n_full, n_end, m, seed):
    groups, q = linear_problem(n_full, n_end, seed)
    groups = [group for group in groups if len(group.indices)]
    assert cluster(groups, q, {"linear": m}).energy["linear"] == pytest.approx(
        brute_force(groups, q, m), abs=1e-14
    )


def test_angles_are_clustered_by_magnitude():
    q = np.array([0.1, -0.12, 1.0, -1.1, 1.2])
    found = cluster([ElementGroup("angular", np.arange(5)[:, None])], q, {"angular": 2})
    np.testing.assert_allclose(found.kit["angular"][:, 0], [0.11, 1.1])
    np.testing.assert_allclose(
        found.assignment.realise(found.kit, q), [0.11, -0.11, 1.1, -1.1, 1.1]
    )


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 1000), st.integers(1, 4), st.floats(1e-3, 1e3))
def test_mirroring_units_and_order_change_nothing(seed, m, unit):
    groups, q = linear_problem(8, 4, seed)
    elements = collect(groups, q)["linear"]
    start = np.random.default_rng(seed).uniform(1, 3, (m, 2))
    parts, labels = lloyd(elements, start, np.zeros(2), np.full(2, np.inf))
    rng = np.random.default_rng(seed + 1)
    order = rng.permutation(8)
    full = groups[0].indices[order]
    full[::2] = full[::2, ::-1]
    changed = collect([ElementGroup("linear", full), groups[1]], unit * q)["linear"]
    parts_2, labels_2 = lloyd(changed, unit * start, np.zeros(2), np.full(2, np.inf))
    np.testing.assert_allclose(parts_2, unit * parts, rtol=1e-12)
    np.testing.assert_array_equal(labels_2.part[:8], labels.part[:8][order])
    assert changed.energy(parts_2, labels_2) == pytest.approx(
        elements.energy(parts, labels), rel=1e-11
    )


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 1000))
def test_sign_of_angles_changes_nothing(seed):
    rng = np.random.default_rng(seed)
    q = rng.uniform(-2, 2, 12)
    groups = [ElementGroup("angular", np.arange(12)[:, None])]
    one, other = (
        cluster(groups, values, {"angular": 3}, restarts=2)
        for values in (q, q * rng.choice([-1, 1], 12))
    )
    np.testing.assert_allclose(one.kit.vector, other.kit.vector, rtol=1e-12)


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 1000), st.integers(1, 6), st.sampled_from(["linear", "slit"]))
def test_energy_never_increases(seed, m, kind):
    groups, q = linear_problem(10, 5, seed)
    elements = collect([ElementGroup(kind, group.indices) for group in groups], q)[kind]
    lower, upper = elements.kind.bounds()
    parts = np.random.default_rng(seed).uniform(0.5, 3, (m, len(lower)))
    energies = []
    for _ in range(6):
        labels = elements.nearest(parts)
        energies.append(elements.energy(parts, labels))
        parts = best_parts(elements, parts, labels, lower, upper)
    assert np.all(np.diff(energies) <= 1e-15)
    final, labels = lloyd(elements, parts, lower, upper)
    assert elements.energy(final, labels) <= energies[-1] + 1e-15


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 1000), st.integers(1, 8))
def test_parts_of_feasible_elements_are_feasible(seed, m):
    groups, q = linear_problem(10, 6, seed, 1.5, 2.5)
    kit = cluster(groups, q, {"linear": m}, restarts=3, seed=seed).kit
    assert kit.vector.min() >= 1.5 - 1e-14 and kit.vector.max() <= 2.5 + 1e-14


def test_bounds_are_honoured():
    groups, q = linear_problem(20, 6)
    found = cluster(groups, q, {"linear": 4}, bounds={"linear": (1.8, [2.0, 2.6])})
    parts = found.kit["linear"]
    assert parts.min() >= 1.8 and parts[:, 1].max() <= 2.6 and parts[:, 0].max() <= 2.0
    with pytest.raises(InputError, match="unknown kind"):
        cluster(groups, q, {"linear": 4}, bounds={"lineal": (1, 2)})


def test_result_is_canonical_sorted_and_nearest():
    groups, q = linear_problem(60, 20)
    found = cluster(groups, q, {"linear": 7})
    parts = found.kit["linear"]
    assert np.all(parts[:, 0] <= parts[:, 1])
    assert np.all(np.diff(parts[:, 0]) >= 0)
    assert nearest(groups, q, found.kit).changes(found.assignment) == 0
    again = cluster(groups, q, {"linear": 7})
    np.testing.assert_array_equal(again.kit.vector, found.kit.vector)


def test_empty_clusters_are_moved_to_the_worst_element():
    q = np.array([1, 1.1, 1.2, 5.0, 9.0])
    elements = collect([ElementGroup("angular", np.arange(5)[:, None])], q / 3)["angular"]
    start = np.array([[0.4], [2.9], [3.1]])  # the last one serves nothing
    parts, labels = lloyd(elements, start, np.zeros(1), np.full(1, np.pi))
    np.testing.assert_allclose(np.sort(parts[:, 0]) * 3, [1.1, 5, 9])


def test_fewer_distinct_elements_than_parts():
    q = np.array([1.0, 2.0, 2.0, 1.0, 1.0, 2.0, 1.0])  # three mirror images and an end element
    groups = [
        ElementGroup("linear", np.arange(6).reshape(3, 2)),
        ElementGroup("linear", np.array([[6]])),
    ]
    found = cluster(groups, q, {"linear": 3})
    np.testing.assert_array_equal(found.kit["linear"], [[1, 2]] * 3)
    assert found.energy["linear"] == 0


def test_as_many_parts_as_elements_leave_nothing():
    groups, q = linear_problem(6, 3)
    assert cluster(groups, q, {"linear": 9}, restarts=40).energy["linear"] < 1e-20


def test_groups_of_several_designs_share_the_kit():
    groups, q = linear_problem(6, 2)
    both = [*groups, *(group.shifted(len(q)) for group in groups)]
    one, two = cluster(groups, q, {"linear": 3}), cluster(both, np.tile(q, 2), {"linear": 3})
    np.testing.assert_allclose(two.kit.vector, one.kit.vector, rtol=1e-12)
    np.testing.assert_array_equal(two.assignment.part[0], two.assignment.part[2])


def test_slits_shrink_with_their_cost():
    groups, q = linear_problem(20, 6)
    groups = [ElementGroup("slit", group.indices) for group in groups]
    slits = [
        cluster(groups, q, {"slit": 3}, restarts=3, penalties={"slit": (0, 0, cost)})
        .kit["slit"][:, 2]
        .mean()
        for cost in (1e-3, 1e-1, 10.0)
    ]
    assert slits[0] > slits[1] > slits[2] > 0
    plain = cluster([ElementGroup("linear", group.indices) for group in groups], q, {"linear": 3})
    assert cluster(groups, q, {"slit": 3}).energy["slit"] < plain.energy["linear"]


def test_more_restarts_of_the_published_size_are_no_worse():
    rng = np.random.default_rng(0)
    q = np.concatenate([rng.uniform(1, 3, 1440), rng.uniform(-1, 1, 720)])
    groups = [
        ElementGroup("linear", np.arange(1260).reshape(-1, 2)),
        ElementGroup("linear", np.arange(1260, 1440)[:, None]),
        ElementGroup("angular", np.arange(1440, 2160)[:, None]),
    ]
    sizes = {"linear": 20, "angular": 5}
    once, often = (cluster(groups, q, sizes, restarts=n, seed=1).energy for n in (1, 20))
    for kind in sizes:
        assert 0 < often[kind] <= once[kind]
    assert sum(often.values()) < sum(once.values())


@pytest.mark.parametrize(
    "parts, message",
    [
        ({"linear": 6}, "more parts than elements"),
        ({"linear": 0}, "at least 1"),
        ({"linear": 2.0}, "whole number"),
        ({"linear": 2, "angular": 1}, "no elements of this kind"),
        ({"curved": 1}, "unknown kind"),
        ({}, "say how many"),
    ],
)
def test_impossible_requests(parts, message):
    groups, q = linear_problem(3, 2)
    with pytest.raises(InputError, match=message):
        cluster(groups, q, parts)


def test_unusable_parameters():
    groups, q = linear_problem(3, 2)
    with pytest.raises(InputError, match="median length"):
        cluster(groups, 0 * q, {"linear": 1})
    q[2] = np.nan
    with pytest.raises(InputError, match="finite"):
        cluster(groups, q, {"linear": 1})
    with pytest.raises(InputError, match="negative"):
        collect(groups, np.ones(8), penalties={"linear": (-1, 0)})


def test_swaps_leave_a_local_minimum_of_k_means():
    # three tight heaps, two parts in the first and one between the others: k-means stays there
    heaps = np.repeat([[1.0, 1.0], [2.0, 2.0], [2.4, 2.4]], 6, axis=0)
    q = (heaps + np.random.default_rng(0).normal(0, 0.01, heaps.shape)).ravel()
    groups = [ElementGroup("linear", np.arange(len(q)).reshape(-1, 2))]
    elements = collect(groups, q)["linear"]
    limits = elements.kind.bounds(None)
    stuck = lloyd(elements, np.array([[0.99, 1.0], [1.0, 1.01], [2.2, 2.2]]), *limits)
    parts, labels = swapped(elements, *stuck, limits)
    assert elements.energy(parts, labels) < 0.05 * elements.energy(*stuck)
    np.testing.assert_allclose(np.sort(parts.mean(axis=1)), [1.0, 2.0, 2.4], atol=0.02)
    again = swapped(elements, parts, labels, limits)
    assert elements.energy(*again) == elements.energy(parts, labels)
