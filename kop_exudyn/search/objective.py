"""Design preservation: how far a design with changed parameters is from the design that was wanted.

F(q) = beta T / l0^2 + gamma sum_roles E / E0 + ..., with T the target fitting of the deployed
joints at the best rigid placement, E the elastic energies (deployed, and assembled where the class
has such a state), l0 the target's size and E0 the input design's deployed energy:
every term is divided by its own scale, so F doesn't change with units. The terms are the modules of
`terms/`.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from ..equilibrium.equilibria import Equilibrium, Start
from ..equilibrium.exudyn_confirm import confirm
from ..equilibrium.newton import NewtonOptions, refine, solve
from ..equilibrium.sensitivities import Sensitivities
from ..errors import InputError, SimulationFailure
from ..scene.state import State
from ..structures.base import Design, Role
from ..structures.fitting import Placement, TargetFitting, best_placement
from ..structures.load_bound import LoadBound
from ..structures.opening import SAME_STATE
from ..structures.stress_bound import NEAR, Rows, StressBound
from .evaluation import DesignDerivatives, Evaluation, distance
from .requirements import Requirements
from .terms.base import Reference, term_class
from .weights import Weights

log = logging.getLogger(__name__)

# A trial point that takes longer than this is better met by a shorter step.
_TRIAL = NewtonOptions(max_iterations=80)
# Joints' movement that one step is enough for, as a share of the size. Measured on three C-shells:
# up to 0.6 % one step ends where five do, to five digits of J, in a fifth of the time; ways that
# begin in another state than the designs open into need more.
_REACH = 0.002


class DesignObjective:
    """F of one design, with the solver workspaces and Exudyn models that it needs, each made at
    first use: by each thread that works with it for itself."""

    def __init__(
        self,
        design: Design,
        weights: Weights = Weights(),
        reference: Reference | None = None,
        requirements: Requirements = Requirements.none(),
    ):
        self.design, self.weights, self.requirements = design, weights, requirements
        self.reference = reference if reference is not None else reference_of(design)
        self._fitting = TargetFitting(self.reference.target, weights.share, level=weights.level)
        self._terms = [
            (term_class(name)(design, self.reference), weight)
            for name, weight in weights.of_terms().items()
            if weight
        ]
        self._bounds: dict[str, StressBound] = {}
        if requirements.stress:
            bounds = {
                role.name: StressBound(design, design.scene(role.name), requirements.safety)
                for role in design.roles
            }
            self._bounds = {name: bound for name, bound in bounds.items() if bound.known}
        self._way = design.way if requirements.opening else None
        # which of the required sets of errors made the design snap last, and of states that were
        # tried lately whether they forgive, by elements, energy and further sets: see tolerance.py
        self.last_snapped = 0
        self.forgiven: dict[tuple[bytes, str, bytes], bool] = {}
        self._loads = self._load_bounds() if requirements.loads else []

    def _load_bounds(self) -> list[LoadBound]:
        """Those of all load cases that can be looked at; what hinders the others is said by the
        verdict on the design."""
        unloaded = self.reference.equilibria[self.design.fitted_role.name]
        safety = self.requirements.safety if self.requirements.stress else None
        found = []
        for case in self.design.load_cases:
            try:
                found.append(LoadBound(self.design, case, unloaded, safety))
            except InputError as error:
                log.info("%s: %s: %s", self.design.name, case.name, error)
        return found

    def evaluate(
        self,
        q: np.ndarray,
        previous: Evaluation | None = None,
        options: NewtonOptions = _TRIAL,
        fitted_only: bool = False,
    ) -> Evaluation:
        """F at q, warm-started from a previous evaluation (default: the input design's equilibria).

        fitted_only : the other roles' states stay as they were, for those who look at the fitted
            one alone

        Raises SimulationFailure, naming design and role, when an equilibrium isn't found.
        """
        starts = previous.equilibria if previous is not None else self.reference.equilibria
        equilibria = dict(starts) if fitted_only else {}
        for role in self.design.roles:
            if fitted_only and not role.fitted:
                continue
            equilibria[role.name] = self._found(role, q, starts[role.name], options)
        return self.judge(q, equilibria)

    def fitted_at(self, q: np.ndarray, near: Evaluation, start: Start) -> Equilibrium:
        """The fitted role's state alone at q, from a start that an evaluation's state predicts.

        Raises SimulationFailure as `evaluate` does.
        """
        role = self.design.fitted_role
        return self._found(role, q, near.equilibria[role.name], _TRIAL, start)

    def _found(
        self,
        role: Role,
        q: np.ndarray,
        near: Equilibrium,
        options: NewtonOptions,
        start: Start | None = None,
    ) -> Equilibrium:
        """A role's state at q, warm-started; SimulationFailure, naming design and role, where there
        is none, or one that can't be."""
        try:
            found = self._solve(role.name, q, near, role.opening, options, start)
            self.design.check_state(role.name, found.state)
        except SimulationFailure as failure:
            raise failure.within(f"{self.design.name}: {role.name} state") from None
        return found

    def redeploy(self, q: np.ndarray) -> Evaluation:
        """F at q, every role solved from the design's own starting geometry, with the states on its
        way from the assembly where designs have to open by themselves. May raise
        SimulationFailure."""
        try:
            found = self.judge(q, self.design.deploy(q))
        except SimulationFailure as failure:
            raise failure.within(self.design.name) from None
        return found if self._way is None else self.opened(found)

    def opened(self, evaluation: Evaluation) -> Evaluation:
        """F of the state that the design opens into by itself at the evaluation's parameters, with
        the states on its way there.

        Designs that are assembled in place are solved from there. Raises SimulationFailure.
        """
        design, q = self.design, evaluation.q
        role = design.fitted_role.name
        try:
            if self._way is None:
                found = self.judge(q, design.deploy(q))
                same = distance(design, found, evaluation) <= SAME_STATE
                return evaluation if same else found
            *way, deployed = self._way.opened(
                design.systems, q, design.assembled(q, evaluation.equilibria)
            )
            design.check_state(role, deployed.state)
        except SimulationFailure as failure:
            raise failure.within(f"{design.name}: on its way from the assembly") from None
        if self._way.apart(deployed, evaluation.equilibria[role]) <= SAME_STATE:
            return self._with_way(evaluation, way)
        found = self.judge(q, {**evaluation.equilibria, role: deployed})
        return self._with_way(found, way)

    def completed(self, evaluation: Evaluation, previous: Evaluation) -> Evaluation:
        """The evaluation with the states on its way from the assembly, from those of a previous
        one; the same one where these aren't known.

        Raises SimulationFailure where the way from the assembly doesn't lead to it.
        """
        if self._way is None or not previous.way or evaluation.way:
            return evaluation
        deployed = evaluation.equilibria[self.design.fitted_role.name]
        try:
            way = self._way.followed(self.design.systems, evaluation.q, previous.way, deployed)
        except SimulationFailure as failure:
            raise failure.within(f"{self.design.name}: on its way from the assembly") from None
        return self._with_way(evaluation, way)

    def _with_loads(self, evaluation: Evaluation) -> Evaluation:
        """The evaluation with its states under loads."""
        unloaded = evaluation.equilibria[self.design.fitted_role.name]
        loaded: dict[str, Mapping[float, Equilibrium]] = {}
        used = dict(evaluation.utilisation)
        for load in self._loads:
            loaded[load.case.name] = states = load.loaded(unloaded)
            used |= load.utilisation(unloaded, states)
        solved = [state for states in loaded.values() for state in states.values()]
        return replace(
            evaluation,
            loaded=loaded,
            utilisation=used,
            iterations=evaluation.iterations + sum(state.iterations for state in solved),
            solves=evaluation.solves + len(solved),
        )

    def _with_way(self, evaluation: Evaluation, way: Sequence[Equilibrium]) -> Evaluation:
        """The evaluation with the states on its way, and the stresses there."""
        assert self._way is not None
        utilisation = {}
        bound = self._bounds.get(self.design.fitted_role.name)
        if bound is not None:
            utilisation = {
                station.name: bound.utilisation(state)
                for station, state in zip(self._way.stations, way)
            }
        return replace(
            evaluation,
            way=tuple(way),
            utilisation={**evaluation.utilisation, **utilisation},
            iterations=evaluation.iterations + sum(state.iterations for state in way),
            solves=evaluation.solves + len(way),
        )

    def derivatives(self, evaluation: Evaluation, hessian: bool = True) -> DesignDerivatives:
        """Differentiate F at the evaluation's states, converged to round-off; Exudyn's, where it
        has confirmed them."""
        begin = perf_counter()
        evaluation = self._refined(evaluation)
        gradient = np.zeros(len(evaluation.q))
        model = np.zeros((len(evaluation.q),) * 2) if hessian else None
        bounds = {}
        for role in self.design.roles:
            terms = [(term, weight) for term, weight in self._terms if term.sees(role)]
            near = evaluation.utilisation.get(role.name, 0.0) > NEAR
            if not terms and not near and not (role.fitted and self._loads):
                continue
            sensitivities = Sensitivities(
                self.design.systems[role.name], evaluation.equilibria[role.name]
            )
            if near:
                bounds[role.name] = self._bounds[role.name].rows(sensitivities)
            if role.fitted:
                for load in self._loads:
                    bounds |= load.rows(sensitivities, evaluation.loaded[load.case.name])
            for term, weight in terms:
                if model is None:
                    gradient += weight * term.gradient(role, sensitivities, evaluation.fit)
                else:
                    slope, curvature = term.model(role, sensitivities, evaluation.fit)
                    gradient += weight * slope
                    model += weight * curvature
        bounds |= self._bounds_on_the_way(evaluation)
        seconds = {"sensitivities": perf_counter() - begin}
        return DesignDerivatives(gradient, model, evaluation, seconds, bounds)

    def _bounds_on_the_way(self, evaluation: Evaluation) -> dict[str, Rows]:
        """The bounds at the stations that come near to being met with."""
        if self._way is None or not evaluation.way:
            return {}
        bound = self._bounds.get(self.design.fitted_role.name)
        found = {}
        for station, state in zip(self._way.stations, evaluation.way):
            if bound is not None and evaluation.utilisation[station.name] > NEAR:
                system = self.design.systems[station.scene]
                found[station.name] = bound.rows(Sensitivities(system, state))
        return found

    def confirm(self, evaluation: Evaluation) -> Evaluation:
        """The same evaluation at Exudyn's own solutions, placed where its largest deviation is
        least; SimulationFailure where Exudyn doesn't confirm one."""
        if evaluation.confirmations:
            return evaluation
        evaluation = self._refined(evaluation)
        confirmations, equilibria = {}, {}
        for role in self.design.roles:
            name = role.name
            refined = evaluation.equilibria[name]
            try:
                confirmations[name] = confirm(
                    self.design.scene(name), refined, evaluation.q, role.opening
                )
            except SimulationFailure as failure:
                raise failure.within(f"{self.design.name}: {name} state") from None
            equilibria[name] = replace(refined, state=confirmations[name].state)
        found = replace(evaluation, equilibria=equilibria, confirmations=confirmations)
        return self.placed(found)

    def placed(self, evaluation: Evaluation) -> Evaluation:
        """The same evaluation, placed where its largest deviation is least."""
        fitted = evaluation.equilibria[self.design.fitted_role.name]
        joints = fitted.state.positions[self.design.joints]
        return replace(evaluation, fit=self._fitting.minimum_zone(joints, evaluation.fit))

    def deviation_near(self, state: State, near: Evaluation) -> float:
        """The largest deviation of a fitted state where it is placed best, % of the size.

        near : another state of the design, whose placement is known
        """
        role, joints = self.design.fitted_role.name, self.design.joints
        x, y = (at.positions[joints] for at in (state, near.equilibria[role].state))
        onto = best_placement(x, y)
        place = near.fit.placement
        start = Placement(place.rotation @ onto.rotation, place.apply(onto.translation[None])[0])
        return self._fitting.minimum_zone(x, replace(near.fit, placement=start)).max_percent

    def _refined(self, evaluation: Evaluation) -> Evaluation:
        """The same evaluation with its states converged to round-off."""
        if evaluation.confirmations:
            return evaluation
        equilibria = {
            name: refine(self.design.systems[name], state)
            for name, state in evaluation.equilibria.items()
        }
        return replace(evaluation, equilibria=equilibria)

    def follow(
        self, q: np.ndarray, previous: Evaluation, steps: int, fitted_only: bool = False
    ) -> list[Evaluation]:
        """Evaluations along the straight path from a previous one to q, in equal steps, each
        started from the last; see `evaluate`."""
        path: list[Evaluation] = []
        for t in np.linspace(0, 1, steps + 1)[1:]:
            at = q if t == 1 else previous.q + t * (q - previous.q)
            try:
                last = path[-1] if path else previous
                path.append(self.evaluate(at, last, NewtonOptions(), fitted_only))
            except SimulationFailure as failure:
                raise failure.within(f"at {t:.0%} of the way to the parts") from None
        return path

    def approach(self, q: np.ndarray, previous: Evaluation, steps: int) -> list[Evaluation]:
        """As `follow`, in no more steps than the way asks for: as many as keep the joints'
        predicted movement in each below 0.2 % of the size; in all of them where that fails. Where
        the elements stay as they are, so does the evaluation."""
        if np.array_equal(q, previous.q):
            return [replace(previous, iterations=0, solves=0)]
        fewer = min(steps, max(1, int(np.ceil(self._moved(q, previous) / _REACH))))
        try:
            return self.follow(q, previous, fewer)
        except SimulationFailure:
            if fewer == steps:
                raise
            return self.follow(q, previous, steps)

    def _moved(self, q: np.ndarray, previous: Evaluation) -> float:
        """How far the joint that moves most is predicted to move on the way to q, at its best
        placement, as a share of the size."""
        design, role = self.design, self.design.fitted_role.name
        near = previous.equilibria[role]
        there = Sensitivities(design.systems[role], near).predict(q - near.q)
        x, y = (start.state.positions[design.joints] for start in (there, near))
        placed = best_placement(x, y).apply(x)
        return float(np.linalg.norm(placed - y, axis=1).max()) / previous.fit.size

    def _solve(
        self,
        role: str,
        q: np.ndarray,
        near: Equilibrium,
        opening: float | None,
        options: NewtonOptions,
        start: Start | None = None,
    ) -> Equilibrium:
        system = self.design.systems[role]
        if np.array_equal(q, near.q) and opening == near.opening:
            return replace(near, iterations=0, escapes=0, wall_s=0.0)
        if start is None:
            start = Sensitivities(system, near).predict(q - near.q)
        try:
            return solve(system, q, start, opening, options)
        except SimulationFailure:
            # the linear prediction overshoots near bifurcations; the last state itself is the safer
            # start there
            return solve(system, q, near, opening, options)

    def judge(
        self,
        q: np.ndarray,
        equilibria: dict[str, Equilibrium],
        way: Sequence[Equilibrium] = (),
    ) -> Evaluation:
        """F of given equilibria, and of those on the way where they are known; depends on nothing
        else, so a resumed run judges as the first one did."""
        role = self.design.fitted_role.name
        joints = equilibria[role].state.positions[self.design.joints]
        fit = self._fitting(joints)
        terms = {
            term.label(role): weight * term.value(role, equilibria[role.name], fit)
            for term, weight in self._terms
            for role in self.design.roles
            if term.sees(role)
        }
        value = float(sum(terms.values()))
        if not np.isfinite(value):
            raise SimulationFailure("the objective is not a finite number", where=self.design.name)
        found = Evaluation(
            np.array(q),
            value,
            terms,
            fit,
            equilibria,
            {},
            sum(eq.iterations for eq in equilibria.values()),
            len(equilibria),
            {name: bound.utilisation(equilibria[name]) for name, bound in self._bounds.items()},
        )
        if self._loads:
            found = self._with_loads(found)
        return self._with_way(found, way) if way else found


def reference_of(design: Design) -> Reference:
    """Simulate the input design: its target, its equilibria, its energy. May raise
    SimulationFailure."""
    try:
        target = design.target
        equilibria = design.deploy()
    except SimulationFailure as failure:
        raise failure.within(f"{design.name}: input design") from None
    return Reference(target, equilibria[design.fitted_role.name].elastic_energy, equilibria)
