"""Splines and polylines of every kind that CAD programs write, as DXF and OBJ files."""

from __future__ import annotations

from typing import Any

import numpy as np
from drawings import NET, Net, Refused, case, dxf, lines, obj

# two rings, of radii 2 and 3, cut by six spokes from 1.5 to 3.5
RINGS = Net(8, 12, 2 * np.pi * 5 + 6, tolerance=2e-4)
RADII = (2.0, 3.0)
# of a ring of twelve control points of a periodic cubic: at its knots, (4 + 2 cos 30 deg) / 6
SHRUNK = (2 + np.cos(np.pi / 6)) / 3


def spokes() -> list[np.ndarray]:
    angles = np.radians(np.arange(0, 360, 60))
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return [np.array([1.5 * way, 3.5 * way]) for way in ways]


def ring(radius: float, n: int) -> np.ndarray:
    """(n, 2) points on a circle, from angle 0."""
    angles = 2 * np.pi * np.arange(n) / n
    return radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def square(radius: float) -> list[tuple[float, float]]:
    """Control points of a circle as a rational spline of degree two."""
    ways = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]
    return [(radius * x, radius * y) for x, y in ways]


SQUARE_KNOTS = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
SQUARE_WEIGHTS = [1 if k % 2 == 0 else np.sqrt(0.5) for k in range(9)]


@case("splines_rational_circles.dxf", RINGS)
def _rational() -> bytes:
    def draw(document: Any, space: Any) -> None:
        lines(space, spokes())
        for radius in RADII:
            points = [(x, y, 0) for x, y in square(radius)]
            space.add_rational_spline(points, SQUARE_WEIGHTS, 2, knots=SQUARE_KNOTS)

    return dxf(draw)


@case("splines_periodic.dxf", Net(8, 12, (2 * np.pi * 5 + 6) * SHRUNK, tolerance=1e-3))
def _periodic() -> bytes:
    """As Rhino writes closed curves: the first control points again at the end, knots that aren't
    repeated, so that the curve begins and ends within them."""

    def draw(document: Any, space: Any) -> None:
        lines(space, spokes())
        for radius in RADII:
            points = ring(radius, 12)
            points = np.concatenate([points, points[:3]])
            spline = space.add_spline(dxfattribs={"degree": 3, "flags": 1 | 2 | 8})
            spline.control_points = [(x, y, 0) for x, y in points.tolist()]
            spline.knots = [k - 3.0 for k in range(len(points) + 4)]

    return dxf(draw)


@case("splines_closed_through_fit_points.dxf", RINGS)
def _closed_fit() -> bytes:
    def draw(document: Any, space: Any) -> None:
        lines(space, spokes())
        for radius in RADII:
            points = ring(radius, 24)
            space.add_spline(np.concatenate([points, points[:1]]).tolist())

    return dxf(draw)


@case("splines_closed_by_their_flag.dxf", RINGS)
def _closed_flag() -> bytes:
    def draw(document: Any, space: Any) -> None:
        lines(space, spokes())
        for radius in RADII:
            space.add_spline(ring(radius, 24).tolist()).closed = True

    return dxf(draw)


def zigzag(k: int) -> list[tuple[float, float]]:
    return [(-0.2, k), (0.5, k), (1.5, k + 0.3), (2.2, k + 0.3)]


ZIGZAG = 0.5 + np.hypot(1, 0.3) + 0.5  # between x = 0 and 2
CROSSED = [((k, -0.2), (k, 2.7)) for k in range(3)]


@case("splines_of_degree_one.dxf", Net(length=6 + 3 * ZIGZAG, options={"kind": "polyline"}))
def _degree_one() -> bytes:
    """Rhino's polylines: no corner may be rounded."""

    def draw(document: Any, space: Any) -> None:
        lines(space, CROSSED)
        for k in range(3):
            space.add_open_spline(zigzag(k), degree=1)

    return dxf(draw)


