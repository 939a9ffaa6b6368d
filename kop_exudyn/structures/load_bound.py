"""A load case as bounds on a design that is still sought: how far it deflects under the loads, and
its stress under the factored ones.

The loaded design is held where the unloaded one has its supports, and those move with the elements.
So the loaded scene has the supports' places p as further parameters, beside the elements q. With
x(q) the unloaded state, p = x_s(q), and the chain rule gives what follows from both:

    d u(q, p(q)) / dq = u_q + u_p dx_s/dq

with u_q, u_p from the sensitivities of the loaded scene and dx_s/dq from those of the unloaded one.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Indices
from ..equilibrium.equilibria import Equilibrium
from ..equilibrium.newton import NewtonOptions, solve
from ..equilibrium.sensitivities import Sensitivities
from ..equilibrium.system import System
from ..errors import SimulationFailure
from ..scene.assembly import ENERGY, GRADIENT
from ..scene.scene import Driven, Scene
from .base import Design
from .loading import held_scene, loaded_scene
from .loads import LoadCase
from .opening import SAME_STATE
from .stress_bound import MOST_ROWS, NEAR, Rows, StressBound

GIVES_WAY = 10.0  # utilisation that stands for a state that is not there
_STEPS = 3  # to the largest factor
_FAR = 0.02  # of the size: a step that moves more has to lead back to where it began
# a design that gives way finds no other state here: it doesn't carry the load
_NO_SADDLES = NewtonOptions(escapes=0, soften=False, max_iterations=60)


@dataclass(frozen=True)
class _Asked:
    """What a loaded state is asked for.

    factor : of the loads
    scene : under them
    stress : bound on its stress, or None
    deflection : whether it is bounded
    """

    factor: float
    scene: Scene
    stress: StressBound | None
    deflection: bool


class LoadBound:
    """What one load case asks of a design, for elements near those of a known state.

    case : with its factor and its limit on deflections
    unloaded : the design's deployed state, from which supports are chosen where the case names none
    safety : factor that divides the elastic limit; None: stress is not bounded

    Deflections are those of the rods' joints and nodes on their axes. Raises InputError where a
    density is missing or the supports don't hold the design.
    """

    def __init__(
        self, design: Design, case: LoadCase, unloaded: Equilibrium, safety: float | None = 1.0
    ):
        self.case = case
        supports, held = held_scene(design, unloaded, case)
        self._supports = design.joints[supports]
        dofs = (6 * self._supports[:, None] + np.arange(3)).ravel()
        self._moved = np.setdiff1d(dofs, held.driven.dofs)
        self._scene = with_places(held, self._moved)
        self._nodes = np.unique(self._scene.node_body)
        bounded = case.deflection.allowed(1.0) < np.inf
        factors = {case.factor, *((1.0,) if bounded else ())}
        steps = {float(f) for f in np.linspace(0, max(factors), _STEPS + 1)[1:]}
        self._steps: list[_Asked] = []
        self._own = threading.local()
        self._size = design.target.size
        for factor in sorted(steps | factors):
            scene = loaded_scene(design, self._scene, unloaded, case, factor)
            bound = StressBound(design, scene, safety) if safety is not None else None
            strong = bound if bound is not None and bound.known and factor == case.factor else None
            self._steps.append(_Asked(factor, scene, strong, bounded and factor == 1.0))

    @property
    def states(self) -> list[str]:
        """What is bounded, as results name it."""
        return [name for asked in self._steps for name in self._names(asked)]

    def loaded(self, unloaded: Equilibrium) -> dict[float, Equilibrium]:
        """By factor of the loads, the states that an unloaded one deforms into; empty where it
        gives way."""
        z = np.concatenate([unloaded.q, unloaded.state.positions.reshape(-1)[self._places]])
        found: dict[float, Equilibrium] = {}
        here: Equilibrium = replace(unloaded, q=z)
        before: _Asked | None = None
        for asked in self._steps:
            try:
                there = solve(self._system(asked), z, here, unloaded.opening, _NO_SADDLES)
                if self._apart(here, there) > _FAR and not self._leads_back(before, here, there):
                    return {}
            except SimulationFailure:
                return {}
            here, before = there, asked
            found[asked.factor] = here
        return found

    def _leads_back(self, before: _Asked | None, here: Equilibrium, there: Equilibrium) -> bool:
        """Whether a state leads back to the one before it, when the loads are taken away again: a
        design that has given way ends in another one."""
        system = System(self._scene) if before is None else self._system(before)
        back = solve(system, here.q, there, here.opening, _NO_SADDLES)
        return self._apart(here, back) <= SAME_STATE

    def _apart(self, a: Equilibrium, b: Equilibrium) -> float:
        """How far apart a body of the rods is in two states, as a share of the size."""
        return float(np.linalg.norm(self.moves(a, b), axis=1).max()) / self._size

    def moves(self, unloaded: Equilibrium, loaded: Equilibrium) -> np.ndarray:
        """(n, 3) how far the rods' n bodies move under the loads."""
        return loaded.state.positions[self._nodes] - unloaded.state.positions[self._nodes]

    def moves_adjoint(
        self, sensitivities: Sensitivities, factor: float, loaded: Equilibrium, weights: np.ndarray
    ) -> np.ndarray:
        """(nq,) the derivative of sum(weights * moves) in the elements, by two adjoint solves.

        sensitivities : of the unloaded state
        factor, loaded : of the loads, and the state under them
        weights : (n, 3)
        """
        dofs = (6 * self._nodes[:, None] + np.arange(3)).ravel()
        both = self._loaded_sensitivities(factor, loaded).adjoint(dofs, weights.ravel())
        nq = len(sensitivities.equilibrium.q)
        of_places = sensitivities.adjoint(self._moved, both[nq:])
        return both[:nq] + of_places - sensitivities.adjoint(dofs, weights.ravel())

    def moves_derivatives(
        self, sensitivities: Sensitivities, factor: float, loaded: Equilibrium
    ) -> np.ndarray:
        """(n, 3, nq) derivatives of `moves` in the elements; parameters as of `moves_adjoint`."""
        own = self._loaded_sensitivities(factor, loaded)
        places = sensitivities.rows(self._moved)
        return self._moves_derivatives(sensitivities, own, places, self._nodes)

    def work(self, factor: float, unloaded: Equilibrium, loaded: Equilibrium) -> float:
        """f.u, of a factor of the loads and of how far what they act on moves."""
        system = self._loads(factor)
        system.set_parameters(unloaded.q)
        before = system.assemble(unloaded.state, ENERGY).potential
        return before - system.assemble(loaded.state, ENERGY).potential

    def work_adjoint(
        self, sensitivities: Sensitivities, factor: float, loaded: Equilibrium
    ) -> np.ndarray:
        """(nq,) the derivative of `work` in the elements, by three adjoint solves; parameters as of
        `moves_adjoint`."""
        unloaded, system = sensitivities.equilibrium, self._loads(factor)
        nq = len(unloaded.q)
        system.set_parameters(unloaded.q)
        kept = system.sparsity.kept
        dofs = np.flatnonzero(kept >= 0)
        pulls = []
        for state in (unloaded.state, loaded.state):
            system.assemble(state, GRADIENT)
            pulls.append(system.gradient[kept[dofs]])
        both = self._loaded_sensitivities(factor, loaded).adjoint(dofs, -pulls[1])
        found = both[:nq] + sensitivities.adjoint(self._moved, both[nq:])
        found += sensitivities.adjoint(dofs, pulls[0])
        if (weight := system.scene.weight) is not None:
            x0, x1 = (self._scene.node_poses(s.state)[0] for s in (unloaded, loaded))
            mean = (x1 - x0)[self._scene.elements].mean(axis=1)
            found += self._scene.by_parameter(np.einsum("ei,ei->e", weight, mean))[:nq]
        return found

    def stiffness_product(
        self, sensitivities: Sensitivities, factor: float, loaded: Equilibrium
    ) -> np.ndarray:
        """(nq, nq) u_q^T K u_q, of the derivatives of all movements under the loads, and the
        stiffness in the loaded state; parameters as of `moves_adjoint`."""
        own = self._loaded_sensitivities(factor, loaded)
        dofs = own.system.sparsity.free
        places = sensitivities.rows(self._moved)
        moved_q = _chained(own.full, places) - sensitivities.rows(dofs)
        return moved_q.T @ own.system.multiply(moved_q)

    def _of(self, factor: float) -> _Asked:
        return next(one for one in self._steps if one.factor == factor)

    def _loaded_sensitivities(self, factor: float, loaded: Equilibrium) -> Sensitivities:
        """Of the state under a factor of the loads."""
        return Sensitivities(self._system(self._of(factor)), loaded)

    def _moves_derivatives(
        self, sensitivities: Sensitivities, own: Sensitivities, places: np.ndarray, nodes: Indices
    ) -> np.ndarray:
        loaded_q = _chained(own.positions(nodes), places)
        return (loaded_q - sensitivities.positions(nodes)).reshape(len(nodes), 3, -1)

    def utilisation(
        self, unloaded: Equilibrium, loaded: Mapping[float, Equilibrium]
    ) -> dict[str, float]:
        """Of what is allowed, by what is bounded; `GIVES_WAY` where there is no loaded state.

        loaded : as `loaded` has it
        """
        if not loaded:
            return dict.fromkeys(self.states or [self.case.name], GIVES_WAY)
        found = {}
        for asked in self._steps:
            state = loaded[asked.factor]
            if asked.deflection:
                moved = np.linalg.norm(self.moves(unloaded, state), axis=1)
                found[self._deflection] = float(moved.max()) / self._allowed(unloaded)[0]
            if asked.stress is not None:
                found[self._stress] = asked.stress.utilisation(state)
        return found or {self.case.name: 0.0}

    def rows(
        self, sensitivities: Sensitivities, loaded: Mapping[float, Equilibrium]
    ) -> dict[str, Rows]:
        """The bounds that come near to being met with, linearised in the elements; none where the
        design gives way.

        sensitivities : of the unloaded state
        loaded : as `loaded` has it
        """
        found: dict[str, Rows] = {}
        if not loaded:
            return found
        unloaded = sensitivities.equilibrium
        used = self.utilisation(unloaded, loaded)
        near = {name for name, value in used.items() if value > NEAR}
        for asked in self._steps:
            if not near & set(self._names(asked)):
                continue
            places = sensitivities.rows(self._moved)
            own = self._loaded_sensitivities(asked.factor, loaded[asked.factor])
            if asked.stress is not None and self._stress in near:
                rows = asked.stress.rows(own)
                found[self._stress] = Rows(rows.value, _chained(rows.jacobian, places))
            if asked.deflection and self._deflection in near:
                found[self._deflection] = self._deflection_rows(sensitivities, own, places)
        return found

    def _deflection_rows(
        self, sensitivities: Sensitivities, own: Sensitivities, places: np.ndarray
    ) -> Rows:
        unloaded = sensitivities.equilibrium
        moved = self.moves(unloaded, own.equilibrium)
        size = np.linalg.norm(moved, axis=1)
        allowed, allowed_q = self._allowed(unloaded, sensitivities)
        some = np.argsort(-size)[:MOST_ROWS]
        some = some[size[some] > NEAR * allowed]
        moved_q = self._moves_derivatives(sensitivities, own, places, self._nodes[some])
        unit = moved[some] / size[some][:, None]
        jacobian = np.einsum("mi,miq->mq", unit, moved_q) / allowed
        jacobian -= np.outer(size[some] / allowed**2, allowed_q)
        return Rows(size[some] / allowed - 1.0, jacobian)

    def _allowed(
        self, unloaded: Equilibrium, sensitivities: Sensitivities | None = None
    ) -> tuple[float, np.ndarray]:
        """The allowed deflection and, with sensitivities, its derivative (nq,)."""
        x = unloaded.state.positions[self._supports]
        apart = np.linalg.norm(x[:, None] - x[None], axis=2)
        a, b = np.unravel_index(np.argmax(apart), apart.shape)
        span = float(apart[a, b])
        allowed, limit = self.case.deflection.allowed(span), self.case.deflection.absolute
        slope = np.zeros(len(unloaded.q))
        if sensitivities is not None and (limit is None or allowed < limit):
            x_q = sensitivities.positions(self._supports[[a, b]]).reshape(2, 3, -1)
            slope = allowed / span * ((x[a] - x[b]) / span @ (x_q[0] - x_q[1]))
        return allowed, slope

    def _system(self, asked: _Asked) -> System:
        """The workspace of a loaded scene; each thread has its own."""
        return self._workspace("systems", asked.factor, lambda: asked.scene)

    def _loads(self, factor: float) -> System:
        """The workspace of the loads alone."""
        return self._workspace("loads", factor, lambda: self._only_loads(factor))

    def _workspace(self, kind: str, factor: float, scene: Callable[[], Scene]) -> System:
        systems: dict[float, System] = self._own.__dict__.setdefault(kind, {})
        if factor not in systems:
            systems[factor] = System(scene())
        return systems[factor]

    def _only_loads(self, factor: float) -> Scene:
        """What a factor of the loads adds to the held scene, whose potential is theirs alone."""
        held, loaded = self._scene, self._of(factor).scene
        weight = loaded.weight
        if weight is not None and held.weight is not None:
            weight = weight - held.weight
        bare = replace(loaded, stiffness=np.zeros_like(loaded.stiffness), weight=weight)
        return bare.with_terms(*loaded.terms[len(held.terms) :])

    @property
    def _places(self) -> np.ndarray:
        """Of the supports' coordinates that are parameters, among all bodies' coordinates."""
        return 3 * (self._moved // 6) + self._moved % 6

    @property
    def _stress(self) -> str:
        return f"{self.case.name}, stress"

    @property
    def _deflection(self) -> str:
        return f"{self.case.name}, deflection"

    def _names(self, asked: _Asked) -> list[str]:
        found = [self._stress] if asked.stress is not None else []
        return found + ([self._deflection] if asked.deflection else [])


def with_places(scene: Scene, dofs: np.ndarray) -> Scene:
    """A scene in which some pinned unknowns are parameters of their own, after all others."""
    pinned, old = scene.pinned.copy(), scene.driven
    pinned[dofs] = False
    n = len(dofs)
    driven = Driven(
        np.concatenate([old.dofs, dofs]),
        np.concatenate([old.constants, np.zeros(n)]),
        np.concatenate([old.parameters, scene.n_parameters + np.arange(n)]),
        np.concatenate([old.factors, np.ones(n)]),
    )
    return replace(scene, n_parameters=scene.n_parameters + n, pinned=pinned, driven=driven)


def _chained(jacobian: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(m, nq) from derivatives (m, nq + n) in elements and places, and those of the places
    (n, nq)."""
    nq = places.shape[1]
    return jacobian[:, :nq] + jacobian[:, nq:] @ places
