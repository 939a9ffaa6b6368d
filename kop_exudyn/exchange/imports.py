"""Drawings as designs: the files of the classes that are made of drawn nets, with what a reader
should know about each step."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..geometry.mesh_cleaning import pieces_of
from ..geometry.mesh_files import read_mesh
from ..geometry.mesh_surface import MeshSurface, load_mesh_surface
from ..structures.base import Design, design_from_dict
from ..structures.nets import NetClass, net_class, net_classes
from ..units import LENGTHS, Units
from .curve_files import read_drawing
from .design_data import Rods, design_data, mesh_target, rod_doubts
from .drawing import Drawing, Finding, size_of
from .drawn_networks import DrawnNetwork, ReadingOptions, drawn_network
from .frames import Frame
from .mesh_edges import edges_of
from .mixed_units import scale_beside, size_doubts
from .space_nets import laid_flat, surface_through, with_heights_checked

_SMALLEST, _LARGEST = 0.02, 300.0  # m: nets that are built are of a size between
_ON_SURFACE = 0.01  # of a mesh's size: curves drawn in space on it may be that far off


@dataclass(frozen=True)
class Imported:
    """A design made of a drawing.

    data : the content of its file
    drawn : what was understood of the drawing
    findings : of reading and of making the design
    meshes : files that the design names, and the vertices and faces to write there
    """

    data: dict[str, Any]
    drawn: DrawnNetwork
    findings: list[Finding]
    meshes: dict[Path, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)


@dataclass(frozen=True)
class _Order:
    """What is made of a net: a design of a class, named, of such rods, for a file at `out`, by
    options as of `import_net`."""

    class_name: str
    net: NetClass
    name: str
    rods: Rods
    out: Path
    options: Mapping[str, Any]

    def data(self, drawn: DrawnNetwork, own: Mapping[str, Any]) -> dict[str, Any]:
        """The content of the file, of the net and the class's own options."""
        content = self.net.content(drawn.entries, {**self.options, **own})
        return design_data(self.class_name, self.name, self.rods, content) | drawn.placed


def scaled_reading(
    drawing: Drawing, options: ReadingOptions, scale: float | None, units: Units | None
) -> tuple[ReadingOptions, Units | None]:
    """The options with the scale that leads to the design's units, and these units.

    scale : as asked for; None: from the drawing's unit to the design's, where both are known
    units : as asked for; None: the drawing's, as far as the scale leads to a unit that is known
    """
    if units is not None and scale is None and drawing.metres is not None:
        scale = drawing.metres / units.metres
    scale = 1.0 if scale is None else scale
    if units is None and drawing.metres is not None:
        metres = drawing.metres / scale
        near = [name for name, m in LENGTHS.items() if abs(metres / m - 1) < 1e-9]
        units = Units(near[0]) if near else None
    return replace(options, scale=scale), units


def read_scaled(
    path: Path,
    options: ReadingOptions,
    scale: float | None,
    units: Units | None,
    *,
    space: bool = False,
) -> tuple[DrawnNetwork, Units | None]:
    """The network of a drawing in the design's units, see `scaled_reading` and `read_network`."""
    if options.edges and options.layers:
        raise InputError(
            "edges are read of all that a file has: leave out --layer or --edges",
            source=path,
            field="--layer",
            value=options.layers[0],
        )
    drawing = edges_of(path) if options.edges else read_drawing(path, options.layers)
    options, units = scaled_reading(drawing, options, scale, units)
    try:
        drawn = drawn_network(drawing, options, space=space)
    except InputError as error:
        raise error.at(path) from None
    return replace(drawn, findings=drawn.findings + _size_doubts(drawn, units)), units


def _size_doubts(drawn: DrawnNetwork, units: Units | None) -> list[Finding]:
    """A finding where a net is as small, or as large, as none is built."""
    if units is None:
        return []
    size = drawn.options.scale * size_of(drawn.curves)
    if _SMALLEST <= size * units.metres <= _LARGEST:
        return []
    text = (
        f"the net is {size:.3g} {units.length} large: is this its unit? (--unit names the right "
        "one, with --scale for the drawing's numbers)"
    )
    return [Finding("suspicious", text)]


def import_net(
    drawn: DrawnNetwork,
    class_name: str,
    name: str,
    rods: Rods,
    out: Path,
    options: Mapping[str, Any],
) -> Imported:
    """A design of a drawn net.

    class_name : one of `net_classes`
    name : of the design
    out : where the design will be written
    options : by name; of classes in a plane "target" (a mesh file in the drawing's coordinates, or
        None), of classes on surfaces "surface" (such a file; None: the surface through a net in
        space), "chart" ("plane": curves are taken in plan; "conformal": they are drawn in space on
        the surface) and "mesh_file", where the net's own surface will be written; and those that
        the class asks for

    Raises InputError, naming the drawing's curves, where no design comes of it.
    """
    net = net_class(class_name)
    if net is None:
        raise InputError(
            f"isn't made of drawings (known: {', '.join(net_classes())})",
            field="--as",
            value=class_name,
        )
    order = _Order(class_name, net, name, rods, out, options)
    return (_in_plane if net.on_surface is None else _on_surface)(drawn, order)


