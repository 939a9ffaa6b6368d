"""An umbrella mesh's way from its compact state to the final one: the scenes of the stages that
`deployment` lays out, and the states that a builder sees on the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ...equilibrium.equilibria import Equilibrium, Start
from ...equilibrium.newton import NewtonOptions
from ...equilibrium.newton import solve as fast
from ...equilibrium.system import System
from ...errors import SimulationFailure
from ...scene.state import State
from ..fitting import best_placement
from ..opening import SAME_STATE
from .deployment import Deployment, Stage, drawn_towards, follow, state_of

if TYPE_CHECKING:
    from ...scene.attraction import Attraction
    from ...scene.scene import Scene
    from ..base import Solve, Target
    from .mesh import UmbrellaMesh
    from .pins import Anchor, Pins
    from .scene import UmbrellaScene

_LIGHT = 0.01  # of the attraction: a guide that strains the mesh little


class Opened(Protocol):
    """What the way of a design is made of: see `Umbrella`."""

    name: str
    mesh: UmbrellaMesh
    deployment: Deployment
    pins: Pins | None
    joints: np.ndarray

    @property
    def model(self) -> UmbrellaScene: ...
    @property
    def held(self) -> Scene: ...
    @property
    def anchor(self) -> Anchor | None: ...
    @property
    def target(self) -> Target: ...
    @property
    def systems(self) -> dict[str, System]: ...
    def attractions(self) -> tuple[Attraction, ...]: ...


class Opening:
    """The way of a design at parameters q.

    solve : of an engine, as `equilibrium.newton.solve`, which is the default
    """

    def __init__(self, design: Opened, q: np.ndarray, solve: Solve | None = None):
        self._design, self._q = design, q
        self._solve = fast if solve is None else solve
        self._attraction = design.attractions()
        self.compact = self._placed_compact()
        model = design.model
        self._scene = model.scene if self._attraction else design.held
        self._upright = model.actuators.spacings(self.compact)

    def followed(self, deployment: Deployment) -> list[Equilibrium]:
        """The equilibria along the path, the final one last; a second time with weaker loads where
        that fails. Raises SimulationFailure."""
        name = self._design.name
        path, weaker = deployment.path(), deployment.path(gentle=True)
        tolerance = deployment.tolerance

        def reach(stage: Stage, start: State | Equilibrium, iterations: int) -> Equilibrium:
            return self._reached(stage, start, NewtonOptions(tolerance, max_iterations=iterations))

        try:
            return follow(self.compact, path, reach, deployment, name)
        except SimulationFailure as failure:
            try:
                return follow(self.compact, weaker, reach, deployment, name)
            except SimulationFailure:
                raise failure from None

    def through(self, deployed: Equilibrium | None) -> dict[str, Equilibrium]:
        """The compact state and those at the stages, by name, each placed like the next one: the
        last stage moves the open mesh to where it is held.

        deployed : where the way should end, or None

        What guides the mesh to its places strains it on the way, so a light guide is taken where
        that leads to the deployed state without branching.
        """
        found = self._lightly(deployed) or self.followed(self._design.deployment)
        path = [found[-1]]
        for state in [*found[-2::-1], self._closed(found[0])]:
            if _openness(state.state) < _openness(path[-1].state):  # else a stage tried in vain
                path.append(replace(state, state=self._placed_like(path[-1].state, state.state)))
        final, *between, closed = path
        stages = {
            f"stage {k}, opened by {_openness(e.state) / _openness(final.state):.0%}": e
            for k, e in enumerate(reversed(between), 1)
        }
        return {"compact": closed, **stages, "deployed": final}

    def _lightly(self, deployed: Equilibrium | None) -> Sequence[Equilibrium] | None:
        """The equilibria along the path with a light guide; None where it branches or leads
        elsewhere."""
        design = self._design
        attraction = _LIGHT * design.deployment.attraction
        try:
            found = self.followed(replace(design.deployment, attraction=attraction))
        except SimulationFailure:
            return None
        if any(state.escapes for state in found):
            return None
        if deployed is not None:
            placed = self._placed_like(deployed.state, found[-1].state)
            apart = placed.positions[design.joints] - deployed.state.positions[design.joints]
            if np.linalg.norm(apart, axis=1).max() > SAME_STATE * design.target.size:
                return None
        return found

    def _closed(self, like: Equilibrium) -> Equilibrium:
        """The compact state, with the stresses that its elements have there."""
        system = System(self._design.model.scene)
        system.set_parameters(self._q)
        energy = system.assemble(self.compact)
        return replace(
            like,
            state=self.compact,
            stress=system.stress(),
            elastic_energy=energy.elastic,
            potential=energy.potential,
        )

    def _placed_compact(self) -> State:
        """The compact state as near to the target as it can be."""
        design = self._design
        compact = design.model.compact(self._q, design.deployment.angle)
        if not self._attraction:
            return compact
        x = np.concatenate([term.queries(compact) for term in self._attraction])
        places = np.concatenate([term.targets for term in self._attraction])
        placed = best_placement(x, places)
        return compact.transformed(placed.rotation, placed.translation)

    def _reached(
        self, stage: Stage, start: State | Equilibrium, options: NewtonOptions
    ) -> Equilibrium:
        """The equilibrium of a stage; of the final one, to the usual tolerance."""
        design, q = self._design, self._q
        if stage.final:
            options = NewtonOptions(max_iterations=options.max_iterations)
            return self._solve(design.systems["deployed"], q, self._laid(start), options=options)
        model = design.model
        spacing = self._upright + stage.opening * (design.mesh.spacing - self._upright)
        actuators = model.actuators.weighted(stage.actuators * model.energy_scale, spacing)
        drawn = (
            drawn_towards(term, self.compact, stage.opening, stage.attraction)
            for term in self._attraction
        )
        system = System(self._scene.with_terms(actuators, model.limits, *drawn))
        return self._solve(system, q, start, options=options)

    def _laid(self, state: State | Equilibrium) -> State | Start | Equilibrium:
        """An open mesh, moved rigidly to where the final state is held."""
        design = self._design
        if design.pins is not None:
            places = self._q[design.mesh.lengths.size :].reshape(-1, 3)
            return design.pins.aligned(state_of(state), design.joints[design.pins.joints], places)
        if design.anchor is None:
            return state
        placed = design.anchor.placed(state_of(state), design.joints)
        return Start(placed, stress=state.stress if isinstance(state, Equilibrium) else None)

    def _placed_like(self, other: State, state: State) -> State:
        joints = self._design.joints
        x, y = (each.positions[joints] for each in (state, other))
        placed = best_placement(x, y)
        return state.transformed(placed.rotation, placed.translation)


def _openness(state: State) -> float:
    """Mean turn of all hinges, rad."""
    return float(np.abs(state.angles).mean())
