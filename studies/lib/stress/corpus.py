"""Small valid files of every kind that this project reads, made here: what the fuzzing starts
from."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np

from kop_exudyn.files.arrays import save_arrays, sealed
from kop_exudyn.kit.parts import Kit
from kop_exudyn.structures.umbrella.generator import parallelogram_patch
from kop_exudyn.structures.umbrella.layout import BaseMesh, Plates, umbrella_mesh
from kop_exudyn.structures.umbrella.mesh import UmbrellaMesh

_ENVELOPE = {"format": "kop_exudyn/design", "version": 1}
_RODS = {
    "material": {"young": 2100.0, "poisson": 0.35},
    "section": {"type": "rectangle", "width": 0.02, "height": 0.01},
}

_DRAWING = """v 0 0 0
v 2 0 0
v 0 1 0
v 2 1 0
v 0.5 -1 0
v 0.6 0.5 0
v 0.5 2 0
v 1 -1 0
v 1 2 0
l 1 2
l 3 4
l 5 6 7
l 8 9
"""
STUDY_DESIGNS = ("one.json", "two.json")  # files that the study names
_STUDY = """format = "kop_exudyn/study"
version = 1
designs = ["one.json", {file = "two.json", weight = 2}]
parts = {linear = 3}
[weights]
energy = 0.05
[settings]
seed = 2
schedule = [1e3, 1e5]
bounds.linear = {lower = 0.1, upper = [1, 2]}
"""


def corpus(folder: Any) -> dict[str, bytes]:
    """File name -> content. The name's first part says what reads it (see fuzz.READERS); `folder`
    is for scratch."""
    patch = BaseMesh(*parallelogram_patch(1, 1, 35.0))
    kit = Kit(
        {
            "linear": np.array([[1.0, 2.0], [1.5, 1.5]]),
            "angular": np.array([0.1, 0.2]),
            "cell": np.array([[30.0, 31.0]]),
        }
    )
    documents = {
        "design-c_shell.json": _c_shell("polyline"),
        "design-spline.json": _c_shell("spline"),
        "design-grid.json": _grid(),
        "design-umbrella.json": _umbrella(patch),
        "design-release.json": release_of(
            umbrella_mesh(patch, np.full((len(patch.faces), 2), 32.0), Plates())
        ),
        "kit-small.json": {"format": "kop_exudyn/kit", "version": 1, "parts": kit.to_dict()},
        "result-small.json": _result(kit),
        "job-small.json": {
            "format": "kop_exudyn/job",
            "version": 1,
            "settings": {"seed": 0, "parts": {"linear": 2}},
            "inputs": {"a.json": "0" * 64},
        },
    }
    vertices, faces = _mesh()
    obj = "".join(
        [
            *(f"v {x:.4f} {y:.4f} {z:.4f}\n" for x, y, z in vertices),
            *(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces),
        ]
    )
    ply = (
        f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\nproperty float x\nproperty float "
        f"y\n"
        f"property float z\nelement face {len(faces)}\nproperty list uchar int "
        f"vertex_indices\nend_header\n"
        + "".join(f"{x:.4f} {y:.4f} {z:.4f}\n" for x, y, z in vertices)
        + "".join(f"3 {a} {b} {c}\n" for a, b, c in faces)
    )
    return {
        **{name: json.dumps(document).encode() for name, document in documents.items()},
        "mesh-compas.json": json.dumps(_compas()).encode(),
        "drawing-net.obj": _DRAWING.encode(),
        "drawing-net.dxf": _dxf(),
        "study-small.toml": _STUDY.encode(),
        "mesh-patch.obj": obj.encode(),
        "mesh-patch.ply": ply.encode(),
        "mesh-patch.stl": _stl(vertices, faces),
        "states-small.npz": _archive(folder, _states()),
        "checkpoint-small.npz": _archive(folder, _checkpoint()),
    }


def _archive(folder: Any, arrays: dict[str, np.ndarray]) -> bytes:
    return save_arrays(folder / "scratch.npz", sealed(arrays), overwrite=True).read_bytes()


def _c_shell(kind: str) -> dict[str, Any]:
    lines = [[[-0.2, y], [1.0, 1.02 * y], [2.2, y]] for y in (0.0, 1.0, 2.0)]
    lines += [[[x, -0.2], [1.02 * x, 1.0], [x, 2.2]] for x in (0.0, 1.0, 2.0)]
    return {
        **_ENVELOPE,
        **_RODS,
        "class": "c_shell",
        "name": kind,
        "crossings": "find",
        "free_ends": False,
        "curves": [{"type": kind, "points": points} for points in lines],
        "rod_offset": 0.0,
        "opening": {"angle": 0.6, "side": "up"},
        "elements_per_piece": 2,
    }


def _grid() -> dict[str, Any]:
    lines = [-0.4, 0.0, 0.4]
    return {
        **_ENVELOPE,
        **_RODS,
        "class": "grid",
        "name": "grid",
        "network": {"type": "isolines", "u": lines, "v": lines},
        "surface": {
            "type": "analytic",
            "name": "polynomial",
            "coefficients": [[0, 0, -0.3], [0, 0.1], [0.25]],
        },
    }


def _umbrella(patch: BaseMesh) -> dict[str, Any]:
    return {
        **_ENVELOPE,
        "class": "umbrella",
        "name": "umbrella",
        "base": {
            "vertices": np.asarray(patch.vertices).tolist(),
            "faces": np.asarray(patch.faces).tolist(),
            "flipped": False,
        },
        "lengths": [[32.0, 33.0]] * len(patch.faces),
        "plates": {"arm_position": 10.0, "thickness": 3.0, "width": 5.0, "spacing": 15.0},
        "materials": {
            "arms": {"young": 1400.0, "poisson": 0.35},
            "plates": {"young": 14000.0, "poisson": 0.35},
        },
    }


def release_of(mesh: UmbrellaMesh) -> dict[str, Any]:
    """The content of a released file (see structures.umbrella_release) that describes one of our
    own meshes."""
    n, rods = len(mesh.positions), mesh.rods
    labels, uid = np.full(n, "AAM", dtype="<U3"), np.zeros(n, int)
    segments: dict[str, list[list[int]]] = {
        "A": [[] for _ in range(n)],
        "B": [[] for _ in range(n)],
    }
    offsets: dict[str, list[list[Any]]] = {"A": [[] for _ in range(n)], "B": [[] for _ in range(n)]}
    for rod, (joints, behind) in enumerate(zip(rods.joints, rods.behind)):
        for end in range(2):
            side = "AB"[int(behind[end])]
            segments[side][joints[end]].append(rod)
            offsets[side][joints[end]].append((rods.offsets[rod, end] / mesh.size).tolist())
            if joints[end] not in mesh.crossings:
                labels[joints[end]] = "PT" if rods.sides[rod] == 0 else "PB"
                uid[joints[end]] = rods.cells[rod]
    for centres, label in zip(mesh.centres.T, ("OT", "OB")):
        labels[centres], uid[centres] = label, np.arange(mesh.n_cells)
    kinds = np.where(rods.arms, "TA", np.where(rods.sides == 0, "PT", "PB"))
    return {
        "bbox_diagonal": mesh.size,
        "vertices": (mesh.positions / mesh.size).tolist(),
        "v_labels": labels.tolist(),
        "uid": [[int(cell)] for cell in uid],
        "ghost_bisectors": mesh.frames[:, :, 0].tolist(),
        "ghost_normals": mesh.frames[:, :, 2].tolist(),
        "edges": rods.joints.tolist(),
        "e_labels": kinds.tolist(),
        "A_segments": segments["A"],
        "B_segments": segments["B"],
        "midpoint_offsets_A": offsets["A"],
        "midpoint_offsets_B": offsets["B"],
        "segment_normals": rods.normals.tolist(),
        "base_mesh_f": [[0, 1, 2]] * mesh.n_cells,
    }


def _result(kit: Kit) -> dict[str, Any]:
    exudyn = {
        "version": "1.13.6",
        "newton_steps": 1,
        "residual": 1e-12,
        "moved": 1e-12,
        "wall_s": 0.1,
    }
    solved = {
        "fit": {"max_percent": 1.0, "mean_percent": 0.5},
        "elastic_energy": 2.0,
        "energy_ratio": 1.1,
        "stable": True,
        "exudyn": exudyn,
    }
    return {
        "format": "kop_exudyn/result",
        "version": 1,
        "designs": [
            {
                "name": "a",
                "elements": 9,
                "direct": {"failed": "snaps"},
                "relaxed": solved,
                "assigned": solved,
            }
        ],
        "kit": kit.to_dict(),
        "assignment": [{"kind": "linear", "part": [0, 1], "variant": [1, 0]}],
        "steps": {"relaxed": 10, "assigned": 5},
        "equilibria": 100,
        "newton_iterations": 400,
        "wall_s": 12.5,
        "peak_memory_mb": 300.0,
        "settings": {"seed": 0},
    }


def _compas() -> dict[str, Any]:
    return {
        "dtype": "compas.datastructures/Mesh",
        "data": {
            "default_vertex_attributes": {"x": 0.0, "y": 0.0, "z": 0.0},
            "vertex": {str(k): {"x": k % 2, "y": k // 2, "z": 0.1 * k} for k in range(6)},
            "face": {"0": [0, 1, 3, 2], "1": [2, 3, 5], "2": [2, 5, 4]},
        },
    }


def _dxf() -> bytes:
    """The part of a DXF file that matters, with every kind of curve."""
    import ezdxf

    document = ezdxf.new("R12")
    space = document.modelspace()
    for y in (0, 1):
        space.add_line((-0.2, y), (2.2, y))
    space.add_polyline2d([(0, -0.2), (0.1, 0.5), (0, 1.2)])
    space.add_arc((-8, 0.5), 10, -10, 10)
    text = io.StringIO()
    document.write(text)
    whole = text.getvalue()
    return ("  0\nSECTION\n  2\n" + whole[whole.index("ENTITIES") :]).encode()


def _states() -> dict[str, np.ndarray]:
    return {
        "a/assigned/deployed/positions": np.zeros((4, 3)),
        "a/assigned/deployed/angles": np.zeros(2),
        "a/assigned/deployed/rotations": np.tile(np.eye(3), (4, 1, 1)),
    }


def _checkpoint() -> dict[str, np.ndarray]:
    from kop_exudyn.sqp.history import SQPState

    state = SQPState(np.linspace(0, 1, 6), 0.5, step=0, y=np.zeros(0), z=np.zeros(6))
    return {
        **{f"sqp/{name}": value for name, value in state.to_arrays().items()},
        "kit": np.ones(4),
        "terms": np.array(["{}", '{"fit": 1.0}']),
        "tally": np.array([3, 9]),
        "states/0/q": np.ones(6),
    }


def _mesh() -> tuple[np.ndarray, np.ndarray]:
    n = 6
    x, y = (
        a.ravel() for a in np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    )
    number = np.arange(n * n).reshape(n, n)
    a, b, c, d = (
        k.ravel() for k in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    )
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return np.stack([x, y, 0.2 * x**2 - 0.1 * y**2], axis=1), faces


def _stl(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    """Binary STL."""
    buffer = io.BytesIO(b"\0" * 80)
    buffer.seek(80)
    buffer.write(np.uint32(len(faces)).tobytes())
    for corners in vertices[faces].astype("<f4"):
        buffer.write(np.zeros(3, "<f4").tobytes() + corners.tobytes() + b"\0\0")
    return buffer.getvalue()
