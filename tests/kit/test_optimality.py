"""Bounds on clusterings: never above a known optimum, close to it, and for all kinds of parts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.kit import paying
from kop_exudyn.kit.cluster import cluster
from kop_exudyn.kit.dual_bound import lower_bound
from kop_exudyn.kit.elements import collect
from kop_exudyn.kit.groups import ElementGroup
from kop_exudyn.kit.optimality import clustering_gaps
from kop_exudyn.kit.parts import Kit
from kop_exudyn.kit.pricing import Pricing


def problem(kind, n, seed):
    """Elements of a kind (with end elements, where it has some), spread about a few values."""
    rng = np.random.default_rng(seed)
    sizes = {"linear": (2, 1), "slit": (2, 1), "cell": (2,), "angular": (1,)}[kind]
    centres = rng.uniform(0.5, 2.0, (4, 2))
    groups, q, first = [], [], 0
    for size in sizes:
        values = centres[rng.integers(4, size=n)][:, :size] + rng.normal(0, 0.1, (n, size))
        values = values * (rng.choice([-1, 1], values.shape) if kind == "angular" else 1)
        indices = first + np.arange(values.size).reshape(n, size)
        groups.append(ElementGroup(kind, indices))
        q.append(values.ravel())
        first += values.size
    return groups, np.concatenate(q)


@pytest.mark.parametrize("kind", ["linear", "slit", "cell", "angular"])
@pytest.mark.parametrize("seed", range(3))
def test_no_part_earns_more_than_the_bound(kind, seed):
    groups, q = problem(kind, 20, seed)
    elements = collect(groups, q)[kind]
    pricing = Pricing.of(elements, 3, elements.kind.bounds(None))
    rng = np.random.default_rng(seed)
    prices = rng.uniform(0.0, 0.3, len(pricing.weights)) ** 2
    parts = rng.uniform(pricing.lower, pricing.upper, (3000, len(pricing.lower)))
    best, earned = pricing.improved(prices, parts)
    bound, good = pricing.most_earned(prices, 0.0, 1e-3, most=20_000)
    assert bound >= earned.max() * (1 - 1e-12)
    assert bound <= earned.max() * (1.05 if kind == "slit" else 1.0011)
    assert pricing.earnings(prices, good).max() == pytest.approx(earned.max(), rel=0.05)
    # what is earned is what it says
    squared = pricing.squared(best[:1])[:, 0]
    by_hand = pricing.weights @ np.maximum(prices - squared, 0) - pricing.own_cost(best[:1])[0]
    assert earned[0] == pytest.approx(by_hand, rel=1e-12)


@pytest.mark.parametrize("kind", ["linear", "slit", "cell", "angular"])
def test_compiled_or_not_is_the_same(kind, monkeypatch):
    groups, q = problem(kind, 20, 7)
    elements = collect(groups, q)[kind]
    pricing = Pricing.of(elements, 3, elements.kind.bounds(None))
    rng = np.random.default_rng(7)
    prices = rng.uniform(0.0, 0.3, len(pricing.weights)) ** 2
    parts = rng.uniform(pricing.lower, pricing.upper, (40, len(pricing.lower)))

    def all_of_it():
        return (
            pricing.earnings(prices, parts),
            *pricing.improved(prices, parts, 2),
            *pricing.most_earned(prices, 0.0, 1e-2, most=300),
        )

    first = all_of_it()
    monkeypatch.setattr(paying, "library", lambda: None)
    for one, other in zip(first, all_of_it()):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12)


@settings(deadline=None, max_examples=6)
@given(st.integers(0, 1000), st.integers(1, 4), st.sampled_from(["linear", "cell"]))
def test_the_bound_is_below_every_clustering_and_close_to_the_best(seed, m, kind):
    groups, q = problem(kind, 10, seed)
    good = cluster(groups, q, {kind: m}, seed=seed)
    gap = clustering_gaps(groups, q, good.kit)[kind]
    assert gap.energy == pytest.approx(good.energy[kind], rel=1e-12)
    assert 0.6 * gap.energy <= gap.bound <= gap.energy
    # the same bound, to the method's tolerance, is found from a bad clustering
    bad = Kit({kind: good.kit[kind] * np.linspace(0.8, 1.1, m)[:, None]})
    other = clustering_gaps(groups, q, bad)[kind]
    assert other.bound <= good.energy[kind] * (1 + 1e-9)
    assert other.gap_percent >= 100 * (1 - good.energy[kind] / other.energy) - 1e-9


def test_well_separated_clusters_are_proven_optimal():
    rng = np.random.default_rng(2)
    values = np.repeat([[1.0, 2.0], [1.5, 1.6], [3.0, 3.5]], 20, axis=0)
    values = values + rng.normal(0, 0.02, values.shape)
    values[::3] = values[::3, ::-1]
    groups = [ElementGroup("linear", np.arange(values.size).reshape(-1, 2))]
    found = cluster(groups, values.ravel(), {"linear": 3})
    gap = clustering_gaps(groups, values.ravel(), found.kit)["linear"]
    assert gap.gap_percent < 1.0 and not gap.exact


def test_merged_elements_still_give_a_bound():
    groups, q = problem("linear", 40, 3)
    elements = collect(groups, q)["linear"]
    limits = elements.kind.bounds(None)
    found = cluster(groups, q, {"linear": 4})
    parts = found.kit["linear"] / elements.scale
    whole, merged = (Pricing.of(elements, 4, limits, most) for most in (1500, 40))
    assert len(merged.weights) <= 40 < len(whole.weights) and merged.displacement > 0
    assert merged.weights.sum() == whole.weights.sum() == 80
    energy = found.energy["linear"] * 2 * elements.n
    bounds = [lower_bound(pricing, parts).bound for pricing in (whole, merged)]
    assert 0 < bounds[1] <= bounds[0] * 1.02 and bounds[0] <= energy


def test_bounds_on_parts_count():
    groups, q = problem("linear", 20, 4)
    limits = {"linear": (0.9, 1.1)}
    free, bounded = (cluster(groups, q, {"linear": 3}, bounds=b) for b in (None, limits))
    gap = clustering_gaps(groups, q, bounded.kit, bounds=limits)["linear"]
    assert gap.bound > 1.5 * free.energy["linear"]
    assert gap.gap_percent < 5.0


@pytest.mark.parametrize(("kind", "least"), [("linear", 1e3), ("cell", 3.0)])
def test_bounds_far_from_all_elements_leave_a_bound(kind, least):
    """No part earns anything at the prices that are tried first."""
    groups, q = problem(kind, 6, 0)
    bounds = {kind: (np.full(2, least), np.full(2, np.inf))}
    kit = Kit({kind: np.full((8, 2), least)})
    gap = clustering_gaps(groups, q, kit, bounds=bounds)[kind]
    assert 0 < gap.bound <= gap.energy


def test_angles_are_exact_and_units_change_nothing():
    groups, q = problem("angular", 50, 5)
    found = cluster(groups, q, {"angular": 4})
    assert clustering_gaps(groups, q, found.kit)["angular"].gap_percent < 1e-9
    groups, q = problem("linear", 12, 6)
    found = cluster(groups, q, {"linear": 3})
    first = clustering_gaps(groups, q, found.kit)["linear"]
    second = clustering_gaps(groups, 1000 * q, Kit({"linear": 1000 * found.kit["linear"]}))
    assert second["linear"].bound == pytest.approx(first.bound, rel=2e-2)


def test_as_many_parts_as_distinct_elements_leave_no_gap():
    groups = [ElementGroup("linear", np.arange(8).reshape(-1, 2))]
    q = np.array([1.0, 2.0, 2.0, 1.0, 1.5, 1.5, 1.0, 2.0])
    gap = clustering_gaps(groups, q, cluster(groups, q, {"linear": 2}).kit)["linear"]
    assert (gap.energy, gap.bound, gap.gap_percent) == (0.0, 0.0, 0.0)
