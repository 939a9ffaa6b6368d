"""Optimal clusters of numbers: against every division into intervals, and against k-means."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.kit.cluster import cluster, lloyd
from kop_exudyn.kit.elements import collect
from kop_exudyn.kit.groups import ElementGroup
from kop_exudyn.kit.intervals import optimal_centres


def least(values, m, lower, upper):
    """Over every division of the sorted values into at most m intervals."""
    x = np.sort(values)
    best = np.inf
    for cuts in itertools.combinations_with_replacement(range(len(x) + 1), m - 1):
        pieces = np.split(x, cuts)
        centres = [np.clip(piece.mean(), lower, upper) for piece in pieces if len(piece)]
        best = min(
            best,
            sum(np.sum((p - c) ** 2) for p, c in zip((p for p in pieces if len(p)), centres)),
        )
    return best


@settings(deadline=None, max_examples=60)
@given(
    st.lists(st.integers(-20, 20), min_size=1, max_size=9),
    st.integers(1, 4),
    st.sampled_from([(-np.inf, np.inf), (-5.0, 7.0), (3.0, 3.0)]),
)
def test_no_division_is_better(values, m, limits):
    values = np.array(values) / 7
    centres, total = optimal_centres(values, m, *limits)
    assert centres.shape == (m,) and np.all(np.diff(centres) >= 0)
    assert np.all((centres >= limits[0]) & (centres <= limits[1]))
    assert total == pytest.approx(least(values, m, *limits), abs=1e-12)
    reached = np.min((values[:, None] - centres) ** 2, axis=1).sum()
    assert total == pytest.approx(reached, abs=1e-12)


def test_small_spreads_about_a_large_mean_keep_their_digits():
    values = 1e6 + np.array([0.0, 1e-3, 5.0, 5.001])
    centres, total = optimal_centres(values, 2)
    np.testing.assert_allclose(centres - 1e6, [5e-4, 5.0005], atol=1e-9)
    assert total == pytest.approx(1e-6, rel=1e-3)


def test_clustering_of_angles_is_never_above_any_k_means_run():
    rng = np.random.default_rng(5)
    q = np.concatenate([rng.normal(c, 0.1, 40) for c in (0.3, 0.5, 0.9, 1.4)]) * rng.choice([-1, 1])
    groups = [ElementGroup("angular", np.arange(len(q))[:, None])]
    elements = collect(groups, q)["angular"]
    best = cluster(groups, q, {"angular": 6}).energy["angular"]
    limits = elements.kind.bounds(None)
    runs = [lloyd(elements, rng.uniform(0, 2, (6, 1)), *limits) for _ in range(30)]
    energies = [elements.energy(*run) for run in runs]
    assert best <= min(energies) * (1 + 1e-12)
    assert max(energies) > 1.01 * best  # k-means alone does end elsewhere


def test_clustering_of_angles_depends_on_no_seed():
    q = np.random.default_rng(1).uniform(-1.5, 1.5, 200)
    groups = [ElementGroup("angular", np.arange(200)[:, None])]
    kits = [cluster(groups, q, {"angular": 7}, restarts=1, seed=seed).kit for seed in (0, 1)]
    np.testing.assert_array_equal(kits[0]["angular"], kits[1]["angular"])
