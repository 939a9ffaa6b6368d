"""Nets as Rhino writes them, as 3dm files."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from drawings import NET, Net, Refused, case, in_metres, size_doubts
from splines import RADII, RINGS, spokes


def rhino(draw: Callable[[Any, Any], None], unit: str = "None") -> bytes:
    """The file that a function of the library and a model draws."""
    import rhino3dm

    model = rhino3dm.File3dm()
    model.Settings.ModelUnitSystem = getattr(rhino3dm.UnitSystem, unit)
    draw(rhino3dm, model)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "net.3dm"
        model.Write(str(path), 7)
        return path.read_bytes()


def segment(r: Any, start: Any, end: Any) -> Any:
    return r.LineCurve(r.Point3d(*start, 0.0), r.Point3d(*end, 0.0))


def lines(r: Any, model: Any, net: Any = NET, layer: int = -1, visible: bool = True) -> None:
    for start, end in net:
        attributes = r.ObjectAttributes()
        attributes.LayerIndex, attributes.Visible = layer, visible
        model.Objects.AddCurve(segment(r, start, end), attributes)


def layer(r: Any, model: Any, name: str, parent: int | None = None, shown: bool = True) -> int:
    made = r.Layer()
    made.Name = name
    if parent is not None:
        made.ParentLayerId = model.Layers[parent].Id
    index = model.Layers.Add(made)
    model.Layers[index].Visible = shown
    return index


NOISE = [((-0.5, -0.5), (2.5, 2.5)), ((0.5, -0.2), (0.5, 2.2))]


@case("lines.3dm", Net())
def _lines() -> bytes:
    return rhino(lines)


for _name, _unit, _metres in (("mm", "Millimeters", 1e-3), ("ft", "Feet", 0.3048)):
    case(f"unit_{_name}.3dm", Net(unit=_name, findings=size_doubts(_metres)))(
        lambda unit=_unit: rhino(lines, unit)
    )
    case(f"unit_{_name}_to_m.3dm", in_metres(_metres))(lambda unit=_unit: rhino(lines, unit))


@case("unit_unknown.3dm", Net(findings={"suspicious": 1}))
def _unit_unknown() -> bytes:
    return rhino(lines, "PrinterPoints")


@case("circles.3dm", RINGS)
def _circles() -> bytes:
    def draw(r: Any, model: Any) -> None:
        lines(r, model, spokes())
        for radius in RADII:
            circle = r.Circle(r.Point3d(0, 0, 0), radius)
            model.Objects.AddCurve(r.NurbsCurve.CreateFromCircle(circle))

    return rhino(draw)


@case("arcs.3dm", Net(5, 6, 3 + 5 * 5 * np.pi / 6, tolerance=3e-4))
def _arcs() -> bytes:
    def draw(r: Any, model: Any) -> None:
        ways = [np.array([np.cos(t), np.sin(t)]) for t in np.radians([0, 75, 150])]
        lines(r, model, [(1.5 * w, 3.5 * w) for w in ways])
        for radius in RADII:
            ends = np.radians([-10, 60, 160])
            places = [r.Point3d(radius * np.cos(t), radius * np.sin(t), 0) for t in ends]
            model.Objects.AddArc(r.Arc(*places))

    return rhino(draw)


@case("polylines.3dm", Net(length=6 + 3 * (1 + np.hypot(1, 0.3)), options={"kind": "polyline"}))
def _polylines() -> bytes:
    def draw(r: Any, model: Any) -> None:
        lines(r, model, [((k, -0.2), (k, 2.7)) for k in range(3)])
        for k in range(3):
            points = r.Point3dList()
            for x, y in [(-0.2, k), (0.5, k), (1.5, k + 0.3), (2.2, k + 0.3)]:
                points.Add(x, y, 0.0)
            model.Objects.AddPolyline(points)

    return rhino(draw)


@case("polycurves.3dm", Net())
def _polycurves() -> bytes:
    """Each lath of two lines, as Rhino joins them."""

    def draw(r: Any, model: Any) -> None:
        for start, end in NET:
            middle = (0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1]))
            curve = r.PolyCurve()
            curve.Append(segment(r, start, middle))
            curve.Append(segment(r, middle, end))
            model.Objects.AddCurve(curve)

    return rhino(draw)


@case("hidden_layers.3dm", Net(findings={"skipped": 3}))
def _hidden() -> bytes:
    """A layer that is hidden, one below a hidden one, and hidden objects."""

    def draw(r: Any, model: Any) -> None:
        shown = layer(r, model, "LATHS")
        hidden = layer(r, model, "OLD", shown=False)
        below = layer(r, model, "OLDER", hidden)
        lines(r, model, layer=shown)
        lines(r, model, NOISE, hidden)
        lines(r, model, NOISE, below)
        lines(r, model, NOISE, shown, visible=False)

    return rhino(draw)


@case("hidden_layer_asked_for.3dm", Net(options={"layers": ["old::LATHS"]}))
def _asked_for() -> bytes:
    def draw(r: Any, model: Any) -> None:
        below = layer(r, model, "LATHS", layer(r, model, "OLD", shown=False))
        lines(r, model, layer=below)
        lines(r, model, NOISE, layer(r, model, "OTHERS"))

    return rhino(draw)


@case("layer_unknown.3dm", Refused("no such layer (there are LATHS)", {"layers": ["RODS"]}))
def _unknown() -> bytes:
    def draw(r: Any, model: Any) -> None:
        lines(r, model, layer=layer(r, model, "LATHS"))

    return rhino(draw)


def block(r: Any, model: Any, name: str, things: Any) -> Any:
    attributes = tuple(r.ObjectAttributes() for _ in things)
    index = model.InstanceDefinitions.Add(
        name, "", "", "", r.Point3d(0, 0, 0), tuple(things), attributes
    )
    return model.InstanceDefinitions[index].Id


def inserted(r: Any, number: Any, matrix: np.ndarray) -> Any:
    transform = r.Transform(1.0)
    for i in range(4):
        for k in range(4):
            setattr(transform, f"M{i}{k}", float(matrix[i, k]))
    return r.InstanceReference(number, transform)


def flat_map(matrix: Any, shift: Any = (0.0, 0.0)) -> np.ndarray:
    found = np.eye(4)
    found[:2, :2], found[:2, 3] = matrix, shift
    return found


@case("block.3dm", Net(length=30.0))
def _block() -> bytes:
    def draw(r: Any, model: Any) -> None:
        number = block(r, model, "NET", [segment(r, *line) for line in NET])
        turn = 2.5 * np.array([[0.6, -0.8], [0.8, 0.6]])
        model.Objects.AddInstanceObject(inserted(r, number, flat_map(turn, (7, -3))))

    return rhino(draw)


@case("block_within_a_block_sheared.3dm", Net(length=6 * 2 + 6 * np.sqrt(2)))
def _nested() -> bytes:
    def draw(r: Any, model: Any) -> None:
        half = block(r, model, "HALF", [segment(r, *line) for line in NET[:3]])
        other = block(r, model, "OTHER", [segment(r, *line) for line in NET[3:]])
        both = [inserted(r, n, flat_map(np.eye(2), (1, 2))) for n in (half, other)]
        whole = block(r, model, "WHOLE", both)
        sheared = flat_map([[2.0, 1.0], [0.0, 1.0]])
        model.Objects.AddInstanceObject(inserted(r, whole, sheared))

    return rhino(draw)


@case("points_and_meshes.3dm", Net(findings={"skipped": 1}))
def _others() -> bytes:
    def draw(r: Any, model: Any) -> None:
        lines(r, model)
        model.Objects.AddPoint(r.Point3d(1, 1, 0))
        mesh = r.Mesh()
        for x, y in ((0, 0), (1, 0), (0, 1)):
            mesh.Vertices.Add(x, y, 0.0)
        mesh.Faces.AddFace(0, 1, 2)
        model.Objects.AddMesh(mesh)

    return rhino(draw)


@case("nothing_drawn.3dm", Refused("contains no curves"))
def _nothing() -> bytes:
    return rhino(lambda r, model: None)


@case("not_3dm.3dm", Refused("can't be read as 3dm"))
def _not() -> str:
    return "something else under this name\n"
