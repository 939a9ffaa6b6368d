from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from kop_exudyn.scene.sparsity import ParameterPattern, element_dofs, sparsity_of


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_free_unknowns_come_first_then_the_driven(case_of, seed):
    scene = case_of(seed).scene
    s = sparsity_of(scene)
    driven = set(scene.driven.dofs.tolist())
    assert s.n_driven == len(driven) == 2
    assert s.n_free == scene.n_dofs - scene.pinned.sum() - len(driven)
    assert np.array_equal(s.kept[s.free], np.arange(s.n_free))
    assert np.array_equal(s.kept[scene.driven.dofs], s.n_free + np.arange(2))
    assert (s.kept[scene.pinned] == -1).all()


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_pattern_is_exactly_that_of_the_elements_and_terms(case_of, seed):
    scene = case_of(seed).scene
    s = sparsity_of(scene)
    n = s.n_free + s.n_driven
    expected = np.zeros((n, n), bool)
    kept = np.append(s.kept, -1)
    for dofs in [*element_dofs(scene), *(row for term in scene.terms for row in term.dofs)]:
        rows = kept[dofs][kept[dofs] >= 0]
        expected[np.ix_(rows, rows)] = True
    expected[np.arange(s.n_free), np.arange(s.n_free)] = True
    columns = np.repeat(np.arange(n), np.diff(s.indptr))
    found = np.zeros((n, n), bool)
    found[s.indices, columns] = True
    assert np.array_equal(found, np.triu(expected))
    assert s.n_values == found.sum()
    assert all((np.diff(s.indices[a:b]) > 0).all() for a, b in zip(s.indptr, s.indptr[1:]))


def test_slots_address_the_right_entries(case_of):
    scene = case_of(4).scene
    s = sparsity_of(scene)
    column_of = np.repeat(np.arange(len(s.indptr) - 1), np.diff(s.indptr))
    blocks = [(s.rows, s.slots), *zip(s.term_rows, s.term_slots)]
    for rows, slots in blocks:
        first, second = np.triu_indices(rows.shape[1])
        a, b = rows[:, first], rows[:, second]
        used = slots >= 0
        assert np.array_equal(used, (a >= 0) & (b >= 0))
        assert np.array_equal(s.indices[slots[used]], np.minimum(a, b)[used])
        assert np.array_equal(column_of[slots[used]], np.maximum(a, b)[used])
    assert np.array_equal(s.indices[s.diagonal], column_of[s.diagonal])
    assert np.array_equal(s.indices[s.diagonal], np.arange(s.n_free))


def test_free_matrix_shares_memory(case_of):
    s = sparsity_of(case_of(0).scene)
    values = np.zeros(s.n_values)
    matrix = s.free_matrix(values)
    values[s.diagonal] = 3.0
    assert np.array_equal(matrix.diagonal(), np.full(s.n_free, 3.0))
    assert matrix.nnz == s.n_factor_values


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_derivatives_in_the_parameters_against_a_matrix_of_entries(case_of, seed):
    """Entries of one place are summed, those of pinned and driven unknowns left out."""
    scene = case_of(seed).scene
    s, rng = sparsity_of(scene), np.random.default_rng(seed)
    pattern = ParameterPattern(scene, s)
    by_lengths = rng.normal(size=len(pattern.rows))
    in_driven = rng.normal(size=s.n_values - s.n_factor_values)
    n = s.n_free + s.n_driven
    expected = np.zeros((n, scene.n_parameters))
    np.add.at(expected, (pattern.rows, pattern.columns), by_lengths)
    upper = sp.csc_matrix(
        (in_driven, s.indices[s.n_factor_values :], s.indptr[s.n_free :] - s.n_factor_values),
        shape=(n, s.n_driven),
    )
    expected += upper @ scene.driven_map
    found = pattern.matrix(by_lengths, in_driven)
    assert found.has_canonical_format
    np.testing.assert_allclose(found.toarray(), expected[: s.n_free], rtol=1e-14, atol=1e-14)
    kept = s.rows[pattern.elements]
    assert np.array_equal(pattern.rows, kept[kept >= 0])
