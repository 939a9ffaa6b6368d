"""How far a built design is from its target: its joints, and the pieces between them.

Joints may all lie on the target while the corners between them stand off it: what is built is both.
Distances are from the target's surface, at the placement in space for which the largest one of the
joints is least. They are given in the design's unit of length and in percent of the target's size.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..scene.state import State
from .base import Design, Target
from .fitting import FitResult

OFF_TARGET = 1.0  # %: inputs that deviate more than this blame the kit


@dataclass(frozen=True)
class Deviation:
    """Distances from the target's surface, in the design's unit of length.

    joints (n,) : of the joints
    pieces (m,) : of all points that the rods are followed at, corners and joints included; the
        joints alone for designs whose rods lie beside the target
    size : of the target
    """

    joints: np.ndarray
    pieces: np.ndarray
    size: float

    def to_dict(self) -> dict[str, float]:
        """Largest and mean distances, in units of length and in % of the size, as results have
        them."""
        found = {"max": self.joints.max(), "mean": self.joints.mean()}
        found |= {"pieces_max": self.pieces.max(), "pieces_mean": self.pieces.mean()}
        percent = {f"{name}_percent": 100 * d / self.size for name, d in found.items()}
        return {name: float(value) for name, value in (percent | found).items()}


def deviation(design: Design, target: Target, fit: FitResult, state: State) -> Deviation:
    """The deviation of a design's fitted state.

    fit : of its joints, which says where it is placed
    """
    distances = fit.distances
    if not design.beside_target:
        closest = target.surface.closest(fit.placement.apply(rod_points(design, state)))
        distances = np.concatenate([distances, np.sqrt(closest.squared_distances)])
    return Deviation(fit.distances, distances, fit.size)


def rod_points(design: Design, state: State) -> np.ndarray:
    """(m, 3) ends of all elements of a design's rods in its fitted state."""
    scene = design.scene(design.fitted_role.name)
    nodes = np.unique(np.concatenate([chain.nodes for chain in scene.chains]))
    return scene.node_poses(state)[0][nodes]


def fit_summary(design: Design, target: Target, fit: FitResult, state: State) -> Mapping[str, Any]:
    """The field "fit" of results, see `Deviation.to_dict`."""
    return deviation(design, target, fit, state).to_dict()
