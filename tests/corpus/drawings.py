"""Nets as CAD programs write them, as DXF and OBJ files, and what must come out of each.

Most show the same net: three lines along x, three along y, one apart, that go on by 0.2 beyond
their last joints: 6 curves, 9 joints, 12 units of length between the joints.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import ezdxf
import numpy as np
from ezdxf import units
from ezdxf.math import OCS, Matrix44

_IMPERIAL = (units.IN, units.FT, units.MI, units.YD, 8, 9)
NET = [((-0.2, k), (2.2, k)) for k in range(3)] + [((k, -0.2), (k, 2.2)) for k in range(3)]


@dataclass(frozen=True)
class Net:
    """What must come out of a drawn net.

    curves, joints; length : of all spans, in the design's unit
    unit : of the design, None where it isn't known
    options : of `ReadingOptions`, besides "scale", "unit" and "space", which are asked for
    findings : kind -> how many findings
    """

    curves: int = 6
    joints: int = 9
    length: float = 12.0
    unit: str | None = None
    options: dict[str, Any] = field(default_factory=dict)
    findings: dict[str, int] = field(default_factory=dict)
    tolerance: float = 1e-6


@dataclass(frozen=True)
class Refused:
    """A file that is refused: words of the message, and the options under which it is read."""

    message: str
    options: dict[str, Any] = field(default_factory=dict)


CASES: dict[str, tuple[Callable[[], bytes], Net | Refused]] = {}


def case(name: str, expected: Net | Refused) -> Callable:
    """Decorator: a file of the corpus and what must come out of it."""

    def add(make: Callable[[], bytes | str]) -> Callable:
        def content() -> bytes:
            made = make()
            return made.encode() if isinstance(made, str) else made

        CASES[name] = (content, expected)
        return make

    return add


def size_doubts(metres: float) -> dict[str, int]:
    """The findings of the net, of 3.4 units, where no net is of such a size."""
    return {} if 0.02 < 3.4 * metres < 300 else {"suspicious": 1}


def in_metres(metres: float) -> Net:
    """The net in metres, of a file with another unit."""
    net = Net(unit="m", length=12 * metres, options={"unit": "m"})
    return replace(net, findings=size_doubts(metres))


# -- DXF ------------------------------------------------------------------------------------------


def dxf(draw: Callable[[Any, Any], None], version: str = "R2010", unit: int | None = None) -> bytes:
    """The file that a function of document and model space draws."""
    ezdxf.options.write_fixed_meta_data_for_testing = True
    document = ezdxf.new(version)
    if unit is not None:
        document.units = unit
        if unit in _IMPERIAL:
            document.header["$MEASUREMENT"] = 0
    elif version != "R12":
        document.header["$INSUNITS"] = 0
    draw(document, document.modelspace())
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue().encode(document.output_encoding)


def lines(space: Any, net: Any = NET, **attributes: Any) -> None:
    for start, end in net:
        space.add_line(start, end, dxfattribs=attributes)


for _version in ("R12", "R2000", "R2004", "R2007", "R2010", "R2013", "R2018"):
    case(f"lines_{_version.lower()}.dxf", Net())(
        lambda version=_version: dxf(lambda document, space: lines(space), version)
    )

for _name, _code, _metres in (
    ("mm", units.MM, 1e-3),
    ("cm", units.CM, 1e-2),
    ("m", units.M, 1.0),
    ("in", units.IN, 0.0254),
    ("ft", units.FT, 0.3048),
):
    case(f"unit_{_name}.dxf", Net(unit=_name, findings=size_doubts(_metres)))(
        lambda code=_code: dxf(lambda document, space: lines(space), unit=code)
    )
    case(f"unit_{_name}_to_m.dxf", in_metres(_metres))(
        lambda code=_code: dxf(lambda document, space: lines(space), unit=code)
    )


@case("unit_dm_to_mm.dxf", Net(unit="mm", length=1200.0, options={"unit": "mm"}))
def _decimetres() -> bytes:
    return dxf(lambda document, space: lines(space), unit=units.DM)


@case(
    "unit_mm_by_scale.dxf",
    Net(unit="m", length=0.012, options={"scale": 0.001}, findings=size_doubts(1e-3)),
)
def _by_scale() -> bytes:
    return dxf(lambda document, space: lines(space), unit=units.MM)


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


@case("block.dxf", Net())
def _block() -> bytes:
    def draw(document, space):
        lines(document.blocks.new("NET"))
        space.add_blockref("NET", (7, -3))

    return dxf(draw)


@case("block_scaled_and_turned.dxf", Net(length=30.0))
def _scaled_block() -> bytes:
    def draw(document, space):
        lines(document.blocks.new("NET"))
        space.add_blockref(
            "NET", (7, -3), dxfattribs={"xscale": 2.5, "yscale": 2.5, "rotation": 33}
        )

    return dxf(draw)


@case("block_mirrored.dxf", Net())
def _mirrored_block() -> bytes:
    def draw(document, space):
        lines(document.blocks.new("NET"))
        space.add_blockref("NET", (1, 1), dxfattribs={"xscale": -1.0})

    return dxf(draw)


@case("block_stretched.dxf", Net(length=6 * 2 + 6 * 3))
def _stretched_block() -> bytes:
    def draw(document, space):
        lines(document.blocks.new("NET"))
        space.add_blockref("NET", (0, 0), dxfattribs={"xscale": 2.0, "yscale": 3.0})

    return dxf(draw)


@case("blocks_nested.dxf", Net(length=12 * 0.5))
def _nested() -> bytes:
    def draw(document, space):
        lines(document.blocks.new("HALF"), NET[:3])
        whole = document.blocks.new("WHOLE")
        whole.add_blockref("HALF", (0, 0))
        whole.add_blockref("HALF", (2, 0), dxfattribs={"rotation": 90})
        space.add_blockref("WHOLE", (0, 5), dxfattribs={"xscale": 0.5, "yscale": 0.5})

    return dxf(draw)


@case("block_array.dxf", Net())
def _array() -> bytes:
    """One lath inserted as an array of three, in both directions."""

    def draw(document, space):
        document.blocks.new("LATH").add_line((-0.2, 0), (2.2, 0))
        rows = {"row_count": 3, "row_spacing": 1.0}
        space.add_blockref("LATH", (0, 0), dxfattribs=rows)
        space.add_blockref("LATH", (2, 0), dxfattribs={"rotation": 90} | rows)

    return dxf(draw)


@case("block_and_lines.dxf", Net())
def _half_block() -> bytes:
    def draw(document, space):
        lines(document.blocks.new("HALF"), NET[3:])
        lines(space, NET[:3])
        space.add_blockref("HALF", (0, 0))

    return dxf(draw)


@case("block_that_is_missing.dxf", Net(findings={"suspicious": 1}))
def _missing_block() -> bytes:
    def draw(document, space):
        lines(space)
        space.add_blockref("NOT_HERE", (0, 0))

    return dxf(draw)


def with_layers(document: Any) -> None:
    document.layers.add("LATHS")
    document.layers.add("FROZEN").freeze()
    document.layers.add("OFF").off()


def noise(space: Any, layer: str) -> None:
    """Lines that would make the net another one."""
    lines(space, [((-0.5, -0.5), (2.5, 2.5)), ((0.5, -0.2), (0.5, 2.2))], layer=layer)


@case("layers_hidden.dxf", Net(findings={"skipped": 2}))
def _hidden() -> bytes:
    def draw(document, space):
        with_layers(document)
        lines(space, layer="LATHS")
        noise(space, "FROZEN")
        noise(space, "OFF")

    return dxf(draw)


@case("layers_hidden_asked_for.dxf", Net(7, 12, 14.0, options={"layers": ["LATHS", "off"]}))
def _asked_for() -> bytes:
    def draw(document, space):
        with_layers(document)
        lines(space, layer="LATHS")
        lines(space, [((0.5, -0.2), (0.5, 2.2))], layer="OFF")

    return dxf(draw)


@case("layer_unknown.dxf", Refused("no such layer", {"layers": ["RODS"]}))
def _unknown_layer() -> bytes:
    return dxf(lambda document, space: lines(space))


@case("layer_chosen.dxf", Net(options={"layers": ["laths"]}))
def _chosen() -> bytes:
    def draw(document, space):
        with_layers(document)
        document.layers.add("FRAME")
        lines(space, layer="LATHS")
        noise(space, "FRAME")

    return dxf(draw)


@case("layer_defpoints.dxf", Net(findings={"skipped": 1}))
def _defpoints() -> bytes:
    def draw(document, space):
        lines(space)
        noise(space, "Defpoints")

    return dxf(draw)


@case("block_on_a_frozen_layer.dxf", Net(findings={"skipped": 1}))
def _frozen_block() -> bytes:
    def draw(document, space):
        with_layers(document)
        lines(space)
        noise(document.blocks.new("EXTRA"), "LATHS")
        space.add_blockref("EXTRA", (0, 0), dxfattribs={"layer": "FROZEN"})

    return dxf(draw)


@case("block_on_layer_0_inserted_on_a_hidden_layer.dxf", Net(findings={"skipped": 1}))
def _layer_0() -> bytes:
    def draw(document, space):
        with_layers(document)
        lines(space)
        noise(document.blocks.new("EXTRA"), "0")
        space.add_blockref("EXTRA", (0, 0), dxfattribs={"layer": "OFF"})

    return dxf(draw)


@case("entities_invisible.dxf", Net(findings={"skipped": 1}))
def _invisible() -> bytes:
    def draw(document, space):
        lines(space)
        lines(space, [((0.5, -0.2), (0.5, 2.2))], invisible=1)

    return dxf(draw)


@case("paper_space.dxf", Net())
def _paper() -> bytes:
    def draw(document, space):
        lines(space)
        noise(document.paperspace(), "0")

    return dxf(draw)


@case("paper_space_only.dxf", Refused("entities on the sheet Layout1: draw the net in model"))
def _paper_only() -> bytes:
    return dxf(lambda document, space: lines(document.paperspace()))


@case("texts_dimensions_hatches.dxf", Net(findings={"skipped": 1}))
def _annotated() -> bytes:
    def draw(document, space):
        lines(space)
        space.add_text("LATH 1")
        space.add_mtext("two\nlines")
        space.add_point((1, 1))
        space.add_linear_dim(base=(0, -1), p1=(0, 0), p2=(2, 0)).render()
        space.add_hatch().paths.add_polyline_path([(0, 0), (1, 0), (1, 1)])
        space.add_3dface([(0, 0), (1, 0), (1, 1), (0, 1)])
        space.add_xline((0.5, 0), (0, 1))

    return dxf(draw)


@case("texts_only.dxf", Refused("contains no curves (no curves: 1 TEXT)"))
def _texts() -> bytes:
    return dxf(lambda document, space: space.add_text("nothing drawn"))


@case("polyface_mesh.dxf", Net(findings={"skipped": 1}))
def _polyface() -> bytes:
    def draw(document, space):
        lines(space)
        mesh = space.add_polyface()
        mesh.append_faces([[(0, 0, 0), (1, 0, 0), (1, 1, 1)]])

    return dxf(draw)


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


def edges() -> list[tuple]:
    """Every piece of the net between its joints for itself, the ends beyond them too."""
    stops = (-0.2, 0.0, 1.0, 2.0, 2.2)
    along = [((a, k), (b, k)) for k in range(3) for a, b in zip(stops, stops[1:])]
    return along + [((y0, x0), (y1, x1)) for (x0, y0), (x1, y1) in along]


def mixed(pieces: list, seed: int = 1) -> list:
    """In another order, some of them the other way round."""
    rng = np.random.default_rng(seed)
    return [pieces[k][:: rng.choice([1, -1])] for k in rng.permutation(len(pieces))]


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


@case("binary.dxf", Net())
def _binary() -> bytes:
    ezdxf.options.write_fixed_meta_data_for_testing = True
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = 0
    lines(document.modelspace())
    stream = io.BytesIO()
    document.write(stream, fmt="bin")
    return stream.getvalue()


@case("not_dxf.dxf", Refused("can't be read as DXF"))
def _not_dxf() -> str:
    return "PK\x03\x04 something else under this name\n"


# -- OBJ ------------------------------------------------------------------------------------------


def obj(net: Any, head: str = "", numbers: str = "{} {}", z: float = 0.0) -> str:
    """Lines with vertices of their own."""
    text = [head] if head else []
    for k, line in enumerate(net):
        text += [f"v {x!r} {y!r} {z!r}" for x, y in np.asarray(line, float)[:, :2].tolist()]
        text.append("l " + numbers.format(2 * k + 1, 2 * k + 2))
    return "\n".join([*text, ""])


@case("lines.obj", Net())
def _obj_lines() -> str:
    return obj(NET)


@case("negative_numbers.obj", Net())
def _negative() -> str:
    return obj(NET, numbers="-2 -1")


@case("textures_and_comments.obj", Net())
def _slashes() -> str:
    return obj(NET, "# a net\nmtllib net.mtl\no net\ng laths\nusemtl wood", "{}/1 {}/2 # a lath")


@case("windows_line_ends.obj", Net())
def _crlf() -> str:
    return obj(NET).replace("\n", "\r\n")


@case("continued_lines.obj", Net())
def _continued() -> str:
    return obj(NET, numbers="{} \\\n {}")


@case("vertices_first.obj", Net(findings={"joined": 1}))
def _shared_vertices() -> str:
    """As Blender writes edges: all vertices, then all edges between them."""
    points = sorted({point for piece in edges() for point in piece})
    number = {point: k + 1 for k, point in enumerate(points)}
    text = ["o Grid", *(f"v {x} {y} 0.0" for x, y in points)]
    text += [f"l {number[a]} {number[b]}" for a, b in mixed(edges())]
    return "\n".join([*text, ""])


@case("elevated.obj", Net())
def _obj_elevated() -> str:
    return obj(NET, z=12.5)


@case("map_coordinates.obj", Net(tolerance=1e-8))
def _obj_map() -> str:
    return obj([[(x + 2.6e6, y + 1.2e6) for x, y in line] for line in NET], z=430.0)


@case("in_millimetres.obj", Net(unit="m", options={"scale": 0.001, "unit": "m"}))
def _obj_mm() -> str:
    return obj(1000 * np.array(NET))


@case("tiny.obj", Net(length=12e-6))
def _obj_tiny() -> str:
    return obj(1e-6 * np.array(NET))


@case("huge.obj", Net(length=12e7))
def _obj_huge() -> str:
    return obj(1e7 * np.array(NET))


def rhombus(half_angle: float, n: int = 3) -> list[np.ndarray]:
    """Whole laths of a scissor net with tips, of n spans each."""
    u, v = (np.array([np.cos(a), np.sin(a)]) for a in (half_angle, -half_angle))
    laths = [np.array([k * v, k * v + n * u]) for k in range(n + 1)]
    return laths + [np.array([k * u, k * u + n * v]) for k in range(n + 1)]


for _degrees in (6, 15, 40, 50, 75, 84):
    case(f"scissor_tips_{_degrees}.obj", Net(8, 16, 24.0, findings={"hinged": 1}))(
        lambda degrees=_degrees: obj(rhombus(np.radians(degrees)))
    )


@case("scissor_edges_with_tips.obj", Net(8, 16, 24.0, findings={"hinged": 1, "joined": 1}))
def _scissor_edges() -> str:
    pieces = []
    for lath in rhombus(np.radians(15)):
        stops = np.linspace(lath[0], lath[1], 4)
        pieces += list(zip(stops[:-1].tolist(), stops[1:].tolist()))
    return obj(mixed(pieces))


@case(
    "scissor_never_joined.obj",
    Net(8, 16, 24.0, options={"join": "never"}, findings={"hinged": 1}),
)
def _never() -> str:
    return obj(rhombus(np.radians(15)))


@case(
    "scissor_joined_by_turns.obj",
    Net(
        6,
        14,
        24.0,
        options={"join": "always", "kind": "polyline"},
        findings={"hinged": 1, "joined": 1, "suspicious": 1},
    ),
)
def _always() -> str:
    """At the obtuse tips two laths become one, of both families."""
    return obj(rhombus(np.radians(15)))


@case(
    "ring_of_pieces.obj",
    Net(11, 24, 2 * np.pi * 5 + 8 * 1.5, findings={"joined": 1}, tolerance=1e-3),
)
def _ring() -> str:
    pieces: list = []
    angles = np.linspace(0, 2 * np.pi, 49)
    for radius in (1.5, 2.5, 1.0):
        points = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        pieces += list(zip(points[:-1].tolist(), points[1:].tolist()))
    for angle in np.linspace(0, 2 * np.pi, 8, endpoint=False) + 0.01:
        direction = np.array([np.cos(angle), np.sin(angle)])
        pieces.append([(0.8 * direction).tolist(), (2.7 * direction).tolist()])
    return obj(pieces)


@case("saddle_in_space.obj", Net(options={"space": True}, length=12.0, tolerance=0.2))
def _saddle() -> str:
    text = []
    t = np.linspace(-0.2, 2.2, 13)
    for k in range(3):
        for x, y in ((t, np.full(13, float(k))), (np.full(13, float(k)), t)):
            z = 0.2 * (x - 1) * (y - 1)
            text += [f"v {a!r} {b!r} {c!r}" for a, b, c in np.stack([x, y, z], 1).tolist()]
            text.append("l " + " ".join(str(n - 13) for n in range(13)))
    return "\n".join([*text, ""])


@case("passing_in_space.obj", Refused("must lie in a plane"))
def _passing() -> str:
    lower = obj(NET[:3])
    upper = obj(NET[3:], numbers="-2 -1", z=0.5)
    return lower + upper


@case(
    "faces_only.obj",
    Refused("contains no curves (1 face, which is a surface's: --edges reads them"),
)
def _faces() -> str:
    return "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@case("surfaces_only.obj", Refused("contains no curves (1 surf element)"))
def _surface_only() -> str:
    head = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\ncstype bezier\ndeg 1 1\n"
    return head + "surf 0 1 0 1 1 2 3 4\nparm u 0 1\nparm v 0 1\nend\n"


@case("bad_number.obj", Refused("expected three coordinates of a vertex"))
def _bad_number() -> str:
    return "v 0 0 0\nv 1,5 0 0\nl 1 2\n"


@case("bad_vertex.obj", Refused("no such vertex"))
def _bad_vertex() -> str:
    return "v 0 0 0\nv 1 0 0\nl 1 3\n"
