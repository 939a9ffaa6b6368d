"""The stages of finding a kit: direct, unrelaxed, relaxed and assigned."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..errors import InputError, SimulationFailure
from ..kit.kinds import part_kind
from ..kit.part_costs import PartCosts
from ..kit.parts import Assignment, Kit
from ..kit.projection import Projection
from ..kit.stock import Stock
from ..sqp.constraints import check_feasible
from ..sqp.options import SQPOptions, SQPResult
from ..sqp.qp import QPOptions
from .checkpoints import NoStore, Store, minimise_kept
from .dataset import Dataset, all_or_raise
from .evaluation import Evaluation
from .events import ASSIGNED, Observer, SQPLabel, Stage
from .judge import Judge
from .kit_rule import rule_of
from .problems import AssignedProblem, RelaxedProblem
from .settings import StageSettings
from .stage_results import StageResult, find_jump, realised, restrict

log = logging.getLogger(__name__)

# of the parts' sizes: where designs only open if steps are shorter than that, there is none
_SHORTEST = 1e-5
_TRIALS = 4  # of such a step, each a quarter as long as the last one, and each costs a few seconds


class Stages(Judge):
    """Runs the stages for one dataset, and judges what they leave; interrupted SQPs go on from the
    store's checkpoints.

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
        q0 = dataset.parameters
        required = settings.requirements
        super().__init__(
            # the search may pass through states that are led to; what it returns opens
            dataset.requiring(replace(required, opening=False, samples=0)),
            required,
            PartCosts.of(dataset.groups, q0, settings.slit_cost * (weights.fit or weights.energy)),
            settings.reuse,
        )
        self.settings = settings
        self.rule = rule_of(parts, dataset.group_designs)
        self.store, self.observer = store or NoStore(), observer or (lambda event: None)
        self.q0 = q0
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
        return self.judged(
            StageResult(
                designs,
                result.point.data.kit,
                start.assignment,
                result.steps,
                status=result.status,
                pressure=_pressure(result),
                blocked=_blocked(result),
            )
        )

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
        """All designs followed from evaluations to the parts of another kit or assignment; one that
        fails on the way is deployed there from scratch instead. Not confirmed yet.

        free : (k,) new values of the parameters of no element; default: they stay
        path_steps : default: the settings'
        watched : for snaps, in all these steps; else in as few of them as lead there
        """
        if free is None:
            free = np.concatenate([e.q for e in start])[self.dataset.free]
        q = realised(self.dataset, kit, assignment, free)
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
        return self.judged(StageResult(designs, kit, assignment, jumps=jumps))

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

    def limited(self, kit: Kit) -> Kit:
        """A kit that is sought, whose parts keep to their own limits; a given one as it is."""
        kinds = [name for name in kit.parts if part_kind(name).limits is not None]
        if not kinds or not self.rule.parts_move:
            return kit
        limited = {name: part_kind(name).limited(kit[name]) for name in kinds}
        return Kit({**kit.parts, **limited}, kit.units)


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
