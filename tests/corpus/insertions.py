"""Blocks, files within files, what is hidden, and units of length, as DXF files."""

from __future__ import annotations

from typing import Any

import numpy as np
from drawings import NET, Net, Refused, case, dxf, in_metres, lines, noise
from splines import RADII, part_of_rings


@case("block_hidden.dxf", Net(findings={"skipped": 1}))
def _hidden() -> bytes:
    """What a hidden insertion draws is hidden too."""

    def draw(document: Any, space: Any) -> None:
        lines(space)
        noise(document.blocks.new("EXTRA"), "0")
        space.add_blockref("EXTRA", (0, 0), dxfattribs={"invisible": 1})

    return dxf(draw)


@case("block_hidden_within_a_block.dxf", Net(findings={"skipped": 1}))
def _hidden_within() -> bytes:
    def draw(document: Any, space: Any) -> None:
        noise(document.blocks.new("EXTRA"), "0")
        whole = document.blocks.new("WHOLE")
        lines(whole)
        whole.add_blockref("EXTRA", (0, 0), dxfattribs={"invisible": 1})
        space.add_blockref("WHOLE", (3, 4), dxfattribs={"rotation": 10})

    return dxf(draw)


@case("file_within_the_file.dxf", Net(findings={"skipped": 1}))
def _xref() -> bytes:
    def draw(document: Any, space: Any) -> None:
        lines(space)
        document.add_xref_def("other.dwg", "OTHER")
        space.add_blockref("OTHER", (0, 0))

    return dxf(draw)


@case("file_within_the_file_only.dxf", Refused("1 insertion of OTHER, a block of another file"))
def _xref_only() -> bytes:
    def draw(document: Any, space: Any) -> None:
        document.add_xref_def("other.dwg", "OTHER")
        space.add_blockref("OTHER", (0, 0))

    return dxf(draw)


@case("block_with_a_base_point.dxf", Net())
def _base_point() -> bytes:
    def draw(document: Any, space: Any) -> None:
        lines(document.blocks.new("HALF", base_point=(2, 1)), NET[:3])
        space.add_blockref("HALF", (2, 1))
        lines(space, NET[3:])

    return dxf(draw)


@case("block_mirrored_by_its_direction.dxf", Net())
def _mirrored() -> bytes:
    """Seen from below: its own x axis points the other way."""

    def draw(document: Any, space: Any) -> None:
        lines(document.blocks.new("HALF"), NET[:3])
        space.add_blockref("HALF", (-2, 0), dxfattribs={"extrusion": (0, 0, -1)})
        lines(space, NET[3:])

    return dxf(draw)


@case("block_with_attributes.dxf", Net())
def _attributes() -> bytes:
    def draw(document: Any, space: Any) -> None:
        block = document.blocks.new("NET")
        lines(block)
        block.add_attdef("NUMBER", (0, 0))
        space.add_blockref("NET", (0, 0)).add_auto_attribs({"NUMBER": "A 1"})

    return dxf(draw)


@case("block_of_itself.dxf", Refused("reference cycle"))
def _cycle() -> bytes:
    def draw(document: Any, space: Any) -> None:
        block = document.blocks.new("NET")
        lines(block)
        block.add_blockref("NET", (0, 0))
        space.add_blockref("NET", (0, 0))

    return dxf(draw)


def stretched_length(*maps: np.ndarray) -> float:
    """Of arcs over 150 degrees and three spokes under a linear map."""
    total = np.eye(2)
    for one in maps:
        total = one @ total
    angles = np.radians(np.linspace(0, 150, 20_001))
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1) @ total.T
    ring = float(np.hypot(*np.diff(circle, axis=0).T).sum())
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)[[0, 10_000, 20_000]] @ total.T
    return sum(RADII) * ring + float(np.hypot(*ways.T).sum())


def turn(degrees: float) -> np.ndarray:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s], [s, c]])


STRETCHED = (np.diag([2.0, 1.0]), turn(30))
AGAIN = (*STRETCHED, np.diag([1.0, -1.5]), turn(45))


def arcs_block(document: Any) -> None:
    block = document.blocks.new("ARCS")
    for radius in RADII:
        block.add_arc((0, 0), radius, -10, 160)
    part_of_rings(block)


