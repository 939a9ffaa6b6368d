"""Errors of the workshop: elements that aren't exactly as long, or as angled, as planned, and what
becomes of a design that is built of them.

Sets of errors are drawn at random, and the equilibria solved for each. What ends where the
sensitivities say has only been deformed; anything else has to come back when the errors are undone,
or it has snapped.

Two predictions say it before anything is led back: from the state as planned, and from the one
found, back. Where one branch leads from the one to the other, each misses its end by half the
branch's curvature, to opposite sides, and their mean is right to the third order (as of the
trapezoidal rule). In the mean of what they miss, another branch does not come out near zero.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..checks import check_kind, check_not_negative, check_whole
from ..equilibrium.equilibria import Equilibrium
from ..equilibrium.sensitivities import Sensitivities
from ..errors import SimulationFailure
from ..kit.kinds import part_kind
from ..scene.state import State
from ..structures.base import Design
from ..structures.fitting import best_placement
from ..structures.opening import SAME_STATE
from .buckling import snapped
from .evaluation import Evaluation
from .objective import DesignObjective

_USUAL_SHARE, _LEAST_LENGTH = 1e-3, 2e-4  # of the median length; m
_USUAL_ANGLE = np.radians(0.1)
# to the planned elements, which are near: more only where one doesn't end at the origin
_STEPS_BACK = (1, 3)
CONFIRMED = 0.1  # share of the samples that Exudyn confirms
_SEARCH = (0, 1)  # seed of the errors that a search tries
_REMEMBERED = 8  # states that are asked for again, of each design


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
            check_not_negative(name, getattr(self, name))

    def scaled(self, factor: float) -> Tolerance:
        return Tolerance(factor * self.length, factor * self.angle)

    def deviations(self, design: Design) -> np.ndarray:
        """(nq,) standard deviation of every parameter; 0 for those that belong to no element."""
        found = np.zeros(len(design.parameters))
        for group in design.groups:
            found[group.indices] = self.angle if part_kind(group.kind).angular else self.length
        return found


@dataclass(frozen=True)
class Sample:
    """One set of errors, and what came of it.

    errors : (nq,) of the parameters, lengths in the design's unit and angles in rad
    displacements : (n, 3) of the joints, in the design's unit; None where nothing was found
    failed : why no equilibrium was found, or None
    max_percent : largest deviation where it is placed best, % of the size; None where that wasn't
        asked for or nothing was found
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

    @property
    def lost(self) -> bool:
        """Whether the design isn't in its shape."""
        return self.snapped or self.failed is not None


def joint_jacobian(design: Design, evaluation: Evaluation) -> np.ndarray:
    """(3n, nq) derivative of the fitted state's joints in the parameters, rigid motions taken
    out."""
    role = design.fitted_role.name
    equilibrium = evaluation.equilibria[role]
    J = Sensitivities(design.systems[role], equilibrium).positions(design.joints)
    motions = _rigid_motions(equilibrium.state.positions[design.joints])
    return J - motions @ (motions.T @ J)


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

    design : as it was designed
    evaluation : of its parameters, with its states, which the samples begin from
    tolerance : standard deviations of the errors, lengths in the design's unit and angles in rad
    number : of samples; seed : of their errors
    confirmed : share of the samples that Exudyn has to confirm, evenly spread, the first one among
        them
    objective : the design's, where there is one already

    A set for which no equilibrium is found, or whose equilibrium Exudyn doesn't confirm, is a
    sample with its reason. What ends where its sensitivities say has not snapped; anything else has
    to come back when the errors are undone.
    """
    check_kind("design", design, Design, "see load_design")
    check_kind("evaluation", evaluation, Evaluation)
    check_kind("tolerance", tolerance, Tolerance)
    check_whole("number", number)
    check_whole("seed", seed)
    objective = DesignObjective(design) if objective is None else objective
    sets = _sets(design, tolerance, number, np.random.default_rng(seed))
    return list(_samples(objective, evaluation, sets, confirmed))


def forgives(
    objective: DesignObjective, evaluation: Evaluation, besides: Sequence[np.ndarray] = ()
) -> bool:
    """Whether none of the sets of errors that the objective's requirements name makes a design
    snap. They are other sets than those that `sample_spread` draws for a verdict.

    objective : of the design, with the requirements
    evaluation : of the design's parameters, with its states
    besides : sets of errors (nq,) that are tried first
    """
    state = evaluation.equilibria[objective.design.fitted_role.name]
    also = b"".join(errors.tobytes() for errors in besides)
    key = (evaluation.q.tobytes(), f"{state.elastic_energy:.6e}", also)
    if key in objective.forgiven:
        return objective.forgiven[key]
    told = _forgives(objective, evaluation, [*besides, *_required_sets(objective)])
    while len(objective.forgiven) >= _REMEMBERED:
        objective.forgiven.pop(next(iter(objective.forgiven)))
    objective.forgiven[key] = told
    return told


def _forgives(
    objective: DesignObjective, evaluation: Evaluation, sets: Sequence[np.ndarray]
) -> bool:
    # that which made it snap last is the likeliest to do so again, a little further on
    order = sorted(range(len(sets)), key=lambda k: k != objective.last_snapped)
    samples = _samples(objective, evaluation, [sets[k] for k in order], 0.0, placed=False)
    for k, sample in zip(order, samples):
        if sample.lost:
            objective.last_snapped = k
            return False
    return True


def unforgiven(objective: DesignObjective, evaluation: Evaluation) -> list[np.ndarray]:
    """Those of the required sets of errors (nq,) that make a design snap, see `forgives`; all of
    them where nothing can be predicted from its state."""
    sets = _required_sets(objective)
    try:
        samples = list(_samples(objective, evaluation, sets, 0.0, placed=False))
    except SimulationFailure:
        return sets
    return [sample.errors for sample in samples if sample.lost]


def _required_sets(objective: DesignObjective) -> list[np.ndarray]:
    """The sets of errors that an objective's requirements name, the same for the same design."""
    required, design = objective.requirements, objective.design
    usual = usual_tolerance(design)
    tolerance = Tolerance(
        usual.length if required.length is None else required.length,
        usual.angle if required.angle is None else required.angle,
    ).scaled(required.margin)
    generator = np.random.default_rng([*_SEARCH, required.seed])
    return _sets(design, tolerance, required.samples, generator)


