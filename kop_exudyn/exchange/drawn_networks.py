"""Planar networks from drawn curves: pieces put together to whole curves, and written as a design
file has them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..errors import InputError
from ..files.documents import check_schema
from ..geometry.curves import curve_from_dict
from ..geometry.network import network
from ..io.designs import DESIGN_VERSION
from .curve_files import DrawnCurve, read_curves

_SAME_POINT = 1e-6  # of the drawing's size
_FLAT = 1e-4  # of the size: how far a drawing may leave its plane
_LARGEST_TURN = np.pi / 4  # rad; pieces that meet at a larger one are two curves with a joint
_DIGITS = 9  # of the size, that points are written with
_PLANES = ((0, 1), (0, 2), (1, 2))

End = tuple[int, int]  # number of the curve; 0: its first point, -1: its last


def read_network(
    path: str | Path,
    layers: Sequence[str] = (),
    *,
    kind: str = "spline",
    scale: float = 1.0,
    free_ends: bool = False,
) -> list[dict[str, Any]]:
    """The field `curves` of a design file, from an OBJ or DXF file; see `read_curves` and
    `network_curves`.

    Raises InputError, naming the curve as the drawing does, where no network comes of it (see
    `network.network`).
    """
    drawn = read_curves(path, layers)
    try:
        entries, labels = network_curves(drawn, kind, scale)
        network(
            [curve_from_dict(entry, label) for entry, label in zip(entries, labels)],
            free_ends=free_ends,
        )
    except InputError as error:
        raise error.at(path) from None
    return entries


def c_shell_data(
    name: str,
    curves: Sequence[Mapping[str, Any]],
    section: Mapping[str, Any],
    material: Mapping[str, Any],
    opening: float,
    *,
    free_ends: bool = False,
) -> dict[str, Any]:
    """The content of a C-shell's design file, see c_shell.schema.json. Raises InputError for values
    that can't be."""
    data = {
        "format": "kop_exudyn/design",
        "version": DESIGN_VERSION,
        "class": "c_shell",
        "name": name,
        "material": dict(material),
        "section": dict(section),
        "curves": list(curves),
        "crossings": "find",
        "free_ends": free_ends,
        "opening": {"angle": opening},
    }
    check_schema(data, "c_shell")
    return data


def grid_data(
    name: str,
    curves: Sequence[Mapping[str, Any]],
    section: Mapping[str, Any],
    material: Mapping[str, Any],
    surface: str,
    held: str | Sequence[int] | None = None,
) -> dict[str, Any]:
    """The content of a grid's design file, see grid.schema.json: curves in plan on the mesh of a
    file.

    surface : path of the mesh, relative to the design file
    held : joints that keep their places, see `Grid`
    """
    data = {
        "format": "kop_exudyn/design",
        "version": DESIGN_VERSION,
        "class": "grid",
        "name": name,
        "material": dict(material),
        "section": dict(section),
        "surface": {"type": "mesh", "file": surface},
        "network": {"type": "curves", "curves": list(curves)},
    }
    if held is not None:
        data["held"] = held
    check_schema(data, "grid")
    return data


def network_curves(
    curves: Sequence[DrawnCurve], kind: str = "spline", scale: float = 1.0
) -> tuple[list[dict[str, Any]], list[str]]:
    """The field `curves` of a design file, and what each of them is called in the drawing.

    kind : "spline": smooth through all points; "polyline": with the corners that are drawn. Two
        points are a line.
    scale : the design's unit in the drawing's

    Pieces that meet end to end without a sharp corner are one curve: many programs write every edge
    for itself. Raises InputError where the drawing isn't in a coordinate plane.
    """
    size = float(np.linalg.norm(np.ptp(np.concatenate([curve.points for curve in curves]), axis=0)))
    if not size > 0:
        raise InputError("all points are the same")
    axes = _plane(curves, size)
    digits = _DIGITS - int(np.floor(np.log10(size * scale)))
    entries, labels = [], []
    for curve in joined(
        [_without_repetitions(curve, _SAME_POINT * size) for curve in curves], _SAME_POINT * size
    ):
        points = (scale * curve.points[:, axes]).round(digits).tolist()
        entries.append(
            {"type": "polyline" if len(points) == 2 else kind, "points": points}
            | ({"closed": True} if curve.closed else {})
        )
        labels.append(curve.label)
    return entries, labels


