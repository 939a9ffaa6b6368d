"""The way from a design's assembly to its deployed state, as a builder goes it.

The way is a sequence of stations: the growing mean angles of a C-shell, say. Opened from the
assembly, each station's state is solved from the one before it, and the last one leads to the
deployed state. Where an assembly is flat, and has many ways to leave its plane, the builder lifts
it towards the wanted shape at one station, early on, while that takes little force; from there on
nothing but the opening moves it. Once these states are known for one design, those of a design with
other parameters are predicted from them by sensitivities and corrected up to there; what is left to
verify is that each state leads into the next.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ..equilibrium.equilibria import Equilibrium, Start
from ..equilibrium.newton import NewtonOptions, solve
from ..equilibrium.sensitivities import Sensitivities
from ..equilibrium.system import System
from ..errors import SimulationFailure
from ..scene.state import State

SAME_STATE = 1e-3  # of the bounding box: states whose joints are this close are one
_FLAT = 1e-4  # of the bounding box: mean heights of joints that are none
_MOST_ITERATIONS = 80  # of a correction; what takes longer isn't near the predicted state
_OTHER_SIDE = 0.5  # of the distance from a shape, that from its mirror image: a state is this one
_PARTS = (1, 2, 4)  # of the way between two stations that one is led to the other in


@dataclass(frozen=True)
class Station:
    """A state on the way from the assembly to the deployed design.

    name : as messages and results have it
    scene : name of the scene that it is a state of, see `Design.systems`
    opening : rad, prescribed mean hinge angle, or None without actuation
    lifted : shape that the builder lifts the assembly to at this station before it is let go, or
        None; stations after one that has a shape have one, too, for what falls back flat
    """

    name: str
    scene: str
    opening: float | None = None
    lifted: Start | None = None

    def side(self, system: System) -> np.ndarray | None:
        """(n_free,) where a saddle is left to: towards the shape to lift to, whose mirror image is
        as good an equilibrium. A net may bend in another way first, and turn into that shape at a
        bifurcation on the way."""
        if self.lifted is None:
            return None
        heights = np.zeros(system.scene.n_dofs)
        z = self.lifted.state.positions[:, 2]
        heights[: 6 * len(z)].reshape(-1, 6)[:, 2] = z - z.mean()
        return heights[system.sparsity.free]


@dataclass(frozen=True)
class Way:
    """The stations of a design.

    opening : mean angle of the assembly, or None without actuation
    stations : on the way, in order
    deployed : where the way ends
    joints : (n_joints,) bodies by which states are compared
    size : to which distances are relative

    The methods' `systems` are the design's workspaces, by the names of scenes.
    """

    opening: float | None
    stations: tuple[Station, ...]
    deployed: Station
    joints: np.ndarray
    size: float

    def opened(
        self,
        systems: Mapping[str, System],
        q: np.ndarray,
        assembled: Start,
        solve: Callable[..., Equilibrium] = solve,
    ) -> list[Equilibrium]:
        """The states at all stations and the deployed one, each solved from the one before, by
        the fast solver or another engine's `solve`.

        Mean angles grow in half the steps from station to station. Where a saddle is left on such a
        step, it was too long to tell which way the design goes there, and is taken in two parts,
        then in four: engines that iterate differently follow the same way. Iterations of a state
        count those of all states since the one before. Raises SimulationFailure, naming the
        station, where none is found.
        """
        found: list[Equilibrium] = []
        before: Start | Equilibrium = assembled
        opening = self.opening
        for number, station in enumerate((*self.stations, self.deployed)):
            system, steps = systems[station.scene], [station.opening]
            if station.lifted is not None and self._is_lifted(number, before.state):
                before, opening = station.lifted, None
            if opening is not None and station.opening is not None:
                steps = [0.5 * (opening + station.opening), station.opening]
            passed: list[Equilibrium] = []
            try:
                options = NewtonOptions(side=station.side(system))
                for to in steps:
                    passed += _stepped(system, q, before, opening, to, solve, options)
                    before, opening = passed[-1], to
                other = self._righted(system, q, station, passed[-1], solve)
                if other is not None:
                    passed.append(other)
                    before = other
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

        From the station on where the assembly is lifted, as it is there, each has to lead into the
        next one, and the last into `deployed`; those before are predicted from the known ones.
        Without lifting, the first one is. A step that is too long may miss the branch, so more and
        shorter ones are taken before the way counts as broken. Raises SimulationFailure, naming the
        station, where it does.
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
        stations = (*self.stations, self.deployed)
        first = self._first
        for number, (station, near) in enumerate(zip(stations, (*known, deployed))):
            try:
                lifted = station.lifted is not None and (
                    number == first or self._is_lifted(number, found[-1].state)
                )
                if number > first and not lifted:
                    before = systems[self.stations[number - 1].scene]
                    state = _led(before, systems[station.scene], q, found[-1], station, parts)
                else:
                    state = _near(systems[station.scene], q, near, station)
                other = self._righted(systems[station.scene], q, station, state, solve)
                found.append(state if other is None else other)
            except SimulationFailure as failure:
                raise failure.within(station.name) from None
        return found

    def _righted(
        self,
        system: System,
        q: np.ndarray,
        station: Station,
        found: Equilibrium,
        solve: Callable[..., Equilibrium],
    ) -> Equilibrium | None:
        """The state on the side of the shape to lift to, where a station's state has come out as
        that shape's mirror image, and its own mirror image is one; else None.

        A net may bend in another way first, and turn into one of the two where that one ends. A
        flat assembly is its own mirror image: lifted to the other side first, it would have come
        out here. Builders find out by trying.
        """
        if station.lifted is None or not self._mirrored(station.lifted.state, found.state):
            return None
        options = NewtonOptions(side=station.side(system))
        other = solve(system, q, station.lifted, station.opening, options)
        x, y = (state.positions[self.joints] for state in (other.state, found.state))
        same = _apart(x, y * (1.0, 1.0, -1.0)).max() <= SAME_STATE * self.size
        return other if same else None

    def _mirrored(self, wanted: State, found: State) -> bool:
        """Whether the joints lie clearly nearer to a shape's mirror image than to the shape."""
        x, y = (state.positions[self.joints] for state in (found, wanted))
        own, other = (_apart(x, y * (1.0, 1.0, side)).max() for side in (1.0, -1.0))
        return bool(other < _OTHER_SIDE * own and own > SAME_STATE * self.size)

    @property
    def _first(self) -> int:
        """The station at which the assembly is lifted first; that at the beginning where it isn't
        lifted."""
        stations = (*self.stations, self.deployed)
        return next((k for k, s in enumerate(stations) if s.lifted is not None), 0)

    def _is_lifted(self, number: int, before: State) -> bool:
        """Whether the assembly is lifted at a station that has a shape for that: at the first one
        in any case, as it may have risen to the wrong side; then while it falls back."""
        return number == self._first or self.is_flat(before)

    def is_flat(self, state: State) -> bool:
        """Whether all joints lie in one plane."""
        x = state.positions[self.joints]
        height = np.linalg.svd(x - x.mean(axis=0), compute_uv=False)[-1] / np.sqrt(len(x))
        return bool(height < _FLAT * self.size)

    def apart(self, a: Equilibrium, b: Equilibrium) -> float:
        """The largest distance of a joint in two states at their best placement, as a share of
        the size."""
        x, y = (e.state.positions[self.joints] for e in (a, b))
        return float(_apart(x, y).max()) / self.size


