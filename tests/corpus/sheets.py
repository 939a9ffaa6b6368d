"""Nets as sheets and files for workshops show them: laths by their sides or outlines, cells, parts
of blocks, frames and legends beside; meshes whose edges are laths; and files of other formats."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import ezdxf.xclip
import numpy as np
from drawings import NET, Net, Refused, case, dxf, lines, obj
from ezdxf import units

WIDTH = 0.03


def sides(start: Any, end: Any) -> list[tuple[float, float]]:
    """Corners of a lath's outline, the sides' ends first."""
    (x0, y0), (x1, y1) = start, end
    dx, dy = (0.0, WIDTH / 2) if y0 == y1 else (WIDTH / 2, 0.0)
    return [(x0 - dx, y0 - dy), (x1 - dx, y1 - dy), (x1 + dx, y1 + dy), (x0 + dx, y0 + dy)]


@case("laths_by_two_lines.dxf", Net(12, 36, 24.36, findings={"suspicious": 1}))
def _two_lines() -> bytes:
    """Read as drawn, which is said to be doubtful."""

    def draw(document: Any, space: Any) -> None:
        for start, end in NET:
            a, b, c, d = sides(start, end)
            lines(space, [(a, b), (d, c)])

    return dxf(draw)


@case("laths_by_four_lines.dxf", Net(findings={"suspicious": 1}))
def _four_lines() -> bytes:
    def draw(document: Any, space: Any) -> None:
        for start, end in NET:
            corners = sides(start, end)
            lines(space, zip(corners, [*corners[1:], corners[0]]))

    return dxf(draw)


@case(
    "laths_by_outlines_with_holes.dxf",
    Net(findings={"suspicious": 1, "skipped": 1}, tolerance=1e-4),
)
def _holes() -> bytes:
    """As a laser cutter gets them: round ends, a hole at every joint."""

    def draw(document: Any, space: Any) -> None:
        for start, end in NET:
            corners = sides(start, end)
            way = 1 if start[1] == end[1] else -1
            bulges = (0, way, 0, way)
            points = [(x, y, b) for (x, y), b in zip(corners, bulges)]
            space.add_lwpolyline(points, format="xyb", close=True)
        for x in range(3):
            for y in range(3):
                space.add_circle((x, y), 0.005)

    return dxf(draw)


@case(
    "laths_by_curved_outlines.dxf",
    Net(6, 9, 3 * 2.0 + 0.8 * (3 + 4 + 5), tolerance=2e-3, findings={"suspicious": 1}),
)
def _curved() -> bytes:
    """Three arcs around the origin, of radii 3 to 5, and three rays across them."""

    def draw(document: Any, space: Any) -> None:
        for k in range(3):
            angle = 0.4 * k
            u, v = (
                np.array([np.cos(angle), np.sin(angle)]),
                np.array([-np.sin(angle), np.cos(angle)]),
            )
            corners = [
                2.9 * u - 0.02 * v,
                5.1 * u - 0.02 * v,
                5.1 * u + 0.02 * v,
                2.9 * u + 0.02 * v,
            ]
            space.add_lwpolyline([tuple(x) for x in corners], close=True)
        t = np.linspace(-0.1, 0.9, 41)
        for radius in (3.0, 4.0, 5.0):
            outer, inner = (
                (radius + w) * np.stack([np.cos(t), np.sin(t)], axis=1) for w in (0.02, -0.02)
            )
            space.add_lwpolyline([*map(tuple, outer), *map(tuple, inner[::-1])], close=True)

    return dxf(draw)


@case("cells_as_polygons.dxf", Net(findings={"joined": 1, "hinged": 1, "suspicious": 1}))
def _cells() -> bytes:
    """Squares that share sides, turned, so that rounding moves the shared ones apart."""

    def draw(document: Any, space: Any) -> None:
        c, s = np.cos(0.3), np.sin(0.3)
        for x in range(2):
            for y in range(2):
                square = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)]
                space.add_lwpolyline(
                    [(c * a - s * b, s * a + c * b) for a, b in square], close=True
                )

    return dxf(draw)


def clipped(window: Any, *, inverted: bool = False, within: bool = False) -> bytes:
    """A block of two nets, of which one is shown."""

    def draw(document: Any, space: Any) -> None:
        nets = document.blocks.new("nets")
        lines(nets)
        lines(nets, [((a + 10, b), (c + 10, d)) for (a, b), (c, d) in NET])
        target = document.blocks.new("sheet") if within else space
        insert = target.add_blockref("nets", (3, 4), dxfattribs={"rotation": 30})
        clip = ezdxf.xclip.XClip(insert)
        clip.set_block_clipping_path(window)
        if inverted:
            clip.invert_clipping_path(ignore_acad_compatibility=True)
        if within:
            space.add_blockref("sheet", (1, 1), dxfattribs={"xscale": -1, "rotation": 10})

    return dxf(draw)


case("block_clipped.dxf", Net(findings={"skipped": 1}))(lambda: clipped([(-1, -1), (3, 3)]))
case("block_clipped_within_a_block.dxf", Net(findings={"skipped": 1}))(
    lambda: clipped([(-1, -1), (3, -1), (3, 3), (-1, 3)], within=True)
)
case("block_clipped_the_other_way.dxf", Net(findings={"skipped": 1}))(
    lambda: clipped([(9, -1), (13, 3)], inverted=True)
)
case("block_clipped_across.dxf", Refused("is cut by the clip (XCLIP) of block nets"))(
    lambda: clipped([(-1, -1), (1.5, 3)])
)


for _n, _name in enumerate(("top", "middle", "bottom")):

    @case(f"multilines_by_their_{_name}.dxf", Net())
    def _multilines(justification: int = _n) -> bytes:
        def draw(document: Any, space: Any) -> None:
            for k, (start, end) in enumerate(NET):
                # moved so that its middle is on the net's line
                off = 0.05 * (1 - justification)
                dx, dy = (0.0, off) if k < 3 else (-off, 0.0)
                points = [(start[0] + dx, start[1] + dy), (end[0] + dx, end[1] + dy)]
                form = {"scale_factor": 0.1, "justification": justification}
                space.add_mline(points, dxfattribs=form)

        return dxf(draw)


def classless(version: str) -> str:
    """Polylines and splines without the names of their classes, as scripts write them."""
    text = "0\nSECTION\n2\nHEADER\n" + version + "0\nENDSEC\n0\nSECTION\n2\nENTITIES\n"
    for k, (start, end) in enumerate(NET):
        (x0, y0), (x1, y1) = start, end
        if k < 3:
            text += f"0\nLWPOLYLINE\n5\n{k + 1:X}\n8\nlaths\n90\n2\n70\n0\n"
            text += f"10\n{x0}\n20\n{y0}\n10\n{x1}\n20\n{y1}\n"
        else:
            text += f"0\nSPLINE\n5\n{k + 1:X}\n8\nlaths\n70\n8\n71\n1\n72\n4\n73\n2\n74\n0\n"
            text += "40\n0.0\n40\n0.0\n40\n1.0\n40\n1.0\n"
            text += f"10\n{x0}\n20\n{y0}\n30\n0.0\n10\n{x1}\n20\n{y1}\n30\n0.0\n"
    return text + "0\nENDSEC\n0\nEOF\n"


case("entities_without_classes.dxf", Net())(lambda: classless("9\n$ACADVER\n1\nAC1015\n"))
case("entities_without_classes_r10.dxf", Net())(lambda: classless("9\n$ACADVER\n1\nAC1006\n"))
case("entities_without_classes_nor_version.dxf", Net())(lambda: classless(""))


def sheet(layer: str = "0") -> bytes:
    """A net with a frame, a title block, a legend and a north arrow."""

    def draw(document: Any, space: Any) -> None:
        lines(space, layer=layer)
        space.add_lwpolyline([(-1, -1), (6, -1), (6, 4), (-1, 4)], close=True)
        lines(space, [((4, -1), (4, 0)), ((4, 0), (6, 0)), ((5, 3), (5, 3.6))])
        lines(space, [((4, 2 - 0.2 * k), (4.4, 2 - 0.2 * k)) for k in range(3)])
        space.add_circle((5, 3.2), 0.3)
        space.add_text("lath", height=0.1).set_placement((4.5, 2))
        space.add_linear_dim(base=(0, -0.6), p1=(0, 0), p2=(2, 0)).render()

    return dxf(draw)


case("sheet.dxf", Net(options={"largest_part": True}, findings={"skipped": 2}))(sheet)
case("sheet_as_it_is.dxf", Refused("6 of 14 curves hang together: --largest-part reads them"))(
    sheet
)
case(
    "sheet_with_a_layer.dxf",
    Refused("6 of 14 curves hang together: --layer 'LATHS' reads them alone"),
)(lambda: sheet("LATHS"))
case("sheet_by_its_layer.dxf", Net(options={"layers": ["LATHS"]}))(lambda: sheet("LATHS"))


@case("ends_that_miss_by_more.dxf", Refused("short of LINE from (0, 0, 0) at "))
def _missing() -> bytes:
    def draw(document: Any, space: Any) -> None:
        lines(space, [((0.003, k), (1.997, k)) for k in range(3)])
        lines(space, [((k, 0), (k, 2)) for k in range(3)])

    return dxf(draw)


@case("six_ends_in_a_place.obj", Refused("More than four ends of curves meet at 1 place,"))
def _six() -> str:
    star = [((0, 0), (np.cos(a), np.sin(a))) for a in np.arange(6) * np.pi / 3]
    rim = [(star[k][1], star[k - 1][1]) for k in range(6)]
    return obj([*star, *rim])


@case("upright_pieces.obj", Refused("line 8: is seen as a point between", {"space": True}))
def _upright() -> str:
    roof = obj([((0, 0), (1, 0)), ((1, 0), (1, 1))])
    return roof + "v 0 0 -1\nl 1 5\n" + "v 0 1 0.3\nl 1 6\nl 4 6\n"


@case("inches_in_a_metric_file.dxf", Net(unit="in", findings={"suspicious": 1}))
def _inches() -> bytes:
    def draw(document: Any, space: Any) -> None:
        document.header["$MEASUREMENT"] = 1
        lines(space)

    return dxf(draw, unit=units.IN)


@case("net_of_kilometres.dxf", Net(unit="m", length=12000.0, findings={"suspicious": 1}))
def _kilometres() -> bytes:
    def draw(document: Any, space: Any) -> None:
        lines(space, [((1e3 * a, 1e3 * b), (1e3 * c, 1e3 * d)) for (a, b), (c, d) in NET])

    return dxf(draw, unit=units.M)


# -- edges of meshes ------------------------------------------------------------------------------

SQUARES = [[4 * y + x + k for k in (1, 2, 6, 5)] for y in range(2) for x in range(3)]
_EDGES = Net(7, 12, 17.0, options={"edges": True}, findings={"joined": 1, "hinged": 1})


def quads(pick: str = "{}") -> str:
    text = [f"v {x} {y} 0" for y in range(3) for x in range(4)]
    text += ["f " + " ".join(pick.format(k) for k in face) for face in SQUARES]
    return "\n".join([*text, ""])


case("edges_of_quads.obj", _EDGES)(quads)
case("edges_of_quads_in_inches.obj", replace(_EDGES, unit="in"))(
    lambda: "# File units = inches\n" + quads()
)
case("edges_of_quads_with_normals.obj", _EDGES)(lambda: quads("{}//1"))
case("faces_without_curves.obj", Refused("6 faces, which are a surface's: --edges reads them"))(
    quads
)


@case(
    "edges_of_unwelded_quads.obj",
    replace(_EDGES, findings=_EDGES.findings | {"cleaned": 2}, tolerance=1e-5),
)
def _unwelded() -> str:
    """Corners of their own for each face, a little apart."""
    text, rng = [], np.random.default_rng(0)
    for face in SQUARES:
        for k in face:
            x, y = (k - 1) % 4, (k - 1) // 4
            dx, dy = 1e-7 * rng.normal(size=2)
            text.append(f"v {float(x + dx)!r} {float(y + dy)!r} 0")
        text.append("f -4 -3 -2 -1")
    return "\n".join([*text, ""])


def places(quoted: bool = False) -> dict[str, Any]:
    name = repr if quoted else str
    return {name(str(k)): {"x": k % 4, "y": k // 4} for k in range(12)}


@case("edges_of_compas_mesh.json", _EDGES)
def _compas_mesh() -> str:
    faces = {str(k): [n - 1 for n in face] for k, face in enumerate(SQUARES)}
    data = {"vertex": places(), "face": faces, "default_vertex_attributes": {"z": 0.0}}
    return json.dumps({"dtype": "compas.datastructures/Mesh", "data": data})


@case("edges_of_compas_graph.json", _EDGES)
def _compas_graph() -> str:
    edge: dict[str, Any] = {str(k): {} for k in range(12)}
    for face in SQUARES:
        for a, b in zip(face, [*face[1:], face[0]]):
            edge[str(min(a, b) - 1)][str(max(a, b) - 1)] = {}
    data = {"node": places(), "edge": edge, "default_node_attributes": {"z": 0.0}}
    return json.dumps({"dtype": "compas.datastructures/Graph", "data": data})


def _pairs() -> list[tuple[int, int]]:
    sides = [(a - 1, b - 1) for face in SQUARES for a, b in zip(face, [*face[1:], face[0]])]
    return sorted({(min(pair), max(pair)) for pair in sides})


@case("edges_of_networkx.json", _EDGES)
def _networkx() -> str:
    """As node_link_data writes a grid_2d_graph with places: nodes are pairs of numbers."""
    nodes = [{"pos": [k % 4, k // 4], "id": [k % 4, k // 4]} for k in range(12)]
    links = [{"source": nodes[a]["id"], "target": nodes[b]["id"]} for a, b in _pairs()]
    data = {"directed": False, "multigraph": False, "graph": {}, "nodes": nodes, "links": links}
    return json.dumps(data)


@case("edges_of_newer_networkx.json", _EDGES)
def _newer_networkx() -> str:
    """Version 3.4 calls them edges; attributes are what the user called them."""
    nodes = [{"x": k % 4, "y": k // 4, "z": 0, "id": f"n{k}"} for k in range(12)]
    edges = [{"weight": 1.0, "source": f"n{a}", "target": f"n{b}"} for a, b in _pairs()]
    return json.dumps({"directed": True, "nodes": nodes, "edges": edges})


case("edges_of_lists.json", _EDGES)(
    lambda: json.dumps({"vertices": [[k % 4, k // 4, 0] for k in range(12)], "edges": _pairs()})
)
case("faces_of_lists.json", _EDGES)(
    lambda: json.dumps(
        {
            "net": {
                "vertices": [{"x": k % 4, "y": k // 4} for k in range(12)],
                "faces": [[k - 1 for k in face] for face in SQUARES],
            }
        }
    )
)
case(
    "edges_to_nowhere.json",
    Refused("edges[0] = 2: ends at a node that isn't", {"edges": True}),
)(lambda: json.dumps({"nodes": [[0, 0], [1, 0]], "edges": [[0, 2]]}))
case("nodes_without_places.json", Refused("nodes[0]", {"edges": True}))(
    lambda: json.dumps({"nodes": [{"id": 0}, {"id": 1}], "links": [{"source": 0, "target": 1}]})
)
case("edges_without_ends.json", Refused("expected two nodes, or source", {"edges": True}))(
    lambda: json.dumps({"nodes": [[0, 0], [1, 0]], "links": [{"a": 0, "b": 1}]})
)


def _two_nets(**of_first: Any) -> str:
    """Two networks in one list, each with ids of its own from 0; or one with more of node 0."""
    nodes = [{"id": k, "pos": [k % 4, k // 4]} | (of_first if k == 0 else {}) for k in range(12)]
    more = [{"id": k, "pos": [10 + k % 4, k // 4]} for k in range(12)]
    links = [{"source": a, "target": b} for a, b in _pairs()]
    if of_first:
        return json.dumps({"nodes": nodes, "links": links})
    return json.dumps({"nodes": nodes + more, "links": links + links})


case("nodes_of_one_id.json", Refused("nodes[12] = 0: has the id of nodes[0]", {"edges": True}))(
    _two_nets
)
case("node_at_two_places.json", Refused("has places that differ", {"edges": True}))(
    lambda: _two_nets(x=3000, y=0, z=900)
)
case("edges_of_points.json", Refused("expected one mesh or graph (of COMPAS", {"edges": True}))(
    lambda: json.dumps({"dtype": "compas.geometry/Point", "data": [0, 0, 0]})
)
case("edges_that_reach_nothing.json", Refused("can't be read as a mesh or graph", {"edges": True}))(
    lambda: json.dumps({"node": places(), "edge": {"0": {"99": {}}}})
)
case("edges_without_places.json", Refused("have its nodes no coordinates?", {"edges": True}))(
    lambda: json.dumps({"node": {"0": {}, "1": {}}, "edge": {"0": {"1": {}}}})
)


# -- files of other formats under a wrong name ----------------------------------------------------

for _kind, _content, _words in (
    ("dwg", b"AC1032\0\0\0\0\0", "is a drawing of AutoCAD by its content (DWG)"),
    ("svg", b'<?xml version="1.0"?>\n<svg width="1"></svg>\n', "is a picture of lines by its"),
    ("pdf", b"%PDF-1.7\n", "is a page by its content (PDF)"),
    ("step", b"ISO-10303-21;\nHEADER;\n", "is a solid model by its content (STEP)"),
):
    case(f"{_kind}_by_another_name.dxf", Refused(_words))(lambda content=_content: content)


# -- corners --------------------------------------------------------------------------------------


@case("laths_in_one_polyline.dxf", Net(length=12.0, findings={"hinged": 1, "suspicious": 1}))
def _zigzag() -> bytes:
    """Three laths and the ways between them, drawn in one go, and two laths across."""

    def draw(document: Any, space: Any) -> None:
        way = [(0, 0), (2, 0), (2, 1), (2, 2), (0, 2)]
        space.add_lwpolyline([*way, (0, 1), (0, 0)])
        lines(space, [((0, 1), (2, 1)), ((1, 0), (1, 2))])

    return dxf(draw)


@case("frame_of_laths.dxf", Net(length=12.0, findings={"hinged": 1, "suspicious": 1}))
def _frame_of_laths() -> bytes:
    """The outermost laths drawn as a rectangle."""

    def draw(document: Any, space: Any) -> None:
        space.add_lwpolyline([(0, 0), (2, 0), (2, 2), (0, 2)], close=True)
        lines(space, [((0, 1), (2, 1)), ((1, 0), (1, 2))])

    return dxf(draw)


_RISING, _FALLING = range(-19, 20, 2), range(1, 40, 2)
_MET = [(a, b) for a in _RISING for b in _FALLING if abs(a) <= b <= 40 - abs(a)]
_LAID = sum(np.sqrt(2) * (20 - abs(a)) for a in _RISING)


@case("diagonals_in_a_square.obj", Net(40, len(_MET), 2 * _LAID, findings={"hinged": 1}))
def _diagonals() -> str:
    """The longest ones, with the short ones that they are hinged with, go round narrow loops."""
    up = [((max(0, -a), max(0, a)), (20 - max(0, a), 20 - max(0, -a))) for a in _RISING]
    down = [((max(0, b - 20), min(20, b)), (min(20, b), max(0, b - 20))) for b in _FALLING]
    return obj([*up, *down])


@case("outlines_of_wide_laths.dxf", Net(findings={"suspicious": 1}))
def _wide() -> bytes:
    """Ten times as long as they are wide."""

    def draw(document: Any, space: Any) -> None:
        for (x0, y0), (x1, y1) in NET:
            dx, dy = (0.0, 0.12) if y0 == y1 else (0.12, 0.0)
            corners = [(x0 - dx, y0 - dy), (x1 - dx, y1 - dy), (x1 + dx, y1 + dy)]
            space.add_lwpolyline([*corners, (x0 + dx, y0 + dy)], close=True)

    return dxf(draw)
