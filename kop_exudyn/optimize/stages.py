"""The stages of finding a kit: direct, unrelaxed, relaxed, the watched path to the parts, and assigned."""
from __future__ import annotations

import json
import logging
from dataclasses import dataclass, field, replace
from typing import Any, Callable, Mapping, Protocol, Sequence

import numpy as np

from ..errors import InputError, SimulationFailure
from ..kit.cluster import cluster
from ..kit.kinds import Bounds
from ..kit.parts import Assignment, Kit
from ..kit.projection import Projection
from ..structures.base import Design
from .constraints import LinearConstraints, check_feasible
from .dataset import Dataset, evaluations_from_arrays, evaluations_to_arrays
from .history import SQPState, StepRecord
from .objective import Evaluation
from .problem import Point
from .problems import AssignedProblem, RelaxedProblem
from .sqp import SQPOptions, SQPResult, minimise

log = logging.getLogger(__name__)

# A joint that moves this much further in one step of the path than in the steps around it has snapped.
_JUMP_FACTOR = 6.0
_JUMP_SHARE = 0.01  # of the bounding box; smaller moves are no snap whatever their ratio
SAME_STATE = 1e-3  # of the bounding box: states whose joints are this close are one


class Store(Protocol):
    """Where checkpoints go: named sets of plain arrays."""

    def load(self, name: str) -> Mapping[str, np.ndarray] | None: ...

    def save(self, name: str, arrays: Mapping[str, np.ndarray]) -> None: ...


class NoStore:
    """Keeps nothing."""

    def load(self, name: str) -> None:
        return None

    def save(self, name: str, arrays: Mapping[str, np.ndarray]) -> None:
        pass


@dataclass(frozen=True)
class StageSettings:
    """Settings of the stages.

    schedule : values of w_c, one after the other; default: 0.1, 1, 10 and 100 times the weight of the fit, so that
        the balance of fit and projection is the same whatever the weights
    tight : largest rms distance of elements to their parts, relative to the kind's scale, at which raising w_c ends
    relaxed_steps, assigned_steps, round_steps : accepted SQP steps at most: for each w_c, for an assigned stage (or
        baseline) without reassignments, for each round of one with them
    relaxed_tolerance, last_tolerance, assigned_tolerance : the rounds of the relaxed stage before the last, the last
        one, and the assigned stage end when steps promise or gain less than this share of J
    reassignments : rounds of the assigned stage in which elements get other parts (see reassign.py), at most; a round
        that gains less than `reassigned_tolerance` of J is the last
    redeployments : how often, after the assigned stage, the designs are opened from their assembly instead of led from
        the relaxed ones, and the stage goes on from where they end, see `that_open` in rounds.py
    path_steps : steps of the watched path between the stages
    rescues : how often w_c is raised by ten when a design fails on that path, or snaps and there are no reassignments
    growth : how many parts a kind may then get more, when raising w_c didn't help
    restarts, seed : of the clustering
    bounds : kind -> (lower, upper) of the parts, besides the natural ones
    constraints : on the elements of all designs, see `on_elements`; the baselines "direct" and "unrelaxed" keep to them
        as far as their parts can
    hessian : "exact" or "bfgs"
    """

    schedule: tuple[float, ...] | None = None
    tight: float = 1e-3
    relaxed_steps: int = 25
    assigned_steps: int = 40
    round_steps: int = 15
    relaxed_tolerance: float = 3e-3
    last_tolerance: float = 5e-4
    assigned_tolerance: float = 1e-4
    reassignments: int = 4
    reassigned_tolerance: float = 2e-2
    redeployments: int = 0
    path_steps: int = 10
    rescues: int = 2
    growth: int = 0
    restarts: int = 20
    seed: int = 0
    bounds: Bounds | None = None
    constraints: LinearConstraints | None = None
    hessian: str = "exact"


