"""Nets in DXF files drawn in pieces, with gaps, twice, or with crossings of their own."""

from __future__ import annotations

import numpy as np
from drawings import (
    NET,
    Net,
    Refused,
    case,
    dxf,
    edges,
    lines,
    mixed,
)


@case("exploded.dxf", Net(findings={"joined": 1}))
def _exploded() -> bytes:
    return dxf(lambda document, space: lines(space, mixed(edges())))


@case("doubles.dxf", Net(findings={"cleaned": 3}))
def _doubles() -> bytes:
    """Three laths drawn twice, one of them backwards, one a little aside."""
    more = [NET[0], NET[1][::-1], tuple((x + 1e-5, y - 1e-5) for x, y in NET[4])]
    return dxf(lambda document, space: lines(space, [*NET, *more]))


@case("pieces_over_a_whole.dxf", Net(findings={"cleaned": 2}))
def _over() -> bytes:
    """A lath, and two pieces of it that were forgotten below it."""
    return dxf(lambda document, space: lines(space, [*NET, ((0, 1), (1, 1)), ((1, 1), (2, 1))]))


@case("overlapping.dxf", Net(findings={"joined": 1, "suspicious": 1}))
def _overlapping() -> bytes:
    """A lath of two lines that lie on each other for a part of their way."""
    net = [*NET[1:], ((-0.2, 0), (1.4, 0)), ((0.8, 0), (2.2, 0))]
    return dxf(lambda document, space: lines(space, net))


@case("zero_length.dxf", Net(findings={"skipped": 1}))
def _zero() -> bytes:
    return dxf(lambda document, space: lines(space, [*NET, ((1, 1), (1, 1))]))


@case("ends_miss_by_a_hair.dxf", Net(findings={"cleaned": 1}, tolerance=2e-4))
def _gaps() -> bytes:
    net = [((0.0003, k), (2 - 0.0003, k)) for k in range(3)] + NET[3:]
    return dxf(lambda document, space: lines(space, net))


@case("ends_far_from_a_lath.dxf", Net(6, 8, 10.0))
def _too_far() -> bytes:
    """An end 0.3 short of the next lath: nothing that could be taken for a joint."""
    net = [((-0.2, 0), (1.7, 0)), *NET[1:]]
    return dxf(lambda document, space: lines(space, net))


@case("pieces_with_gaps.dxf", Net(findings={"cleaned": 1, "joined": 1}, tolerance=2e-4))
def _with_gaps() -> bytes:
    """Pieces whose ends miss each other by a few hundredths of a per mille."""
    rng = np.random.default_rng(5)
    pieces = [
        tuple((x + dx, y + dy) for (x, y), (dx, dy) in zip(piece, rng.uniform(-5e-5, 5e-5, (2, 2))))
        for piece in edges()
    ]
    return dxf(lambda document, space: lines(space, pieces))


@case("points_nearly_repeated.dxf", Net(findings={"cleaned": 1}, tolerance=1e-4))
def _repeated() -> bytes:
    """A point 7 micrometres beside the one before, which would bend a spline into a loop."""

    def draw(document, space):
        lines(space, NET[1:])
        space.add_lwpolyline([(-0.2, 0), (0.7, 0), (0.700004, 0.000006), (1.4, 0), (2.2, 0)])

    return dxf(draw)


@case("tail.dxf", Net(findings={"cleaned": 1}, tolerance=1e-4, options={"free_ends": False}))
def _tail() -> bytes:
    def draw(document, space):
        lines(space, NET[1:])
        space.add_lwpolyline([(-0.2, 0), (1.0, 0), (2.2, 0), (2.20001, 0.00002)])

    return dxf(draw)


@case("free_ends.dxf", Net(options={"free_ends": True}))
def _free_ends() -> bytes:
    return dxf(lambda document, space: lines(space))


def star() -> list[tuple]:
    """Three pairs of parallel lines at 60 degrees, at distances +-0.25 from the middle."""
    found = []
    for angle in np.radians([0, 60, 120]):
        u, v = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        for side in (-0.25, 0.25):
            found.append(tuple(map(tuple, (side * v - 1.1 * u, side * v + 1.1 * u))))
    return found


# each line crosses four others; the outer two of these crossings are 0.75 / sin 60 apart
@case("three_families.dxf", Net(6, 12, 4.5 / np.sin(np.pi / 3), findings={"suspicious": 1}))
def _three() -> bytes:
    return dxf(lambda document, space: lines(space, star()))


@case("three_through_one_point.dxf", Refused("a joint holds two curves"))
def _triple() -> bytes:
    return dxf(lambda document, space: lines(space, [*NET, ((-0.2, -0.2), (2.2, 2.2))]))


@case("lonely.dxf", Refused("crosses no other curve"))
def _lonely() -> bytes:
    return dxf(lambda document, space: lines(space, [*NET, ((5, 5), (6, 5))]))


@case("two_nets.dxf", Refused("the network falls into 2 parts"))
def _two_nets() -> bytes:
    second = [tuple((x + 5, y) for x, y in line) for line in NET]
    return dxf(lambda document, space: lines(space, [*NET, *second]))


@case("crossing_itself.dxf", Refused("crosses itself", {"kind": "polyline"}))
def _itself() -> bytes:
    def draw(document, space):
        lines(space, NET)
        space.add_lwpolyline([(0.3, 0.3), (0.7, 0.7), (0.7, 0.3), (0.3, 0.6)])

    return dxf(draw)