def _apart(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(n,) distances of points (n, 3) from others, at the best placement."""
    x, y = x - x.mean(axis=0), y - y.mean(axis=0)
    turn, _ = Rotation.align_vectors(y, x)
    return np.linalg.norm(turn.apply(x) - y, axis=1)


def _stepped(
    system: System,
    q: np.ndarray,
    before: Start | Equilibrium,
    opening: float | None,
    to: float | None,
    solve: Callable[..., Equilibrium],
    options: NewtonOptions,
) -> list[Equilibrium]:
    """The states between a start of some opening and the one at another, that one included: none
    between them unless a saddle was left."""
    if opening is None or to is None:
        return [solve(system, q, before, to, options)]
    for parts in _PARTS:
        found: list[Equilibrium] = []
        for k in range(1, parts + 1):
            at = to if k == parts else opening + (to - opening) * k / parts
            found.append(solve(system, q, found[-1] if found else before, at, options))
            if found[-1].escapes and parts < _PARTS[-1]:
                break
        else:
            break
    return found


def _near(system: System, q: np.ndarray, near: Equilibrium, station: Station) -> Equilibrium:
    """A station's state: from its lifted shape, or predicted from one at other parameters."""
    side, opening = station.side(system), station.opening
    if station.lifted is not None:
        return solve(system, q, station.lifted, opening, NewtonOptions(side=side))
    options = NewtonOptions(max_iterations=_MOST_ITERATIONS, side=side)
    start = Sensitivities(system, near).predict(q - near.q)
    try:
        return solve(system, q, start, opening, options)
    except SimulationFailure:  # close to a bifurcation the prediction overshoots
        return solve(system, q, near, opening, options)


def _led(
    before: System,
    system: System,
    q: np.ndarray,
    here: Equilibrium,
    station: Station,
    parts: int,
) -> Equilibrium:
    """The state that one leads to at the next station, in equal parts of the way."""
    options = NewtonOptions(max_iterations=_MOST_ITERATIONS, side=station.side(system))
    if here.opening is None or station.opening is None or before is not system:
        return solve(system, q, here, station.opening, options)
    step, state = (station.opening - here.opening) / parts, here
    for k in range(1, parts + 1):
        start = Sensitivities(system, state).predict(np.zeros_like(q), step)
        opening = station.opening if k == parts else here.opening + k * step
        state = solve(system, q, start, opening, options)
    return state