@dataclass(frozen=True)
class StageEvent:
    """One accepted step, as observers see it: the SQP's name, the record, the objective's terms, w_c (or None).

    The SQP of round 2 of the assigned stage is "assigned-2".
    """

    sqp: str
    record: StepRecord
    terms: Mapping[str, float]
    weight: float | None

    @property
    def stage(self) -> str:
        """ "relaxed" with all its w_c and rescues, "assigned" with all its rounds, or "unrelaxed"."""
        return "relaxed" if self.weight is not None else self.sqp.partition("-")[0]

    @property
    def round(self) -> int | None:
        """The round of the assigned stage, from 1; None elsewhere."""
        number = self.sqp.partition("-")[2]
        return int(number) if self.stage == "assigned" and number else None


@dataclass(frozen=True)
class Jump:
    """A snap on the path to the parts: which design, at which fraction of the way, how far (share of the box)."""

    design: str
    fraction: float
    distance: float


@dataclass
class StageResult:
    """What a stage left: by design an evaluation confirmed by Exudyn, or the failure that it met.

    kit, assignment : those that the stage ended with
    steps : accepted steps; value : objective (None where a design failed); status : of the last SQP
    """

    designs: list[Evaluation | SimulationFailure]
    kit: Kit
    assignment: Assignment
    steps: int = 0
    value: float | None = None
    status: str = ""
    jumps: list[Jump] = field(default_factory=list)


Observer = Callable[[StageEvent], None]


