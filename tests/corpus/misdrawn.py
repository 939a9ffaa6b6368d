"""Drawings that show something else than laths' axes, and files that lost something."""

from __future__ import annotations

from typing import Any

import numpy as np
from drawings import NET, Net, Refused, case, dxf, lines, obj


@case("bolts.dxf", Net(findings={"skipped": 1}))
def _bolts() -> bytes:
    """A bolt at every joint, drawn as a circle."""

    def draw(document: Any, space: Any) -> None:
        lines(space)
        for x in range(3):
            for y in range(3):
                space.add_circle((x, y), 0.05)

    return dxf(draw)


@case("bolts_as_polylines.dxf", Net(findings={"skipped": 1}))
def _square_bolts() -> bytes:
    def draw(document: Any, space: Any) -> None:
        lines(space)
        for x, y in ((0, 0), (1, 2)):
            corners = [(x - 0.03, y - 0.03), (x + 0.03, y - 0.03), (x + 0.03, y + 0.03)]
            space.add_lwpolyline([*corners, (x - 0.03, y + 0.03)], close=True)

    return dxf(draw)


@case(
    "ring_around_a_crossing.dxf",
    Net(3, 5, 4 + 2 * np.pi, tolerance=2e-4, findings={"suspicious": 1}),
)
def _ring() -> bytes:
    """No bolt, but a lath: two laths that cross in the middle of a ring."""

    def draw(document: Any, space: Any) -> None:
        lines(space, [((-1.2, 0), (1.2, 0)), ((0, -1.2), (0, 1.2))])
        space.add_circle((0, 0), 1)

    return dxf(draw)


@case("outlines_of_laths.dxf", Net(findings={"suspicious": 1}))
def _outlines() -> bytes:
    """Laths as rectangles: read as their axes, which is said."""

    def draw(document: Any, space: Any) -> None:
        for (x0, y0), (x1, y1) in NET:
            dx, dy = (0.0, 0.02) if y0 == y1 else (0.02, 0.0)
            corners = [(x0 - dx, y0 - dy), (x1 - dx, y1 - dy), (x1 + dx, y1 + dy)]
            space.add_lwpolyline([*corners, (x0 + dx, y0 + dy)], close=True)

    return dxf(draw)


@case("frame_of_the_sheet.dxf", Refused("6 of 7 curves hang together: --largest-part reads"))
def _frame() -> bytes:
    def draw(document: Any, space: Any) -> None:
        lines(space)
        space.add_lwpolyline([(-1, -1), (4, -1), (4, 4), (-1, 4)], close=True)

    return dxf(draw)


@case("stray_line_far_away.obj", Refused("Leave out what is far away or far larger, as line 21"))
def _stray() -> str:
    return obj(NET) + obj([((1e6, 1e6), (1e6 + 1, 1e6))], numbers="-2 -1")


for _space in (False, True):

    @case(
        f"stray_height{'_in_space' * _space}.dxf",
        Refused(
            "LINE from (2, -0.2, 0): leaves the plane z = 0, which 5 of 6 curves lie in, by 50",
            {"space": _space},
        ),
    )
    def _height() -> bytes:
        def draw(document: Any, space: Any) -> None:
            lines(space, NET[:5])
            (x0, y0), (x1, y1) = NET[5]
            space.add_line((x0, y0, 0), (x1, y1, 50))

        return dxf(draw)


@case("heights_of_noise.dxf", Net())
def _noise() -> bytes:
    rng = np.random.default_rng(0)

    def draw(document: Any, space: Any) -> None:
        for start, end in NET:
            space.add_line((*start, 1e-7 * rng.normal()), (*end, 1e-7 * rng.normal()))

    return dxf(draw)


@case("layers_of_laths_apart.dxf", Net(options={"space": True}))
def _layers() -> bytes:
    """One family lies on the other, a hundredth above it."""

    def draw(document: Any, space: Any) -> None:
        lines(space, NET[:3])
        for start, end in NET[3:]:
            space.add_line((*start, 0.01), (*end, 0.01))

    return dxf(draw)


def entities(net: Any = NET) -> str:
    """A section of entities alone, as scripts write it."""
    text = "999\nmade by a script\n  0\nSECTION\n  2\nENTITIES\n"
    for (x0, y0), (x1, y1) in net:
        text += f"  0\nLINE\n  8\n0\n 10\n{float(x0)}\n 20\n{float(y0)}\n"
        text += f" 11\n{float(x1)}\n 21\n{float(y1)}\n"
    return text + "  0\nENDSEC\n"


@case("entities_only.dxf", Net())
def _entities() -> str:
    return entities() + "  0\nEOF\n"


@case("entities_only_without_an_end.dxf", Net(findings={"suspicious": 1}))
def _without_end() -> str:
    return entities()


@case("cut_off.dxf", Refused("has no end (EOF): it may be cut off"))
def _cut_off() -> str:
    return entities()[:-60]


@case("commas_in_numbers.dxf", Refused("damaged DXF file"))
def _commas() -> str:
    return (entities() + "  0\nEOF\n").replace(".", ",")


@case("old_macintosh_line_ends.dxf", Net())
def _cr() -> bytes:
    return dxf(lambda document, space: lines(space)).replace(b"\n", b"\r")


@case("byte_order_mark.dxf", Net())
def _bom() -> bytes:
    return b"\xef\xbb\xbf" + dxf(lambda document, space: lines(space))


@case("not_a_number.dxf", Refused("expected points within 1e60"))
def _nan() -> bytes:
    return dxf(lambda document, space: lines(space)).replace(b"\n2.2\n", b"\nnan\n", 1)


@case("empty.dxf", Refused("contains no curves"))
def _empty() -> bytes:
    return b""
