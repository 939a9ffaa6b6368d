"""Secant corrections to a model Hessian: the curvature that Gauss-Newton leaves out, learned from
gradients.

Gauss-Newton drops the second derivatives of the joints' positions times the residual. With kits of
few parts the residual stays large, and then these terms rule the steps' length. As in NL2SOL
(Dennis, Gay, Welsch, ACM TOMS 7, 1981) the missing part S is built from what the model didn't
predict, y - H s, here by symmetric rank-one updates a block, and sized down before each update
where it proves too large.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from ..errors import InputError

# relative size of a denominator below which an SR1 update is skipped; Nocedal & Wright (2006), eq.
# 6.26
_SAFE = 1e-8


class SecantCorrection:
    """S for each group of variables, as a sum of rank-one terms in scaled variables.

    sizes : sizes of the consecutive groups; scale : (n,) typical changes of the variables
    memory : rank-one terms a group; the oldest goes first
    """

    def __init__(self, sizes: tuple[int, ...], scale: np.ndarray, memory: int = 30):
        self._ends = np.cumsum(sizes)
        self._starts = self._ends - sizes
        self._scale, self._memory = scale, memory
        self._vectors = [np.zeros((0, size)) for size in sizes]
        self._factors = [np.zeros(0) for _ in sizes]
        self._x: np.ndarray | None = None
        self._gradient = np.zeros(0)

    def observe(self, x: np.ndarray, gradient: np.ndarray, hessian: sp.csc_matrix) -> None:
        """Learn at the next accepted point from its gradient and model Hessian (of the same part of
        the objective)."""
        if self._x is not None and not np.array_equal(x, self._x):
            step = (x - self._x) / self._scale
            change = self._scale * (gradient - self._gradient)
            missed = change - self._scale * (hessian @ (x - self._x))
            length = float(np.linalg.norm(step))
            for k, (a, b) in enumerate(zip(self._starts, self._ends)):
                if np.linalg.norm(step[a:b]) > 1e-12 * length:
                    self._update(k, step[a:b], missed[a:b])
        self._x, self._gradient = x.copy(), gradient.copy()

    def _update(self, k: int, step: np.ndarray, missed: np.ndarray) -> None:
        image = self._times(k, step)
        known = float(step @ image)
        if known != 0.0:
            # halfway: sized down all the way, the error would be orthogonal to the step and the
            # update void
            share = 0.5 + 0.5 * min(1.0, abs(float(step @ missed)) / abs(known))
            self._factors[k] = share * self._factors[k]
            image = share * image
        error = missed - image
        denominator = float(error @ step)
        if abs(denominator) > _SAFE * np.linalg.norm(error) * np.linalg.norm(step):
            self._vectors[k] = np.vstack([self._vectors[k], error])[-self._memory :]
            self._factors[k] = np.append(self._factors[k], 1 / denominator)[-self._memory :]

    def _times(self, k: int, step: np.ndarray) -> np.ndarray:
        return self._vectors[k].T @ (self._factors[k] * (self._vectors[k] @ step))

    def matrix(self) -> sp.csc_matrix:
        """S (n, n) in the variables themselves."""
        blocks = [(v.T * f) @ v for v, f in zip(self._vectors, self._factors)]
        unscale = sp.diags(1 / self._scale)
        return sp.csc_matrix(unscale @ sp.block_diag(blocks) @ unscale)

    def to_arrays(self) -> dict[str, np.ndarray]:
        """All data as plain arrays, exactly."""
        arrays = {
            "x": np.zeros(0) if self._x is None else self._x.copy(),
            "gradient": self._gradient.copy(),
        }
        for k, (vectors, factors) in enumerate(zip(self._vectors, self._factors)):
            arrays |= {f"vectors{k}": vectors.copy(), f"factors{k}": factors.copy()}
        return arrays

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """Take over what `to_arrays` gave for the same sizes. Raises InputError for others."""
        for k, size in enumerate(self._ends - self._starts):
            vectors, factors = arrays[f"vectors{k}"], arrays[f"factors{k}"]
            if vectors.shape != (len(factors), size):
                raise InputError("curvature of other variables", field="quasi_newton")
        self._x = np.array(arrays["x"]) if len(arrays["x"]) else None
        self._gradient = np.array(arrays["gradient"])
        self._vectors = [np.array(arrays[f"vectors{k}"]) for k in range(len(self._vectors))]
        self._factors = [np.array(arrays[f"factors{k}"]) for k in range(len(self._factors))]
