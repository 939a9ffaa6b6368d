"""Where every element's Hessian entries go in the assembled matrix: found once a topology.

Kept unknowns are ordered free first, then driven. The upper triangle of the symmetric matrix over
the kept unknowns is stored by columns, so its first n_free columns are exactly the factorisation's
input, and the columns of the driven unknowns hold d(gradient)/d(driven), which the sensitivities
need.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from .recent import Recent
from .scene import Scene


@dataclass(frozen=True)
class Sparsity:
    """Assembly maps of a scene.

    n_free, n_driven : numbers of kept unknowns
    kept : (n_dofs,) place of each unknown among the kept ones, -1 when pinned
    free : (n_free,) the free unknowns, numbered as in the scene
    rows : (E, 14) kept place of each element's unknowns (two nodes x body 6 and hinge), -1 when
        absent or pinned
    slots : (E, 105) place of each upper element entry in the values, -1 when dropped
    term_rows, term_slots : the same for every term's blocks (m, k) and (m, k (k + 1) / 2)
    indptr, indices : compressed columns of the upper triangle over all kept unknowns
    diagonal : (n_free,) places of the free diagonal entries
    """

    n_free: int
    n_driven: int
    kept: np.ndarray
    free: np.ndarray
    rows: np.ndarray
    slots: np.ndarray
    term_rows: tuple[np.ndarray, ...]
    term_slots: tuple[np.ndarray, ...]
    indptr: np.ndarray
    indices: np.ndarray
    diagonal: np.ndarray

    @property
    def n_values(self) -> int:
        return len(self.indices)

    @property
    def n_factor_values(self) -> int:
        """Entries that belong to the factorised matrix: a prefix of the values."""
        return int(self.indptr[self.n_free])

    def free_matrix(self, values: np.ndarray) -> sp.csc_matrix:
        """Upper triangle over the free unknowns, sharing memory with the values."""
        n, m = self.n_free, self.n_factor_values
        return sp.csc_matrix((values[:m], self.indices[:m], self.indptr[: n + 1]), shape=(n, n))

    @cached_property
    def driven_column(self) -> np.ndarray:
        """Driven unknown of each entry in the driven columns, `values[n_factor_values:]`."""
        return np.repeat(np.arange(self.n_driven), np.diff(self.indptr[self.n_free :]))

    def driven_columns(self, values: np.ndarray) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """Hessian blocks free x driven (n_free, n_driven) and upper driven x driven (n_driven,
        n_driven).

        values : those of the driven columns, `values[n_factor_values:]`
        """
        n, m = self.n_free, self.n_driven
        start = self.n_factor_values
        block = sp.csc_matrix(
            (values, self.indices[start:], self.indptr[n:] - start), shape=(n + m, m)
        )
        return block[:n], block[n:]


def sparsity_of(scene: Scene) -> Sparsity:
    """The assembly maps of a scene; not to be changed, scenes of one topology share them."""
    structure = element_dofs(scene), scene.pinned, scene.driven.dofs
    return _recent.get(lambda: _find(scene), *structure, *(term.dofs for term in scene.terms))


_recent: Recent[Sparsity] = Recent()


def _find(scene: Scene) -> Sparsity:
    n_dofs = scene.n_dofs
    is_driven = np.zeros(n_dofs, bool)
    is_driven[scene.driven.dofs] = True
    free = np.flatnonzero(~scene.pinned & ~is_driven)
    kept = np.full(n_dofs + 1, -1)
    kept[free] = np.arange(len(free))
    kept[scene.driven.dofs] = len(free) + np.arange(len(scene.driven.dofs))

    rows = kept[element_dofs(scene)]
    term_rows = [kept[term.dofs] for term in scene.terms]
    n_kept = len(free) + len(scene.driven.dofs)
    pairs = [_pair_keys(r, n_kept) for r in (rows, *term_rows)]
    diagonal = np.arange(len(free), dtype=np.int64) * (n_kept + 1)
    keys, where = np.unique(
        np.concatenate([p.ravel() for p in pairs] + [diagonal, [-1]]), return_inverse=True
    )
    where = where - 1  # the key -1 (dropped entries) comes first
    cuts = np.cumsum([p.size for p in pairs])
    slots = [
        part.reshape(p.shape).astype(np.int32) for part, p in zip(np.split(where, cuts), pairs)
    ]
    keys = keys[1:]
    indptr = np.searchsorted(keys, np.arange(n_kept + 1, dtype=np.int64) * n_kept).astype(np.int32)
    return Sparsity(
        n_free=len(free),
        n_driven=n_kept - len(free),
        kept=kept[:-1],
        free=free,
        rows=rows.astype(np.int32),
        slots=slots[0],
        term_rows=tuple(r.astype(np.int32) for r in term_rows),
        term_slots=tuple(slots[1:]),
        indptr=indptr,
        indices=(keys % n_kept).astype(np.int32),
        diagonal=where[cuts[-1] : -1],
    )


class ParameterPattern:
    """Where derivatives of the gradient in the parameters go: found once a scene.

    elements (m,) : whose rest lengths depend on a parameter
    kept (m, 14) : which of their unknowns are kept
    rows, columns : kept unknowns and parameters of the entries that come by way of the lengths
    """

    def __init__(self, scene: Scene, sparsity: Sparsity):
        s = sparsity
        self.elements = np.flatnonzero(scene.length_parameter >= 0)
        rows = s.rows[self.elements]
        self.kept = rows >= 0
        columns = np.broadcast_to(scene.length_parameter[self.elements][:, None], rows.shape)
        self.rows, self.columns = rows[self.kept], columns[self.kept]
        # the Hessian's columns of driven unknowns, each for the one parameter that drives it
        driven = scene.driven
        self._factors = driven.factors[s.driven_column]
        rows = np.concatenate([self.rows, s.indices[s.n_factor_values :]])
        columns = np.concatenate([self.columns, driven.parameters[s.driven_column]])
        self._shape = s.n_free, scene.n_parameters
        self._free = np.flatnonzero(rows < s.n_free)
        keys, self._slots = np.unique(
            columns[self._free].astype(np.int64) * s.n_free + rows[self._free], return_inverse=True
        )
        self._indices = (keys % max(s.n_free, 1)).astype(np.int32)
        self._starts = np.searchsorted(
            keys, np.arange(scene.n_parameters + 1, dtype=np.int64) * s.n_free
        ).astype(np.int32)

    def matrix(self, by_lengths: np.ndarray, in_driven: np.ndarray) -> sp.csc_matrix:
        """d(gradient)/dq (n_free, n_parameters), from the entries by way of the lengths and the
        Hessian's in the driven columns, `values[n_factor_values:]`."""
        values = np.concatenate([by_lengths, in_driven * self._factors])[self._free]
        data = np.bincount(self._slots, values, minlength=len(self._indices))
        return sp.csc_matrix((data, self._indices, self._starts), shape=self._shape)


def element_dofs(scene: Scene) -> np.ndarray:
    """(E, 14) unknowns of each element; n_dofs stands for "no hinge"."""
    hinge = np.where(scene.node_hinge >= 0, 6 * scene.n_bodies + scene.node_hinge, scene.n_dofs)
    node = np.concatenate([6 * scene.node_body[:, None] + np.arange(6), hinge[:, None]], axis=1)
    return np.concatenate([node[scene.elements[:, 0]], node[scene.elements[:, 1]]], axis=1)


def _pair_keys(rows: np.ndarray, n: int) -> np.ndarray:
    """column n + row of every upper entry (a <= b) of each block; -1 where one of them is not
    kept."""
    a, b = np.triu_indices(rows.shape[1])
    first, second = rows[:, a].astype(np.int64), rows[:, b].astype(np.int64)
    key = np.maximum(first, second) * n + np.minimum(first, second)
    return np.where((first >= 0) & (second >= 0), key, -1)
