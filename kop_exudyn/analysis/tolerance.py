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

from ..equilibrium.sensitivities import Sensitivities
from ..errors import InputError, SimulationFailure
from ..kit.kinds import part_kind
from ..search.objective import DesignObjective, Evaluation
from ..search.stage_results import SAME_STATE
from ..structures.base import Design
from ..structures.fitting import best_placement
from .buckling import snapped

_USUAL_SHARE, _LEAST_LENGTH = 1e-3, 2e-4  # of the median length; m
_USUAL_ANGLE = np.radians(0.1)
_STEPS_BACK = 3  # to the planned elements, which are near
CONFIRMED = 0.1  # share of the samples that Exudyn confirms


@dataclass(frozen=True)
class Tolerance:
    """Standard deviations of fabrication errors, independent from element to element.

    length : in the design's unit
    angle : rad
    """

    length: float
    angle: float

    def __post_init__(self) -> None:
        for name in ("length", "angle"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise InputError(
                    "must be a number that is not negative", field=name, value=getattr(self, name)
                )

    def scaled(self, factor: float) -> Tolerance:
        return Tolerance(factor * self.length, factor * self.angle)

    def deviations(self, design: Design) -> np.ndarray:
        """(nq,) standard deviation of every parameter; 0 for those that belong to no element."""
        found = np.zeros(len(design.parameters))
        for group in design.groups:
            found[group.indices] = self.angle if part_kind(group.kind).angular else self.length
        return found


@dataclass(frozen=True)
class Spread:
    """Displacements of the joints by fabrication errors, rigid motions taken out.

    joints : (n,) root mean square displacement of every joint, length
    diagonal : of the target's bounding box, length
    """

    joints: np.ndarray
    diagonal: float

    @property
    def rms_percent(self) -> float:
        """Root mean square over all joints, % of the bounding-box diagonal."""
        return 100 * float(np.sqrt(np.mean(self.joints**2))) / self.diagonal

    @property
    def worst_percent(self) -> float:
        """Of the joint that moves most, % of the bounding-box diagonal."""
        return 100 * float(self.joints.max()) / self.diagonal


@dataclass(frozen=True)
class Sample:
    """One set of errors, and what came of it: the joints' displacements (n, 3), or why no
    equilibrium was found.

    snapped : into another state, from which the design doesn't come back when the errors are taken
        away
    confirmed : by Exudyn, which only some samples are given to
    """

    errors: np.ndarray
    displacements: np.ndarray | None
    max_percent: float | None
    failed: str | None = None
    snapped: bool = False
    confirmed: bool = False


def joint_jacobian(design: Design, evaluation: Evaluation) -> np.ndarray:
    """(3n, nq) derivative of the fitted state's joints in the parameters, rigid motions taken
    out."""
    role = design.fitted_role.name
    equilibrium = evaluation.equilibria[role]
    J = Sensitivities(design.systems[role], equilibrium).positions(design.joints)
    motions = _rigid_motions(equilibrium.state.positions[design.joints])
    return J - motions @ (motions.T @ J)


def predicted_spread(design: Design, evaluation: Evaluation, tolerance: Tolerance) -> Spread:
    """The joints' displacements to first order: no equilibrium is solved."""
    rows = joint_jacobian(design, evaluation) * tolerance.deviations(design)
    variance = np.sum(rows.reshape(-1, 3, rows.shape[1]) ** 2, axis=(1, 2))
    return Spread(np.sqrt(variance), evaluation.fit.diagonal)


def shares_by_kind(
    design: Design, evaluation: Evaluation, tolerance: Tolerance
) -> Mapping[str, float]:
    """kind -> its share of the joints' mean square displacement, to first order; they sum to
    one."""
    rows = joint_jacobian(design, evaluation) * tolerance.deviations(design)
    by_parameter = np.sum(rows**2, axis=0)
    total = by_parameter.sum()
    found: dict[str, float] = {}
    for group in design.groups:
        share = float(by_parameter[group.indices].sum() / total) if total else 0.0
        found[group.kind] = found.get(group.kind, 0.0) + share
    return found


def sample_spread(
    design: Design,
    evaluation: Evaluation,
    tolerance: Tolerance,
    number: int,
    seed: int = 0,
    confirmed: float = CONFIRMED,
    objective: DesignObjective | None = None,
) -> list[Sample]:
    """Re-solved equilibria for `number` sets of normally distributed errors; the same errors for
    the same seed.

    confirmed : share of the samples that Exudyn has to confirm, evenly spread, the first one among
        them
    objective : the design's, where there is one already

    A set for which no equilibrium is found, or whose equilibrium Exudyn doesn't confirm, is a
    sample with its reason. What ends where its sensitivities say has not snapped; anything else has
    to come back when the errors are undone.
    """
    generator, deviations = np.random.default_rng(seed), tolerance.deviations(design)
    role = design.fitted_role.name
    objective = DesignObjective(design) if objective is None else objective
    J = joint_jacobian(design, evaluation)
    wanted = evaluation.equilibria[role].state.positions[design.joints]
    samples = []
    for k in range(number):
        errors = deviations * generator.standard_normal(len(deviations))
        try:
            found = objective.evaluate(evaluation.q + errors, evaluation)
            asked = int(np.ceil((k + 1) * confirmed)) > int(np.ceil(k * confirmed))
            if asked:
                found = objective.confirm(found)
        except SimulationFailure as failure:
            samples.append(Sample(errors, None, None, str(failure)))
            continue
        joints = found.equilibria[role].state.positions[design.joints]
        moved = (
            best_placement(joints, wanted, np.full(len(joints), 1 / len(joints))).apply(joints)
            - wanted
        )
        missed = np.linalg.norm(moved - (J @ errors).reshape(-1, 3), axis=1).max()
        away = missed > SAME_STATE * evaluation.fit.diagonal
        samples.append(
            Sample(
                errors,
                moved,
                found.fit.max_percent,
                snapped=bool(away and snapped(objective, found, evaluation, _STEPS_BACK)),
                confirmed=asked,
            )
        )
    return samples


def sampled_spread(samples: Sequence[Sample], diagonal: float) -> Spread:
    """Root mean square displacements over the samples that were found. Raises SimulationFailure
    when none was."""
    found = [sample.displacements for sample in samples if sample.displacements is not None]
    if not found:
        raise SimulationFailure("no equilibrium was found for any sample of fabrication errors")
    return Spread(np.sqrt(np.mean(np.sum(np.square(found), axis=2), axis=0)), diagonal)


def predicted_displacements(
    design: Design, evaluation: Evaluation, samples: Sequence[Sample]
) -> np.ndarray:
    """(number, n, 3) first-order displacements for the samples' own errors: the sampling's noise is
    in both."""
    J = joint_jacobian(design, evaluation)
    return np.stack([(J @ sample.errors).reshape(-1, 3) for sample in samples])


def _rigid_motions(x: np.ndarray) -> np.ndarray:
    """(3n, r) orthonormal basis of the infinitesimal rigid motions of points (n, 3); collinear
    points have fewer."""
    arms = x - x.mean(axis=0)
    size = np.abs(arms).max() or 1.0
    columns = [np.tile(axis, (len(x), 1)) for axis in np.eye(3)] + [
        np.cross(axis, arms / size) for axis in np.eye(3)
    ]
    u, s, _ = np.linalg.svd(np.stack([c.ravel() for c in columns], axis=1), full_matrices=False)
    return u[:, s > 1e-9 * s[0]]


def relative_tolerance(design: Design, share: float, angle: float) -> Tolerance:
    """Lengths uncertain by a share of the design's median length, angles by so many rad."""
    lengths = [
        design.parameters[group.indices].ravel()
        for group in design.groups
        if not part_kind(group.kind).angular
    ]
    return Tolerance(share * float(np.median(np.concatenate(lengths))) if lengths else 0.0, angle)


def usual_tolerance(design: Design) -> Tolerance:
    """What careful work keeps to: lengths within 0.1 % of the median, but not below 0.2 mm where
    the design names its units, and angles within 0.1 degrees."""
    found = relative_tolerance(design, _USUAL_SHARE, _USUAL_ANGLE)
    if design.units is None:
        return found
    return Tolerance(max(found.length, _LEAST_LENGTH / design.units.metres), found.angle)


def robustness(
    design: Design,
    evaluation: Evaluation,
    tolerance: Tolerance,
    factors: Sequence[float],
    number: int,
    seed: int = 0,
) -> dict[str, Any]:
    """What errors of several sizes do to a design, by sensitivities and by sampling; plain data.

    factors : multiples of the tolerance; number : samples for each Of each size: root mean square
    and worst joint's displacement, predicted and sampled; the fit's largest deviations; how many
    samples failed, how many snapped, and how many of them Exudyn was asked to confirm and did;
    `linear_error`, the part of the displacements that their
    own prediction misses, of the samples that kept to the state.
    """
    sizes = []
    for factor in factors:
        scaled = tolerance.scaled(factor)
        predicted = predicted_spread(design, evaluation, scaled)
        samples = sample_spread(design, evaluation, scaled, number, seed)
        found = [sample for sample in samples if sample.displacements is not None]
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
            sampled = sampled_spread(samples, evaluation.fit.diagonal)
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
        / evaluation.fit.diagonal,
        "sizes": sizes,
    }
