"""The straight path from relaxed elements to their parts, with all that is seen on it: snaps,
energies, deviations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kop_exudyn.errors import SimulationFailure
from kop_exudyn.search.dataset import Dataset
from kop_exudyn.search.evaluation import Evaluation
from kop_exudyn.search.stage_results import Jump, StageResult, find_jump
from kop_exudyn.structures.base import Design


@dataclass(frozen=True)
class WatchedPath:
    """One design on its way.

    start : relaxed; states : (steps,) after equal steps, the last one at the parts
    moves_percent : (steps,) how far the joint that moves most goes in each step, % of the
        size of the target
    energies : (steps + 1,) elastic, relative to the input design's, the start's first
    deviations_percent : (steps + 1,) largest distance of a joint from the target, % of its size
    jump : the snap, or None
    """

    start: Evaluation
    states: Sequence[Evaluation]
    moves_percent: np.ndarray
    energies: np.ndarray
    deviations_percent: np.ndarray
    jump: Jump | None


def watch(
    dataset: Dataset, relaxed: StageResult, steps: int
) -> list[WatchedPath | SimulationFailure]:
    """Follow every design of a relaxed result to its parts; one that fails on the way comes back as
    its failure."""
    q = relaxed.assignment.matrix(relaxed.kit) @ relaxed.kit.vector
    q[dataset.free] = np.concatenate([e.q for e in relaxed.evaluations])[dataset.free]
    paths = dataset.follow(q, relaxed.evaluations, steps)
    return [
        path if isinstance(path, SimulationFailure) else _watched(design, reference, start, path)
        for design, reference, start, path in zip(
            dataset.designs, dataset.references, relaxed.evaluations, paths
        )
    ]


def _watched(
    design: Design, reference, start: Evaluation, path: Sequence[Evaluation]
) -> WatchedPath:
    role, size = design.fitted_role.name, reference.target.size
    every = [start, *path]
    joints = np.stack([e.equilibria[role].state.positions[design.joints] for e in every])
    moves = np.linalg.norm(np.diff(joints, axis=0), axis=2).max(axis=1)
    energies = np.array([e.equilibria[role].elastic_energy for e in every]) / reference.energy
    return WatchedPath(
        start,
        list(path),
        100 * moves / size,
        energies,
        np.array([e.fit.max_percent for e in every]),
        find_jump(design, start, path, size),
    )
