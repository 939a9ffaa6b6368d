"""Reads the content of released umbrella-mesh files, which list every joint and rod of the compact
state.

The data are those of the repository UmbrellaMesh_release_v1 of EPFL's Geometric Computing
Laboratory. Lengths are divided by `bbox_diagonal` (mm), or in mm where the file has no such field.
Joints are labelled OT, OB (plate centres),
PT, PB (plate edges), AAM (X joints); rods PT, PB (plate rods) and TA, ANB (arms).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...errors import InputError
from ...geometry.centring import middle_of, moved
from ...geometry.extent import size_of_points
from .mesh import BOTTOM, TOP, UmbrellaMesh, UmbrellaRods, UmbrellaTarget, arm_lengths

_MAX_ITEMS = 2_000_000
_CENTRES, _EDGES, _CROSSING = ("OT", "OB"), ("PT", "PB"), "AAM"
_PLATE_RODS, _ARMS = ("PT", "PB"), ("TA", "ANB")
# Sizes in mm of the files that don't carry them.
_THICKNESS, _WIDTH, _PLATE_EDGE = 3.0, 5.0, 30.0
_TOLERANCE = 1e-6
REQUIRED = frozenset(
    (
        "vertices",
        "v_labels",
        "uid",
        "ghost_bisectors",
        "ghost_normals",
        "A_segments",
        "B_segments",
        "midpoint_offsets_A",
        "midpoint_offsets_B",
        "edges",
        "e_labels",
        "segment_normals",
        "base_mesh_f",
    )
)
_LIKE_A_RELEASE = 8  # of these fields: files that lack some of the others are damaged releases


def is_release(data: Any) -> bool:
    """Whether a file's content looks like a released umbrella mesh, perhaps with fields missing."""
    return (
        isinstance(data, Mapping)
        and not data.keys() & {"class", "format"}
        and len(data.keys() & REQUIRED) >= _LIKE_A_RELEASE
    )


def centred_release(data: Mapping[str, Any]) -> tuple[Mapping[str, Any], np.ndarray]:
    """A released file's content with the mesh and the target each seen from its own middle, and the
    target's middle (3,), without one the mesh's; see `geometry.centring`."""
    mesh = middle_of(data.get("vertices"), "vertices")
    target = middle_of(data["target_v"], "target_v") if "target_v" in data else mesh
    own = {"vertices": mesh}
    if "target_v" in data:
        own |= dict.fromkeys(("target_v", "correspondence", "plate_correspondence"), target)
    try:
        changed = {
            name: moved(data[name], middle)
            for name, middle in own.items()
            if name in data and middle.any()
        }
    except (TypeError, ValueError):  # not points at all: refused where they are read
        return data, np.zeros(3)
    return {**data, **changed}, target


def release_mesh(data: Mapping[str, Any], source: str = "umbrella mesh") -> UmbrellaMesh:
    """The mesh that a released file's content describes, in the file's own unit of length.

    Raises InputError naming the field that is missing or wrong.
    """
    missing = sorted(REQUIRED - data.keys()) if isinstance(data, Mapping) else sorted(REQUIRED)
    if missing:
        raise InputError(
            "is missing in this released umbrella mesh", source=source, field=missing[0]
        )
    read = _Fields(data, source)
    unit = read.number("bbox_diagonal", 1.0)
    positions = read.array("vertices", (None, 3))
    n = len(positions)
    labels = read.labels("v_labels", n, (*_CENTRES, *_EDGES, _CROSSING))
    n_cells = len(read.array("base_mesh_f", (None, 3), int))
    own = _own_cells(read, n, n_cells)
    rods, hinged = _rods(read, labels, own, n)
    arms = rods.arms
    lengths = arm_lengths(
        rods.joints[arms],
        rods.offsets[arms],
        positions,
        rods.cells[arms],
        rods.sides[arms],
        n_cells,
        _TOLERANCE,
        source,
    )
    crossings = np.flatnonzero(labels == _CROSSING)
    thickness = read.number("thickness", _THICKNESS / unit)
    return UmbrellaMesh(
        positions=positions,
        frames=_frames(read, n),
        hinged=hinged,
        rods=rods,
        centres=_centres(read, labels, own, n_cells),
        crossings=crossings,
        lengths=lengths,
        thickness=thickness,
        width=read.number("width", _WIDTH / unit),
        plate_edge=read.number("plate_edge_length", _PLATE_EDGE / unit),
        spacing=read.number("target_spacing_factor", 5.0) * thickness,
        size=1.0 if "bbox_diagonal" in data else size_of_points(positions),
        target=_target(read, crossings, n, n_cells),
        unit=unit,
    )


