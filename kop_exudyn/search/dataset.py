"""Several designs that share a kit: one long parameter vector, and their evaluation side by
side."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Concatenate, ParamSpec, TypeVar

import numpy as np

from ..equilibrium.equilibria import Equilibrium
from ..errors import InputError, SimulationFailure
from ..files.arrays import numbers_of
from ..kit.groups import ElementGroup
from ..kit.kinds import Bounds, part_kind
from ..scene.state import State
from ..sqp.model import penalty_of
from ..structures.base import Design
from ..structures.stacking import group_designs, parameter_offsets, stacked_groups
from .evaluation import DesignDerivatives, Evaluation
from .objective import DesignObjective, Reference
from .pool import DesignPool
from .requirements import Requirements
from .tolerance import forgives, unforgiven
from .weights import Weights

P = ParamSpec("P")
T = TypeVar("T")

_EQUILIBRIUM_NUMBERS = ("torque", "elastic_energy", "potential", "residual")


@dataclass
class Tally:
    """What a run has cost so far: equilibria solved, Newton iterations in them, and seconds that
    Exudyn took to confirm states, in all processes."""

    equilibria: int = 0
    newton_iterations: int = 0
    confirmation_s: float = 0.0

    def add(self, evaluation: Evaluation) -> None:
        self.equilibria += evaluation.solves
        self.newton_iterations += evaluation.iterations


@dataclass(frozen=True)
class Dataset:
    """Designs with their parameters after each other.

    pool : solves them
    weights : of the objective
    numbers : which of the pool's designs
    design_weights : how much each of these counts
    requirements : that designs have to meet
    exempt : those of the pool's designs that errors of the workshop may make snap nevertheless
    minded : sets of errors (nq,) by the pool's designs that must not make them snap, besides the
        required ones
    tally : counts what was solved
    """

    pool: DesignPool
    weights: Weights
    numbers: tuple[int, ...]
    design_weights: tuple[float, ...]
    requirements: Requirements = Requirements.none()
    tally: Tally = field(default_factory=Tally)
    exempt: frozenset[int] = frozenset()
    minded: Mapping[int, Sequence[np.ndarray]] = field(default_factory=dict)

    @classmethod
    def of_pool(
        cls, pool: DesignPool, weights: Weights, design_weights: Sequence[float] | None = None
    ) -> Dataset:
        """All designs of a pool."""
        n = len(pool.designs)
        return cls(
            pool,
            weights,
            tuple(range(n)),
            tuple(design_weights) if design_weights is not None else (1.0,) * n,
        )

    def subset(self, members: Sequence[int]) -> Dataset:
        """Some of the designs, by their place in this dataset; counts on in the same tally."""
        return replace(
            self,
            numbers=tuple(self.numbers[k] for k in members),
            design_weights=tuple(self.design_weights[k] for k in members),
        )

    @property
    def designs(self) -> list[Design]:
        return [self.pool.designs[n] for n in self.numbers]

    @property
    def references(self) -> list[Reference]:
        return [self.pool.references[n] for n in self.numbers]

    @property
    def offsets(self) -> np.ndarray:
        """(n_designs + 1,) where each design's parameters start."""
        return parameter_offsets(self.designs)

    @property
    def groups(self) -> list[ElementGroup]:
        """All elements, indexing the long parameter vector; design by design."""
        return stacked_groups(self.designs)

    @property
    def group_designs(self) -> np.ndarray:
        """(n_groups,) the place in this dataset of each group's design."""
        return group_designs(self.designs)

    @property
    def parameters(self) -> np.ndarray:
        """(n_q,) the inputs' parameters."""
        return np.concatenate([d.parameters for d in self.designs])

    @property
    def free(self) -> np.ndarray:
        """(k,) places in the long vector whose values no part's are: those of no element, see
        `Design.free`, and then those of `sliding`."""
        own = [d.free + offset for d, offset in zip(self.designs, self.offsets)]
        return np.concatenate([*own, self.sliding]).astype(int)

    @property
    def sliding(self) -> np.ndarray:
        """(k,) places of elements whose parts realise intervals, increasing: they may take any
        value within."""
        return np.sort(
            np.concatenate(
                [
                    np.empty(0, dtype=int),
                    *(
                        group.indices.ravel()
                        for group in self.groups
                        if part_kind(group.kind).realises_intervals
                    ),
                ]
            )
        )

    def split(self, q: np.ndarray) -> list[np.ndarray]:
        """The designs' own parts of the long vector."""
        return np.split(q, self.offsets[1:-1])

    def scales(self) -> np.ndarray:
        """(n_q,) typical size of every parameter: the kind's scale, or the design's for those of no
        element."""
        q = self.parameters
        out = np.concatenate(
            [np.full(len(d.parameters), float(d.free_scale)) for d in self.designs]
        )
        for kind in {g.kind for g in self.groups}:
            indices = np.concatenate([g.indices.ravel() for g in self.groups if g.kind == kind])
            out[indices] = part_kind(kind).scale(q[indices])
        return out

    def bounds(self, bounds: Bounds | None) -> tuple[np.ndarray, np.ndarray]:
        """(n_q,), (n_q,): the designs' own bounds, narrowed by the user's (kind -> lower, upper).

        The user's bounds are those of parts, so an angular element may have either sign within
        them.
        """
        lower = np.concatenate([d.lower for d in self.designs])
        upper = np.concatenate([d.upper for d in self.designs])
        for group in self.groups:
            if not bounds or group.kind not in bounds:
                continue
            kind = part_kind(group.kind)
            low, high = kind.bounds(bounds)
            if kind.angular:
                low, high = -high, high
            elif kind.realises_intervals and len(group.indices):
                ways = kind.variants_of(group.indices.shape[1])
                assert ways.reach is not None
                low, high = (
                    (ways.matrices @ low).min(axis=0),
                    _times(ways.matrices + ways.reach, high).max(axis=0),
                )
            else:
                # an element may be realised mirrored: each of its lengths must suit one side of a
                # part
                low, high = np.full_like(low, low.min()), np.full_like(high, high.max())
            columns = group.indices.shape[1]
            lower[group.indices] = np.maximum(lower[group.indices], low[:columns])
            upper[group.indices] = np.minimum(upper[group.indices], high[:columns])
        if (lower > upper).any():
            worst = int(np.argmax(lower - upper))
            raise InputError(
                "bounds exclude each other",
                field=f"bounds of parameter {worst}",
                value=(float(lower[worst]), float(upper[worst])),
            )
        return lower, upper

    def evaluate(self, q: np.ndarray, previous: Sequence[Evaluation] | None) -> list[Evaluation]:
        """All designs at q, solving only those whose parameters changed. Raises the first
        SimulationFailure."""
        parts = self.split(q)
        results: list[Any] = [None] * len(parts)
        calls = {}
        for n, part in enumerate(parts):
            if previous is not None and np.array_equal(part, previous[n].q):
                results[n] = previous[n]
            else:
                calls[n] = (part, None if previous is None else previous[n])
        for n, result in self._map(DesignObjective.evaluate, calls).items():
            results[n] = result
            if isinstance(result, Evaluation):
                self.tally.add(result)
        return all_or_raise(results)

    def derivatives(
        self, evaluations: Sequence[Evaluation], hessian: bool
    ) -> list[DesignDerivatives]:
        """Confirmed evaluations and their derivatives."""
        calls = {n: (evaluation, hessian) for n, evaluation in enumerate(evaluations)}
        return all_or_raise(list(self._map(DesignObjective.derivatives, calls).values()))

    def follow(
        self, q: np.ndarray, previous: Sequence[Evaluation], steps: int, watched: bool = True
    ) -> list[list[Evaluation] | SimulationFailure]:
        """Straight paths of all designs to q; a design that fails on its way comes back as its
        failure.

        watched : in all these steps; else in as few of them as lead there, see
            `DesignObjective.approach`
        """
        calls = {n: (part, previous[n], steps) for n, part in enumerate(self.split(q))}
        method = DesignObjective.follow if watched else DesignObjective.approach
        results = list(self._map(method, calls).values())
        for path in results:
            for evaluation in path if isinstance(path, list) else ():
                self.tally.add(evaluation)
        return results

    def confirm(
        self, evaluations: Mapping[int, Evaluation]
    ) -> dict[int, Evaluation | SimulationFailure]:
        """Exudyn's word on some designs."""
        calls = {n: (e,) for n, e in evaluations.items() if not e.confirmations}
        found = self._map(DesignObjective.confirm, calls)
        for evaluation in found.values():
            if isinstance(evaluation, Evaluation):
                said = evaluation.confirmations.values()
                self.tally.confirmation_s += sum(confirmation.wall_s for confirmation in said)
        return {n: found.get(n, evaluation) for n, evaluation in evaluations.items()}

    def redeploy(
        self, q: np.ndarray, members: Sequence[int]
    ) -> dict[int, Evaluation | SimulationFailure]:
        """Some designs deployed at q from their own starting geometry, without a warm start."""
        parts = self.split(q)
        found = self._map(DesignObjective.redeploy, {n: (parts[n],) for n in members})
        for evaluation in found.values():
            if isinstance(evaluation, Evaluation):
                self.tally.add(evaluation)
        return found

    def requiring(self, requirements: Requirements) -> Dataset:
        """The same designs with other requirements."""
        return replace(self, requirements=requirements)

    def open(
        self, evaluations: Mapping[int, Evaluation]
    ) -> dict[int, Evaluation | SimulationFailure]:
        """Some designs opened from their assembly at the evaluations' parameters, see
        `DesignObjective.opened`."""
        found = self._map(DesignObjective.opened, {n: (e,) for n, e in evaluations.items()})
        for evaluation in found.values():
            if isinstance(evaluation, Evaluation):
                self.tally.add(evaluation)
        return found

    def completed(
        self, evaluations: Sequence[Evaluation], previous: Sequence[Evaluation]
    ) -> list[Evaluation]:
        """The evaluations with the states on the way from the assembly, see
        `DesignObjective.completed`. Raises the first SimulationFailure, and one where sets of
        errors are required that make a design snap."""
        calls = {
            n: (now, before)
            for n, (now, before) in enumerate(zip(evaluations, previous))
            if before.way and not now.way
        }
        results: list[Evaluation | SimulationFailure] = list(evaluations)
        for n, result in self._map(DesignObjective.completed, calls).items():
            results[n] = result
            if isinstance(result, Evaluation):
                self.tally.equilibria += len(result.way)
                self.tally.newton_iterations += sum(state.iterations for state in result.way)
        found = all_or_raise(results)
        if self.requirements.samples:
            changed = {
                n: now
                for n, (now, before) in enumerate(zip(found, previous))
                if not np.array_equal(now.q, before.q)
            }
            for n in self.snapping(changed):
                raise SimulationFailure(
                    "errors of the workshop make it snap", where=self.designs[n].name
                )
        return found

    def snapping(self, evaluations: Mapping[int, Evaluation]) -> list[int]:
        """The designs among these that errors of the workshop make snap, as far as the requirements
        ask for that, see `forgives`."""
        if not self.requirements.samples:
            return []
        asked = {n: e for n, e in evaluations.items() if self.numbers[n] not in self.exempt}
        besides = {n: self.minded.get(self.numbers[n], ()) for n in asked}
        told = self._map(forgives, {n: (e, besides[n]) for n, e in asked.items()})
        return [n for n, forgiving in told.items() if forgiving is not True]

    def unforgiven(self, evaluations: Mapping[int, Evaluation]) -> dict[int, list[np.ndarray]]:
        """The required sets of errors (nq,) that make designs snap, of those that snap."""
        found = self._map(unforgiven, {n: (e,) for n, e in evaluations.items()})
        return {n: sets for n, sets in found.items() if isinstance(sets, list) and sets}

    def judge(
        self,
        calls: Mapping[int, tuple[Any, ...]],
    ) -> dict[int, Evaluation | SimulationFailure]:
        """Evaluations of given parameters, equilibria and, where known, the states on the way:
        (q, {role: equilibrium}[, states]) a design."""
        return self._map(DesignObjective.judge, calls)

    def _map(
        self,
        method: Callable[Concatenate[DesignObjective, P], T],
        calls: Mapping[int, tuple[Any, ...]],
    ) -> dict[int, T | SimulationFailure]:
        numbered = self.pool.map(
            method,
            self.weights,
            {self.numbers[n]: call for n, call in calls.items()},
            self.requirements,
        )
        return dict(zip(calls, numbered.values()))

    def value(self, evaluations: Sequence[Evaluation]) -> float:
        """Weighted sum of the designs' F."""
        return float(sum(w * e.value for w, e in zip(self.design_weights, evaluations)))

    @property
    def penalty(self) -> float:
        """Weight of a bound's excess, against that of J."""
        return self.requirements.penalty * (self.weights.fit or self.weights.energy)

    def merit(self, evaluations: Sequence[Evaluation]) -> float:
        """J with what the excess of bounds costs."""
        return self.value(evaluations) + sum(self.penalty_of(e) for e in evaluations)

    def penalty_of(self, evaluation: Evaluation) -> float:
        """What the excess of a design's bounds costs."""
        return self.penalty * penalty_of(np.array(list(evaluation.excess.values())))