@case("splines_with_corners.dxf", Net(length=6 + 3 * ZIGZAG, options={"kind": "polyline"}))
def _corners() -> bytes:
    """Cubics whose knots in between are there three times: straight pieces, and corners."""

    def draw(document: Any, space: Any) -> None:
        lines(space, CROSSED)
        for k in range(3):
            corners = np.array(zigzag(k), float)
            pieces = [np.linspace(a, b, 4)[:-1] for a, b in zip(corners[:-1], corners[1:])]
            points = np.concatenate([*pieces, corners[-1:]])
            knots = [0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 3]
            space.add_open_spline(points.tolist(), degree=3, knots=knots)

    return dxf(draw)


@case("spline_with_too_few_knots.dxf", Net(findings={"suspicious": 1}))
def _few_knots() -> bytes:
    def draw(document: Any, space: Any) -> None:
        lines(space)
        spline = space.add_spline(dxfattribs={"degree": 3})
        spline.control_points = [(x, y, 0) for x, y in zigzag(0)]
        spline.knots = [0, 0, 1, 1, 1]

    return dxf(draw)


def bezier(k: int, t: np.ndarray) -> np.ndarray:
    b = np.array([(-0.2, k), (0.6, k + 0.5), (1.4, k - 0.5), (2.2, k)])
    t = t[:, None]
    return (
        (1 - t) ** 3 * b[0] + 3 * (1 - t) ** 2 * t * b[1] + 3 * (1 - t) * t * t * b[2] + t**3 * b[3]
    )


def bezier_length() -> float:
    """Of a lath between its outer joints, at x = 0 and 2: x is linear in t."""
    x = bezier(0, np.linspace(1 / 12, 11 / 12, 4001))
    return float(np.hypot(*np.diff(x, axis=0).T).sum())


@case("polylines_fitted_r12.dxf", Net(length=6 + 3 * bezier_length(), tolerance=1e-4))
def _fitted() -> bytes:
    """Polylines made smooth in AutoCAD keep the polygon that controls them beside the points on the
    curve."""

    def draw(document: Any, space: Any) -> None:
        lines(space, NET[3:])
        for k in range(3):
            polyline = space.add_polyline2d(bezier(k, np.array([0.0, 1.0])).tolist())
            polyline.dxf.flags, polyline.dxf.smooth_type = 4, 6
            polygon = [(-0.2, k), (0.6, k + 0.5), (1.4, k - 0.5), (2.2, k)]
            polyline.vertices.clear()
            polyline.append_formatted_vertices(polygon, format="xy")
            for vertex in polyline.vertices:
                vertex.dxf.flags = 16
            polyline.append_formatted_vertices(bezier(k, np.linspace(0, 1, 17)).tolist(), "xy")
            for vertex in polyline.vertices[4:]:
                vertex.dxf.flags = 8

    return dxf(draw, "R12")


@case("ellipses_nearly_round.dxf", Net(8, 12, 2 * np.pi * 5 + 6, tolerance=1e-3))
def _ellipses() -> bytes:
    def draw(document: Any, space: Any) -> None:
        lines(space, spokes())
        for radius in RADII:
            space.add_ellipse((0, 0), (0, radius), 0.999)

    return dxf(draw)


def part_of_rings(space: Any) -> None:
    lines(space, [np.array([1.5 * w, 3.5 * w]) for w in (ring(1.0, 24)[k] for k in (0, 5, 10))])


ARCS = Net(5, 6, 3 + 5 * 5 * np.pi / 6, tolerance=3e-4)


@case("arcs_seen_from_below.dxf", ARCS)
def _arcs_below() -> bytes:
    """Mirrored arcs, whose angles count the other way round."""

    def draw(document: Any, space: Any) -> None:
        part_of_rings(space)
        for radius in RADII:
            space.add_arc((0, 0), radius, 20, 190, dxfattribs={"extrusion": (0, 0, -1)})

    return dxf(draw)


@case("ellipse_arcs_seen_from_below.dxf", ARCS)
def _ellipse_arcs_below() -> bytes:
    def draw(document: Any, space: Any) -> None:
        part_of_rings(space)
        for radius in RADII:
            ends = np.radians([-160, 10])
            below = {"extrusion": (0, 0, -1)}
            space.add_ellipse((0, 0), (radius, 0), 1.0, *ends, dxfattribs=below)

    return dxf(draw)


@case("squares_keep_their_corners.dxf", Net(6, 8, 24 + 4, options={"kind": "polyline"}))
def _squares() -> bytes:
    return squares()