def joined(curves: Sequence[DrawnCurve], tolerance: float) -> list[DrawnCurve]:
    """The curves, with those put together that go on in each other; every end at most once, the
    straightest first."""
    links = _links(curves, tolerance)
    starts = [
        (k, end)
        for k, curve in enumerate(curves)
        for end in (0, -1)
        if curve.closed or (k, end) not in links
    ]
    starts += [(k, 0) for k in range(len(curves))]  # loops have no end to start from
    found, used = [], set()
    for start in starts:
        if start[0] in used:
            continue
        chain = list(_chain(start, links))
        used |= {k for k, _ in chain}
        found.append((min(k for k, _ in chain), _put_together(curves, chain, links)))
    return [curve for _, curve in sorted(found, key=lambda entry: entry[0])]


def _links(curves: Sequence[DrawnCurve], tolerance: float) -> dict[End, End]:
    """Which end goes on in which."""
    ends = [(k, end) for k, curve in enumerate(curves) if not curve.closed for end in (0, -1)]
    if not ends:
        return {}
    points = np.array([curves[k].points[end] for k, end in ends])
    inward = np.array([_inward(curves[k].points, end) for k, end in ends])
    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    cosines = -(inward[pairs[:, 0]] * inward[pairs[:, 1]]).sum(axis=1)
    links: dict[End, End] = {}
    for n in np.lexsort((pairs[:, 1], pairs[:, 0], -cosines.round(9))):
        a, b = (ends[number] for number in pairs[n])
        if cosines[n] >= np.cos(_LARGEST_TURN) and a not in links and b not in links:
            links[a], links[b] = b, a
    return links


def _inward(points: np.ndarray, end: int) -> np.ndarray:
    """Unit direction (3,) in which a curve leaves one of its ends."""
    step = points[1] - points[0] if end == 0 else points[-2] - points[-1]
    return step / np.linalg.norm(step)


def _chain(start: End, links: dict[End, End]) -> Iterator[End]:
    """The pieces that follow each other, each by the end at which it begins."""
    here = start
    while True:
        yield here
        following = links.get((here[0], -1 if here[1] == 0 else 0))
        if following is None or following[0] == start[0]:
            return
        here = following


def _put_together(
    curves: Sequence[DrawnCurve], chain: Sequence[End], links: dict[End, End]
) -> DrawnCurve:
    first = curves[chain[0][0]]
    if first.closed or len(chain) == 1 and chain[0] not in links:
        return first
    pieces = [curves[k].points if end == 0 else curves[k].points[::-1] for k, end in chain]
    points = np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])])
    closed = chain[0] in links  # the end where it began goes on as well
    label = first.label if len(chain) == 1 else f"{first.label} and {len(chain) - 1} more"
    return DrawnCurve(points[:-1] if closed else points, closed, label)


def _without_repetitions(curve: DrawnCurve, tolerance: float) -> DrawnCurve:
    """Without points that are the ones before; closed where the ends are the same."""
    steps = np.linalg.norm(np.diff(curve.points, axis=0), axis=1)
    points = curve.points[np.append(True, steps > tolerance)]
    closed = curve.closed
    if len(points) > 3 and np.linalg.norm(points[-1] - points[0]) <= tolerance:
        points, closed = points[:-1], True
    if len(points) < 2:
        raise InputError("is a single point", field=curve.label)
    return DrawnCurve(points, closed, curve.label)


def _plane(curves: Sequence[DrawnCurve], size: float) -> list[int]:
    """The two axes of the coordinate plane that the drawing is in; the first such plane of xy, xz,
    yz."""
    extent = np.ptp(np.concatenate([curve.points for curve in curves]), axis=0)
    for axes in _PLANES:
        height = extent[3 - sum(axes)]
        if height <= _FLAT * size:
            return list(axes)
    raise InputError(
        f"the curves must lie in a plane parallel to the axes; they extend by "
        f"{', '.join(f'{length:.4g}' for length in extent)} along x, y, z"
    )