def _sets(
    design: Design, tolerance: Tolerance, number: int, generator: np.random.Generator
) -> list[np.ndarray]:
    """Sets of errors (nq,) of the parameters, drawn one after the other."""
    deviations = tolerance.deviations(design)
    return [deviations * generator.standard_normal(len(deviations)) for _ in range(number)]


def _samples(
    objective: DesignObjective,
    evaluation: Evaluation,
    sets: Sequence[np.ndarray],
    confirmed: float,
    placed: bool = True,
) -> Iterator[Sample]:
    """What comes of each set of errors, solved when it is asked for.

    placed : whether it is asked how far off they are
    """
    design, name = objective.design, objective.design.fitted_role.name
    # all at once: the factorisation is needed again for every one that is predicted later
    near = Sensitivities(design.systems[name], evaluation.equilibria[name])
    starts = [near.predict(errors) for errors in sets]
    wanted = evaluation.equilibria[name].state.positions[design.joints]
    for k, (errors, start) in enumerate(zip(sets, starts)):
        asked = int(np.ceil((k + 1) * confirmed)) > int(np.ceil(k * confirmed))
        try:
            q = evaluation.q + errors
            if asked:
                found = objective.confirm(objective.evaluate(q, evaluation)).equilibria[name]
            else:
                found = objective.fitted_at(q, evaluation, start)
        except SimulationFailure as failure:
            yield Sample(errors, None, None, str(failure))
            continue
        moved = _moved(design, found.state, wanted)
        missed = moved - _moved(design, start.state, wanted)
        yield Sample(
            errors,
            moved,
            objective.deviation_near(found.state, evaluation) if placed else None,
            snapped=_snapped(objective, found, evaluation, missed),
            confirmed=asked,
        )


def _snapped(
    objective: DesignObjective, found: Equilibrium, origin: Evaluation, missed: np.ndarray
) -> bool:
    """Whether a state has left the branch of its origin.

    missed : (n, 3) by how much the prediction from the origin misses the joints
    """
    design, name = objective.design, objective.design.fitted_role.name
    allowed = SAME_STATE * origin.fit.size
    if _largest(missed) <= allowed:
        return False
    there = Sensitivities(design.systems[name], found)
    back = there.predict(origin.q - found.q).state
    wanted = origin.equilibria[name].state.positions[design.joints]
    if _largest(0.5 * (missed + _moved(design, back, wanted))) <= allowed:
        return False
    state = objective.judge(found.q, {**origin.equilibria, name: found})
    return all(snapped(objective, state, origin, steps) for steps in _STEPS_BACK)


def _moved(design: Design, state: State, wanted: np.ndarray) -> np.ndarray:
    """(n, 3) how far a state's joints are from where they are wanted, at the best placement."""
    joints = state.positions[design.joints]
    return best_placement(joints, wanted).apply(joints) - wanted


def _largest(vectors: np.ndarray) -> float:
    return float(np.linalg.norm(vectors, axis=1).max())


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
