"""Target fitting: how far joints are from a target surface and from their target positions, at best
placement.

T(x) = share sum_i w_i |y_i - x*_i|^2 + (1 - share) sum_i w_i |y_i - P(y_i)|^2, minimised over rigid
placements y = R x + t, with P the closest point on the surface and weights w that sum to one. As
the placement is a minimiser, the gradient in x needs no derivative of it; the Hessian does, by
Schur complement. Large distances can be given more weight by a fourth power.

T is what a search minimises. What is built may be set up anywhere, and what is told of its form is
the largest distance from the surface, placed so that this is least (the minimum zone of ISO 1101).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..checks import check_positive
from ..errors import InputError
from ..geometry.triangles import Closest
from ..rods.rotations import exp_so3, hat
from ..wording import counted
from .base import Target

_MAX_ITERATIONS = 100
# of the joints' size; Newton converges quadratically, the step after that is round-off
_STEP_TOLERANCE = 1e-10
# powers of the distances by which the largest one is brought down: each begins where the last ended
_POWERS = (4, 8, 16, 32, 64)
# weight of the joints' own places beside these, or they would slide along a surface at will
_ZONE_SHARE = 1e-2
_ON_SURFACE = 1e-9  # of the size
# relative: rigid motions that no residual sees, as turning collinear joints about their line
_DEGENERATE = 1e-10


@dataclass(frozen=True)
class Placement:
    """Rigid motion y = R x + t: rotation (3, 3), translation (3,)."""

    rotation: np.ndarray
    translation: np.ndarray

    def apply(self, points: np.ndarray) -> np.ndarray:
        """Placed points (n, 3)."""
        return points @ self.rotation.T + self.translation

    def moved(self, centre: np.ndarray, turn: np.ndarray, shift: np.ndarray) -> Placement:
        """This placement followed by a turn (rotation vector) about a point, and a shift."""
        rotation = exp_so3(turn)
        return Placement(
            rotation @ self.rotation, rotation @ (self.translation - centre) + centre + shift
        )


@dataclass(frozen=True)
class FitResult:
    """Target fitting of n joints.

    value : T, length^2, at the placement for which it is least
    gradient : (n, 3) dT/dx in the coordinates that the joints were given in
    placement : the one for which T is least, or where the largest distance is
        (`TargetFitting.minimum_zone`)
    distances : (n,) of the placed joints from the surface
    displacements : (n,) of the placed joints from their own places in the target
    size : of the target, which percentages refer to
    blocks : (n, 3, 3) square root of the Hessian of T in each placed joint
    motions : (3n, r) orthonormal basis of the weighted residual rows' change by rigid motions
    fitted : the placement for which T is least, which value, gradient, blocks and motions are of
    """

    value: float
    gradient: np.ndarray
    placement: Placement
    distances: np.ndarray
    displacements: np.ndarray
    size: float
    blocks: np.ndarray
    motions: np.ndarray
    fitted: Placement

    def __repr__(self) -> str:
        return (
            f"<FitResult of {counted(len(self.distances), 'joint')}: at most "
            f"{self.max_percent:.3g} % off, "
            f"{self.mean_percent:.3g} % in the mean>"
        )

    @property
    def max_percent(self) -> float:
        """Largest distance from the surface, % of the target's size."""
        return 100 * float(self.distances.max()) / self.size

    @property
    def mean_percent(self) -> float:
        """Mean distance from the surface, % of the target's size."""
        return 100 * float(self.distances.mean()) / self.size

    def weighted_rows(self, jacobian: np.ndarray) -> np.ndarray:
        """R J (3n, m) for J = dx/dq (3n, m): the Gauss-Newton Hessian of T in q is (R J)^T (R
        J)."""
        n = len(self.blocks)
        rows = ((self.blocks @ self.fitted.rotation) @ jacobian.reshape(n, 3, -1)).reshape(
            3 * n, -1
        )
        return rows - self.motions @ (self.motions.T @ rows)


# joints (n, 3), closest points, T, dT/dy (n, 3)
_Placed = tuple[np.ndarray, Closest, float, np.ndarray]


@dataclass(frozen=True)
class _Measure:
    """How distances d from the surface and e from the joints' own places count: w (share e^2 +
    (1 - share) phi(d^2)) with phi(s) = linear s + factor scale (s / scale)^power."""

    share: float
    linear: float = 1.0
    factor: float = 0.0
    power: float = 2.0
    scale: float = 1.0

    def felt(self, s: np.ndarray) -> np.ndarray:
        """(n,) phi of squared distances."""
        return self.linear * s + self.factor * self.scale * (s / self.scale) ** self.power

    def slope(self, s: np.ndarray) -> np.ndarray:
        """(n,) its derivative."""
        return self.linear + self.factor * self.power * (s / self.scale) ** (self.power - 1)

    def bend(self, s: np.ndarray) -> np.ndarray:
        """(n,) its second derivative."""
        factor = self.factor * self.power * (self.power - 1) / self.scale
        return factor * (s / self.scale) ** (self.power - 2)


