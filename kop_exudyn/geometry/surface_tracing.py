"""Curves traced on a surface: geodesics, asymptotic lines, curvature lines, as sampled
parameter-space curves."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from .surfaces import LocalGeometry, Surface

_RELATIVE, _ABSOLUTE = 1e-9, 1e-11
_LONGEST = 4.0  # times the domain's size: a curve that still winds on then is cut off
# Where the surface is that close to flat or umbilic, a field of asymptotic or principal directions
# has no meaning.
_DIRECTIONLESS = 1e-6


class Domain:
    """A rectangle (lower, upper), each (2,), in the parameter plane, within which curves are traced
    on a surface."""

    def __init__(self, surface: Surface, lower: Any, upper: Any):
        self.surface = surface
        self.lower, self.upper = np.asarray(lower, float), np.asarray(upper, float)
        if not (self.lower < self.upper).all():
            raise InputError(
                "its lower bounds must be below its upper ones",
                field="network.domain",
                value=[self.lower.tolist(), self.upper.tolist()],
            )

    def contains(self, uv: np.ndarray) -> bool:
        return bool(
            ((uv >= self.lower) & (uv <= self.upper)).all() and self.surface.contains(uv[None])[0]
        )

    @property
    def size(self) -> float:
        """Length of the rectangle's diagonal on the surface, measured at its middle: a bound for
        how far to trace."""
        middle = 0.5 * (self.lower + self.upper)
        middle = middle if self.surface.contains(middle[None])[0] else self.lower
        metric = self.surface.at(middle[None]).metric[0]
        span = self.upper - self.lower
        return float(np.sqrt(metric[0, 0]) * span[0] + np.sqrt(metric[1, 1]) * span[1])


def geodesic(domain: Domain, point: Any, angle: float, samples: int = 60) -> np.ndarray:
    """Parameters (n, 2) along the geodesic through a point, both ways until it leaves the domain.

    angle : rad in the tangent plane, from x_u towards the normal's cross product with it
    Solves u'' = -Gamma(u', u') (do Carmo, 4-4) at unit speed.
    """
    point = _inside(domain, point)
    frame = domain.surface.at(point[None]).frame_to_parameters()[0]
    start = frame @ np.array([np.cos(angle), np.sin(angle)])

    def slope(_: float, y: np.ndarray) -> np.ndarray:
        gamma = domain.surface.local(y[None, :2]).christoffel[0]
        return np.concatenate([y[2:], -np.einsum("kab,a,b->k", gamma, y[2:], y[2:])])

    return _both_ways(
        domain, slope, np.concatenate([point, start]), np.concatenate([point, -start]), samples
    )


def asymptotic_line(domain: Domain, point: Any, family: int, samples: int = 60) -> np.ndarray:
    """Parameters (n, 2) along an asymptotic line (normal curvature zero) through a point, both
    ways.

    family : 0 or 1, the two directions at equal angles to the principal direction of the larger
    curvature Raises InputError where the surface has no asymptotic directions.
    """

    def direction(local: LocalGeometry) -> np.ndarray | None:
        values, vectors = local.principal()
        low, high = values[0]
        if not low < -_DIRECTIONLESS * high or not high > -_DIRECTIONLESS * low:
            return None
        # Euler: low cos^2 + high sin^2 = 0 with the angle counted from the direction of the lower
        # curvature
        turn = np.arctan(np.sqrt(-low / high)) * (1 if family == 0 else -1)
        first, second = vectors[0].T
        if first[0] * second[1] < first[1] * second[0]:  # eigenvectors come in either sense
            second = -second
        return np.cos(turn) * first + np.sin(turn) * second

    return _field_line(
        domain, direction, point, samples, "the Gaussian curvature isn't negative here"
    )


def curvature_line(domain: Domain, point: Any, family: int, samples: int = 60) -> np.ndarray:
    """Parameters (n, 2) along a curvature line through a point, both ways.

    family : 0 for the lower principal curvature, 1 for the higher one
    Raises InputError at umbilic points, where no direction is principal.
    """

    def direction(local: LocalGeometry) -> np.ndarray | None:
        values, vectors = local.principal()
        return (
            None
            if np.ptp(values[0]) <= _DIRECTIONLESS * np.abs(values[0]).max()
            else vectors[0][:, family]
        )

    return _field_line(
        domain, direction, point, samples, "an umbilic point has no principal directions"
    )


def _field_line(
    domain: Domain,
    direction: Callable[[LocalGeometry], np.ndarray | None],
    point: Any,
    samples: int,
    reason: str,
) -> np.ndarray:
    """Follow a field of unit directions without sense; it is made continuous by the last direction
    taken."""
    point = _inside(domain, point)
    start = direction(domain.surface.local(point[None]))
    if start is None:
        raise InputError(reason, field="network.points", value=point.tolist())

    def sense(first: np.ndarray) -> Callable[[float, np.ndarray], np.ndarray]:
        last = [first]

        def slope(_: float, y: np.ndarray) -> np.ndarray:
            local = domain.surface.local(y[None])
            here = direction(local)
            if here is None:
                raise _Lost
            here = here if here @ local.metric[0] @ last[0] > 0 else -here
            last[0] = here
            return here

        return slope

    return _both_ways(domain, (sense(start), sense(-start)), point, point, samples)


class _Lost(Exception):
    """The direction field ends here."""


def _both_ways(
    domain: Domain, slope: Any, forward: np.ndarray, backward: np.ndarray, samples: int
) -> np.ndarray:
    """Points (samples, 2) equally spaced by arc length, which the equations have as their
    independent variable."""
    slopes = slope if isinstance(slope, tuple) else (slope, slope)
    ahead, back = (_until_outside(domain, f, y) for f, y in zip(slopes, (forward, backward)))
    stations = np.linspace(-back.end, ahead.end, samples)
    return np.array([ahead(s) if s > 0 else back(-s) for s in stations])


@dataclass
class _Path:
    """A solution by its steps: the arc lengths at their ends, and their interpolants."""

    start: np.ndarray
    ends: list[float]
    steps: list[Callable[[float], np.ndarray]]

    @property
    def end(self) -> float:
        return self.ends[-1] if self.ends else 0.0

    def __call__(self, length: float) -> np.ndarray:
        if not self.steps:
            return self.start[:2]
        return self.steps[min(bisect_left(self.ends, length), len(self.steps) - 1)](length)[:2]


def _until_outside(domain: Domain, slope: Callable, start: np.ndarray) -> _Path:
    """The solution from a start until it leaves the domain, or until there is no direction any
    more."""
    from scipy.integrate import DOP853

    longest, path = _LONGEST * domain.size, _Path(start, [], [])
    try:
        solver = DOP853(
            slope, 0.0, start, longest, max_step=domain.size / 20, rtol=_RELATIVE, atol=_ABSOLUTE
        )
        while solver.status == "running":
            solver.step()
            if solver.status == "failed":
                break
            step = solver.dense_output()
            outside = not domain.contains(solver.y[:2])
            path.steps.append(step)
            path.ends.append(_border(domain, step, solver.t_old, solver.t) if outside else solver.t)
            if outside:
                break
    except (_Lost, np.linalg.LinAlgError):  # no direction, or a stage of a step at a singular point
        pass
    return path


def _border(domain: Domain, step: Callable, inside: float, outside: float) -> float:
    """The arc length at which a step leaves the domain, by bisection from within."""
    for _ in range(50):
        middle = 0.5 * (inside + outside)
        inside, outside = (
            (middle, outside) if domain.contains(step(middle)[:2]) else (inside, middle)
        )
    return inside


def _inside(domain: Domain, point: Any) -> np.ndarray:
    point = np.asarray(point, float)
    if not domain.contains(point):
        raise InputError("lies outside the domain", field="network.points", value=point.tolist())
    return point