class Stages:
    """Runs the stages for one dataset; interrupted SQPs go on from the store's checkpoints."""

    def __init__(self, dataset: Dataset, parts: Mapping[str, int], settings: StageSettings = StageSettings(),
                 store: Store | None = None, observer: Observer | None = None):
        if settings.schedule is None:
            weights = dataset.weights
            settings = replace(settings, schedule=tuple(k * (weights.fit or weights.energy) for k in (0.1, 1, 10, 100)))
        self.dataset, self.parts, self.settings = dataset, dict(parts), settings
        self.store, self.observer = store or NoStore(), observer or (lambda event: None)
        self.q0 = dataset.parameters
        self.projection = Projection.of_inputs(dataset.groups, self.q0, bounds=settings.bounds)

    def direct(self, kit: Kit | None = None) -> StageResult:
        """Cluster the inputs (or take a kit), replace every element by its part."""
        clustering = None
        if kit is None:
            clustering = cluster(self.dataset.groups, self.q0, self.parts, bounds=self.settings.bounds,
                                 restarts=self.settings.restarts, seed=self.settings.seed)
            kit = clustering.kit
        nearest = self.projection.minimise(self.q0, kit, fixed_kit=True)
        assignment = clustering.assignment if clustering is not None else nearest.assignment
        return self.confirmed(self.built_from(kit, assignment, self.inputs()))

    def inputs(self) -> list[Evaluation]:
        """The input designs, judged by the objective."""
        calls = {n: (d.parameters, dict(r.equilibria))
                 for n, (d, r) in enumerate(zip(self.dataset.designs, self.dataset.references))}
        return list(self.dataset.judge(calls).values())

    def relaxed(self, kit: Kit, start: Sequence[Evaluation] | None = None, fixed_kit: bool = False,
                name: str = "relaxed") -> StageResult:
        """Minimise over all elements, w_c raised until the clusters are tight; from the inputs or given evaluations."""
        settings, evaluations = self.settings, list(start or self.inputs())
        steps, q, result = 0, np.concatenate([e.q for e in evaluations]), None
        for weight in settings.schedule:
            result, problem = self._relax(f"{name}-{weight:g}", weight, q, evaluations, kit, fixed_kit)
            q, evaluations, kit = result.x, result.point.data.evaluations, result.point.data.kit
            steps += result.steps
            if max(problem.projection.tightness(q, kit, result.point.data.assignment).values()) <= settings.tight:
                break
        data = result.point.data
        return StageResult(list(evaluations), kit, data.assignment, steps, result.point.value, result.status)

    def assigned(self, start: StageResult, name: str = "assigned", max_steps: int | None = None) -> StageResult:
        """Minimise over the parts from a state in which every element is its part; designs that failed stay out.

        max_steps : default: the settings' `assigned_steps`
        """
        members = [n for n, e in enumerate(start.designs) if isinstance(e, Evaluation)]
        if not members:
            return replace(start, status="no design could be built from the kit", jumps=[])
        problem = self.assigned_problem(start, members)
        try:
            check_feasible(problem.lower, problem.upper, problem.constraints)
        except InputError as error:
            log.warning("%s: the elements' constraints can't be met by these parts: %s", name, error)
            return replace(start, status="the constraints can't be met by these parts", jumps=[])
        evaluations = [start.designs[n] for n in members]
        point = problem.point(problem.variables(np.concatenate([e.q for e in evaluations])), evaluations)
        options = SQPOptions(hessian=self.settings.hessian, secant=True, max_steps=max_steps or self.settings.assigned_steps,
                             decrease_tolerance=self.settings.assigned_tolerance)
        result = self._sqp(name, problem, point, options, None)
        designs = list(start.designs)
        for n, evaluation in zip(members, result.point.data.evaluations):
            designs[n] = evaluation
        return self.confirmed(self._result(designs, result.point.data.kit, start.assignment, result.steps,
                                           result.status))

    def assigned_problem(self, start: StageResult, members: Sequence[int]) -> AssignedProblem:
        """The problem over the parts, for some of the designs."""
        constraints = self.settings.constraints
        if constraints is not None and len(members) < len(self.dataset.designs):
            offsets = self.dataset.offsets
            constraints = constraints.among(np.concatenate([np.arange(offsets[n], offsets[n + 1]) for n in members]))
        return AssignedProblem(self.dataset.subset(members), start.kit,
                               restrict(start.assignment, self.dataset, members), self.settings.bounds, constraints)

    def built_from(self, kit: Kit, assignment: Assignment, start: Sequence[Evaluation],
                   free: np.ndarray | None = None) -> StageResult:
        """All designs followed from evaluations to the parts of another kit or assignment; not confirmed yet.

        free : (k,) new values of the parameters of no element; default: they stay
        """
        designs, jumps = self._to_parts(start, kit, assignment, free)
        return self._result(designs, kit, assignment, jumps=jumps)

    def judged(self, result: StageResult) -> StageResult:
        """The same result with the objective of its designs."""
        return replace(result, value=self._value(result.designs))

    def confirmed(self, result: StageResult) -> StageResult:
        """The same result at Exudyn's own solutions; a design that Exudyn doesn't confirm becomes a failure."""
        found = {n: d for n, d in enumerate(result.designs) if isinstance(d, Evaluation)}
        designs = list(result.designs)
        for n, evaluation in self.dataset.confirm(found).items():
            designs[n] = evaluation
        return self.judged(replace(result, designs=designs))

    def redeployed(self, result: StageResult) -> list[Evaluation | SimulationFailure]:
        """Every design built of the result's parts and deployed from its own starting geometry."""
        places = [d.q if isinstance(d, Evaluation) else design.parameters
                  for d, design in zip(result.designs, self.dataset.designs)]
        q = self._realised(result.kit, result.assignment, np.concatenate(places)[self.dataset.free])
        found = self.dataset.redeploy(q, range(len(result.designs)))
        return [found[n] for n in range(len(result.designs))]

    def to_parts(self, relaxed: StageResult, fixed_kit: bool = False) -> tuple[StageResult, StageResult]:
        """Follow the straight path from the relaxed elements to their parts, watching for snaps.

        When a design fails, w_c is raised and the relaxed stage goes on from where it was; also when one snaps, unless
        the rounds of the assigned stage are to make up for that. Returns the relaxed result that the path started from
        in the end, and the state at the parts.
        """
        settings = self.settings
        weight = settings.schedule[-1]
        for rescue in range(settings.rescues + 1):
            designs, jumps = self._to_parts(relaxed.designs, relaxed.kit, relaxed.assignment)
            failed = [d for d in designs if isinstance(d, SimulationFailure)]
            for jump in jumps:
                log.warning("%s snaps at %.0f %% of the way to its parts (%.1f %% of its size)", jump.design,
                            100 * jump.fraction, 100 * jump.distance)
            for failure in failed:
                log.warning("%s", failure)
            needed = failed or jumps and not settings.reassignments
            if not needed or rescue == settings.rescues:
                break
            weight *= 10
            log.warning("raising w_c to %g", weight)
            before = relaxed
            q = np.concatenate([e.q for e in before.designs])
            result, _ = self._relax(f"rescue-{rescue + 1}", weight, q, before.designs, before.kit, fixed_kit)
            data = result.point.data
            relaxed = StageResult(list(data.evaluations), data.kit, data.assignment, before.steps + result.steps,
                                  result.point.value, result.status, before.jumps + jumps)
        return relaxed, self.confirmed(self._result(designs, relaxed.kit, relaxed.assignment, jumps=jumps))

    # -- pieces ----------------------------------------------------------------------------------------------------
    def _relax(self, name: str, weight: float, q: np.ndarray, evaluations: Sequence[Evaluation], kit: Kit,
               fixed_kit: bool) -> tuple[SQPResult, RelaxedProblem]:
        settings = self.settings
        problem = RelaxedProblem(self.dataset, self.projection.with_weight(weight), kit, settings.bounds,
                                 settings.constraints, fixed_kit)
        options = SQPOptions(hessian=settings.hessian, max_steps=settings.relaxed_steps,
                             decrease_tolerance=settings.last_tolerance if weight >= settings.schedule[-1]
                             else settings.relaxed_tolerance)
        return self._sqp(name, problem, problem.point(q, list(evaluations), kit), options, weight), problem

    def _sqp(self, name: str, problem: Any, start: Point, options: SQPOptions, weight: float | None) -> SQPResult:
        """Minimise, or go on from the store's checkpoint of that name."""
        tally = problem.dataset.tally
        before = (tally.equilibria, tally.newton_iterations)
        state, saved = None, self.store.load(name)
        terms: list[str] = []
        if saved is not None:
            try:
                state, start, terms = _restored(problem, saved)
                equilibria, iterations = saved["tally"].astype(int).tolist()
            except (IndexError, KeyError, TypeError, ValueError):  # some array is missing or of another shape
                raise InputError(f"the checkpoint {name!r} is damaged: start anew instead of resuming") from None
            tally.equilibria += equilibria
            tally.newton_iterations += iterations
            for record, row in zip(state.history, terms):
                self.observer(StageEvent(name, record, json.loads(row), weight))

        def checkpoint(state: SQPState, point: Point) -> None:
            terms.append(json.dumps(point.data.terms))
            self.observer(StageEvent(name, state.history[-1], point.data.terms, weight))
            self.store.save(name, {
                **{f"sqp/{k}": v for k, v in state.to_arrays().items()},
                **{f"states/{k}": v for k, v in evaluations_to_arrays(point.data.solved).items()},
                "kit": point.data.kit.vector, "terms": np.array(terms),
                "tally": np.array([tally.equilibria - before[0], tally.newton_iterations - before[1]]),
            })

        result = minimise(problem, start.x, options, checkpoint=checkpoint, state=state, start=start)
        log.info("%s: %d steps, J = %.6g, %s", name, result.steps, result.point.value, result.status)
        return result

    def _realised(self, kit: Kit, assignment: Assignment, free: np.ndarray) -> np.ndarray:
        """(n_q,) every element its part, and the parameters of no element (k,) as given."""
        q = assignment.matrix(kit) @ kit.vector
        q[self.dataset.free] = free
        return q

    def _to_parts(self, start: Sequence[Evaluation], kit: Kit, assignment: Assignment, free: np.ndarray | None = None,
                  ) -> tuple[list[Evaluation | SimulationFailure], list[Jump]]:
        """Follow all designs to their parts; one that fails on the way is deployed there from scratch instead."""
        if free is None:
            free = np.concatenate([e.q for e in start])[self.dataset.free]
        q = self._realised(kit, assignment, free)
        outcomes = self.dataset.follow(q, start, self.settings.path_steps)
        designs: list[Evaluation | SimulationFailure] = []
        jumps = []
        for n, path in enumerate(outcomes):
            if isinstance(path, SimulationFailure):
                designs.append(path)
                continue
            jump = find_jump(self.dataset.designs[n], start[n], path, self.dataset.references[n].target.diagonal)
            jumps += [jump] if jump is not None else []
            designs.append(path[-1])
        failed = [n for n, d in enumerate(designs) if isinstance(d, SimulationFailure)]
        for n, evaluation in self.dataset.redeploy(q, failed).items():
            if isinstance(evaluation, Evaluation):
                designs[n] = evaluation
        return designs, jumps

    def _result(self, designs: list[Evaluation | SimulationFailure], kit: Kit, assignment: Assignment, steps: int = 0,
                status: str = "", jumps: Sequence[Jump] = ()) -> StageResult:
        return StageResult(designs, kit, assignment, steps, self._value(designs), status, list(jumps))

    def _value(self, designs: Sequence[Evaluation | SimulationFailure]) -> float | None:
        """The objective, where no design failed."""
        return self.dataset.value(designs) if all(isinstance(d, Evaluation) for d in designs) else None


