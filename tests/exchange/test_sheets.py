"""Drawings of more than a net, and of a net in other ways than by axes: what the command says."""

from __future__ import annotations

import json
import math
from pathlib import Path

import ezdxf
import numpy as np
import pytest
import shapely

from kop_exudyn.cli import main
from kop_exudyn.exchange.drawing import DrawnCurve
from kop_exudyn.exchange.other_formats import instead_of
from kop_exudyn.exchange.strips import axes_of_strips, is_narrow

FILES = Path(__file__).parents[1] / "corpus" / "files"


def imported(tmp_path, capsys, name, *options):
    """Status and what was told, as plain data or as an error."""
    page = tmp_path / "page.html"
    status = main(
        ["import", str(FILES / name), "--preview", str(page), "--json", "--overwrite", *options]
    )
    said = capsys.readouterr()
    return status, json.loads(said.out) if status == 0 else said.err


def test_the_largest_part_is_read_alone(tmp_path, capsys):
    status, told = imported(tmp_path, capsys, "sheet.dxf")
    assert status == 2 and "--largest-part reads them alone" in told
    status, told = imported(tmp_path, capsys, "sheet.dxf", "--largest-part")
    assert status == 0
    assert (told["summary"]["curves"], told["summary"]["joints"]) == (6, 9)
    assert any("not connected with the largest part" in f["text"] for f in told["findings"])


def test_edges_of_a_mesh_become_laths(tmp_path, capsys):
    assert imported(tmp_path, capsys, "edges_of_quads.obj")[0] == 2
    status, told = imported(tmp_path, capsys, "edges_of_quads.obj", "--edges", "--as", "grid")
    assert status == 0
    assert (told["summary"]["curves"], told["summary"]["joints"]) == (7, 12)
    status, told = imported(tmp_path, capsys, "edges_of_compas_graph.json", "--edges")
    assert status == 0 and told["summary"]["joints"] == 12
    status, told = imported(tmp_path, capsys, "ascii.stl", "--edges")
    assert status == 2 and "save the mesh as OBJ" in told


def test_curves_that_pass_each_other_in_space_are_no_net(tmp_path, capsys):
    """Also where only a preview is asked for."""
    net = [((-0.2, k), (2.2, k)) for k in range(3)] + [((k, -0.2), (k, 2.2)) for k in range(3)]
    text = ""
    for number, ((x0, y0), (x1, y1)) in enumerate(net):
        up = 0.5 * (number >= 3)
        text += f"v {x0} {y0} {0.1 * x0 + up}\nv {x1} {y1} {0.1 * x1 + up}\nl -2 -1\n"
    path = tmp_path / "net.obj"
    path.write_text(text)
    assert main(["import", str(path), "--preview", str(tmp_path / "net.html")]) == 2
    assert "where they cross in plan" in capsys.readouterr().err


@pytest.mark.parametrize("ending", ["dwg", "DWG", "svg", "pdf", "skp", "step", "ifc", "glb", "ghx"])
def test_files_of_other_programs_are_told_what_to_save(tmp_path, capsys, ending):
    path = tmp_path / f"net.{ending}"
    path.write_bytes(b"anything")
    assert main(["import", str(path), "--preview", str(tmp_path / "net.html")]) == 2
    said = capsys.readouterr().err
    assert instead_of(path.name) and instead_of(path.name) in said
    assert any(word in said for word in ("DXF", "OBJ"))


def strip(axis: np.ndarray, width: float, cap: int) -> np.ndarray:
    """The outline of a strip along a polyline, its ends round for cap > 0."""
    line = shapely.LineString(axis)
    style = "round" if cap else "flat"
    outline = line.buffer(width / 2, cap_style=style, join_style="mitre", quad_segs=max(cap, 1))
    return np.array(outline.exterior.coords)[:-1]


@pytest.mark.parametrize("cap", [0, 4])
@pytest.mark.parametrize("bend", [0.0, 1.0, 2.5])
@pytest.mark.parametrize("first", [0, 7, 31])
def test_axes_of_strips_are_the_strips_axes(bend, cap, first):
    """Straight or bent, from whichever corner their outlines begin."""
    t = np.linspace(-0.5, 0.5, 41)
    axis = np.stack([t, np.zeros(41)], axis=1)
    if bend:
        axis = np.stack([np.sin(bend * t), 1 - np.cos(bend * t)], axis=1) / bend
    plan = np.roll(strip(axis, 0.03, cap), first, axis=0)
    curve = DrawnCurve(np.column_stack([plan, np.zeros(len(plan))]), True, "a lath")
    (read,), (flat,), (said,) = axes_of_strips([curve], [plan], 1e-4)
    assert not read.closed and said.kind == "suspicious" and "0.03" in said.text
    line = shapely.LineString(axis)
    # the axis goes on into round ends by half the width
    assert shapely.LineString(flat).length == pytest.approx(1 + 0.03 * (cap > 0), abs=2e-3)
    inner = flat[1:-1] if len(flat) > 2 else flat[:0]
    assert all(line.distance(shapely.Point(x)) < 3e-4 for x in inner)
    whole = np.concatenate([3 * axis[:1] - 2 * axis[1:2], axis, 3 * axis[-1:] - 2 * axis[-2:-1]])
    ends = [shapely.LineString(whole).distance(shapely.Point(x)) for x in flat[[0, -1]]]
    assert max(ends) < 1e-3  # a thirtieth of the width


def test_a_ring_and_a_wedge_are_no_strips():
    t = np.linspace(0, 2 * math.pi, 60, endpoint=False)
    ring = np.stack([np.cos(t), np.sin(t)], axis=1)
    wedge = np.array([[0.0, 0.0], [4.0, 0.1], [4.0, -0.1]])
    curves = [
        DrawnCurve(np.column_stack([x, np.zeros(len(x))]), True, "a loop") for x in (ring, wedge)
    ]
    kept, _, said = axes_of_strips(curves, [ring, wedge], 1e-4)
    assert kept == curves and not said


def test_laths_that_go_on_from_edge_to_edge_of_a_net_are_no_outline(tmp_path, capsys):
    """A net of diagonals within a rectangle, as lamella roofs have it: laths meet at its edges two
    by two and so go round closed loops, which cross themselves. Their areas cancel, as those of
    narrow loops vanish."""
    box, drawing, drawn = shapely.box(-6.0, -4.0, 6.0, 4.0), ezdxf.new(units=6), 0
    for c in np.arange(-12.0, 12.1, 2.0):
        for s in (1, -1):
            lath = shapely.LineString([(c - 20, -20 * s), (c + 20, 20 * s)]).intersection(box)
            if lath.length > 2.5:
                drawing.modelspace().add_lwpolyline(list(lath.coords))
                drawn += 1
    drawing.saveas(tmp_path / "roof.dxf")
    status, told = imported(tmp_path, capsys, tmp_path / "roof.dxf")
    assert status == 0 and drawn == 18
    assert (told["summary"]["curves"], told["summary"]["joints"]) == (18, 55)
    assert not any("outline" in finding["text"] for finding in told["findings"])


def test_a_curve_that_crosses_itself_is_no_outline():
    t = np.linspace(0, 2 * np.pi, 80, endpoint=False)
    assert not is_narrow(np.stack([np.cos(t), 0.5 * np.sin(2 * t)], axis=1))
    thin = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 0.2], [0.0, 0.2]])
    sloppy = np.insert(thin, 2, [[10.02, 0.01], [9.99, -0.01]], axis=0)  # corners that miss
    assert is_narrow(thin) and is_narrow(sloppy)
