"""Random tiny designs of all classes, and the same ones elsewhere: turned, moved, mirrored, in
other units."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from kop_exudyn.exchange.polygons import write_mesh_obj
from kop_exudyn.structures.umbrella.generator import (
    design_on_surface,
    height_field,
    hexagon_patch,
)
from kop_exudyn.structures.umbrella.layout import BaseMesh, Plates

CLASSES = ("c_shell", "grid", "umbrella")
_HEAD = {"format": "kop_exudyn/design", "version": 1}
_EDGE = 30 + np.sqrt(3) * Plates().thickness
_CELLS = 16  # of a grid's mesh, along each side


@dataclass(frozen=True)
class Place:
    """Where a design is put, and how its numbers are written.

    rotation (3, 3), perhaps with a reflection; shift (3,), in the design's sizes
    unit : of length: all lengths are multiplied by it, moduli divided by its square
    """

    rotation: np.ndarray
    shift: np.ndarray
    unit: float = 1.0

    def points(self, x: Any, size: float) -> np.ndarray:
        """Points (n, 2 or 3) of the design, there."""
        x = np.array(x, float)
        k = x.shape[1]
        turned = np.pad(x, ((0, 0), (0, 3 - k))) @ self.rotation.T
        return (self.unit * (turned + size * self.shift))[:, :k]


HERE = Place(np.eye(3), np.zeros(3))


def random_design(rng: np.random.Generator, class_name: str) -> dict[str, Any]:
    """The content of a design file; of grids without the mesh's file: see `written`."""
    material = {"young": 10 ** rng.uniform(8.5, 11), "poisson": rng.uniform(0.2, 0.4)}
    if class_name == "umbrella":
        a, b, c = rng.uniform(-1, 1, 3) / 900
        surface = height_field(
            lambda x, y: a * x**2 + b * y**2 + c * x * y, rng.uniform(500, 900), 12
        )
        data = design_on_surface(
            "soak", BaseMesh(*hexagon_patch(1, _EDGE)), *surface, plates=Plates()
        )
        data.pop("units", None)
        data["materials"] = {
            "arms": {"young": 1400.0, "poisson": 0.35},
            "plates": {"young": 14000.0, "poisson": 0.35},
        }
        return data
    if class_name == "grid":
        lines = [np.sort(rng.uniform(-0.8, 0.8, 3) + np.array([-0.6, 0, 0.6])) for _ in range(2)]
        return {
            **_HEAD,
            "class": "grid",
            "name": "soak",
            "material": material,
            "section": {"type": "rectangle", "width": 0.004, "height": rng.uniform(0.01, 0.03)},
            "surface": {"type": "mesh", "file": "mesh.obj", "up": "z"},
            "network": {"type": "isolines", "u": lines[0].tolist(), "v": lines[1].tolist()},
            "held": "corners",
            "heights": rng.uniform(-0.3, 0.3, 3).tolist(),
        }
    n, bend = int(rng.integers(3, 5)), rng.uniform(-0.06, 0.06, 4)
    steps = np.linspace(-0.5, 0.5, n)
    along = np.linspace(-0.65, 0.65, 7)  # beyond the outermost crossings
    curves = []
    for family in range(2):
        for s in steps:
            x, y = along, s + bend[2 * family] * along**2 + bend[2 * family + 1] * s * along
            plane = np.stack([x, y] if family == 0 else [y, x], axis=1)
            plane = plane + 0.02 * np.sin(3 * plane[:, ::-1])
            curves.append({"type": "spline", "points": plane.tolist()})
    return {
        **_HEAD,
        "class": "c_shell",
        "name": "soak",
        "material": material,
        "section": {"type": "rectangle", "width": 0.02, "height": rng.uniform(0.001, 0.003)},
        "opening": {"angle": float(rng.uniform(0.3, 1.0)), "side": "up"},
        "curves": curves,
    }


