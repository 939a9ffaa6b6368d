"""Parametric surfaces x(u, v): named families with coefficients, and the differential geometry of
any surface.

Formulas of the local geometry: do Carmo, Differential Geometry of Curves and Surfaces, chapters 3
and 4. A point's normal is x_u x x_v normalised; a normal curvature is positive where the surface
bends towards the normal.
"""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import prod
from typing import Any

import numpy as np

from ..errors import InputError
from .jets import Jet, constant, cos, cosh, exp, log, sin, sinh, tanh, variables

# x_u and x_v that span less than this share of |x_u| |x_v|, or are that much smaller than
# elsewhere, span no plane.
_DEGENERATE = 1e-9
# Coordinates that a surface over a plane has as parameters, by the axis that points up.
PLAN_AXES = {"x": [1, 2], "y": [2, 0], "z": [0, 1]}


@dataclass(frozen=True)
class LocalGeometry:
    """A surface at n points.

    points (n, 3) ; first (n, 3, 2) derivatives x_u, x_v ; second (n, 3, 2, 2) second derivatives
    """

    points: np.ndarray
    first: np.ndarray
    second: np.ndarray

    @cached_property
    def normals(self) -> np.ndarray:
        """(n, 3) unit normals."""
        normals = np.cross(self.first[:, :, 0], self.first[:, :, 1])
        return normals / np.linalg.norm(normals, axis=1, keepdims=True)

    @cached_property
    def metric(self) -> np.ndarray:
        """(n, 2, 2) first fundamental form."""
        return np.swapaxes(self.first, 1, 2) @ self.first

    @cached_property
    def shape(self) -> np.ndarray:
        """(n, 2, 2) second fundamental form."""
        return np.einsum("ni,niab->nab", self.normals, self.second)

    @cached_property
    def christoffel(self) -> np.ndarray:
        """(n, 2, 2, 2) symbols Gamma[k, a, b] of the second kind."""
        tangential = np.einsum("nic,niab->ncab", self.first, self.second)
        return np.einsum("nkc,ncab->nkab", np.linalg.inv(self.metric), tangential)

    @cached_property
    def gauss(self) -> np.ndarray:
        """(n,) Gaussian curvatures."""
        return np.linalg.det(self.shape) / np.linalg.det(self.metric)

    @cached_property
    def mean(self) -> np.ndarray:
        """(n,) mean curvatures (half the sum of the principal ones)."""
        return 0.5 * np.trace(np.linalg.solve(self.metric, self.shape), axis1=1, axis2=2)

    def push(self, directions: np.ndarray) -> np.ndarray:
        """Tangent vectors (n, 3) of parameter directions (n, 2)."""
        return np.einsum("nia,na->ni", self.first, directions)

    def normal_curvatures(self, directions: np.ndarray) -> np.ndarray:
        """(n,) curvatures of the normal sections in parameter directions (n, 2) of any length."""
        along = np.einsum("nab,na,nb->n", self.shape, directions, directions)
        return along / np.einsum("nab,na,nb->n", self.metric, directions, directions)

    def frame_to_parameters(self) -> np.ndarray:
        """(n, 2, 2) parameter directions (columns) of an orthonormal tangent frame e1 along x_u, e2
        = n x e1."""
        E, F = self.metric[:, 0, 0], self.metric[:, 0, 1]
        root = np.sqrt(np.linalg.det(self.metric))
        out = np.zeros_like(self.metric)
        out[:, 0, 0] = 1 / np.sqrt(E)
        out[:, 0, 1] = -F / (np.sqrt(E) * root)
        out[:, 1, 1] = np.sqrt(E) / root
        return out

    def principal(self) -> tuple[np.ndarray, np.ndarray]:
        """Principal curvatures (n, 2), ascending, and their unit parameter directions (n, 2, 2) as
        columns."""
        frame = self.frame_to_parameters()
        values, vectors = np.linalg.eigh(np.swapaxes(frame, 1, 2) @ self.shape @ frame)
        return values, frame @ vectors