class TargetFitting:
    """Compares joints with a target; the search tree of the surface is built once.

    share : weight of the target positions, in [0, 1]; the surface has the rest
    weights : (n,) positive weights of the joints, all equal by default
    level : share of the size; squared distances d^2 from the surface count as
        d^2 (1 + d^2 / (2 (level size)^2)), so that large ones are felt more. Default: as squares
    Raises InputError for a share or weights that make no sense, and for unusable targets.
    """

    def __init__(
        self,
        target: Target,
        share: float = 0.1,
        weights: np.ndarray | None = None,
        level: float | None = None,
    ):
        if not 0 <= share <= 1:
            raise InputError("must lie in [0, 1]", field="share", value=share)
        if level is not None:
            check_positive("level", level)
        self.surface = target.surface
        self.positions = np.asarray(target.positions, dtype=float)
        if (
            self.positions.ndim != 2
            or self.positions.shape[1] != 3
            or not np.isfinite(self.positions).all()
        ):
            raise InputError(
                "expected finite points of shape (n, 3)",
                field="target.positions",
                value=self.positions.shape,
            )
        self.size = float(target.size)
        self._measure = _Measure(float(share))
        if level is not None:
            self._measure = _Measure(float(share), factor=0.5, scale=(level * self.size) ** 2)
        self.weights = _normalised(weights, len(self.positions))

    def __call__(self, x: np.ndarray, placement: Placement | None = None) -> FitResult:
        """Fit joints x (n, 3); the placement is searched from a given one, or from the best fit to
        the positions."""
        x = np.asarray(x, dtype=float)
        if x.shape != self.positions.shape or not np.isfinite(x).all():
            raise InputError(
                f"expected {len(self.positions)} finite joints", field="joints", value=x.shape
            )
        placement = placement or best_placement(x, self.positions, self.weights)
        return self._result(*self._least(x, placement, self._measure))

    def minimum_zone(self, x: np.ndarray, fit: FitResult | None = None) -> FitResult:
        """The fitting of joints x (n, 3), placed so that the largest distance from the surface is
        least: what is told of a shape, and where it is set up.

        fit : theirs, as far as it is known already, however it is placed

        That is where a mean of high powers of the distances is least, which is smooth: in powers
        that grow, each from where the last one ended, 64 at last (Polya's algorithm). The distance
        is never larger than where this began.
        """
        fit = self(x) if fit is None else fit
        x = np.asarray(x, dtype=float)
        best = placement = fit.placement
        nearest = found = self._evaluate(x, placement, self._measure)
        for power in _POWERS:
            largest = float(found[1].squared_distances.max())
            if largest <= (_ON_SURFACE * self.size) ** 2:
                break
            measure = _Measure(_ZONE_SHARE, linear=0.0, factor=1.0, power=power / 2, scale=largest)
            placement, found = self._least(x, placement, measure)
            if found[1].squared_distances.max() < nearest[1].squared_distances.max():
                best, nearest = placement, found
        return replace(
            fit,
            placement=best,
            distances=np.sqrt(nearest[1].squared_distances),
            displacements=np.linalg.norm(nearest[0] - self.positions, axis=1),
        )

    def _least(
        self, x: np.ndarray, placement: Placement, measure: _Measure
    ) -> tuple[Placement, _Placed]:
        """The placement for which a measure is least, searched from a given one."""
        found = self._evaluate(x, placement, measure)
        for _ in range(_MAX_ITERATIONS):
            placement, found, step = self._newton_step(x, placement, found, measure)
            if step <= _STEP_TOLERANCE:
                break
        return placement, found

    def _newton_step(
        self, x: np.ndarray, placement: Placement, found: _Placed, measure: _Measure
    ) -> tuple[Placement, _Placed, float]:
        """One safeguarded Newton step of the placement, what is found there, and its length
        relative to the size."""
        y, closest, value, gradient = found
        centre, size, motions = self._motions(y)
        slope = motions.T @ gradient.ravel()
        hessian = self._placement_hessian(y, centre, closest, gradient, size, motions, measure)
        step = _descent(hessian, slope)
        fraction = 1.0
        while fraction > 1e-8:
            turn, shift = fraction * step[:3] / size, fraction * step[3:]
            trial = placement.moved(centre, turn, shift)
            bound = value * (1 + 1e-14) + 1e-4 * fraction * float(slope @ step)
            there = self._evaluate(x, trial, measure)
            if there[2] <= bound:
                return trial, there, fraction * float(np.linalg.norm(step)) / size
            fraction *= 0.5
        return placement, found, 0.0

    def _evaluate(self, x: np.ndarray, placement: Placement, measure: _Measure) -> _Placed:
        """Placed joints, closest points, the measure and its derivative in y (n, 3)."""
        y = placement.apply(x)
        closest = self.surface.closest(y)
        to_position, to_surface = y - self.positions, y - closest.points
        distances = np.sum(to_surface**2, axis=1)
        share, slope = measure.share, measure.slope(distances)
        values = share * np.sum(to_position**2, axis=1) + (1 - share) * measure.felt(distances)
        gradient = share * to_position + ((1 - share) * slope)[:, None] * to_surface
        return y, closest, float(self.weights @ values), 2 * self.weights[:, None] * gradient

    def _motions(self, y: np.ndarray) -> tuple[np.ndarray, float, np.ndarray]:
        """Centre, size, and dy (3n, 6) of turns about the centre (times the size: all in lengths)
        and of shifts."""
        centre = self.weights @ y
        arms = y - centre
        size = float(np.sqrt(self.weights @ np.sum(arms**2, axis=1))) or self.size
        turns = hat(arms) / size  # (n, axis, 3): row k is e_k x arm
        shifts = np.broadcast_to(np.eye(3), turns.shape)
        return (
            centre,
            size,
            np.concatenate([turns, shifts], axis=1).transpose(0, 2, 1).reshape(-1, 6),
        )

    def _placement_hessian(
        self,
        y: np.ndarray,
        centre: np.ndarray,
        closest: Closest,
        gradient: np.ndarray,
        size: float,
        motions: np.ndarray,
        measure: _Measure,
    ) -> np.ndarray:
        """(6, 6) second derivatives of a measure in the motion: Gauss-Newton, plus the
        curvature of rotations."""
        blocks = self._blocks(y, closest, measure)
        rows = np.einsum("nij,njk->nik", blocks, motions.reshape(-1, 3, 6)).reshape(-1, 6)
        hessian = rows.T @ rows
        moment = gradient.T @ (y - centre)
        hessian[:3, :3] += (0.5 * (moment + moment.T) - np.trace(moment) * np.eye(3)) / size**2
        return hessian

    def _blocks(self, y: np.ndarray, closest: Closest, measure: _Measure) -> np.ndarray:
        """(n, 3, 3) square roots of a measure's Hessian in each placed joint, with the projector
        N = I - dP/dx and the vector r from the surface:
        2 w_i (share I + (1 - share) (phi' N + 2 phi'' r r^T))."""
        normal, share = np.eye(3) - closest.derivative, measure.share
        slope = measure.slope(closest.squared_distances)
        across = np.sqrt(share + (1 - share) * slope)
        root = np.sqrt(share) * closest.derivative + across[:, None, None] * normal
        if measure.factor:
            offset = y - closest.points
            lengths = np.linalg.norm(offset, axis=1, keepdims=True)
            along = np.divide(offset, lengths, out=np.zeros_like(offset), where=lengths > 0)
            bend = 2 * measure.bend(closest.squared_distances) * closest.squared_distances
            more = np.sqrt(share + (1 - share) * (slope + bend)) - across
            root = root + more[:, None, None] * along[:, :, None] * along[:, None, :]
        return np.sqrt(2 * self.weights)[:, None, None] * root

    def _result(self, placement: Placement, found: _Placed) -> FitResult:
        y, closest, value, gradient = found
        blocks = self._blocks(y, closest, self._measure)
        motions = self._motions(y)[2].reshape(-1, 3, 6)
        rows = np.einsum("nij,njk->nik", blocks, motions).reshape(-1, 6)
        basis, sizes, _ = np.linalg.svd(rows, full_matrices=False)
        basis = basis[:, sizes > _DEGENERATE * sizes[0]]
        return FitResult(
            value,
            gradient @ placement.rotation,
            placement,
            np.sqrt(closest.squared_distances),
            np.linalg.norm(y - self.positions, axis=1),
            self.size,
            blocks,
            basis,
            placement,
        )


