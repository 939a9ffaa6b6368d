"""Equilibrium paths in a load factor, through limit points: where they turn, where they branch,
what is stable.

Unknowns are the state x and the factor t of a load: R(x, t) = dPi/dx + t dE_load/dx = 0, with the
arc length measured in the state alone (Crisfield 1981; a load without any effect has no path). Each
step goes along the tangent and is corrected in the plane normal to it by the bordered system  K d +
f dt = -R,  a.d = 0,  with the geometric stiffness at the predicted stress as in `newton`. The
stiffness may be indefinite: a path goes on over unstable states.

A coordinate that is driven instead of loaded has the same equilibria: load it by a unit force and
read the coordinate as the point's `displacement`, the work-conjugate of the factor.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arrays import Parameters
from ..errors import SimulationFailure
from ..scene.loads import HingeTorques, Scaled
from ..scene.scene import Scene
from ..scene.state import State
from .direction import Border, is_convex
from .equilibria import Equilibrium
from .newton import solve
from .system import System

_GROWTH, _EASY, _HARD = 1.5, 5, 8  # iterations after which steps grow, and after which they shrink
_SMALLEST = 1e-6  # of the largest step: below it the path is lost
# rad that the tangent, and share of its largest value that the factor's rate, may change by in a
# step
_SMOOTH = 0.3
_SHARPEST = 1e-3  # of the largest step: below it such changes are taken for a corner of the path
_BISECTIONS = 40
_LOCATED = 1e-7  # relative, of the factor at a critical point: closer to it the tangents are noise


@dataclass(frozen=True)
class PathOptions:
    """Settings of a trace.

    rotation : largest rotation of one step, rad, and largest displacement as a share of the size
    tolerance : largest residual force relative to the largest internal force
    max_points, max_iterations : points of a path, iterations of one correction
    """

    rotation: float = 0.1
    tolerance: float = 1e-9
    max_points: int = 1000
    max_iterations: int = 15


@dataclass(frozen=True)
class PathPoint:
    """An equilibrium on a path, stable or not.

    state, stress (E, 6), elastic_energy : as of an Equilibrium
    factor : load factor
    displacement : work-conjugate of the factor, minus the energy of the unit load
    negative : eigenvalues of the Hessian that are not positive
    stable : at fixed factor; held : at fixed displacement
    factor_rate, displacement_rate : derivatives in the arc length
    """

    state: State
    factor: float
    displacement: float
    elastic_energy: float
    stress: np.ndarray
    negative: int
    held: bool
    factor_rate: float
    displacement_rate: float
    tangent: np.ndarray

    @property
    def stable(self) -> bool:
        return self.negative == 0

    @property
    def signature(self) -> tuple[int, bool, bool]:
        """What changes at a critical point only."""
        return self.negative, self.factor_rate > 0, self.displacement_rate > 0


@dataclass(frozen=True)
class CriticalPoint:
    """Where a path turns or branches.

    kind : "limit" (the factor turns), "turning" (the displacement turns), "bifurcation" (neither
        does, but the Hessian is singular)
    point : just behind it
    mode : (n_free,) the Hessian's softest direction there, largest entry 1; for a turning point the
        path's tangent
    """

    kind: str
    point: PathPoint
    mode: np.ndarray


@dataclass(frozen=True)
class Path:
    """points along the path in order; critical points in order."""

    points: tuple[PathPoint, ...]
    critical: tuple[CriticalPoint, ...]

    @property
    def factors(self) -> np.ndarray:
        return np.array([point.factor for point in self.points])

    @property
    def displacements(self) -> np.ndarray:
        return np.array([point.displacement for point in self.points])

    def first(self, kind: str) -> CriticalPoint:
        """The first critical point of a kind. Raises SimulationFailure when the path met none."""
        for critical in self.critical:
            if critical.kind == kind:
                return critical
        raise SimulationFailure(f"no {kind} point on a path of {len(self.points)} points")


def trace_path(
    scene: Scene,
    q: Parameters,
    load: Any = None,
    *,
    stop: Callable[[PathPoint], bool],
    start: Equilibrium | State | None = None,
    factor: float = 0.0,
    direction: int = 1,
    options: PathOptions = PathOptions(),
) -> Path:
    """Trace the equilibria of a scene under a load that is multiplied by a factor.

    Parameters
    ----------
    scene : what is simulated
    q : (n_parameters,) its parameters
    load : the term to be multiplied, in addition to the scene's own; None: the torque of the
        scene's actuation, whose displacement is the opening angle and whose factor is minus the
        multiplier of `solve`
    stop : true at the point where the path may end
    start, factor : where to start. An Equilibrium is taken as it is (of an actuated scene with its
        torque); from a state, default the scene's initial one, a stable equilibrium at the factor
        is looked for first
    direction : 1 to start towards larger factors, -1 towards smaller ones
    options : how far and how finely the path is followed

    Raises SimulationFailure when no start is found, when the path is lost or doesn't end in time.
    """
    if load is None:
        if scene.actuated is None:
            raise ValueError("a path needs a load or an actuated scene")
        load = HingeTorques(scene.actuated, 1 / len(scene.actuated), scene.n_bodies)
        factor = -start.torque if isinstance(start, Equilibrium) else factor
    elif scene.actuated is not None:
        raise ValueError("a loaded path can't keep an opening angle; make the actuation a load")
    scaled = Scaled(load, factor)
    system = System(replace(scene, actuated=None, terms=(*scene.terms, scaled)))
    system.set_parameters(q)
    state = start.state if isinstance(start, Equilibrium) else solve(system, q, start).state
    return _Tracer(system, scaled, options).trace(state, factor, direction, stop)


class _Tracer:
    """The workspace of one trace."""

    def __init__(self, system: System, load: Scaled, options: PathOptions):
        self.system, self.load, self.options = system, load, options
        s = system.sparsity
        self._load_rows = s.kept[load.dofs]
        self._load_rows[self._load_rows >= s.n_free] = -1

    def trace(
        self, state: State, factor: float, direction: int, stop: Callable[[PathPoint], bool]
    ) -> Path:
        point = self._point(state, factor, None)
        if point.factor_rate * direction < 0:
            point = _reversed(point)
        points, critical = [point], []
        share = 1.0
        while not stop(point):
            if len(points) >= self.options.max_points:
                raise SimulationFailure(f"the path doesn't end within {len(points)} points")
            step = share * self._largest_step(point)
            ahead, iterations = self._advance(point, step)
            if ahead is None or share > _SHARPEST and self._bends(points, ahead):
                share /= 2
                if share < _SMALLEST:
                    raise SimulationFailure(f"the path is lost at factor {point.factor:.6g}")
                continue
            critical += self._critical_between(point, ahead, step)
            points.append(ahead)
            point = ahead
            if iterations <= _EASY:
                share = min(1.0, _GROWTH * share)
            elif iterations >= _HARD:
                share /= 2
        return Path(tuple(points), tuple(critical))

    def _bends(self, points: list[PathPoint], ahead: PathPoint) -> bool:
        """Whether a step is too long for the path's curvature, and might end on another branch."""
        cosine = ahead.tangent @ (self.system.metric * points[-1].tangent)
        largest = max(abs(point.factor_rate) for point in points)
        change = abs(ahead.factor_rate - points[-1].factor_rate)
        return bool(
            cosine < np.cos(_SMOOTH) or change > _SMOOTH * max(largest, abs(ahead.factor_rate))
        )

    def _largest_step(self, point: PathPoint) -> float:
        """Arc length at which the tangent turns or moves something by as much as is allowed."""
        system, t = self.system, np.abs(point.tangent)
        turn = t[system.is_rotation].max(initial=0.0)
        move = t[~system.is_rotation].max(initial=0.0) / system.scene.size
        return self.options.rotation / max(turn, move)

    def _advance(self, point: PathPoint, step: float) -> tuple[PathPoint | None, int]:
        """The point of the path in the plane a step ahead, or None when the correction fails; and
        its iterations."""
        system, options = self.system, self.options
        normal = system.metric * point.tangent
        state = point.state.moved(system.increment(step * point.tangent))
        factor = point.factor + step * point.factor_rate
        system.predicted_stress[:] = point.stress
        for iteration in range(options.max_iterations):
            residual, slope = self._assemble(state, factor, mixed=iteration > 0)
            if self._converged(residual):
                ahead = self._point(state, factor, point.tangent)
                return ahead, iteration
            system.factorise()
            both = system.solve(np.stack([-residual, -slope], axis=1))
            change = -(normal @ both[:, 0]) / (normal @ both[:, 1])
            d = both[:, 0] + change * both[:, 1]
            if not np.isfinite(d).all() or np.abs(d[system.is_rotation]).max(initial=0.0) > 1.0:
                break
            system.predict_stress(d)
            state = state.moved(system.increment(d))
            factor += change
        return None, options.max_iterations

    def _assemble(
        self, state: State, factor: float, mixed: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Residual and its derivative in the factor, (n_free,) each."""
        system = self.system
        self.load.factor = factor
        self._elastic = system.assemble(state, mixed=mixed).elastic
        _, g, _ = self.load.term.gradient_hessian(state)
        slope = np.zeros(system.n_unknowns + 1)
        np.add.at(slope, self._load_rows, g)  # what is not free goes into the last place
        return system.gradient[: system.n_unknowns].copy(), slope[:-1]

    def _converged(self, residual: np.ndarray) -> bool:
        force, noise = self.system.force_scale()
        largest = np.max(np.abs(residual) * self.system.force_weight, initial=0.0)
        return bool(largest <= self.options.tolerance * force + 40 * noise)

    def _point(self, state: State, factor: float, along: np.ndarray | None) -> PathPoint:
        """The equilibrium with its tangent, which points along a given one."""
        system = self.system
        _, slope = self._assemble(state, factor)
        negative = system.factorise()
        column = system.solve(slope)
        size = float(np.sqrt(column @ (system.metric * column)))
        if not 0 < size < np.inf:
            raise SimulationFailure(
                "the load does no work on this scene, or its stiffness is singular"
            )
        tangent, rate = -column / size, 1 / size
        if along is not None and tangent @ (system.metric * along) < 0:
            tangent, rate = -tangent, -rate
        return PathPoint(
            state=state,
            factor=float(factor),
            displacement=-float(self.load.term.energy(state)),
            elastic_energy=self._elastic,
            stress=system.stress(),
            negative=negative,
            held=is_convex(negative, Border(column, float(slope @ column))),
            factor_rate=rate,
            displacement_rate=-float(slope @ tangent),
            tangent=tangent,
        )

    # -- critical points -----------------------------------------------------------------------
    def _critical_between(
        self, point: PathPoint, ahead: PathPoint, step: float
    ) -> list[CriticalPoint]:
        """All critical points on a step, by bisection of its length on what differs between its
        ends.

        What doesn't differ there is not looked at: next to a singular stiffness the tangent's signs
        are noise.
        """
        differs = [a != b for a, b in zip(point.signature, ahead.signature)]

        def signature(of: PathPoint) -> list:
            return [value for value, counts in zip(of.signature, differs) if counts]

        found: list[CriticalPoint] = []
        low, before = 0.0, point
        while signature(before) != signature(ahead):
            high, behind = step, ahead
            for _ in range(_BISECTIONS):
                middle, _ = self._advance(point, 0.5 * (low + high))
                if middle is None:
                    break
                if signature(middle) == signature(before):
                    low, before = 0.5 * (low + high), middle
                else:
                    high, behind = 0.5 * (low + high), middle
                if high - low < 1e-3 * step and abs(
                    behind.factor - before.factor
                ) <= _LOCATED * abs(behind.factor):
                    break
            found.append(self._critical(before, behind, differs))
            low, before = high, behind
        return found

    def _critical(self, before: PathPoint, behind: PathPoint, differs: list[bool]) -> CriticalPoint:
        count, factor, _ = (
            a != b and counts for a, b, counts in zip(before.signature, behind.signature, differs)
        )
        if not count and not factor:
            return CriticalPoint("turning", behind, behind.tangent / np.abs(behind.tangent).max())
        self._point(behind.state, behind.factor, None)
        # without symmetry, and reproducible
        mode = np.sin(np.arange(1, self.system.n_unknowns + 1) * 0.7390851)
        for _ in range(4):
            mode = self.system.solve(self.system.metric * mode)
            mode /= mode[np.argmax(np.abs(mode))]
        return CriticalPoint("limit" if factor else "bifurcation", behind, mode)


def _reversed(point: PathPoint) -> PathPoint:
    return replace(
        point,
        tangent=-point.tangent,
        factor_rate=-point.factor_rate,
        displacement_rate=-point.displacement_rate,
    )