class Surface(ABC):
    """A regular surface patch.

    lower, upper : (2,) bounds of the parameters (infinite where there are none)
    """

    lower: np.ndarray
    upper: np.ndarray

    @abstractmethod
    def derivatives(self, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points (n, 3), first (n, 3, 2) and second (n, 3, 2, 2) derivatives at parameters (n,
        2)."""

    def contains(self, uv: np.ndarray) -> np.ndarray:
        """(n,) whether parameters (n, 2) belong to the patch."""
        return np.all((uv >= self.lower) & (uv <= self.upper), axis=-1)

    def points(self, uv: np.ndarray) -> np.ndarray:
        """(n, 3) points at parameters (n, 2)."""
        return self.derivatives(uv)[0]

    def local(self, uv: np.ndarray) -> LocalGeometry:
        """`at` without its checks, for inner loops: values that aren't finite where the surface is
        singular."""
        return LocalGeometry(*self.derivatives(uv))

    def at(self, uv: np.ndarray) -> LocalGeometry:
        """The local geometry at parameters (n, 2).

        Raises InputError for parameters outside the patch, and where the surface is singular.
        """
        uv = np.asarray(uv, float).reshape(-1, 2)
        inside = self.contains(uv)
        if not inside.all():
            raise InputError(
                "lies outside the surface",
                field="network",
                value=uv[int(np.argmin(inside))].tolist(),
            )
        local = self.local(uv)
        sides = np.linalg.norm(local.first, axis=1)
        area = np.linalg.norm(np.cross(local.first[:, :, 0], local.first[:, :, 1]), axis=1)
        regular = (area > _DEGENERATE * sides[:, 0] * sides[:, 1]) & (
            sides > _DEGENERATE * sides.max()
        ).all(axis=1)
        regular &= np.isfinite(local.points).all(axis=1) & np.isfinite(local.second).all(
            axis=(1, 2, 3)
        )
        if not regular.all():
            raise InputError(
                "the surface has no tangent plane here",
                field="network",
                value=uv[int(np.argmin(regular))].tolist(),
            )
        return local


class ScaledSurface(Surface):
    """A surface at another size, with the same parameters.

    surface : at its own size; scale : positive
    """

    def __init__(self, surface: Surface, scale: float):
        self.surface, self.scale = surface, scale
        self.lower, self.upper = surface.lower, surface.upper

    def derivatives(self, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        points, first, second = self.surface.derivatives(uv)
        return self.scale * points, self.scale * first, self.scale * second

    def contains(self, uv: np.ndarray) -> np.ndarray:
        return self.surface.contains(uv)


class AnalyticSurface(Surface):
    """A surface given by a formula.

    name : one of `FAMILIES`
    parameters : its coefficients, by name
    Raises InputError for unknown names and unusable coefficients.
    """

    def __init__(self, name: str, parameters: Mapping[str, Any] | None = None):
        if name not in FAMILIES:
            raise InputError(
                f"unknown surface (known: {', '.join(sorted(FAMILIES))})",
                field="surface.name",
                value=name,
            )
        self.name = name
        self.coefficients = _coefficients(name, parameters or {})
        self.lower, self.upper = np.array(_DOMAINS.get(name, _PLANE), float).T

    def derivatives(self, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        u, v = variables(np.asarray(uv, float))
        # singular points are told by `at`
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            xyz = FAMILIES[self.name](u, v, **self.coefficients)
        x, first, second = (
            np.stack([getattr(jet, part) for jet in xyz], axis=1)
            for part in ("value", "gradient", "hessian")
        )
        return x, first, second


# -- families: (u, v, coefficients) -> x, y, z; in height fields u = x and v = y ---------------
def _sphere(u: Jet, v: Jet, *, radius: float) -> tuple[Jet, Jet, Jet]:
    """Stereographic from the pole below: (0, 0) is the top, lines of u and v are circles at right
    angles."""
    scale = 1 / (1 + (u * u + v * v) / (4 * radius**2))
    return u * scale, v * scale, radius * (2 * scale - 1)


def _torus(u: Jet, v: Jet, *, radius: float, tube: float) -> tuple[Jet, Jet, Jet]:
    """u around the axis z, v around the tube (0: outside), rad."""
    out = radius + tube * cos(v)
    return out * cos(u), out * sin(u), tube * sin(v)


def _cylinder(u: Jet, v: Jet, *, radius: float) -> tuple[Jet, Jet, Jet]:
    """u and v are lengths, around and along the axis y; the top is u = 0."""
    return radius * sin(u / radius), v, radius * cos(u / radius)


def _paraboloid(u: Jet, v: Jet, *, a: float, b: float) -> tuple[Jet, Jet, Jet]:
    """z = a u^2 / 2 + b v^2 / 2: a and b are the curvatures at the apex."""
    return u, v, 0.5 * (a * u * u + b * v * v)


def _hypar(u: Jet, v: Jet, *, c: float) -> tuple[Jet, Jet, Jet]:
    """z = c u v; u and v are its straight lines."""
    return u, v, c * u * v


def _enneper(u: Jet, v: Jet, *, scale: float) -> tuple[Jet, Jet, Jet]:
    """Minimal; lines of u and v are its curvature lines, the diagonals its asymptotic lines."""
    x = u - u * u * u / 3 + u * v * v
    y = v - v * v * v / 3 + v * u * u
    return scale * x, scale * y, scale * (u * u - v * v)


def _catenoid(u: Jet, v: Jet, *, scale: float) -> tuple[Jet, Jet, Jet]:
    """Minimal; u the angle about the axis z, v along it in units of scale."""
    return scale * cosh(v) * cos(u), scale * cosh(v) * sin(u), scale * v


def _helicoid(u: Jet, v: Jet, *, scale: float) -> tuple[Jet, Jet, Jet]:
    """Minimal; u the angle about the axis z (rise scale a radian), v the distance from it in scale
    sinh v."""
    return scale * sinh(v) * cos(u), scale * sinh(v) * sin(u), scale * u


def _scherk(u: Jet, v: Jet, *, scale: float) -> tuple[Jet, Jet, Jet]:
    """Minimal height field z = scale log(cos(v / scale) / cos(u / scale))."""
    return u, v, scale * (log(cos(v / scale)) - log(cos(u / scale)))


def _pseudosphere(u: Jet, v: Jet, *, scale: float) -> tuple[Jet, Jet, Jet]:
    """Gaussian curvature -1 / scale^2; u > 0 along the axis z, v about it."""
    return scale * cos(v) / cosh(u), scale * sin(v) / cosh(u), scale * (u - tanh(u))


def _polynomial(u: Jet, v: Jet, *, coefficients: list[list[float]]) -> tuple[Jet, Jet, Jet]:
    """z = sum c[i][j] u^i v^j."""
    terms = []
    for i, row in enumerate(coefficients):
        for j, c in enumerate(row):
            if c:
                powers = [x if k == 1 else x**k for x, k in ((u, i), (v, j)) if k]
                terms.append(prod(powers[1:], start=powers[0] * c) if powers else constant(c, u))
    return u, v, sum(terms, constant(0.0, u))


def _gaussians(u: Jet, v: Jet, *, bumps: list[list[float]]) -> tuple[Jet, Jet, Jet]:
    """z = sum of h exp(-((u - a)^2 + (v - b)^2) / (2 w^2)) over bumps [h, a, b, w]."""
    terms = [h * exp(((u - a) ** 2 + (v - b) ** 2) * (-0.5 / w**2)) for h, a, b, w in bumps]
    return u, v, sum(terms, constant(0.0, u))


FAMILIES: dict[str, Callable[..., tuple[Jet, Jet, Jet]]] = {
    "sphere": _sphere,
    "torus": _torus,
    "cylinder": _cylinder,
    "paraboloid": _paraboloid,
    "hypar": _hypar,
    "enneper": _enneper,
    "catenoid": _catenoid,
    "helicoid": _helicoid,
    "scherk": _scherk,
    "pseudosphere": _pseudosphere,
    "polynomial": _polynomial,
    "gaussians": _gaussians,
}
_PLANE = ((-np.inf, np.inf), (-np.inf, np.inf))
_DOMAINS = {"pseudosphere": ((0.0, np.inf), (-np.inf, np.inf))}
_POSITIVE = ("radius", "tube", "scale")  # the other coefficients may have any sign


def _coefficients(name: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """The family's coefficients, all there and finite."""
    wanted = [p for p in inspect.signature(FAMILIES[name]).parameters if p not in ("u", "v")]
    for key in given:
        if key not in wanted:
            raise InputError(
                f"is no coefficient of a {name} (they are {', '.join(wanted)})",
                field=f"surface.{key}",
            )
    for key in wanted:
        if key not in given:
            raise InputError(
                f"is missing: a {name} needs {', '.join(wanted)}", field=f"surface.{key}"
            )
    return {key: _checked(f"surface.{key}", key, given[key]) for key in wanted}


def _checked(field: str, key: str, value: Any) -> Any:
    if key in ("coefficients", "bumps"):
        return _table(field, value, columns=4 if key == "bumps" else None)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
        raise InputError("must be a finite number", field=field, value=value)
    if key in _POSITIVE and not value > 0:
        raise InputError("must be positive", field=field, value=value)
    return float(value)


def _table(field: str, value: Any, columns: int | None) -> list[list[float]]:
    if not isinstance(value, (list, tuple)) or not value:
        raise InputError("must be a list of lists of numbers", field=field, value=value)
    rows = []
    for k, row in enumerate(value):
        try:
            numbers = [float(x) for x in row]
        except (TypeError, ValueError):
            raise InputError(
                "must be a list of numbers", field=f"{field}[{k}]", value=row
            ) from None
        if not np.isfinite(numbers).all() or columns is not None and len(numbers) != columns:
            raise InputError(
                "must be a list of finite numbers" + (f", {columns} of them" if columns else ""),
                field=f"{field}[{k}]",
                value=row,
            )
        if columns == 4 and not numbers[3] > 0:
            raise InputError(
                "the width, the last number, must be positive", field=f"{field}[{k}]", value=row
            )
        rows.append(numbers)
    return rows