def best_placement(
    x: np.ndarray, positions: np.ndarray, weights: np.ndarray | None = None
) -> Placement:
    """Rigid motion of least sum w |R x + t - positions|^2 (Kabsch, Acta Cryst. A32, 1976); weights
    sum to one, and are equal by default."""
    if weights is None:
        weights = np.full(len(x), 1 / len(x))
    centre, goal = weights @ x, weights @ positions
    left, _, right = np.linalg.svd(((x - centre) * weights[:, None]).T @ (positions - goal))
    turn = np.diag([1, 1, np.sign(np.linalg.det(left @ right))])
    rotation = right.T @ turn @ left.T
    return Placement(rotation, goal - rotation @ centre)


def _descent(hessian: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Newton step with eigenvalues made positive, none along directions without stiffness."""
    values, vectors = np.linalg.eigh(hessian)
    stiff = np.abs(values) > _DEGENERATE * np.abs(values).max()
    inverse = np.where(stiff, 1 / np.where(stiff, np.abs(values), 1), 0)
    return -vectors @ (inverse * (vectors.T @ slope))


def _normalised(weights: np.ndarray | None, n: int) -> np.ndarray:
    if weights is None:
        return np.full(n, 1 / n)
    weights = np.asarray(weights, dtype=float)
    if (
        weights.shape != (n,)
        or not np.isfinite(weights).all()
        or np.any(weights < 0)
        or weights.sum() == 0
    ):
        raise InputError(
            f"expected {n} weights, not negative and not all zero",
            field="weights",
            value=weights.shape,
        )
    return weights / weights.sum()
