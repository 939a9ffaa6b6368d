"""States as Rhino files (.3dm). Needs rhino3dm, which comes with the extra "rhino".

A layer for every state, below it one for every part (and for other rods, the joints, the target).
Every rod piece is there twice: as its axis, and as a solid; both are named by part and element, and
carry design, state, part, element, deviation and utilisation as user text. Units are the design's.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..files.files import write_bytes
from .meshes import sweep
from .states import DesignState

_UNITS = {"mm": "Millimeters", "cm": "Centimeters", "m": "Meters", "in": "Inches", "ft": "Feet"}
_TOLERANCE = 1e-5  # of the size, that Rhino works with
_VERSION = 7


def rhino_bytes(states: Sequence[DesignState]) -> bytes:
    """The states as a 3dm file. Raises InputError without rhino3dm."""
    rhino3dm = load_rhino3dm()
    model = rhino3dm.File3dm()
    units = states[0].design.units
    name = "None" if units is None else _UNITS[units.length]
    model.Settings.ModelUnitSystem = getattr(rhino3dm.UnitSystem, name)
    size = float(np.linalg.norm(np.ptp(states[0].points, axis=0)))
    model.Settings.ModelAbsoluteTolerance = _TOLERANCE * size
    for state in states:
        _add_state(rhino3dm, model, state)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "states.3dm"
        model.Write(str(path), _VERSION)
        return path.read_bytes()


def write_rhino(
    path: str | Path, states: Sequence[DesignState], *, overwrite: bool = False
) -> Path:
    """Write states. Raises InputError when the file exists or can't be written, or without
    rhino3dm."""
    return write_bytes(path, rhino_bytes(states), overwrite=overwrite)


def load_rhino3dm() -> Any:
    """The library. Raises InputError without it."""
    try:
        import rhino3dm
    except ImportError:
        raise InputError(
            "3dm files need rhino3dm: pip install 'kop_exudyn[rhino]'", field="format", value="3dm"
        ) from None
    return rhino3dm


def _add_state(rhino3dm: Any, model: Any, state: DesignState) -> None:
    parent = _layer(rhino3dm, model, f"{state.design.name} {state.name}", None, (0.2, 0.2, 0.2))
    layers: dict[str, int] = {}
    for part, colour in zip(state.parts, state.colours):
        if part not in layers:
            layers[part] = _layer(rhino3dm, model, part or "rods", parent, colour)
    mesh = sweep(state.scene, state.equilibrium.state)
    vertices = state.placed(mesh.vertices)
    for chain, line in enumerate(state.lines):
        attributes = rhino3dm.ObjectAttributes()
        attributes.LayerIndex = layers[state.parts[chain]]
        attributes.Name = state.names[chain]
        for key, value in state.of_rod(chain).items():
            if value is not None:
                attributes.SetUserString(key, str(value))
        points = rhino3dm.Point3dList()
        for x, y, z in line.tolist():
            points.Add(x, y, z)
        model.Objects.AddPolyline(points, attributes)
        own = mesh.faces[mesh.chains[mesh.faces[:, 0]] == chain]
        used, faces = np.unique(own, return_inverse=True)
        solid = _mesh(rhino3dm, vertices[used], faces.reshape(-1, 3))
        model.Objects.AddMesh(solid, attributes)
    joints = _layer(rhino3dm, model, "joints", parent, (0.1, 0.1, 0.1))
    places = state.placed(state.equilibrium.state.positions[state.design.joints])
    for number, (x, y, z) in enumerate(places.tolist(), 1):
        attributes = rhino3dm.ObjectAttributes()
        attributes.LayerIndex, attributes.Name = joints, f"joint {number}"
        model.Objects.AddPoint(rhino3dm.Point3d(x, y, z), attributes)
    if state.surface is not None:
        attributes = rhino3dm.ObjectAttributes()
        attributes.Name = "target"
        attributes.LayerIndex = _layer(rhino3dm, model, "target", parent, (0.6, 0.65, 0.7))
        model.Objects.AddMesh(_mesh(rhino3dm, *state.surface), attributes)


def _layer(
    rhino3dm: Any, model: Any, name: str, parent: int | None, colour: Sequence[float]
) -> int:
    """A new layer's index."""
    layer = rhino3dm.Layer()
    layer.Name = name
    layer.Color = (*(int(round(255 * float(c))) for c in colour), 255)
    if parent is not None:
        layer.ParentLayerId = model.Layers[parent].Id
    return model.Layers.Add(layer)


def _mesh(rhino3dm: Any, vertices: np.ndarray, faces: np.ndarray) -> Any:
    mesh = rhino3dm.Mesh()
    for x, y, z in vertices.tolist():
        mesh.Vertices.Add(x, y, z)
    for a, b, c in faces.tolist():
        mesh.Faces.AddFace(a, b, c)
    mesh.Normals.ComputeNormals()
    return mesh
