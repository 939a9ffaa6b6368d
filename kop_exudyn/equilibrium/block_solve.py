"""Solutions of many right-hand sides, as the solvers leave them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..compiled.library import address, library

COLUMNS = 64  # of a block, as in compiled/sources/factor.c


@dataclass(frozen=True)
class Solutions:
    """Solutions (n, count) in blocks: to copy them into one array would take a quarter of the time
    that solving takes.

    blocks : (n_blocks, n, COLUMNS) some columns a block, rows in the order of the elimination
    place : (n,) where each row is in a block
    count : number of solutions; what the last block has beyond them is zero
    """

    blocks: np.ndarray
    place: np.ndarray
    count: int

    @classmethod
    def of(cls, array: np.ndarray) -> Solutions:
        """Solutions (n, count) from one array."""
        n, count = array.shape
        blocks = np.zeros((-(-count // COLUMNS), n, COLUMNS))
        for b, block in enumerate(blocks):
            some = array[:, b * COLUMNS : (b + 1) * COLUMNS]
            block[:, : some.shape[1]] = some
        return cls(blocks, np.arange(n), count)

    def rows(self, numbers: np.ndarray) -> np.ndarray:
        """Some rows (m, count) of the solutions."""
        out = np.empty((len(numbers), self.count))
        places = self.place[numbers]
        for b, block in enumerate(self.blocks):
            some = out[:, b * COLUMNS : (b + 1) * COLUMNS]
            some[:] = block[places, : some.shape[1]]
        return out

    def product(self, matrix: sp.csr_matrix) -> np.ndarray:
        """A sparse matrix (m, n) times the solutions, (m, count)."""
        kernels = library()
        if kernels is None:
            return matrix @ self.rows(np.arange(len(self.place)))
        if matrix.shape[1] != len(self.place):
            raise ValueError(f"a matrix of {matrix.shape[1]} columns, expected {len(self.place)}")
        out = np.zeros((matrix.shape[0], self.count))
        indptr, data = matrix.indptr.astype(np.int32), matrix.data.astype(float)
        places = self.place[matrix.indices]
        kernels.multiply_blocks(
            matrix.shape[0],
            address(indptr, np.int32),
            address(places, np.int64),
            address(data),
            len(self.place),
            self.count,
            address(self.blocks),
            address(out),
        )
        return out
