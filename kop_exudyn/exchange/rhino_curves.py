"""The curves of a Rhino file (.3dm), blocks included. Needs rhino3dm, which comes with the extra
"rhino".

Read is what can be seen: not what is hidden, nor what lies on layers that are hidden, or whose
parents are. Layers that are asked for by name are read in any case.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..checks import LARGEST
from ..errors import InputError
from ..geometry.nurbs import spline_points
from .drawing import Drawing
from .outlines import Outline, flattened
from .rhino import load_rhino3dm

_DEEPEST = 20  # blocks within blocks
_MOST_OBJECTS = 200_000
# names of Rhino's units -> name, metres
_UNITS = {
    "Nanometers": ("nanometres", 1e-9),
    "Microns": ("micrometres", 1e-6),
    "Millimeters": ("mm", 1e-3),
    "Centimeters": ("cm", 1e-2),
    "Decimeters": ("dm", 0.1),
    "Meters": ("m", 1.0),
    "Dekameters": ("decametres", 10.0),
    "Hectometers": ("hectometres", 100.0),
    "Kilometers": ("km", 1e3),
    "Mils": ("mils", 2.54e-5),
    "Inches": ("in", 0.0254),
    "Feet": ("ft", 0.3048),
    "Yards": ("yards", 0.9144),
    "Miles": ("miles", 1609.344),
}


def rhino_drawing(content: bytes, layers: Sequence[str]) -> Drawing:
    """The drawing in a 3dm file's bytes. Raises InputError for what can't be read, for layers that
    aren't there, and without rhino3dm."""
    rhino3dm = load_rhino3dm()
    model = rhino3dm.File3dm.FromByteArray(content)
    if model is None:
        raise InputError("can't be read as 3dm")
    seen = _Seen(rhino3dm, model, layers)
    for layer in layers:
        if layer.lower() not in seen.known:
            names = ", ".join(sorted(layer.FullPath for layer in model.Layers))
            raise InputError(f"no such layer (there are {names})", field="layer", value=layer)
    outlines = list(seen.outlines())
    skipped = [f"{n} {what}" for what, n in seen.unseen.items()]
    skipped += [
        f"{n} insertions of {name}, a block of another file: embed it in this one, or import that "
        "file"
        for name, n in seen.elsewhere.items()
    ]
    if seen.others:
        skipped.append("no curves: " + ", ".join(f"{n} {name}" for name, n in seen.others.items()))
    unit = str(model.Settings.ModelUnitSystem).rpartition(".")[2]
    name, metres = _UNITS.get(unit, (None, None))
    doubts = []
    if name is None and unit not in ("None", "Unset"):
        doubts.append(f"its unit of length, {unit}, isn't known: give --scale")
    return Drawing(list(flattened(outlines)), name, metres, skipped, doubts)


class _Seen:
    """What can be seen of a model, and how often something can't.

    known : names of layers, with those of their parents and without, in small letters
    """

    def __init__(self, rhino3dm: Any, model: Any, layers: Sequence[str]):
        self._rhino3dm, self._model = rhino3dm, model
        self._wanted = {name.lower() for name in layers}
        self._layers = list(model.Layers)
        self._parents = {str(layer.Id): layer for layer in self._layers}
        self.known = {n.lower() for layer in self._layers for n in (layer.Name, layer.FullPath)}
        self.unseen: Counter[str] = Counter()
        self.others: Counter[str] = Counter()
        self.elsewhere: Counter[str] = Counter()
        self._count = 0

    def outlines(self) -> Iterator[tuple[Outline, str]]:
        """Outlines and labels of all curves."""
        for thing in self._model.Objects:
            if not thing.Attributes.IsInstanceDefinitionObject:
                yield from self._of(thing, np.eye(4), "", 0)

    def _of(
        self, thing: Any, matrix: np.ndarray, within: str, depth: int
    ) -> Iterator[tuple[Outline, str]]:
        """Of an object, or of a block's. matrix (4, 4) : into the drawing's coordinates."""
        self._count += 1
        if self._count > _MOST_OBJECTS:
            raise InputError(f"draws more than {_MOST_OBJECTS:,} objects, blocks included")
        geometry, layer = thing.Geometry, self._layer(thing)
        if isinstance(geometry, self._rhino3dm.InstanceReference):
            if not self._wanted and self._hidden(thing, layer):
                return
            yield from self._block(geometry, matrix, depth)
            return
        if self._wanted:
            if layer is None or not self._wanted & {layer.Name.lower(), layer.FullPath.lower()}:
                return
        elif self._hidden(thing, layer):
            return
        if not isinstance(geometry, self._rhino3dm.Curve):
            self.others[type(geometry).__name__] += 1
            return
        label = f"curve {self._count}{within}"
        name = None if layer is None else layer.FullPath
        yield replace(self._outline(geometry, matrix, label), layer=name), label

    def _block(
        self, reference: Any, matrix: np.ndarray, depth: int
    ) -> Iterator[tuple[Outline, str]]:
        if depth == _DEEPEST:
            raise InputError(f"has blocks within blocks, more than {_DEEPEST} deep")
        block = self._model.InstanceDefinitions.FindId(reference.ParentIdefId)
        parts = [] if block is None else list(block.GetObjectIds())
        if not parts:
            self.elsewhere[block.Name if block is not None else "a missing block"] += 1
            return
        inner = matrix @ np.array(reference.Xform.ToFloatArray(True)).reshape(4, 4)
        for number in parts:
            thing = self._model.Objects.FindId(number)
            if thing is not None:
                yield from self._of(thing, inner, f" of block {block.Name}", depth + 1)

    def _layer(self, thing: Any) -> Any:
        index = thing.Attributes.LayerIndex
        return self._layers[index] if 0 <= index < len(self._layers) else None

    def _hidden(self, thing: Any, layer: Any) -> bool:
        """Whether an object is hidden, or its layer, or a layer that this is below; is counted."""
        name = "0" if layer is None else layer.FullPath
        above, shown = layer, True
        for _ in range(_DEEPEST):
            shown &= above is None or above.Visible
            above = None if above is None else self._parents.get(str(above.ParentLayerId))
        if not shown:
            self.unseen[f"on the hidden layer {name} (--layer {name!r} reads them)"] += 1
        elif not thing.Attributes.Visible or str(thing.Attributes.Mode).endswith("Hidden"):
            self.unseen[f"hidden on the layer {name} (--layer {name!r} reads them)"] += 1
        else:
            return False
        return True

    def _outline(self, curve: Any, matrix: np.ndarray, label: str) -> Outline:
        """A curve of any kind as a spline, whose points Rhino gives times their weights, and whose
        first and last knots it leaves out."""
        spline = curve.ToNurbsCurve()
        if spline is None:
            raise InputError("can't be read as a curve", field=label)
        x = np.array([(p.X, p.Y, p.Z, p.W) for p in spline.Points])
        w, inner = x[:, 3], list(spline.Knots)
        control = (x[:, :3] / w[:, None]) @ matrix[:3, :3].T + matrix[:3, 3]
        if not (np.abs(control) <= LARGEST).all():
            raise InputError("is no curve: expected points within 1e60", field=label)
        knots = [*inner[:1], *inner, *inner[-1:]]

        def points(sag: float) -> np.ndarray:
            try:
                return spline_points(control, knots, spline.Degree, w.tolist(), sag)
            except InputError as error:
                raise InputError(error.message, field=label) from None

        return Outline(control, points, bool(curve.IsClosed))
