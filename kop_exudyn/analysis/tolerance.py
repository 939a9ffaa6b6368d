"""Fabrication errors: how far a design moves when its elements aren't exactly as long, or as
angled, as planned.

To first order the joints' displacement is J dq with J = dx/dq, seen after the best rigid placement
(an error that only turns the whole design is none). Independent errors of standard deviation s_k
then give joints of covariance P J diag(s^2) J^T P^T, with P the projection off infinitesimal rigid
motions. Sampling solves the equilibria instead.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import SimulationFailure
from ..search.evaluation import Evaluation
from ..search.tolerance import Sample, Tolerance, joint_jacobian, sample_spread
from ..structures.base import Design


@dataclass(frozen=True)
class Spread:
    """Displacements of the joints by fabrication errors, rigid motions taken out.

    joints : (n,) root mean square displacement of every joint, length
    size : of the target, length
    """

    joints: np.ndarray
    size: float

    @property
    def rms_percent(self) -> float:
        """Root mean square over all joints, % of the target's size."""
        return 100 * float(np.sqrt(np.mean(self.joints**2))) / self.size

    @property
    def worst_percent(self) -> float:
        """Of the joint that moves most, % of the target's size."""
        return 100 * float(self.joints.max()) / self.size


def predicted_spread(design: Design, evaluation: Evaluation, tolerance: Tolerance) -> Spread:
    """The joints' displacements to first order: no equilibrium is solved.

    design : as it was designed
    evaluation : of its parameters, with its states
    tolerance : standard deviations of the errors, lengths in the design's unit and angles in rad
    """
    rows = joint_jacobian(design, evaluation) * tolerance.deviations(design)
    variance = np.sum(rows.reshape(-1, 3, rows.shape[1]) ** 2, axis=(1, 2))
    return Spread(np.sqrt(variance), evaluation.fit.size)


def shares_by_kind(
    design: Design, evaluation: Evaluation, tolerance: Tolerance
) -> Mapping[str, float]:
    """kind -> its share of the joints' mean square displacement, to first order; they sum to
    one.

    design, evaluation, tolerance : as of `predicted_spread`
    """
    rows = joint_jacobian(design, evaluation) * tolerance.deviations(design)
    by_parameter = np.sum(rows**2, axis=0)
    total = by_parameter.sum()
    found: dict[str, float] = {}
    for group in design.groups:
        share = float(by_parameter[group.indices].sum() / total) if total else 0.0
        found[group.kind] = found.get(group.kind, 0.0) + share
    return found


def sampled_spread(samples: Sequence[Sample], size: float) -> Spread:
    """Root mean square displacements over the samples that were found. Raises SimulationFailure
    when none was."""
    found = [sample.displacements for sample in samples if sample.displacements is not None]
    if not found:
        raise SimulationFailure("no equilibrium was found for any sample of fabrication errors")
    return Spread(np.sqrt(np.mean(np.sum(np.square(found), axis=2), axis=0)), size)


def predicted_displacements(
    design: Design, evaluation: Evaluation, samples: Sequence[Sample]
) -> np.ndarray:
    """(number, n, 3) first-order displacements for the samples' own errors: the sampling's noise is
    in both."""
    J = joint_jacobian(design, evaluation)
    return np.stack([(J @ sample.errors).reshape(-1, 3) for sample in samples])


def robustness(
    design: Design,
    evaluation: Evaluation,
    tolerance: Tolerance,
    factors: Sequence[float],
    samples: int | Sequence[int],
    seed: int = 0,
) -> dict[str, Any]:
    """What errors of several sizes do to a design, by sensitivities and by sampling; plain data.

    factors : multiples of the tolerance
    samples : of each of them, one number for all or one each

    Of each size: root mean square and worst joint's displacement, predicted and sampled; the fit's
    largest deviations; how many samples failed, how many snapped, and how many of them Exudyn was
    asked to confirm and did; `linear_error`, the part of the displacements that their own
    prediction misses, of the samples that kept to the state.

    Raises ValueError if there are not as many numbers of samples as factors.
    """
    sizes = []
    numbers = [samples] * len(factors) if isinstance(samples, int) else samples
    for factor, number in zip(factors, numbers, strict=True):
        scaled = tolerance.scaled(factor)
        predicted = predicted_spread(design, evaluation, scaled)
        tried = sample_spread(design, evaluation, scaled, number, seed)
        found = [sample for sample in tried if sample.displacements is not None]
        entry: dict[str, Any] = {
            "factor": factor,
            "predicted_rms_percent": predicted.rms_percent,
            "predicted_worst_percent": predicted.worst_percent,
            "samples": number,
            "confirmed": sum(sample.confirmed for sample in found),
            "failed": number - len(found),
            "snapped": sum(sample.snapped for sample in found),
        }
        if found:
            sampled = sampled_spread(tried, evaluation.fit.size)
            entry |= {
                "sampled_rms_percent": sampled.rms_percent,
                "sampled_worst_percent": sampled.worst_percent,
                "max_percent": [sample.max_percent for sample in found],
            }
        kept = [sample for sample in found if not sample.snapped]
        if kept:
            moved = np.stack(
                [sample.displacements for sample in kept if sample.displacements is not None]
            )
            missed = np.linalg.norm(moved - predicted_displacements(design, evaluation, kept))
            entry["linear_error"] = float(missed / np.linalg.norm(moved))
        sizes.append(entry)
    return {
        "design": design.name,
        "elements": design.n_elements,
        "length": tolerance.length,
        "angle": tolerance.angle,
        "planned_max_percent": evaluation.fit.max_percent,
        "shares": dict(shares_by_kind(design, evaluation, tolerance)),
        "joints_percent": 100
        * predicted_spread(design, evaluation, tolerance).joints
        / evaluation.fit.size,
        "sizes": sizes,
    }