@case(
    "squares_are_four_laths_each.dxf", Net(12, 16, 24 + 4, findings={"hinged": 1, "suspicious": 1})
)
def _squares_of_laths() -> bytes:
    return squares()


def squares() -> bytes:
    """Two squares, and four lines from the inner to beyond the outer one, along the axes."""

    def draw(document: Any, space: Any) -> None:
        for a in (1.0, 2.0):
            corners = [(a, a, 3.0), (-a, a, 3.0), (-a, -a, 3.0), (a, -a, 3.0)]
            space.add_polyline3d(corners, close=True)
        for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1)):
            space.add_line((0.5 * x, 0.5 * y, 3), (3 * x, 3 * y, 3))

    return dxf(draw)


# -- OBJ ------------------------------------------------------------------------------------------


def free_form(kind: str, degree: int, points: Any, parameters: Any, weights: Any = None) -> str:
    """A curve with control points of its own."""
    weights = [""] * len(points) if weights is None else [f" {float(w)!r}" for w in weights]
    text = [f"v {float(x)!r} {float(y)!r} 0.0{w}" for (x, y), w in zip(points, weights)]
    numbers = " ".join(str(k - len(points)) for k in range(len(points)))
    ends = f"{float(parameters[0])} {float(parameters[-1])}"
    inner = " ".join(str(float(u)) for u in parameters)
    return "\n".join(
        [
            *text,
            f"cstype {kind}",
            f"deg {degree}",
            f"curv {ends} {numbers}",
            f"parm u {inner}",
            "end",
        ]
    )


@case("free_form_lines.obj", Net())
def _free_lines() -> str:
    """As Rhino writes curves: as splines, though straight."""
    return "\n".join(free_form("bspline", 1, line, [0, 0, 1, 1]) for line in NET) + "\n"


@case("free_form_beside_lines.obj", Net())
def _free_beside() -> str:
    return obj(NET[:5]) + free_form("bezier", 1, NET[5], [0, 1]) + "\n"


@case("free_form_rational_circles.obj", RINGS)
def _free_rational() -> str:
    text = obj(spokes(), numbers="-2 -1")
    for radius in RADII:
        curve = free_form("rat bspline", 2, square(radius), SQUARE_KNOTS, SQUARE_WEIGHTS)
        text += curve + "\n"
    return text


@case("free_form_bezier_pieces.obj", Net(length=6 + 3 * bezier_length(), tolerance=1e-4))
def _free_bezier() -> str:
    """The curve of one cubic, as two cubics that meet in its middle (de Casteljau)."""
    text = obj(NET[3:])
    for k in range(3):
        a, b, c, d = np.array([(-0.2, k), (0.6, k + 0.5), (1.4, k - 0.5), (2.2, k)])
        ab, bc, cd = (a + b) / 2, (b + c) / 2, (c + d) / 2
        abc, bcd = (ab + bc) / 2, (bc + cd) / 2
        points = [a, ab, abc, (abc + bcd) / 2, bcd, cd, d]
        text += free_form("bezier", 3, points, [0, 1, 2]) + "\n"
    return text


@case("free_form_part_of_a_curve.obj", Net())
def _part() -> str:
    """The curve begins and ends within its knots."""
    text = obj(NET[:5])
    (x, y0), (_, y1) = NET[5]
    points = [(x, y0 - 2.4), (x, y0), (x, y1), (x, y1 + 2.4)]
    curve = free_form("bspline", 1, points, [0, 0, 1, 2, 3, 3])
    return text + curve.replace("curv 0.0 3.0", "curv 1.0 2.0") + "\n"


@case("free_form_without_knots.obj", Refused("line 5: has 0 knots with 2 control points"))
def _no_knots() -> str:
    return "v 0 0 0\nv 1 0 0\ncstype bspline\ndeg 1\ncurv 0 1 1 2\nend\n"


@case("free_form_unknown.obj", Refused("contains no curves (1 curv element)"))
def _taylor() -> str:
    return "v 0 0 0\nv 1 0 0\ncstype taylor\ndeg 1\ncurv 0 1 1 2\nparm u 0 1\nend\n"