def _restored(problem: Any, saved: Mapping[str, np.ndarray]) -> tuple[SQPState, Point, list[str]]:
    """State, point and the steps' terms of a checkpoint."""
    state = SQPState.from_arrays({k[4:]: v for k, v in saved.items() if k.startswith("sqp/")})
    evaluations = evaluations_from_arrays(
        problem.dataset, {k[7:]: v for k, v in saved.items() if k.startswith("states/")})
    point = (problem.point(state.x, evaluations, problem.kit.with_vector(saved["kit"]))
             if isinstance(problem, RelaxedProblem) else problem.point(state.x, evaluations))
    return state, point, [str(row) for row in saved["terms"]]


def find_jump(design: Any, start: Evaluation, path: Sequence[Evaluation], diagonal: float) -> Jump | None:
    """The largest snap on a path of equal parameter steps, or None: joints that move far more in one step."""
    role = design.fitted_role.name
    positions = [e.equilibria[role].state.positions[design.joints] for e in (start, *path)]
    moves = np.array([np.linalg.norm(b - a, axis=1).max() for a, b in zip(positions, positions[1:])]) / diagonal
    worst = int(np.argmax(moves))
    if moves[worst] > _JUMP_SHARE and moves[worst] > _JUMP_FACTOR * np.median(moves):
        return Jump(design.name, (worst + 1) / len(path), float(moves[worst]))
    return None


