"""The way from a design's assembly to its deployed state, as a builder goes it.

The way is a sequence of stations: the growing mean angles of a C-shell, say. Opened from the
assembly, each station's state is solved from the one before it, and the last one leads to the
deployed state. Once these states are known for one design, those of a design with other parameters
are predicted from them by sensitivities and corrected; what is left to verify is that each state
leads into the next.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from ..equilibrium.equilibria import Equilibrium, Start
from ..equilibrium.newton import NewtonOptions, solve
from ..equilibrium.sensitivities import Sensitivities
from ..equilibrium.system import System
from ..errors import SimulationFailure

SAME_STATE = 1e-3  # of the bounding box: states whose joints are this close are one
_FLAT = 1e-4  # of the joints' extent: less than that out of their plane is none
_MOST_ITERATIONS = 80  # of a correction; what takes longer isn't near the predicted state
_HALVINGS = 4  # of a step that leaves the assembly's plane
_PARTS = (1, 2, 4)  # of the way between two stations that one is led to the other in


@dataclass(frozen=True)
class Station:
    """A state on the way from the assembly to the deployed design.

    name : as messages and results have it
    scene : name of the scene that it is a state of, see `Design.systems`
    opening : rad, prescribed mean hinge angle, or None without actuation
    side : (n_free,) direction out of the assembly's plane that the builder pushes to, or None
    """

    name: str
    scene: str
    opening: float | None = None
    side: np.ndarray | None = None

    @property
    def options(self) -> NewtonOptions:
        return NewtonOptions(side=self.side)


@dataclass(frozen=True)
class Way:
    """The stations of a design.

    opening : mean angle of the assembly, or None without actuation
    stations : on the way, in order
    deployed : where the way ends
    joints : (n_joints,) bodies by which states are compared
    diagonal : size to which distances are relative

    The methods' `systems` are the design's workspaces, by the names of scenes.
    """

    opening: float | None
    stations: tuple[Station, ...]
    deployed: Station
    joints: np.ndarray
    diagonal: float

    def opened(
        self,
        systems: Mapping[str, System],
        q: np.ndarray,
        assembled: Start,
        solve: Callable[..., Equilibrium] = solve,
    ) -> list[Equilibrium]:
        """The states at all stations and the deployed one, each solved from the one before, by
        the fast solver or another engine's `solve`.

        Mean angles grow in half the steps from station to station, and in shorter ones where the
        assembly leaves its plane: far beyond the bifurcation an iteration may end on the other
        side. Iterations of a state count those of all steps to it. Raises SimulationFailure, naming
        the station, where none is found.
        """
        found: list[Equilibrium] = []
        before: Start | Equilibrium = assembled
        opening = self.opening
        for station in (*self.stations, self.deployed):
            system, steps = systems[station.scene], [station.opening]
            if opening is not None and station.opening is not None:
                steps = [0.5 * (opening + station.opening), station.opening]
            passed: list[Equilibrium] = []
            try:
                for to in steps:
                    passed += _opened_to(solve, system, q, before, opening, to, station, _HALVINGS)
                    before, opening = passed[-1], to
            except SimulationFailure as failure:
                raise failure.within(station.name) from None
            found.append(passed[-1].after(*passed[:-1]))
        return found

    def followed(
        self,
        systems: Mapping[str, System],
        q: np.ndarray,
        known: Sequence[Equilibrium],
        deployed: Equilibrium,
    ) -> list[Equilibrium]:
        """The states at the stations, from those known at other parameters.

        A state that has left the assembly's plane has to lead into the next one, and the last into
        `deployed`; those in the plane, and the first one out of it, are predicted from the known
        ones. A step that is too long may miss the branch, so more and shorter ones are taken before
        the way counts as broken. Raises SimulationFailure, naming the station, where it does.
        """
        reason = SimulationFailure("no station", where=self.deployed.name)
        for parts in _PARTS:
            try:
                found = self._chain(systems, q, known, deployed, parts)
            except SimulationFailure as failure:
                reason = failure
                continue
            moved = self.apart(found[-1], deployed)
            if moved <= SAME_STATE:
                return found[:-1]
            reason = SimulationFailure(
                f"opens into another state, {100 * moved:.2g} % of its size away"
            )
        raise reason

    def _chain(
        self,
        systems: Mapping[str, System],
        q: np.ndarray,
        known: Sequence[Equilibrium],
        deployed: Equilibrium,
        parts: int,
    ) -> list[Equilibrium]:
        """The states at the stations, each led to in so many steps, and where they lead to."""
        found: list[Equilibrium] = []
        for number, (station, near) in enumerate(
            zip((*self.stations, self.deployed), (*known, deployed))
        ):
            try:
                if found and not self.is_flat(found[-1]):
                    before = systems[self.stations[number - 1].scene]
                    found.append(_led(before, systems[station.scene], q, found[-1], station, parts))
                else:
                    found.append(_near(systems[station.scene], q, near, station))
            except SimulationFailure as failure:
                raise failure.within(station.name) from None
        return found

    def is_flat(self, state: Equilibrium) -> bool:
        """Whether the joints lie in one plane."""
        x = state.state.positions[self.joints]
        sizes = np.linalg.svd(x - x.mean(axis=0), compute_uv=False)
        return bool(sizes[2] <= _FLAT * sizes[0])

    def apart(self, a: Equilibrium, b: Equilibrium) -> float:
        """The largest distance of a joint in two states at their best placement, as a share of
        the size."""
        x, y = (e.state.positions[self.joints] for e in (a, b))
        x, y = x - x.mean(axis=0), y - y.mean(axis=0)
        turn, _ = Rotation.align_vectors(y, x)
        return float(np.linalg.norm(turn.apply(x) - y, axis=1).max()) / self.diagonal


def _opened_to(
    solve: Callable[..., Equilibrium],
    system: System,
    q: np.ndarray,
    before: Start | Equilibrium,
    opening: float | None,
    to: float | None,
    station: Station,
    halvings: int,
) -> list[Equilibrium]:
    """The states on a step to another opening; it is halved where the wrong side is taken."""
    here = solve(system, q, before, to, station.options)
    wrong = here.escapes > 0 and station.side is not None and _height(system, here, station) < 0
    if not wrong or opening is None or to is None or not halvings:
        return [here]
    half = 0.5 * (opening + to)
    first = _opened_to(solve, system, q, before, opening, half, station, halvings - 1)
    return first + _opened_to(solve, system, q, first[-1], half, to, station, halvings - 1)


def _height(system: System, state: Equilibrium, station: Station) -> float:
    """How far a state lies to the side that a builder pushes to."""
    places = np.zeros(system.scene.n_dofs)
    positions = state.state.positions
    places[: 6 * len(positions)].reshape(-1, 6)[:, :3] = positions
    side = station.side
    assert side is not None
    return float(places[system.sparsity.free] @ side / max(np.linalg.norm(side), 1e-300))


def _near(system: System, q: np.ndarray, near: Equilibrium, station: Station) -> Equilibrium:
    """A station's state, predicted from one at other parameters and corrected.

    Close to the bifurcation out of the plane the prediction may end on the other side; the known
    state itself is the safer start then.
    """
    options = replace(station.options, max_iterations=_MOST_ITERATIONS)
    for start in (Sensitivities(system, near).predict(q - near.q), near):
        here = solve(system, q, start, station.opening, options)
        if station.side is None or _height(system, here, station) >= -_FLAT * system.scene.size:
            return here
    raise SimulationFailure("rises to the other side")


def _led(
    before: System,
    system: System,
    q: np.ndarray,
    here: Equilibrium,
    station: Station,
    parts: int,
) -> Equilibrium:
    """The state that one leads to at the next station, in equal parts of the way."""
    options = NewtonOptions(max_iterations=_MOST_ITERATIONS)
    if here.opening is None or station.opening is None or before is not system:
        return solve(system, q, here, station.opening, options)
    step, state = (station.opening - here.opening) / parts, here
    for k in range(1, parts + 1):
        start = Sensitivities(system, state).predict(np.zeros_like(q), step)
        opening = station.opening if k == parts else here.opening + k * step
        state = solve(system, q, start, opening, options)
    return state
