"""Damped BFGS in dense diagonal blocks, the quasi-Newton alternative to the model Hessian."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from ..errors import InputError

# Powell's bound on the curvature that an update may remove; Nocedal & Wright (2006), procedure 18.2
_POWELL = 0.2
# of the whole step, in scaled variables: a block that moved less learns nothing
_SMALLEST_STEP = 1e-14


class BlockBFGS:
    """One BFGS matrix for each group of variables; curvature between the groups is ignored.

    Parameters
    ----------
    sizes : sizes of the consecutive groups, adding up to n
    scale : (n,) typical changes of the variables; the first matrix is a multiple of diag(1/scale^2)

    The first matrix makes the first step about as long as one ``scale``; once a step is known, the
    multiple is replaced by y.s / s.s in scaled variables before the first update (Shanno & Phua
    1978).
    """

    def __init__(self, sizes: tuple[int, ...], scale: np.ndarray):
        self._ends = np.cumsum(sizes)
        self._starts = self._ends - sizes
        self._scale = scale
        self._blocks: list[np.ndarray] | None = None
        self._updated = np.zeros(len(sizes), dtype=bool)
        self._x = np.zeros(0)
        self._gradient = np.zeros(0)

    def observe(self, x: np.ndarray, gradient: np.ndarray) -> None:
        """Learn from the gradient at the next accepted point."""
        if self._blocks is None:
            size = float(np.linalg.norm(self._scale * gradient)) or 1.0
            self._blocks = [
                np.diag(size / self._scale[a:b] ** 2) for a, b in zip(self._starts, self._ends)
            ]
        else:
            step, change = x - self._x, gradient - self._gradient
            length = float(np.linalg.norm(step / self._scale))
            for k, (a, b) in enumerate(zip(self._starts, self._ends)):
                if np.linalg.norm(step[a:b] / self._scale[a:b]) > _SMALLEST_STEP * length:
                    self._update(k, step[a:b], change[a:b], self._scale[a:b])
        self._x, self._gradient = x.copy(), gradient.copy()

    def _update(self, k: int, step: np.ndarray, change: np.ndarray, scale: np.ndarray) -> None:
        assert self._blocks is not None
        if not self._updated[k] and step @ change > 0:
            scaled = step / scale
            self._blocks[k] = np.diag(step @ change / (scaled @ scaled) / scale**2)
            self._updated[k] = True
        self._blocks[k] = damped_bfgs(self._blocks[k], step, change)

    def matrix(self) -> sp.csc_matrix:
        """The (n, n) positive definite approximation."""
        return sp.block_diag(self._blocks, format="csc")

    def to_arrays(self) -> dict[str, np.ndarray]:
        """All data as plain arrays, exactly."""
        arrays = {
            "updated": self._updated.copy(),
            "x": self._x.copy(),
            "gradient": self._gradient.copy(),
        }
        return arrays | {f"block{k}": block.copy() for k, block in enumerate(self._blocks or [])}

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """Take over what ``to_arrays`` gave for the same sizes. Raises InputError for others."""
        sizes = (self._ends - self._starts).tolist()
        shapes = {"updated": (len(sizes),)} | {f"block{k}": (m, m) for k, m in enumerate(sizes)}
        if arrays["x"].shape != arrays["gradient"].shape or any(
            name in arrays and arrays[name].shape != shape for name, shape in shapes.items()
        ):
            raise InputError("curvature of other variables", field="quasi_newton")
        self._updated = np.array(arrays["updated"], dtype=bool)
        self._x, self._gradient = np.array(arrays["x"]), np.array(arrays["gradient"])
        blocks = [
            np.array(arrays[f"block{k}"])
            for k in range(self._updated.size)
            if f"block{k}" in arrays
        ]
        self._blocks = blocks or None


def damped_bfgs(matrix: np.ndarray, step: np.ndarray, change: np.ndarray) -> np.ndarray:
    """The BFGS update of a positive definite matrix (n, n), damped after Powell so that it stays
    so.

    step, change : (n,) x_new - x_old and gradient_new - gradient_old
    """
    image = matrix @ step
    curvature = float(step @ image)
    if float(step @ change) < _POWELL * curvature:
        share = (1 - _POWELL) * curvature / (curvature - float(step @ change))
        change = share * change + (1 - share) * image
    updated = (
        matrix
        - np.outer(image, image) / curvature
        + np.outer(change, change) / float(step @ change)
    )
    return 0.5 * (updated + updated.T)