def distance(design: Design, a: Evaluation, b: Evaluation) -> float:
    """How far apart two states of a design are: the largest distance of a joint, as a share of the bounding box.

    Each state is at its best placement on the target.
    """
    role = design.fitted_role.name
    joints = [e.fit.placement.apply(e.equilibria[role].state.positions[design.joints]) for e in (a, b)]
    return float(np.linalg.norm(joints[0] - joints[1], axis=1).max()) / a.fit.diagonal


def mixed(results: Sequence[StageResult], dataset: Dataset) -> StageResult:
    """Each design from its own result, all of the same kit; its objective is to be judged anew."""
    first = np.cumsum([0, *(len(design.groups) for design in dataset.designs)])

    def pick(name: str) -> tuple[np.ndarray, ...]:
        return tuple(rows for n, result in enumerate(results)
                     for rows in getattr(result.assignment, name)[first[n]:first[n + 1]])

    assignment = replace(results[0].assignment, part=pick("part"), variant=pick("variant"))
    return StageResult([result.designs[n] for n, result in enumerate(results)], results[0].kit, assignment)


def restrict(assignment: Assignment, dataset: Dataset, members: Sequence[int]) -> Assignment:
    """The assignment of some designs of a dataset, in the numbering of their subset."""
    subset = dataset.subset(members)
    counts = [len(d.groups) for d in dataset.designs]
    first = np.cumsum([0, *counts])
    rows = [k for n in members for k in range(first[n], first[n + 1])]
    return Assignment(tuple(subset.groups), tuple(assignment.part[k] for k in rows),
                      tuple(assignment.variant[k] for k in rows), int(subset.offsets[-1]))