def _frames(read: _Fields, n: int) -> np.ndarray:
    """Joint axes (n, 3, 3): bisector, normal x bisector, normal."""
    bisectors, normals = read.array("ghost_bisectors", (n, 3)), read.array("ghost_normals", (n, 3))
    frames = np.stack([bisectors, np.cross(normals, bisectors), normals], axis=2)
    error = np.abs(np.swapaxes(frames, 1, 2) @ frames - np.eye(3)).max(axis=(1, 2))
    if error.max() > _TOLERANCE:
        raise read.error(
            f"ghost_normals[{int(error.argmax())}]",
            "bisector and normal are not orthogonal unit vectors",
        )
    return frames


def _own_cells(read: _Fields, n: int, n_cells: int) -> np.ndarray:
    """(n,) the cell that each joint is listed under first."""
    uid = read.listed("uid", n)
    own = np.empty(n, int)
    for k, entry in enumerate(uid):
        cells = entry if isinstance(entry, list) else [entry]
        good = cells and all(
            isinstance(c, int) and not isinstance(c, bool) and -1 <= c < n_cells for c in cells
        )
        if not good or cells[0] < 0:
            raise read.error(f"uid[{k}]", f"expected cells below {n_cells}", entry)
        own[k] = cells[0]
    return own


def _centres(read: _Fields, labels: np.ndarray, own: np.ndarray, n_cells: int) -> np.ndarray:
    """(n_cells, 2) centre joints of the top and the bottom plates."""
    centres = np.full((n_cells, 2), -1)
    for side, label in enumerate(_CENTRES):
        joints = np.flatnonzero(labels == label)
        centres[own[joints], side] = joints
        if len(joints) != n_cells or (centres[:, side] < 0).any():
            raise read.error("v_labels", f"expected one joint {label} a cell", len(joints))
    return centres


def _rods(
    read: _Fields, labels: np.ndarray, own: np.ndarray, n: int
) -> tuple[UmbrellaRods, np.ndarray]:
    """All rods, and which joints (n,) have both sides."""
    joints = read.array("edges", (None, 2), int, upper=n)
    m = len(joints)
    kinds = read.labels("e_labels", m, (*_PLATE_RODS, *_ARMS))
    arms = np.isin(kinds, _ARMS)
    behind, offsets, seen = np.zeros((m, 2), bool), np.zeros((m, 2, 3)), np.zeros((m, 2), int)
    has = np.zeros((n, 2), bool)
    for side, letter in enumerate("AB"):
        listed, shifts = (
            read.listed(f"{letter}_segments", n),
            read.listed(f"midpoint_offsets_{letter}", n),
        )
        for k in range(n):
            where = f"{letter}_segments[{k}]"
            own_rods = read.values(listed[k], (None,), int, where, upper=m)
            shift = read.values(
                shifts[k], (len(own_rods), 3), float, f"midpoint_offsets_{letter}[{k}]"
            )
            for rod, offset in zip(own_rods, shift):
                ends = np.flatnonzero(joints[rod] == k)
                if len(ends) != 1:
                    raise read.error(where, "names a rod that doesn't end at this joint", int(rod))
                behind[rod, ends[0]], offsets[rod, ends[0]] = side == 1, offset
                seen[rod, ends[0]] += 1
                has[k, side] = True
    if (seen != 1).any():
        raise read.error(
            f"edges[{int(np.argwhere(seen != 1)[0, 0])}]",
            "each end must belong to one side of its joint",
        )
    normals = read.array("segment_normals", (m, 3))
    if np.abs(np.linalg.norm(normals, axis=1) - 1).max() > _TOLERANCE:
        raise read.error("segment_normals", "expected unit vectors")
    plate_end = np.where(
        np.isin(labels[joints[:, 0]], (*_EDGES, *_CENTRES)), joints[:, 0], joints[:, 1]
    )
    on_edge = np.isin(labels[joints], _EDGES).sum(axis=1)
    partner = np.where(
        arms,
        (labels[joints] == _CROSSING).sum(axis=1),
        np.isin(labels[joints], _CENTRES).sum(axis=1),
    )
    if ((on_edge != 1) | (partner != 1)).any():
        rod = int(((on_edge != 1) | (partner != 1)).argmax())
        raise read.error(
            f"edges[{rod}]",
            "an arm joins a plate edge and an X joint, a plate rod an edge and a centre",
        )
    sides = np.where(np.char.endswith(labels[plate_end].astype(str), "T"), TOP, BOTTOM)
    rods = UmbrellaRods(joints, behind, offsets, normals, own[plate_end], sides, arms)
    turning = has.all(axis=1) & ~np.isin(labels, _CENTRES)
    return rods, turning


