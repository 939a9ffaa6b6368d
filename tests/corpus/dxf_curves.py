"""Polylines, splines, arcs and circles in DXF files."""

from __future__ import annotations

import numpy as np
from drawings import (
    NET,
    Net,
    case,
    dxf,
    lines,
)


@case("lwpolylines.dxf", Net())
def _lwpolylines() -> bytes:
    def draw(document, space):
        for (x0, y0), (x1, y1) in NET:
            space.add_lwpolyline([(x0, y0), (0.5 * (x0 + x1), 0.5 * (y0 + y1)), (x1, y1)])

    return dxf(draw)


@case("polylines_2d_elevated_r12.dxf", Net())
def _polylines_2d() -> bytes:
    def draw(document, space):
        for start, end in NET:
            space.add_polyline2d([start, end], dxfattribs={"elevation": (0, 0, 4.5)})

    return dxf(draw, "R12")


@case("polylines_3d.dxf", Net())
def _polylines_3d() -> bytes:
    def draw(document, space):
        for start, end in NET:
            space.add_polyline3d([(*start, 7.0), (*end, 7.0)])

    return dxf(draw)


@case("lwpolylines_elevated.dxf", Net())
def _elevated() -> bytes:
    def draw(document, space):
        for start, end in NET:
            space.add_lwpolyline([start, end], dxfattribs={"elevation": -3.0})

    return dxf(draw)


def bows() -> list[np.ndarray]:
    """Points of three parabolas y = k + 0.4 x (2 - x) / 2 from x = -0.2 to 2.2."""
    x = np.linspace(-0.2, 2.2, 13)
    return [np.stack([x, k + 0.2 * x * (2 - x), 0 * x], axis=1) for k in range(3)]


def parabola_length() -> float:
    """Of y = 0.2 x (2 - x) between 0 and 2: slope t = 0.4 (1 - x) from 0.4 to -0.4."""
    t = 0.4
    return float((t * np.sqrt(1 + t * t) + np.arcsinh(t)) / 0.4)


@case("splines_fit_points.dxf", Net(length=6 + 3 * parabola_length(), tolerance=2e-4))
def _splines() -> bytes:
    def draw(document, space):
        lines(space, NET[3:])
        for points in bows():
            space.add_spline(points.tolist())

    return dxf(draw)


@case("splines_control_points.dxf", Net(length=6 + 3 * parabola_length(), tolerance=2e-4))
def _control_points() -> bytes:
    """The same parabolas exactly, as splines of degree two."""

    def draw(document, space):
        lines(space, NET[3:])
        for k in range(3):
            y = [k + 0.2 * x * (2 - x) for x in (-0.2, 2.2)]
            middle = (1.0, y[0] + 1.2 * 0.4 * (1 + 0.2))  # where the end tangents meet
            space.add_open_spline([(-0.2, y[0]), middle, (2.2, y[1])], degree=2)

    return dxf(draw)


@case("arcs.dxf", Net(5, 6, 3 + 5 * 5 * np.pi / 6, tolerance=2e-4))
def _arcs() -> bytes:
    """Two arcs cut by three spokes, over 150 degrees between the outer ones."""

    def draw(document, space):
        for radius in (2.0, 3.0):
            space.add_arc((0, 0), radius, -10, 160)
        for angle in (0, 75, 150):
            direction = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
            space.add_line((1.5 * direction).tolist(), (3.5 * direction).tolist())

    return dxf(draw)


@case("circles.dxf", Net(8, 12, 2 * np.pi * 5 + 6, tolerance=2e-4))
def _circles() -> bytes:
    def draw(document, space):
        for radius in (2.0, 3.0):
            space.add_circle((0, 0), radius)
        for angle in range(0, 360, 60):
            direction = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
            space.add_line((1.5 * direction).tolist(), (3.5 * direction).tolist())

    return dxf(draw)


@case("bulges.dxf", Net(5, 6, 3 + 5 * np.pi * 2 / 3, tolerance=2e-4))
def _bulges() -> bytes:
    """Arcs of 150 degrees as polylines with bulges, 120 degrees of them between spokes."""

    def draw(document, space):
        bulge = np.tan(np.radians(150) / 4)
        for radius in (2.0, 3.0):
            ends = [(radius * np.cos(t), radius * np.sin(t)) for t in np.radians([-15, 135])]
            space.add_lwpolyline([(*ends[0], 0, 0, bulge), ends[1]])
        for angle in (0, 60, 120):
            direction = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
            space.add_line((1.5 * direction).tolist(), (3.5 * direction).tolist())

    return dxf(draw)
