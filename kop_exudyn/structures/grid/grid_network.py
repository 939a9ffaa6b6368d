"""Curve networks on a surface, drawn in its parameter plane: iso-lines, traced curves, given
curves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...errors import InputError
from ...geometry.curves import Curve, Polyline, Spline, curve_from_dict
from ...geometry.network import CurveNetwork, network
from ...geometry.surface_tracing import Domain, asymptotic_line, curvature_line, geodesic
from ...geometry.surfaces import Surface

_SAMPLES = 65  # points of each curve, besides its own stations, that must lie on the surface


def network_on(surface: Surface, data: Mapping[str, Any]) -> CurveNetwork:
    """The network that a design file's "network" describes; positions are parameters (u, v).

    isolines: {"u": [...], "v": [...]}, every line of u between the outermost lines of v and the
    other way round geodesics: {"domain": [[u0, v0], [u1, v1]], "through": [[u, v, angle], ...]}
    asymptotic, curvature: {"domain": ..., "points": [[u, v], ...], "second_points": [[u, v], ...]}:
    lines of the first family through "points", of the second through "second_points" (default: the
    same)
    curves: {"curves": [{"type": "spline" | "polyline", "points": [[u, v], ...], "closed": false},
    ...]} Raises InputError.
    """
    if data["type"] not in _READERS:
        raise InputError(
            f"unknown network (known: {', '.join(_READERS)})",
            field="network.type",
            value=data["type"],
        )
    found = network(_READERS[data["type"]](surface, data))
    for strand in found.strands:  # ends beyond the last joints are left out, wherever they reach
        curve, (first, last) = strand.curve, strand.stations[[0, -1]]
        first, last = (0.0, curve.length) if strand.closed else (first, last)
        own = curve.stations[(curve.stations > first) & (curve.stations < last)]
        samples = curve.position(np.union1d(own, np.linspace(first, last, _SAMPLES)))
        inside = surface.contains(samples)
        if not inside.all():
            raise InputError(
                "leaves the surface: is it drawn in the surface's unit, and above it?",
                field=curve.field,
                value=samples[int(np.argmin(inside))].tolist(),
            )
    return found


def _isolines(surface: Surface, data: Mapping[str, Any]) -> list[Curve]:
    values = []
    for name in ("u", "v"):
        lines = np.array(data[name], float)
        if len(lines) < 2 or not (np.diff(lines) > 0).all():
            raise InputError(
                "must be two or more increasing numbers", field=f"network.{name}", value=data[name]
            )
        values.append(lines)
    u, v = values
    of_u = [Polyline([[a, v[0]], [a, v[-1]]], field=f"network.u[{k}]") for k, a in enumerate(u)]
    of_v = [Polyline([[u[0], b], [u[-1], b]], field=f"network.v[{k}]") for k, b in enumerate(v)]
    return [*of_u, *of_v]


def _geodesics(surface: Surface, data: Mapping[str, Any]) -> list[Curve]:
    domain = Domain(surface, *data["domain"])
    return [
        _traced(f"network.through[{k}]", geodesic, domain, (u, v), angle)
        for k, (u, v, angle) in enumerate(data["through"])
    ]


def _asymptotic(surface: Surface, data: Mapping[str, Any]) -> list[Curve]:
    return _field_lines(surface, data, asymptotic_line)


def _curvature(surface: Surface, data: Mapping[str, Any]) -> list[Curve]:
    return _field_lines(surface, data, curvature_line)


def _field_lines(surface: Surface, data: Mapping[str, Any], trace: Any) -> list[Curve]:
    domain = Domain(surface, *data["domain"])
    names = ("points", "second_points" if "second_points" in data else "points")
    return [
        _traced(f"network.{name}[{k}]", trace, domain, point, family)
        for family, name in enumerate(names)
        for k, point in enumerate(data[name])
    ]


def _traced(field: str, trace: Any, domain: Domain, point: Any, option: Any) -> Curve:
    try:
        return Spline(trace(domain, point, option), field=field)
    except InputError as error:
        raise InputError(error.message, field=field, value=error.value) from None


def _curves(surface: Surface, data: Mapping[str, Any]) -> list[Curve]:
    return [
        curve_from_dict(entry, f"network.curves[{k}]") for k, entry in enumerate(data["curves"])
    ]


_READERS = {
    "isolines": _isolines,
    "geodesics": _geodesics,
    "asymptotic": _asymptotic,
    "curvature": _curvature,
    "curves": _curves,
}
