"""Nets in DXF files that lie in other planes than xy, or far away."""

from __future__ import annotations

from typing import Any

from drawings import (
    NET,
    Net,
    Refused,
    case,
    dxf,
    lines,
)
from ezdxf import units
from ezdxf.math import OCS, Matrix44


def in_ocs(space: Any, extrusion: tuple[float, float, float], lift: float = 0.0) -> None:
    """The net in the xy plane of the entities' own coordinates."""
    ocs = OCS(extrusion)
    for start, end in NET:
        points = [ocs.from_wcs(ocs.to_wcs((*p, lift))) for p in (start, end)]
        space.add_lwpolyline(
            [(p.x, p.y) for p in points], dxfattribs={"extrusion": extrusion, "elevation": lift}
        )


@case("extrusion_downwards.dxf", Net())
def _downwards() -> bytes:
    """As entities are that were mirrored: their own x axis points the other way."""
    return dxf(lambda document, space: in_ocs(space, (0, 0, -1)))


@case("extrusion_along_y.dxf", Net(findings={"cleaned": 1}))
def _along_y() -> bytes:
    return dxf(lambda document, space: in_ocs(space, (0, 1, 0), 3.0))


@case("extrusion_tilted.dxf", Net(findings={"cleaned": 1}))
def _tilted() -> bytes:
    return dxf(lambda document, space: in_ocs(space, (0.48, -0.6, 0.64), -2.0))


@case("plane_xz.dxf", Net(findings={"cleaned": 1}))
def _xz() -> bytes:
    net = [((a, 5.0, b), (c, 5.0, d)) for (a, b), (c, d) in NET]
    return dxf(lambda document, space: lines(space, net))


@case("plane_yz.dxf", Net(findings={"cleaned": 1}))
def _yz() -> bytes:
    net = [((-1.0, a, b), (-1.0, c, d)) for (a, b), (c, d) in NET]
    return dxf(lambda document, space: lines(space, net))


@case("plane_tilted_far_away.dxf", Net(findings={"cleaned": 1}))
def _tilted_far() -> bytes:
    turn = Matrix44.chain(
        Matrix44.xyz_rotate(0.4, -0.7, 0.2), Matrix44.translate(2600.0, 1200.0, 400.0)
    )
    net = [tuple(turn.transform((*p, 0.0)) for p in line) for line in NET]
    return dxf(lambda document, space: lines(space, net))


@case("space_c_shell.dxf", Refused("must lie in a plane"))
def _in_space() -> bytes:
    net = [((*a, 0.3 * a[0] * a[1]), (*b, -0.3 * b[0] * b[1])) for a, b in NET]
    return dxf(lambda document, space: lines(space, net))


@case("map_coordinates.dxf", Net(unit="m", tolerance=1e-8))
def _map() -> bytes:
    net = [tuple((x + 2_600_000.0, y + 1_200_000.0) for x, y in line) for line in NET]
    return dxf(lambda document, space: lines(space, net), unit=units.M)
