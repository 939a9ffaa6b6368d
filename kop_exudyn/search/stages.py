"""The stages of finding a kit: direct, unrelaxed, relaxed and assigned, and what they demand of
designs."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace

import numpy as np

from ..errors import InputError, SimulationFailure
from ..kit.kinds import part_kind
from ..kit.part_costs import PartCosts
from ..kit.parts import Assignment, Kit
from ..kit.projection import Projection
from ..kit.reuse import PieceCount
from ..kit.stock import Stock
from ..sqp.constraints import check_feasible
from ..sqp.options import SQPOptions, SQPResult
from ..sqp.qp import QPOptions
from .checkpoints import NoStore, Store, minimise_kept
from .dataset import Dataset, all_or_raise
from .evaluation import Evaluation
from .events import ASSIGNED, Observer, SQPLabel, Stage
from .kit_rule import rule_of
from .problems import AssignedProblem, RelaxedProblem
from .requirements import Requirements
from .settings import StageSettings
from .stage_results import Jump, StageResult, find_jump, restrict
from .weights import Weights

log = logging.getLogger(__name__)

# of the parts' sizes: where designs only open if steps are shorter than that, there is none
_SHORTEST = 1e-5
_TRIALS = 4  # of such a step, each a quarter as long as the last one, and each costs a few seconds
_MORE = 4  # times the sets of errors, where more are asked for
_AT_A_STEP = 100  # of them, of all designs together
_PROOF_MARGIN = (
    1.25  # how much larger than a workshop's are the errors that prove a result, at most
)
_SURE = 10  # times the sets of errors, as large as a workshop's, of which none may make it snap


class Stages:
    """Runs the stages for one dataset; interrupted SQPs go on from the store's checkpoints.

    parts : kind -> number of parts of a kit that is sought, or a kit or a stock that is given
    """

    def __init__(
        self,
        dataset: Dataset,
        parts: Mapping[str, int] | Kit | Stock,
        settings: StageSettings = StageSettings(),
        store: Store | None = None,
        observer: Observer | None = None,
    ):
        weights = dataset.weights
        self.schedule = settings.schedule or tuple(
            k * (weights.fit or weights.energy) for k in (0.1, 1.0, 10.0, 100.0)
        )
        # the search may pass through states that are led to; what it returns opens
        self.required = settings.requirements
        self.dataset = dataset.requiring(replace(self.required, opening=False, samples=0))
        self.settings = settings
        self.rule = rule_of(parts, dataset.group_designs)
        self.store, self.observer = store or NoStore(), observer or (lambda event: None)
        self.q0 = dataset.parameters
        self.costs = PartCosts.of(
            dataset.groups, self.q0, settings.slit_cost * (weights.fit or weights.energy)
        )
        self.projection = Projection.of_inputs(
            dataset.groups,
            self.q0,
            bounds=settings.bounds,
            penalties=self.costs.at_weight(self.schedule[0]),
        )

    def direct(self) -> StageResult:
        """Cluster the inputs (or take the given kit), replace every element by its part."""
        kit, assignment = self.rule.first(
            self.dataset.groups, self.q0, self.projection, self.settings
        )
        return self.confirmed(self.built_from(self.limited(kit), assignment, self.inputs()))

    @property
    def optimises(self) -> bool:
        """Whether the assigned stage has variables: parts, or elements that slide in given ones."""
        return self.rule.parts_move or len(self.dataset.sliding) > 0

    def inputs(self) -> list[Evaluation]:
        """The input designs, judged by the objective."""
        calls = {
            n: (d.parameters, dict(r.equilibria))
            for n, (d, r) in enumerate(zip(self.dataset.designs, self.dataset.references))
        }
        return all_or_raise(list(self.dataset.judge(calls).values()))

    def relaxed(
        self,
        kit: Kit,
        start: Sequence[Evaluation] | None = None,
    ) -> StageResult:
        """Minimise over all elements, w_c raised until the clusters are tight; from the inputs or
        given evaluations."""
        settings, evaluations = self.settings, list(start or self.inputs())
        steps, q = 0, np.concatenate([e.q for e in evaluations])
        for weight in self.schedule:
            result, problem = self.relaxed_at(f"relaxed-{weight:g}", weight, q, evaluations, kit)
            q, evaluations, kit = result.x, result.point.data.evaluations, result.point.data.kit
            steps += result.steps
            if (
                max(problem.projection.tightness(q, kit, result.point.data.assignment).values())
                <= settings.tight
            ):
                break
        data = result.point.data
        return StageResult(
            list(evaluations), kit, data.assignment, steps, result.point.value, result.status
        )

    def assigned(
        self,
        start: StageResult,
        label: SQPLabel = ASSIGNED,
        max_steps: int | None = None,
        tolerance: float | None = None,
    ) -> StageResult:
        """Minimise over the parts from a state in which every element is its part; designs that
        failed stay out. Not confirmed yet: that is for what the rounds leave.

        label : of the SQP; one of its own for every call
        max_steps, tolerance : default: the settings' `assigned_steps` and `assigned_tolerance`
        """
        members = [n for n, e in enumerate(start.designs) if isinstance(e, Evaluation)]
        if not members:
            return replace(start, status="no design could be built from the kit", jumps=[])
        problem = self.assigned_problem(start, members)
        try:
            check_feasible(problem.lower, problem.upper, problem.constraints)
        except InputError as error:
            log.warning(
                "%s: the elements' constraints can't be met by these parts: %s", label.name, error
            )
            return replace(start, status="the constraints can't be met by these parts", jumps=[])
        evaluations = [e for e in start.designs if isinstance(e, Evaluation)]
        point = problem.point(
            problem.variables(np.concatenate([e.q for e in evaluations])), evaluations
        )
        secured = self.dataset.requirements.opening
        options = SQPOptions(
            hessian=self.settings.hessian,
            secant=True,
            max_steps=max_steps or self.settings.assigned_steps,
            decrease_tolerance=tolerance or self.settings.assigned_tolerance,
            penalty=self.dataset.penalty,
            min_radius=_SHORTEST if secured else SQPOptions.min_radius,
            max_trials=_TRIALS if secured else SQPOptions.max_trials,
            qp=QPOptions(interior_point=len(problem.sliding) > 0),
        )
        result = minimise_kept(label, problem, point, options, self.store, self.observer)
        designs = list(start.designs)
        for n, evaluation in zip(members, result.point.data.evaluations):
            designs[n] = evaluation
        found = self._result(
            designs, result.point.data.kit, start.assignment, result.steps, result.status
        )
        return replace(found, pressure=_pressure(result), blocked=_blocked(result))

    def assigned_problem(self, start: StageResult, members: Sequence[int]) -> AssignedProblem:
        """The problem over the parts, for some of the designs."""
        constraints = self.settings.constraints
        if constraints is not None and len(members) < len(self.dataset.designs):
            offsets = self.dataset.offsets
            constraints = constraints.among(
                np.concatenate([np.arange(offsets[n], offsets[n + 1]) for n in members])
            )
        return AssignedProblem(
            self.dataset.subset(members),
            start.kit,
            restrict(start.assignment, self.dataset, members),
            self.settings.bounds,
            constraints,
            self.rule.stock,
            self.costs,
            self.rule.parts_move,
        )

    def built_from(
        self,
        kit: Kit,
        assignment: Assignment,
        start: Sequence[Evaluation],
        free: np.ndarray | None = None,
        path_steps: int | None = None,
        watched: bool = True,
    ) -> StageResult:
        """All designs followed from evaluations to the parts of another kit or assignment; not
        confirmed yet.

        free : (k,) new values of the parameters of no element; default: they stay
        path_steps : default: the settings'
        watched : for snaps, in all these steps; else in as few of them as lead there
        """
        designs, jumps = self._to_parts(start, kit, assignment, free, path_steps, watched)
        return self._result(designs, kit, assignment, jumps=jumps)

    def judged(self, result: StageResult) -> StageResult:
        """The same result with the objective of its designs, and the cost of exceeded bounds."""
        value, penalty = self._value(result.designs, result.kit)
        return replace(
            result,
            value=value,
            penalty=penalty,
            reuse_factor=self._reuse_factor(result.kit, result.assignment),
        )

    def opened(self, result: StageResult) -> StageResult:
        """The same result with every design in the state that it opens into by itself; not
        confirmed yet.

        A design for which no such state is found keeps the one it is in.
        """
        found = {
            n: d for n, d in enumerate(result.designs) if isinstance(d, Evaluation) and not d.way
        }
        designs = list(result.designs)
        for n, evaluation in self.dataset.open(found).items():
            if isinstance(evaluation, SimulationFailure):
                log.info("%s", evaluation)
            else:
                designs[n] = evaluation
        return self.judged(replace(result, designs=designs))

    def confirmed(self, result: StageResult) -> StageResult:
        """The same result at Exudyn's own solutions; a design that Exudyn doesn't confirm becomes a
        failure."""
        found = {n: d for n, d in enumerate(result.designs) if isinstance(d, Evaluation)}
        designs = list(result.designs)
        for n, evaluation in self.dataset.confirm(found).items():
            designs[n] = evaluation
        return self.judged(replace(result, designs=designs))

    def kept(self, result: StageResult) -> StageResult:
        """A result that the search goes on from: opened where the stages are secured."""
        return self.opened(result) if self.dataset.requirements.opening else result

    def best_confirmed(self, *results: StageResult) -> StageResult:
        """The first of these results whose designs Exudyn confirms; the first one, with its
        failures, where there is none."""
        found = [self.confirmed(results[0])]
        for result in results[1:]:
            if found[-1].value is not None:
                break
            found.append(self.confirmed(result))
        return found[-1] if found[-1].value is not None else found[0]

    def secured(self, forgiving: bool = False, but: Sequence[int] = ()) -> Stages:
        """The same stages with designs kept on the branch along which they open: reassigned ones
        are judged where they open into, and steps that leave the branch are refused.

        forgiving : steps to where errors of the workshop make a design snap are refused as well
        but : designs that may snap nevertheless, as they do already
        """
        other = copy(self)
        samples = self.required.samples if forgiving else 0
        exempt = frozenset(self.dataset.numbers[n] for n in but)
        required = replace(self.required, samples=samples)
        other.dataset = replace(self.dataset, requirements=required, exempt=exempt)
        return other

    def careful(self) -> Stages:
        """The same stages with more sets of errors that results, and steps that are to forgive, are
        tried with; not so many more where there are many designs, as each step tries all."""
        samples = self.required.samples
        most = max(samples, _AT_A_STEP // len(self.dataset.designs))
        return self._demanding(replace(self.required, samples=min(_MORE * samples, most)))

    def proving(self) -> Stages:
        """The same stages with other and more sets of errors, to try results with: steps that keep
        to some sets come to where just these are forgiven."""
        return self._demanding(
            replace(
                self.required,
                samples=_MORE * self.required.samples,
                margin=min(self.required.margin, _PROOF_MARGIN),
                seed=self.required.seed + 1,
            )
        )

    def sure(self) -> Stages:
        """The same stages with as many sets of errors as large as a workshop's, and other ones, as
        tell a share of one in a hundred, where ten are tried at a step."""
        return self._demanding(
            replace(
                self.required,
                samples=_SURE * self.required.samples,
                margin=min(self.required.margin, 1.0),
                seed=self.required.seed + 2,
            )
        )

    def _demanding(self, required: Requirements) -> Stages:
        """The same stages with other requirements of their results; the dataset's are of steps."""
        other = copy(self)
        other.required = required
        return other

    def unproved(self, result: StageResult, among: Sequence[int] | None = None) -> tuple[int, ...]:
        """The designs that other and more sets of errors than steps are tried with make snap.

        Errors larger than a workshop's tell it in few sets. A design that one of them makes snap
        isn't lost yet: more sets of the workshop's own errors have the last word.

        among : default: all designs
        """
        designs = range(len(result.designs)) if among is None else among
        return self.sure().snapping_among(result, self.proving().snapping_among(result, designs))

    def minding(self, result: StageResult, members: Sequence[int]) -> Stages:
        """The same stages with those sets of errors required besides that make some designs of a
        result snap, of all those that prove it."""
        other = copy(self)
        minded = {number: list(sets) for number, sets in self.dataset.minded.items()}
        designs = {n: d for n in members if isinstance(d := result.designs[n], Evaluation)}
        for stages in (self.sure(), self.proving()):
            found = self.dataset.requiring(stages.required).unforgiven(designs)
            for n, sets in found.items():
                minded.setdefault(self.dataset.numbers[n], []).extend(sets)
        other.dataset = replace(self.dataset, minded=minded)
        return other

    def calmer(self, factor: float) -> Stages:
        """The same stages with all terms but the fit weighing more: less stress and energy leave a
        design fewer shapes to snap into."""
        other = copy(self)
        weights = self.dataset.weights
        more = {name: factor * w for name, w in weights.of_terms().items() if name != "fit"}
        other.dataset = replace(self.dataset, weights=Weights.of({**weights.to_dict(), **more}))
        return other

    def levelled(self, level: float) -> Stages:
        """The same stages with deviations beyond a share of a design's size counting with their
        fourth power."""
        other = copy(self)
        weights = replace(self.dataset.weights, level=level)
        other.dataset = replace(self.dataset, weights=weights)
        return other

    def weighed(self, result: StageResult) -> StageResult:
        """The same result judged by the weights of these stages; with the states on the way where
        designs have to open by themselves."""
        opening = self.dataset.requirements.opening
        found = {
            n: (d.q, dict(d.equilibria), d.way if opening else ())
            for n, d in enumerate(result.designs)
            if isinstance(d, Evaluation)
        }
        designs = list(result.designs)
        for n, evaluation in self.dataset.judge(found).items():
            designs[n] = evaluation
        return self.confirmed(replace(result, designs=designs))

    def snapping(self, result: StageResult) -> tuple[int, ...]:
        """The designs of a result that errors of the workshop make snap, where it is required that
        they don't."""
        return self.snapping_among(result, range(len(result.designs)))

    def snapping_among(self, result: StageResult, members: Sequence[int]) -> tuple[int, ...]:
        """As `snapping`, of some of the designs."""
        designs = {n: result.designs[n] for n in members}
        found = {n: d for n, d in designs.items() if isinstance(d, Evaluation)}
        return tuple(self.dataset.requiring(self.required).snapping(found))

    def redeployed(self, result: StageResult) -> list[Evaluation | SimulationFailure]:
        """Every design built of the result's parts and deployed from its own starting geometry,
        with the states on its way there where designs have to open by themselves."""
        places = [
            d.q if isinstance(d, Evaluation) else design.parameters
            for d, design in zip(result.designs, self.dataset.designs)
        ]
        q = self._realised(result.kit, result.assignment, np.concatenate(places)[self.dataset.free])
        secured = self.secured().dataset
        found = secured.redeploy(q, range(len(result.designs)))
        opened = {n: at for n, at in found.items() if isinstance(at, Evaluation)}
        found = {**found, **secured.confirm(opened)}
        return [found[n] for n in range(len(result.designs))]

    def opened_by_itself(self, result: StageResult) -> StageResult:
        """The states that a result's designs open into from their assembly."""
        return self.judged(replace(result, designs=self.redeployed(result)))

    # -- pieces --------------------------------------------------------------------------------
    def relaxed_at(
        self,
        name: str,
        weight: float,
        q: np.ndarray,
        evaluations: Sequence[Evaluation],
        kit: Kit,
    ) -> tuple[SQPResult, RelaxedProblem]:
        """Minimise over all elements at one weight, from elements q (n_q,) and their
        evaluations.

        name : of the SQP; weight : w_c; kit : whose parts the elements are drawn to
        """
        settings = self.settings
        problem = RelaxedProblem(
            self.dataset,
            self.projection.with_weight(weight, self.costs.at_weight(weight)),
            kit,
            settings.bounds,
            settings.constraints,
            self.rule,
        )
        options = SQPOptions(
            hessian=settings.hessian,
            max_steps=settings.relaxed_steps,
            decrease_tolerance=settings.last_tolerance
            if weight >= self.schedule[-1]
            else settings.relaxed_tolerance,
            penalty=self.dataset.penalty,
        )
        label = SQPLabel(name, Stage.RELAXED, weight=weight)
        return minimise_kept(
            label,
            problem,
            problem.point(q, list(evaluations), kit),
            options,
            self.store,
            self.observer,
        ), problem

    def _realised(self, kit: Kit, assignment: Assignment, free: np.ndarray) -> np.ndarray:
        """(n_q,) every element its part, and the parameters of no element (k,) as given; those of
        elements that slide in their parts as near to what is given as these allow."""
        q = np.zeros(assignment.n_q)
        q[self.dataset.free] = free
        return assignment.realise(kit, q)

    def limited(self, kit: Kit) -> Kit:
        """A kit that is sought, whose parts keep to their own limits; a given one as it is."""
        kinds = [name for name in kit.parts if part_kind(name).limits is not None]
        if not kinds or not self.rule.parts_move:
            return kit
        limited = {name: part_kind(name).limited(kit[name]) for name in kinds}
        return Kit({**kit.parts, **limited}, kit.units)

    def _to_parts(
        self,
        start: Sequence[Evaluation],
        kit: Kit,
        assignment: Assignment,
        free: np.ndarray | None = None,
        path_steps: int | None = None,
        watched: bool = True,
    ) -> tuple[list[Evaluation | SimulationFailure], list[Jump]]:
        """Follow all designs to their parts; one that fails on the way is deployed there from
        scratch instead."""
        if free is None:
            free = np.concatenate([e.q for e in start])[self.dataset.free]
        q = self._realised(kit, assignment, free)
        steps = path_steps or self.settings.path_steps
        outcomes = self.dataset.follow(q, start, steps, watched)
        designs: list[Evaluation | SimulationFailure] = []
        jumps = []
        for n, path in enumerate(outcomes):
            if isinstance(path, SimulationFailure):
                designs.append(path)
                continue
            jump = find_jump(
                self.dataset.designs[n], start[n], path, self.dataset.references[n].target.size
            )
            jumps += [jump] if jump is not None else []
            designs.append(path[-1])
        failed = [n for n, d in enumerate(designs) if isinstance(d, SimulationFailure)]
        for n, evaluation in self.dataset.redeploy(q, failed).items():
            if isinstance(evaluation, Evaluation):
                designs[n] = evaluation
        return designs, jumps

    def _result(
        self,
        designs: list[Evaluation | SimulationFailure],
        kit: Kit,
        assignment: Assignment,
        steps: int = 0,
        status: str = "",
        jumps: Sequence[Jump] = (),
    ) -> StageResult:
        value, penalty = self._value(designs, kit)
        return StageResult(
            designs,
            kit,
            assignment,
            steps,
            value,
            status,
            list(jumps),
            penalty=penalty,
            reuse_factor=self._reuse_factor(kit, assignment),
        )

    def share(self, result: StageResult, n: int) -> float:
        """Design n's share of what results are compared by; infinite where it failed."""
        outcome = result.designs[n]
        if not isinstance(outcome, Evaluation):
            return np.inf
        dataset = self.dataset
        return dataset.design_weights[n] * outcome.value + dataset.penalty_of(outcome)

    def piece_cost(self, result: StageResult) -> float:
        """By how much J may rise for a piece less, see `StageSettings.reuse`."""
        if not self.settings.reuse or result.value is None:
            return 0.0
        count = PieceCount(result.kit, result.assignment, self.dataset.group_designs)
        return self.settings.reuse * (result.value + result.penalty) / count.fabricated

    def _reuse_factor(self, kit: Kit, assignment: Assignment) -> float:
        if not self.settings.reuse:
            return 1.0
        count = PieceCount(kit, assignment, self.dataset.group_designs)
        return float((count.fabricated / count.elements) ** self.settings.reuse)

    def _value(
        self, designs: Sequence[Evaluation | SimulationFailure], kit: Kit
    ) -> tuple[float | None, float]:
        """The objective with what the parts cost, where no design failed, and the cost of exceeded
        bounds."""
        found = [design for design in designs if isinstance(design, Evaluation)]
        if len(found) < len(designs):
            return None, 0.0
        value = self.dataset.value(found)
        return value + self.costs.value(kit), self.dataset.merit(found) - value


def _blocked(result: SQPResult) -> bool:
    """Whether an SQP ended where its next points could not be simulated, whatever its tolerance
    says: steps become short there."""
    tried = result.failures - sum(step.failures for step in result.history)
    return tried > 0 or bool(result.history) and result.history[-1].failures > 0


def _pressure(result: SQPResult) -> dict[str, dict[str, float]]:
    """Multipliers of the bounds by design and state, those that push."""
    found: dict[str, dict[str, float]] = {}
    for (design, state), value in zip(result.point.data.bounds, result.pressure):
        if value > 0:
            found.setdefault(design, {})[state] = float(value)
    return found
