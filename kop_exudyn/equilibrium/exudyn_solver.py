"""Static equilibria by Exudyn alone, from the same starts as the fast solver's.

Exudyn makes every residual and solves for every step. Around it are written here: the composition
of steps on rotations, a limit on rotations a step, the geometric stiffness at predicted instead of
present stresses (see newton.py), a watchdog that returns to the best state and makes steps shorter
and stiffer when several bring nothing, and the way off saddles, downhill by the work of Exudyn's
forces. Exudyn's static solver has no test of stability: whether what it converges to is a minimum
is told by the pivots of this package's own stiffness at that state.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
import scipy.sparse as sp

from ..errors import SimulationFailure
from ..rods.element import evaluate
from ..rods.rotations import exp_so3, hat, log_so3
from ..scene.state import State
from .direction import border_of, factorise_convex, is_convex
from .equilibria import Equilibrium, Start
from .exudyn_confirm import ROUND_OFF, balance_of, gaps_of, model_of
from .exudyn_model import ExudynModel, Point
from .newton import NewtonOptions
from .stability import softest_mode
from .system import System

log = logging.getLogger(__name__)

_MAX_GAP = 1e-10  # rad, or of the size
_MORE = 2  # times as many iterations as the fast solver may take: this one is to get there
_PATIENCE, _QUICK = 8, 2  # as in newton.py
_MAX_RETURNS = 12
_SHIFT, _SHIFT_FACTOR = 1e-4, 30.0  # of the rods' rotational stiffness EI / L
_RAYS = 8
_DESCENT, _HALVINGS = 60, 8


@dataclass
class _Best:
    """The best iterate of a phase, and what the step from it promises.

    stress : (E, 6) that its stiffness is taken at; merit : residual over its tolerance
    value : potential; slope : work that its forces would do along the step
    """

    point: Point
    stress: np.ndarray
    merit: float
    value: float
    slope: float = 0.0

    def above(self, value: float) -> bool:
        """Whether another potential is clearly lower."""
        return value < self.value - 1e-3 * abs(self.slope)


def solve(
    system: System,
    q: np.ndarray,
    start: Start | Equilibrium | State | None = None,
    opening: float | None = None,
    options: NewtonOptions = NewtonOptions(),
) -> Equilibrium:
    """The stable equilibrium that Exudyn reaches from a start; parameters as `newton.solve` has
    them.

    Of the options, those of the predicted stress' iteration count, and twice as many iterations
    are allowed. `stress`, energies and `stable` of the result are this package's, at Exudyn's
    state.

    Raises
    ------
    SimulationFailure
        Exudyn found no step, no equilibrium within the iterations, or none that is stable
    """
    if (opening is None) != (system.constraint is None):
        raise ValueError("an opening angle belongs to an actuated scene, and only to one")
    system.set_parameters(q)
    if isinstance(start, Equilibrium):
        start = start.start
    elif not isinstance(start, Start):
        start = Start(start if start is not None else system.scene.initial)
    return _Run(system, q, start, opening, options).solve()


class _Run:
    """One solve: the iterate and the safeguards' memory."""

    def __init__(
        self,
        system: System,
        q: np.ndarray,
        start: Start,
        opening: float | None,
        options: NewtonOptions,
    ):
        self.system, self.scene, self.q = system, system.scene, q
        self.opening, self.options = opening, options
        self.model: ExudynModel = model_of(system.scene)
        self.model.set(system.scene, q, opening)
        self.rods = _Rods(self.model, q)
        self.point = self.model.point(self.scene.held(start.state, q), start.torque)
        n = len(self.scene.elements)
        self.stress = np.zeros((n, 6)) if start.stress is None else start.stress.copy()
        self.iterations = self.escapes = 0
        self.relative = np.inf
        self.balance = np.zeros(0)

    def solve(self) -> Equilibrium:
        begin = perf_counter()
        system = self.system
        converged = self._iterate(guarded=False)
        while True:
            while not converged:
                converged = self._iterate(guarded=True)
                if not converged:
                    self._descend(_PATIENCE)
            state = self.model.state(self.point)
            energy = system.assemble(state)
            if is_convex(system.factorise(), border_of(system)):
                break
            self._leave_saddle(state)
            # on the second saddle in a row the quick iteration leads back: descend all the way
            if self.escapes > 1:
                self._descend(_DESCENT)
            converged = self._iterate(guarded=True)
        q = np.array(self.q, float)
        system.mark_held(state, q)
        return Equilibrium(
            state=state,
            q=q,
            opening=self.opening,
            torque=self.model.torque(self.point),
            stress=system.stress(),
            elastic_energy=energy.elastic,
            potential=energy.potential,
            iterations=self.iterations,
            residual=self.relative,
            escapes=self.escapes,
            wall_s=perf_counter() - begin,
        )

    # -- iteration ---------------------------------------------------------------------------------
    def _iterate(self, guarded: bool) -> bool:
        """Steps at predicted stresses until Exudyn's residual is small, or several bring nothing;
        the best iterate is kept then.

        guarded : a step's stiffness is shifted until its pivots are positive, and lower energies
            count as headway; else only smaller residuals do
        """
        best: _Best | None = None
        cap, floor, shift, since, returns = self.options.rotation_cap, 0.0, 0.0, 0, 0
        while True:
            merit, value = self._merit(), 0.0
            if merit <= 1.0:
                return True
            if guarded:
                value, shift = self._convexified(max(floor, shift / 16))
            if np.isfinite(merit) and (
                best is None or merit < 0.5 * best.merit or (guarded and best.above(value))
            ):
                if since <= _QUICK:
                    cap, floor = min(self.options.rotation_cap, 2 * cap), floor / _SHIFT_FACTOR
                best, since = _Best(self.point, self.stress.copy(), merit, value), 0
            else:
                since += 1
                if since > _PATIENCE or not np.isfinite(merit):
                    returns, since = returns + 1, 0
                    if best is None or returns > (_MAX_RETURNS if guarded else _QUICK):
                        return False
                    self.point, self.stress = best.point, best.stress.copy()
                    cap, floor = cap / 3, max(_SHIFT_FACTOR * floor, _SHIFT)
                    continue
            self._count()
            slope = self._advance(cap, shift if guarded else floor)
            if since == 0 and best is not None:
                best.slope = slope

    def _convexified(self, shift: float) -> tuple[float, float]:
        """The potential at the iterate, and the shift with which the pivots of the stiffness at
        the predicted stresses are positive; both of this package."""
        system, energy = self.system, self.model.force * self.model.length
        state = self.model.state(self.point)
        system.predicted_stress[:] = self.stress
        value = system.assemble(state, mixed=True).potential
        if self.opening is not None:
            gap = float(state.angles[self.scene.actuated].mean() - self.opening)
            value += self.model.torque(self.point) * gap
        shift, _ = factorise_convex(system, shift * energy)
        return value, shift / energy

    def _count(self) -> None:
        limit = _MORE * self.options.max_iterations
        if self.iterations >= limit:
            raise SimulationFailure(f"no equilibrium within {limit} of Exudyn's Newton steps")
        self.iterations += 1

    def _advance(self, cap: float, shift: float) -> float:
        """One step of Exudyn's, no rotation larger than the cap; returns the work that the forces
        at its beginning would do along it."""
        added = self.rods.stress_stiffness(self.point, self.stress)
        if shift:
            added = added + self.rods.metric(shift)
        found, _ = self.model.step(self.point, added)
        share = self._share(found, cap)
        self.stress = self.rods.predicted(self.point, found, share)
        before, self.point = (
            self.point,
            self._on_joints(self.model.composed(self.point, found, share)),
        )
        return float(self.balance @ _between(before, self.point))

    def _share(self, found: Point, cap: float) -> float:
        """Share of a step that turns no node by more than a cap, rad."""
        turns = np.linalg.norm((found.total - self.point.total)[:, 3:], axis=1)
        return min(1.0, cap / max(float(turns.max()), np.finfo(float).tiny))

    def _on_joints(self, point: Point) -> Point:
        """An iterate brought back to the joints, to which steps are only tangent."""
        state = self.model.state(point)
        return replace(self.model.point(state), torque=point.torque, reactions=point.reactions)

    def _merit(self) -> float:
        """Exudyn's residual over its tolerance; converged at 1."""
        residual = self.model.residual(self.point)
        largest, force = balance_of(self.model, residual)
        self.relative, self.balance = largest / force, residual.balance
        allowed = max(self.options.tolerance * force, 0.2 * ROUND_OFF * self.model.round_off)
        gap = max(gaps_of(self.model, residual, self.point).values(), default=0.0)
        return max(largest / allowed, gap / _MAX_GAP)

    # -- saddles -----------------------------------------------------------------------------------
    def _leave_saddle(self, state: State) -> None:
        """Move downhill along the softest mode of an unstable equilibrium."""
        self.escapes += 1
        if self.escapes > self.options.escapes:
            raise SimulationFailure(f"still unstable after leaving {self.escapes - 1} saddles")
        system, side = self.system, self.options.side
        softest = softest_mode(system)
        mode = softest.vector
        towards = side @ mode if side is not None else mode[np.argmax(np.abs(mode))]
        mode = np.copysign(1.0, towards) * mode
        mode *= self.options.escape_rotation / np.abs(mode[system.is_rotation]).max()
        ahead, work = self._downhill(mode)
        if work <= 0.0 or side is None:
            back, other = self._downhill(-mode)
            ahead, work = (back, other) if other > 1.1 * work or work <= 0.0 else (ahead, work)
        if work <= 0.0:
            raise SimulationFailure(
                "a neutral equilibrium (a mechanism, or a bifurcation point): Exudyn's forces do "
                f"no work along its softest mode, of eigenvalue {softest.eigenvalue:.2g}"
            )
        torque, reactions = self.point.torque, self.point.reactions
        self.point = replace(self.model.point(ahead), torque=torque, reactions=reactions)

    def _descend(self, limit: int) -> None:
        """Shifted steps at the present stresses, none of them uphill; until they are quick."""
        model = self.model
        shift = 0.0
        for _ in range(limit):
            self.stress = self.rods.stress(self.point)
            _, shift = self._convexified(shift / 4)
            self._count()
            found, _ = model.step(self.point, self.rods.metric(shift) if shift else None)
            share = self._share(found, self.options.rotation_cap)
            before = self._unheld(self.point)
            force = model.residual(before).balance
            for _ in range(_HALVINGS):
                ahead = self._on_joints(model.composed(self.point, found, share))
                pull = model.residual(self._unheld(ahead)).balance
                if (force + pull) @ _between(before, ahead) > 0.0:
                    break
                share /= 2
            self.point = ahead
            if self._merit() <= 1.0:
                break
        self.stress = self.rods.stress(self.point)

    @staticmethod
    def _unheld(point: Point) -> Point:
        """An iterate without reactions: they do no work where joints hold."""
        return replace(point, reactions=np.zeros_like(point.reactions))

    def _downhill(self, mode: np.ndarray) -> tuple[State, float]:
        """The lowest state on a ray of doubling steps by the work of Exudyn's forces, and that
        work (not positive: none is lower)."""
        start, before = self.model.state(self.point), self._unheld(self.point)
        force = self.model.residual(before).balance
        best, most, scale = start, 0.0, 1.0
        for _ in range(_RAYS):
            state = start.moved(self.system.increment(scale * mode))
            point = replace(self.model.point(state), torque=self.point.torque)
            pull = self.model.residual(point).balance
            work = most + 0.5 * float((force + pull) @ _between(before, point))
            if work > most:
                best, most, before, force, scale = state, work, point, pull, 2 * scale
            elif most > 0.0:
                break
            else:
                scale /= 8
        return best, most