def _times(matrices: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Matrices (..., k) of no negative entries times limits (k,), of which some are infinite."""
    return np.where(matrices > 0, matrices * np.where(matrices > 0, limits, 0.0), 0.0).sum(axis=-1)


def all_or_raise(results: Sequence[T | SimulationFailure]) -> list[T]:
    """The results, where none is a failure. Raises the first SimulationFailure."""
    found = []
    for result in results:
        if isinstance(result, SimulationFailure):
            raise result
        found.append(result)
    return found


def evaluations_to_arrays(evaluations: Sequence[Evaluation]) -> dict[str, np.ndarray]:
    """The equilibria of evaluations as plain arrays, from which `evaluations_from_arrays` makes the
    same ones."""
    arrays: dict[str, np.ndarray] = {}
    for n, evaluation in enumerate(evaluations):
        arrays[f"{n}/q"] = evaluation.q
        way = {f"way{k}": state for k, state in enumerate(evaluation.way)}
        for role, eq in {**evaluation.equilibria, **way}.items():
            for name, value in {**eq.state.to_arrays(), "stress": eq.stress}.items():
                arrays[f"{n}/{role}/{name}"] = value
            opening = np.nan if eq.opening is None else eq.opening
            numbers = [getattr(eq, name) for name in _EQUILIBRIUM_NUMBERS]
            arrays[f"{n}/{role}/numbers"] = np.array([opening, *numbers])
    return arrays


def evaluations_from_arrays(dataset: Dataset, arrays: Mapping[str, np.ndarray]) -> list[Evaluation]:
    """The evaluations that the arrays came from, judged anew (no equilibrium is solved).

    Raises InputError, naming the array, where one doesn't fit the designs.
    """
    calls = {}
    for n, design in enumerate(dataset.designs):
        equilibria = {}
        q = numbers_of(arrays, f"{n}/q", design.parameters.shape)
        roles = [role.name for role in design.roles]
        stations = sum(key.startswith(f"{n}/way") and key.endswith("/numbers") for key in arrays)
        for role in (*roles, *(f"way{k}" for k in range(stations))):
            prefix = f"{n}/{role}/"
            own = {k.removeprefix(prefix): v for k, v in arrays.items() if k.startswith(prefix)}
            scene = design.scene(role if role in roles else design.fitted_role.name)
            count = 1 + len(_EQUILIBRIUM_NUMBERS)
            opening, *numbers = numbers_of(own, "numbers", (count,), finite=False).tolist()
            if not np.isfinite(numbers).all():
                raise InputError("contains numbers that are not finite", field=prefix + "numbers")
            equilibria[role] = Equilibrium(
                state=State.of(own, scene.n_bodies, scene.n_hinges),
                q=q,
                opening=None if np.isnan(opening) else opening,
                stress=numbers_of(own, "stress", (len(scene.elements), 6)),
                iterations=0,
                escapes=0,
                wall_s=0.0,
                **dict(zip(_EQUILIBRIUM_NUMBERS, numbers)),
            )
        way = tuple(equilibria.pop(f"way{k}") for k in range(stations))
        calls[n] = (q, equilibria, way)
    return all_or_raise(list(dataset.judge(calls).values()))
