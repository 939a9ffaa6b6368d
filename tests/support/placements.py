"""Design files' contents moved by many of their sizes, and turned."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from kop_exudyn.structures.fitting import Placement


def placed(data: dict[str, Any], sizes: float, seed: int) -> tuple[dict, Placement, float]:
    """The content of a design file moved by so many of its sizes, turned at random; the motion, and
    the size. Turned are C-shells in their plane, umbrella meshes' bases in theirs and their targets
    in space."""
    data, rng = copy.deepcopy(data), np.random.default_rng(seed)
    if data["class"] == "c_shell":
        size = _size(np.concatenate([c["points"] for c in data["curves"]]))
        motion = _motion(rng, sizes * size, flat=True)
        for curve in data["curves"]:
            curve["points"] = _applied(motion, curve["points"])
    else:
        size = _size(np.array(data["target"]["vertices"]))
        motion = _motion(rng, sizes * size)
        for name in ("vertices", "crossings", "plates"):
            data["target"][name] = _applied(motion, data["target"][name])
        base = data["base"]
        own = _motion(rng, sizes * _size(np.array(base["vertices"])), flat=True)
        base["vertices"] = _applied(own, base["vertices"])
    return data, motion, size


def _size(points: np.ndarray) -> float:
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _motion(rng: np.random.Generator, distance: float, flat: bool = False) -> Placement:
    way = rng.normal(size=3) * [1.0, 1.0, 0.0 if flat else 1.0]
    turn = Rotation.from_rotvec([0, 0, rng.uniform(-3, 3)]) if flat else Rotation.random(rng=rng)
    return Placement(turn.as_matrix(), distance * way / np.linalg.norm(way))


def _applied(motion: Placement, points: Any) -> list:
    points = np.array(points, float)
    k = points.shape[1]
    return motion.apply(np.pad(points, ((0, 0), (0, 3 - k))))[:, :k].tolist()