class _Rods:
    """The rods of a model: stiffness that comes from stress, prediction of stresses."""

    def __init__(self, model: ExudynModel, q: np.ndarray):
        self._model, scene = model, model.scene
        self._scene, self._lengths = scene, scene.rest_lengths(q)
        self._ends = model.layout.element_nodes
        unit = np.tile(np.repeat([model.length, 1.0], 3), 2)
        self._unit = unit
        self._scale = np.outer(unit, unit) / (model.force * model.length)
        at = (6 * self._ends[:, :, None] + np.arange(6)).reshape(-1, 12)
        self._rows = np.broadcast_to(at[:, :, None], (len(at), 12, 12)).ravel()
        self._columns = np.broadcast_to(at[:, None, :], (len(at), 12, 12)).ravel()
        self._size = 6 * model.layout.n_nodes

    def _evaluated(self, point: Point, stress: np.ndarray | None) -> tuple[np.ndarray, ...]:
        x, R = point.total[:, :3] * self._model.length, exp_so3(point.total[:, 3:])
        a, b = self._ends.T
        return evaluate(
            x[a],
            R[a],
            x[b],
            R[b],
            self._lengths,
            self._scene.stiffness,
            self._scene.rest_strain,
            stress,
        )

    def stress(self, point: Point) -> np.ndarray:
        """(E, 6) generalised stresses."""
        strain = self._evaluated(point, None)[3]
        return self._scene.stiffness * strain / self._lengths[:, None]

    def stress_stiffness(self, point: Point, stress: np.ndarray) -> sp.coo_matrix:
        """What the stiffness changes by if its stresses (E, 6) were these, in the model's units.

        The geometric stiffness is linear in the stress. It is the derivative of forces in the
        nodes' own axes, which has a skew part besides the second variation.
        """
        plain = self._evaluated(point, np.zeros_like(stress))
        change = stress - self._scene.stiffness * plain[3] / self._lengths[:, None]
        H = self._evaluated(point, change)[2] - plain[2]
        g = np.einsum("eij,ei->ej", plain[4], change)
        for k in (3, 9):
            H[:, k : k + 3, k : k + 3] += 0.5 * hat(g[:, k : k + 3])
        values = (H * self._scale).ravel()
        return sp.coo_matrix((values, (self._rows, self._columns)), shape=(self._size,) * 2)

    def predicted(self, point: Point, found: Point, share: float) -> np.ndarray:
        """(E, 6) stresses that a share of a step leads to, linearised at its beginning."""
        _, _, _, strain, B = self._evaluated(point, None)
        step = share * (found.total - point.total)[self._ends].reshape(-1, 12) * self._unit
        strain = strain + np.einsum("eij,ej->ei", B, step)
        return self._scene.stiffness * strain / self._lengths[:, None]

    def metric(self, shift: float) -> sp.coo_matrix:
        """A shift of all nodes' coordinates: of rotations by itself, of places by shift / L^2."""
        unit = np.repeat([(self._model.length / self._scene.length_scale) ** 2, 1.0], 3)
        return sp.coo_matrix(sp.diags(shift * np.tile(unit, self._size // 6)))


def _between(before: Point, after: Point) -> np.ndarray:
    """The nodes' increment (6 n_nodes,) from one iterate to another."""
    R = np.swapaxes(exp_so3(before.total[:, 3:]), 1, 2) @ exp_so3(after.total[:, 3:])
    return np.concatenate([after.total[:, :3] - before.total[:, :3], log_so3(R)], axis=1).ravel()
