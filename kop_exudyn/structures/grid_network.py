"""Curve networks on a surface, drawn in its parameter plane: iso-lines, traced curves, given curves."""
from __future__ import annotations

from typing import Any, Mapping

import numpy as np

from ..errors import InputError
from .curve_network import CurveNetwork, network_of
from .planar_curve import PlanarCurve
from .surface_tracing import Domain, asymptotic_line, curvature_line, geodesic
from .surfaces import Surface


def network_on(surface: Surface, data: Mapping[str, Any]) -> CurveNetwork:
    """The network that a design file's "network" describes; positions are parameters (u, v).

    isolines: {"u": [...], "v": [...]}, every line of u between the outermost lines of v and the other way round
    geodesics: {"domain": [[u0, v0], [u1, v1]], "through": [[u, v, angle], ...]}
    asymptotic, curvature: {"domain": ..., "points": [[u, v], ...], "second_points": [[u, v], ...]}: lines of the first
        family through "points", of the second through "second_points" (default: the same)
    curves: {"curves": [{"type": "spline" | "polyline", "points": [[u, v], ...], "closed": false}, ...]}
    Raises InputError.
    """
    if data["type"] not in _READERS:
        raise InputError(f"unknown network (known: {', '.join(_READERS)})", field="network.type", value=data["type"])
    curves = _READERS[data["type"]](surface, data)
    for curve in curves:
        samples = curve.position(curve.samples())
        inside = surface.contains(samples)
        if not inside.all():
            raise InputError("leaves the surface", field=curve.field, value=samples[int(np.argmin(inside))].tolist())
    return network_of(curves)


def _isolines(surface: Surface, data: Mapping[str, Any]) -> list[PlanarCurve]:
    values = []
    for name in ("u", "v"):
        lines = np.array(data[name], float)
        if len(lines) < 2 or not (np.diff(lines) > 0).all():
            raise InputError("must be two or more increasing numbers", field=f"network.{name}", value=data[name])
        values.append(lines)
    u, v = values
    of_u = [PlanarCurve([[a, v[0]], [a, v[-1]]], smooth=False, field=f"network.u[{k}]") for k, a in enumerate(u)]
    of_v = [PlanarCurve([[u[0], b], [u[-1], b]], smooth=False, field=f"network.v[{k}]") for k, b in enumerate(v)]
    return of_u + of_v


def _geodesics(surface: Surface, data: Mapping[str, Any]) -> list[PlanarCurve]:
    domain = Domain(surface, *data["domain"])
    return [_traced(f"network.through[{k}]", geodesic, domain, (u, v), angle)
            for k, (u, v, angle) in enumerate(data["through"])]


def _asymptotic(surface: Surface, data: Mapping[str, Any]) -> list[PlanarCurve]:
    return _field_lines(surface, data, asymptotic_line)


def _curvature(surface: Surface, data: Mapping[str, Any]) -> list[PlanarCurve]:
    return _field_lines(surface, data, curvature_line)


def _field_lines(surface: Surface, data: Mapping[str, Any], trace: Any) -> list[PlanarCurve]:
    domain = Domain(surface, *data["domain"])
    names = ("points", "second_points" if "second_points" in data else "points")
    return [_traced(f"network.{name}[{k}]", trace, domain, point, family)
            for family, name in enumerate(names) for k, point in enumerate(data[name])]


def _traced(field: str, trace: Any, domain: Domain, point: Any, option: Any) -> PlanarCurve:
    try:
        return PlanarCurve(trace(domain, point, option), field=field)
    except InputError as error:
        raise InputError(error.message, field=field, value=error.value) from None


def _curves(surface: Surface, data: Mapping[str, Any]) -> list[PlanarCurve]:
    return [PlanarCurve(c["points"], c.get("closed", False), c.get("type", "spline") == "spline",
                        field=f"network.curves[{k}]") for k, c in enumerate(data["curves"])]


_READERS = {"isolines": _isolines, "geodesics": _geodesics, "asymptotic": _asymptotic, "curvature": _curvature,
            "curves": _curves}