@case("block_of_arcs_stretched.dxf", Net(5, 6, stretched_length(*STRETCHED), tolerance=3e-4))
def _stretched() -> bytes:
    def draw(document: Any, space: Any) -> None:
        arcs_block(document)
        values = {"xscale": 2, "yscale": 1, "rotation": 30}
        space.add_blockref("ARCS", (5, 5), dxfattribs=values)

    return dxf(draw)


@case("block_of_arcs_stretched_twice.dxf", Net(5, 6, stretched_length(*AGAIN), tolerance=3e-4))
def _stretched_twice() -> bytes:
    """A stretched and turned block within a mirrored, stretched and turned one."""

    def draw(document: Any, space: Any) -> None:
        arcs_block(document)
        values = {"xscale": 2, "yscale": 1, "rotation": 30}
        document.blocks.new("OUTER").add_blockref("ARCS", (1, 0), dxfattribs=values)
        values = {"xscale": 1, "yscale": -1.5, "rotation": 45}
        space.add_blockref("OUTER", (5, 5), dxfattribs=values)

    return dxf(draw)


@case("layer_locked.dxf", Net())
def _locked() -> bytes:
    def draw(document: Any, space: Any) -> None:
        document.layers.add("LATHS").lock()
        lines(space, layer="LATHS")

    return dxf(draw)


@case("layer_of_another_case.dxf", Net(findings={"skipped": 1}))
def _case() -> bytes:
    def draw(document: Any, space: Any) -> None:
        document.layers.add("EXTRA").off()
        lines(space)
        noise(space, "extra")

    return dxf(draw)


@case("layer_in_another_script.dxf", Net(options={"layers": ["Stäbe 木"]}))
def _script() -> bytes:
    def draw(document: Any, space: Any) -> None:
        document.layers.add("Stäbe 木")
        lines(space, layer="Stäbe 木")
        noise(space, "0")

    return dxf(draw)


@case("layer_in_another_code_page_r12.dxf", Net(options={"layers": ["Stäbe"]}))
def _code_page() -> bytes:
    def draw(document: Any, space: Any) -> None:
        document.layers.add("Stäbe")
        lines(space, layer="Stäbe")
        noise(space, "0")

    return dxf(draw, "R12")


@case("paper_space_with_a_viewport.dxf", Net())
def _viewport() -> bytes:
    def draw(document: Any, space: Any) -> None:
        lines(space)
        document.paperspace().add_viewport((2, 2), (4, 4), (1, 1), 3)

    return dxf(draw)


@case("leaders_rays_solids.dxf", Net(findings={"skipped": 1}))
def _others() -> bytes:
    def draw(document: Any, space: Any) -> None:
        lines(space)
        space.add_leader([(0.3, 0.3), (1.5, 0.6)])
        space.add_ray((0, 0), (1, 1))
        space.add_solid([(0, 0), (1, 0), (0, 1)])
        with space.add_mesh().edit_data() as data:
            data.vertices, data.faces = [(0, 0, 0), (1, 0, 0), (1, 1, 0)], [(0, 1, 2)]

    return dxf(draw)


for _name, _code, _metres in (
    ("mil", 9, 2.54e-5),
    ("dam", 15, 10.0),
    ("hm", 16, 100.0),
    ("us_survey_foot", 21, 1200 / 3937),
    ("us_survey_inch", 22, 100 / 3937),
    ("us_survey_yard", 23, 3600 / 3937),
):
    case(f"unit_{_name}.dxf", in_metres(_metres))(
        lambda code=_code: dxf(lambda document, space: lines(space), unit=code)
    )


@case("unit_unknown.dxf", Net(findings={"suspicious": 1}))
def _unknown_unit() -> bytes:
    def draw(document: Any, space: Any) -> None:
        document.header["$INSUNITS"] = 47
        lines(space)

    return dxf(draw)


def _huge_array(contents: int) -> bytes:
    """The net, and an array of 30,000 x 30,000 insertions of a block of so many lines."""

    def draw(document: Any, space: Any) -> None:
        block = document.blocks.new("SPECK")
        lines(block, NET[:contents])
        array = {"row_count": 30_000, "column_count": 30_000, "row_spacing": 1, "column_spacing": 1}
        space.add_blockref("SPECK", (0, 0), dxfattribs=array)
        lines(space)

    return dxf(draw)


case("array_of_too_many.dxf", Refused("draws more than 200,000 entities"))(lambda: _huge_array(1))
case("array_of_nothing.dxf", Net())(lambda: _huge_array(0))