def random_place(rng: np.random.Generator, class_name: str, sizes: float) -> Place:
    """A place so many sizes away; C-shells stay in their plane, grids go along the axes, umbrella
    meshes, whose cells have a sense, aren't mirrored."""
    way, mirror = rng.normal(size=3), rng.random() < 0.5
    if class_name == "c_shell":
        turn = Rotation.from_rotvec([0, 0, rng.uniform(-np.pi, np.pi)]).as_matrix()
        way[2] = 0.0
        turn = turn @ np.diag([1.0, -1.0, 1.0]) if mirror else turn
    elif class_name == "grid":
        turns = Rotation.create_group("O")
        turn = turns[int(rng.integers(len(turns)))].as_matrix().round()
        turn = -turn if mirror else turn
    else:
        turn = Rotation.random(rng=rng).as_matrix()
    unit = float(10 ** rng.uniform(-6, 6)) if rng.random() < 0.5 else 1.0
    return Place(turn, sizes * way / np.linalg.norm(way), unit)


def written(data: dict[str, Any], place: Place, folder: Path) -> dict[str, Any]:
    """The content of the design's file there, for a file in the folder; a grid's mesh is written
    into it."""
    found, unit = copy.deepcopy(data), place.unit
    if data["class"] == "umbrella":
        return _umbrella(found, place)
    found["material"]["young"] /= unit**2
    for name in ("width", "height"):
        found["section"][name] *= unit
    if data["class"] == "c_shell":
        size = _size(np.concatenate([curve["points"] for curve in data["curves"]]))
        for curve in found["curves"]:
            curve["points"] = place.points(curve["points"], size).tolist()
        if np.linalg.det(place.rotation) < 0:  # angles from one family to the other turn round
            found["opening"]["angle"] *= -1
        return found
    a, b, c = found.pop("heights")
    x, y = (v.ravel() for v in np.meshgrid(*[np.linspace(-1.6, 1.6, _CELLS + 1)] * 2))
    points = np.stack([x, y, a * x**2 + b * y**2 + c * x * y], axis=1)
    size, n = _size(points), _CELLS + 1
    k = (np.arange(_CELLS)[:, None] * n + np.arange(_CELLS)).ravel()
    faces = np.concatenate(
        [np.stack([k, k + 1, k + n + 1], axis=1), np.stack([k, k + n + 1, k + n], axis=1)]
    )
    write_mesh_obj(folder / "mesh.obj", place.points(points, size), faces, overwrite=True)
    up = int(np.argmax(np.abs(place.rotation[:, 2])))
    network = {"type": "isolines"}
    for axis, name in zip(((1, 2), (2, 0), (0, 1))[up], "uv"):
        own = int(np.argmax(np.abs(place.rotation[axis])))
        values = place.rotation[axis, own] * np.array(data["network"]["uv"[own]])
        network[name] = np.sort(unit * (values + size * place.shift[axis])).tolist()
    found["network"], found["surface"]["up"] = network, "xyz"[up]
    return found


def _umbrella(found: dict[str, Any], place: Place) -> dict[str, Any]:
    """Its target placed; its base turned in its plane alone."""
    target, size = found["target"], _size(np.array(found["target"]["vertices"]))
    for name in ("vertices", "crossings", "plates"):
        target[name] = place.points(target[name], size).tolist()
    flat = Place(
        Rotation.from_rotvec([0, 0, place.rotation[0, 1]]).as_matrix(), 0 * place.shift, place.unit
    )
    found["base"]["vertices"] = flat.points(found["base"]["vertices"], size).tolist()
    found["lengths"] = (place.unit * np.array(found["lengths"])).tolist()
    found["plates"] = {name: place.unit * value for name, value in found["plates"].items()}
    for material in found["materials"].values():
        material["young"] /= place.unit**2
    return found


def _size(points: np.ndarray | Sequence[Any]) -> float:
    return float(np.linalg.norm(np.ptp(np.asarray(points, float), axis=0)))