def _in_plane(drawn: DrawnNetwork, order: _Order) -> Imported:
    """Of a net that is flat, or can be laid flat."""
    frame = replace(drawn.frame, origin=drawn.frame.origin + drawn.origin)
    if not drawn.frame.flat:
        drawn, frame = laid_flat(drawn), Frame(drawn.origin, np.eye(3), 0.0)
    findings = drawn.findings + _doubts(drawn, order.rods)
    goal = None
    target = order.options["target"]
    if target is not None:
        ratio, said = scale_beside(target, drawn.drawing)
        findings += said
        # seen from the mesh, whose own units its origin is in
        frame = replace(frame, origin=frame.origin / ratio)
        goal = mesh_target(relative(target, order.out), frame, ratio * drawn.options.scale)
    data = order.data(drawn, {"target": goal, "free_ends": drawn.options.free_ends})
    findings += [Finding("suspicious", text) for text in _check(drawn, data, order.out).doubts]
    return Imported(data, drawn, findings + (_piece_doubts(target) if target is not None else []))


def _piece_doubts(target: Path) -> list[Finding]:
    """A finding where a target isn't one surface: joints may be drawn to several."""
    pieces = pieces_of(read_mesh(target)[1])
    if pieces == 1:
        return []
    text = f"{target.name} is in {pieces} pieces, and joints are drawn to the nearest: give one"
    return [Finding("suspicious", text)]


def _on_surface(drawn: DrawnNetwork, order: _Order) -> Imported:
    """Over a net drawn in plan or in space, on a surface or on the net's own."""
    net, out, options = order.net, order.out, order.options
    scale, surface, chart = drawn.options.scale, options["surface"], options["chart"]
    meshes = {}
    if surface is None:
        if drawn.frame.flat:
            raise InputError(
                f"{net.one} needs --surface: the net is drawn flat and says nothing of the shape"
            )
        drawn = with_heights_checked(drawn)
        vertices, faces, up = surface_through(drawn)
        meshes[options["mesh_file"]] = (vertices + scale * drawn.origin, faces)
        file = relative(options["mesh_file"], out)
        where: dict[str, Any] = {"type": "mesh", "file": file, "up": up}
        mesh = MeshSurface(vertices, faces, "plane", up)
    else:
        ratio, said = scale_beside(surface, drawn.drawing)
        where = {"type": "mesh", "file": relative(surface, out)}
        where |= {"scale": ratio * scale} if ratio * scale != 1.0 else {}
        where |= {"chart": chart} if chart != "plane" else {}
        try:
            mesh = load_mesh_surface(surface, chart, "z", ratio * scale, scale * drawn.origin)
        except InputError as error:
            raise InputError(error.message, source=surface) from None
        said += size_doubts(surface, mesh.mesh.size, scale * size_of(drawn.curves))
        drawn = replace(drawn, findings=drawn.findings + said)
        if chart == "conformal":
            drawn = replace(drawn, entries=_in_chart(drawn, mesh))
    findings = drawn.findings + _doubts(drawn, order.rods)
    data = order.data(drawn, {"surface": where})
    assert net.on_surface is not None
    _check(drawn, data, out, partial(net.on_surface, mesh) if meshes else None)
    return Imported(data, drawn, findings, meshes)


def relative(file: Path, out: Path) -> str:
    """A file's path as the design file at `out` names it."""
    return Path(os.path.relpath(file, out.parent)).as_posix()


def _doubts(drawn: DrawnNetwork, rods: Rods) -> list[Finding]:
    """What looks like mixed units. Raises InputError for rods that are thicker than long."""
    spans = np.concatenate([strand.lengths for strand in drawn.network.strands])
    if not len(spans):
        return []
    doubts = rod_doubts(rods, spans)
    thickest = max(float(rods.section[side]) for side in ("width", "height"))
    if thickest > float(np.median(spans)):
        raise InputError(f"{doubts[0]} (--scale, --unit)", field="--section")
    return [Finding("suspicious", text) for text in doubts]


def _check(
    drawn: DrawnNetwork,
    data: dict[str, Any],
    out: Path,
    make: Callable[[Mapping[str, Any]], Design] | None = None,
) -> Design:
    """The design; raises InputError, in the drawing's words, where none can be made of the content.

    make : makes it where the surface's file isn't written yet; None: as any file is read
    """
    try:
        if make is None:
            return design_from_dict(data, str(out))
        return make(data)
    except InputError as error:
        named = drawn.named(error)
        for field in ("surface", "target"):  # files of their own
            if named.field == f"{field}.file" and "file" in data.get(field, {}):
                file = out.parent / data[field]["file"]
                raise InputError(named.message, source=os.path.normpath(file)) from None
        raise InputError(named.message, field=named.field, value=named.value) from None


def _in_chart(drawn: DrawnNetwork, mesh: MeshSurface) -> list[dict[str, Any]]:
    """The curves in a chart's parameters, by the points of the mesh nearest to them."""
    entries = []
    for curve, entry in zip(drawn.curves, drawn.entries):
        uv, apart = mesh.parameters_of(drawn.options.scale * curve.points)
        if apart.max() > _ON_SURFACE * mesh.mesh.size:
            raise InputError(
                f"is up to {apart.max():.3g} off the surface: with --chart conformal curves are "
                "drawn in space on it, in its unit and place",
                field=curve.label,
            )
        entries.append(entry | {"points": uv.tolist()})
    return entries
