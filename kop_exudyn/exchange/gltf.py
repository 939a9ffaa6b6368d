"""States as glTF 2.0 in one binary file (GLB), for Blender, Rhino, and 3D viewers of any kind.

In metres, y up, as glTF wants it. A node for every part, and below it one for every rod piece,
whose extras have its part, element, design, deviation and utilisation. Coordinates are single
precision: what lies far from the origin is moved to it, and the node "origin" says from where.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..drawing.colours import to_linear
from ..files.files import write_bytes
from .meshes import sweep
from .states import DesignState

# glTF's up is y
_Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
_FAR = 100.0  # sizes from the origin beyond which a state is moved to it
_TARGET_COLOUR = (0.55, 0.6, 0.65, 0.35)


def glb_bytes(
    states: Sequence[DesignState], *, target: bool = True, origin: np.ndarray | None = None
) -> bytes:
    """The states as a GLB file.

    target : whether the target surface of those that have one goes with them
    origin : (3,) what is taken off all coordinates; default: see `common_origin`
    """
    import trimesh
    from trimesh.visual import TextureVisuals
    from trimesh.visual.material import PBRMaterial

    centre = common_origin(states) if origin is None else origin
    scene = trimesh.Scene(base_frame="y up, metres")
    metres = states[0].metres
    root = _Y_UP @ np.diag([metres, metres, metres, 1.0])
    scene.graph.update(
        "origin", matrix=root, metadata={"origin_metres": (metres * centre).tolist()}
    )
    materials: dict[tuple, Any] = {}

    def visual(colour: Sequence[float], alpha: float = 1.0) -> Any:
        key = (*np.round(colour, 6), alpha)
        if key not in materials:
            materials[key] = PBRMaterial(
                baseColorFactor=[*to_linear(np.asarray(colour)), alpha],
                metallicFactor=0.0,
                roughnessFactor=0.7,
                alphaMode="OPAQUE" if alpha == 1 else "BLEND",
                doubleSided=alpha != 1,
            )
        return TextureVisuals(material=materials[key])

    def add(
        name: str, vertices: np.ndarray, faces: np.ndarray, look: Any, parent: str, extras: dict
    ) -> None:
        mesh = trimesh.Trimesh(vertices - centre, faces, process=False, visual=look)
        mesh.metadata = extras
        scene.add_geometry(
            mesh, node_name=name, geom_name=name, parent_node_name=parent, metadata=extras
        )

    for state in states:
        prefix = f"{state.design.name} {state.name}"
        scene.graph.update(prefix, "origin", matrix=np.eye(4))
        mesh = sweep(state.scene, state.equilibrium.state)
        placed = state.placed(mesh.vertices)
        for part in dict.fromkeys(state.parts):
            scene.graph.update(f"{prefix} {part or 'rods'}", prefix, matrix=np.eye(4))
        for chain, part in enumerate(state.parts):
            own = mesh.faces[mesh.chains[mesh.faces[:, 0]] == chain]
            used, faces = np.unique(own, return_inverse=True)
            add(
                f"{prefix} {state.names[chain]}",
                placed[used],
                faces.reshape(-1, 3),
                visual(state.colours[chain]),
                f"{prefix} {part or 'rods'}",
                {name: value for name, value in state.of_rod(chain).items() if value is not None},
            )
        if target and state.surface is not None:
            vertices, faces = state.surface
            look = visual(_TARGET_COLOUR[:3], _TARGET_COLOUR[3])
            add(f"{prefix} target", vertices, faces, look, prefix, {"target": True})
    return scene.export(file_type="glb")


def write_glb(
    path: str | Path,
    states: Sequence[DesignState],
    *,
    origin: np.ndarray | None = None,
    overwrite: bool = False,
) -> Path:
    """Write states; origin : see `glb_bytes`. Raises InputError when the file exists or can't be
    written."""
    return write_bytes(path, glb_bytes(states, origin=origin), overwrite=overwrite)


def common_origin(states: Sequence[DesignState]) -> np.ndarray:
    """(3,) what is taken off all coordinates, so that files of one state each lie right beside each
    other: nothing, for states near the origin."""
    points = np.concatenate([state.points for state in states])
    middle, size = points.mean(axis=0), float(np.linalg.norm(np.ptp(points, axis=0)))
    far = np.linalg.norm(middle) > _FAR * size
    return np.round(middle) if far else np.zeros(3)