def _target(read: _Fields, crossings: np.ndarray, n: int, n_cells: int) -> UmbrellaTarget | None:
    """The target, or None in the files that have none; places that a file doesn't give are NaN."""
    if not {"target_v", "target_f"} <= read.data.keys():
        return None
    vertices = read.array("target_v", (None, 3))
    points, plates = np.full((len(crossings), 3), np.nan), np.full((n_cells, 3), np.nan)
    if "correspondence" in read.data:
        listed = read.listed("correspondence", n)
        for row, k in enumerate(crossings):
            if listed[k] is not None:
                points[row] = read.values(listed[k], (3,), float, f"correspondence[{k}]")
    if "plate_correspondence" in read.data:
        plates = read.array("plate_correspondence", (n_cells, 3))
    return UmbrellaTarget(
        vertices=vertices,
        faces=read.array("target_f", (None, 3), int, upper=len(vertices)),
        crossings=points,
        plates=plates,
    )


class _Fields:
    """Checked access to a file's fields."""

    def __init__(self, data: Mapping[str, Any], source: str):
        self.data, self.source = data, source

    def error(self, field: str, message: str, value: Any = None) -> InputError:
        return InputError(message, source=self.source, field=field, value=value)

    def number(self, field: str, default: float | None = None) -> float:
        value = self.data.get(field, default)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 < value < np.inf:
            raise self.error(field, "must be a positive number", value)
        return float(value)

    def listed(self, field: str, n: int) -> list[Any]:
        value = self.data[field]
        if not isinstance(value, list) or len(value) != n:
            raise self.error(field, f"expected a list of {n} entries")
        return value

    def labels(self, field: str, n: int, known: tuple[str, ...]) -> np.ndarray:
        values = self.listed(field, n)
        for k, value in enumerate(values):
            if value not in known:
                raise self.error(
                    f"{field}[{k}]", f"unknown label (known: {', '.join(known)})", value
                )
        return np.array(values)

    def array(
        self,
        field: str,
        shape: tuple[int | None, ...],
        kind: type = float,
        upper: int | None = None,
    ) -> np.ndarray:
        return self.values(self.data[field], shape, kind, field, upper)

    def values(
        self,
        given: Any,
        shape: tuple[int | None, ...],
        kind: type,
        field: str,
        upper: int | None = None,
    ) -> np.ndarray:
        """A finite array of the shape (None: any length); integers must be indices below upper."""
        if isinstance(given, list) and not given and shape[0] in (None, 0):
            return np.zeros((0, *(s or 0 for s in shape[1:])), kind)
        try:
            array = np.array(given)
        except ValueError:
            raise self.error(field, "rows of different lengths") from None
        fits = array.ndim == len(shape) and all(s in (None, k) for s, k in zip(shape, array.shape))
        if (
            not fits
            or array.size > _MAX_ITEMS
            or array.dtype.kind not in ("i" if kind is int else "if")
        ):
            raise self.error(field, f"expected numbers of shape {shape}".replace("None", "n"))
        if not np.isfinite(array).all():
            raise self.error(field, "numbers must be finite")
        if (
            kind is int
            and upper is not None
            and array.size
            and not (array.min() >= 0 and array.max() < upper)
        ):
            raise self.error(field, f"expected indices below {upper}", int(array.max()))
        return array.astype(kind)
