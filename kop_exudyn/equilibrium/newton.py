"""Static equilibria by Newton's method with independently predicted stresses.

Plain Newton on slender rods crawls along the valley of the stretch-stiff energy. Here the geometric
stiffness is taken at the stress that the last step predicted, sigma <- (K/L)(e + B d), while the
gradient stays exact: the mixed-stress iteration of slender-shell continuation (Magisano, Leonetti,
Garcea, CMAME 2017). Safeguards: a cap on rotations a step, a shift wherever a pivot is not
positive, a watchdog that returns to the best state when several steps bring nothing, and after that
a fall-back to energy descent with line search. A converged state that the pivots show to be
unstable is left along its softest mode, as is one that the iteration creeps up to: a saddle is
never returned. Cold starts that bring nothing are tried once more by way of axially soft rods
(softened.py).
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from ..errors import SimulationFailure
from ..scene.assembly import ENERGY
from ..scene.state import State
from .direction import border_of, bordered_solve, factorise_convex, is_convex, shift_unit
from .equilibria import Equilibrium, Start
from .iterate import Iterate, NewtonOptions
from .softened import softened
from .stability import rounding_of, softest_mode, zero_mode
from .system import Energy, System

log = logging.getLogger(__name__)

_QUICK = 2  # headway within so many further steps: the steps may grow again
_MAX_RETURNS = 8  # to the best state, before energy descent takes over
_FLOOR_FACTOR = 30.0
_MECHANISM = (
    "a neutral equilibrium (a mechanism, or a bifurcation point): a motion meets no resistance, "
    "the softest mode's eigenvalue {:.1e} is zero to rounding"
)
# Shifted steps in a row, and the relative residual, after which an iteration is taken to be
# creeping up to a saddle.
_LINGERING, _NEAR = 20, 1e-2


def solve(
    system: System,
    q: np.ndarray,
    start: Start | Equilibrium | State | None = None,
    opening: float | None = None,
    options: NewtonOptions = NewtonOptions(),
) -> Equilibrium:
    """Find the stable equilibrium that the iteration reaches from a start.

    Parameters
    ----------
    system : the scene's workspace; afterwards it holds the assembled and factorised Hessian of the
        solution
    q : (n_parameters,) parameters
    start : what to start from (default: the scene's initial state, unstressed); pinned unknowns are
        set to where the scene pins them, driven ones from q
    opening : rad, mean angle of the actuated hinges (must be given exactly when the scene is
        actuated)

    Raises
    ------
    SimulationFailure
        no stable equilibrium was found; its reason says which limit was met
    """
    if (opening is None) != (system.constraint is None):
        raise ValueError("an opening angle belongs to an actuated scene, and only to one")
    system.set_parameters(q)
    if isinstance(start, Equilibrium):
        start = start.start
    elif not isinstance(start, Start):
        start = Start(start if start is not None else system.scene.initial)
    try:
        return _Run(system, q, start, opening, options).solve()
    except SimulationFailure as failure:
        if start.stress is not None or not options.soften:
            raise
        try:
            return _solve_softened_first(system, q, start, opening, replace(options, soften=False))
        except SimulationFailure:
            raise failure from None


def _solve_softened_first(
    system: System, q: np.ndarray, start: Start, opening: float | None, options: NewtonOptions
) -> Equilibrium:
    """The equilibrium that is reached by way of that of the softened scene."""
    softer = solve(System(softened(system.scene, q)), q, start, opening, options)
    return (
        _Run(system, q, Start(softer.state, softer.torque), opening, options).solve().after(softer)
    )


@dataclass
class _Best:
    """The best state of a mixed phase, with the stress of its geometric stiffness and what the next
    step promises."""

    state: State
    torque: float
    stress: np.ndarray
    value: float
    merit: float
    gap: float
    slope: float = 0.0


class _Run(Iterate):
    """One solve: phases of iterations, and ways off saddles."""

    def solve(self) -> Equilibrium:
        begin = perf_counter()
        converged = (
            self._mixed() if self.options.mixed else self._descend(self.options.max_iterations)
        )
        while True:
            while not converged:
                self.assembled = None
                self.check_budget()
                converged = self._descend(self.options.patience)
                if not converged and self.options.mixed:
                    self.system.predicted_stress[:] = self.system.stress()
                    converged = self._mixed()
            energy = self.assembled or self.system.assemble(self.state)
            residual, gap = self.residual()
            if not self.converged(residual, gap):
                # accepted at a trial state's larger forces
                converged = False
                continue
            negative = self.system.factorise()
            border = border_of(self.system)
            if is_convex(negative, border):
                if (eigenvalue := zero_mode(self.system, border)) is not None:
                    raise SimulationFailure(_MECHANISM.format(eigenvalue))
                break
            self.assembled = None
            self._leave_saddle(energy)
            # on the second saddle in a row the quick iteration leads back: descend all the way
            converged = (
                self._mixed() if self.options.mixed and self.escapes == 1 else self._descend(60)
            )
        q = np.array(self.q, float)
        # taken at a predicted stress, however close, the factors aren't those that another process
        # would make of the state
        if self.assembled is None:
            self.system.mark_held(self.state, q)
        return Equilibrium(
            state=self.state,
            q=q,
            opening=self.opening,
            torque=self.torque,
            stress=self.system.stress(),
            elastic_energy=energy.elastic,
            potential=energy.potential,
            iterations=self.iterations,
            residual=self.relative(residual),
            escapes=self.escapes,
            wall_s=perf_counter() - begin,
        )

    # -- phases --------------------------------------------------------------------------------
    def _mixed(self) -> bool:
        """Mixed-stress iterations until they converge or stop making headway; the best state is
        kept then.

        Single steps may raise energy and residual: the stretch that they cause is undone by the
        next ones. So headway is asked for only within `patience` steps (Grippo, Lampariello,
        Lucidi's watchdog). Without it the best state returns, and the steps from there are shorter
        and, by a shift, stiffer in the soft directions.
        """
        system, options = self.system, self.options
        best: _Best | None = None
        cap, floor, since, returns = options.rotation_cap, 0.0, 0, 0
        counted, shifted = True, 0
        while True:
            energy = system.assemble(self.state, mixed=True)
            residual, gap = self.residual()
            merit, value = self.merit(residual, gap), energy.potential + self.torque * gap
            if merit <= 1.0:
                self.assembled = energy if self.predicted() else None
                return True
            if np.isfinite(value) and (best is None or self._headway(best, value, merit)):
                if since <= _QUICK:
                    cap, floor = min(options.rotation_cap, 2 * cap), floor / _FLOOR_FACTOR
                best = _Best(
                    self.state, self.torque, system.predicted_stress.copy(), value, merit, abs(gap)
                )
                since = 0
            else:
                since += counted
                if best is None:
                    return False
                if since > options.patience or not np.isfinite(value):
                    self.state, self.torque = best.state, best.torque
                    system.predicted_stress[:] = best.stress
                    returns, since = returns + 1, 0
                    if returns > _MAX_RETURNS:
                        return False
                    cap, floor = cap / 3, max(_FLOOR_FACTOR * floor, 1e-3 * shift_unit(system))
                    continue
            self.check_budget()
            self.shift, border = factorise_convex(system, max(floor, self.shift / 16))
            shifted = shifted + 1 if self.shift > floor else 0
            if shifted > _LINGERING and self.relative(residual) < _NEAR:
                if self._unstable_here():
                    # symmetry keeps the residual off the unstable mode, whose shift makes the other
                    # modes converge slowly
                    best, since, shifted = None, 0, 0
                    continue
                # the look at the stability has factorised the unshifted matrix
                self.shift, border = factorise_convex(system, self.shift)
            step, change = bordered_solve(system, border, -residual, -gap)
            scale = self.capped(step, cap)
            # without a potential nothing tells whether a shortened step leads ahead: a roll-up
            # needs many of them
            counted = scale == 1.0 or system.conservative
            if since == 0:
                best.slope = scale * float(residual @ step)
            taken = scale * step
            system.predict_stress(taken)
            self.state = self.state.moved(system.increment(taken))
            self.torque += scale * float(change)

    def _headway(self, best: _Best, value: float, merit: float) -> bool:
        """Whether a state is an advance on the best one: a lower energy, or half of its residual.

        While the mean angle is still on its way to the opening energies can't be compared.
        """
        if merit < 0.5 * best.merit or best.gap > 1e-9:
            return True
        return self.system.conservative and value < best.value - 1e-3 * abs(best.slope)

    def _descend(self, limit: int) -> bool:
        """Newton on the energy with shift and Armijo line search; at most `limit` accepted
        steps."""
        system = self.system
        self.close_gap()
        energy = system.assemble(self.state)
        shift = 0.0
        for _ in range(limit):
            residual, gap = self.residual()
            shift, border = factorise_convex(system, shift)
            if border is not None:
                # the multiplier that fits the energy's gradient best: after the gap is closed only
                # it is unknown
                self.torque = (
                    -float(system.gradient[: system.n_unknowns] @ border.column) / border.schur
                )
                residual, gap = self.residual()
            if self.converged(residual, gap):
                return True
            self.check_budget()
            step, _ = bordered_solve(system, border, -residual, -gap)
            scale = self._line_search(
                step, self.capped(step, self.options.rotation_cap), float(residual @ step), energy
            )
            if scale == 0.0:
                if shift == 0.0:
                    return self.merit(residual, gap) < 1.0
                shift *= 8
                if shift > 1e12 * float(np.median(np.abs(system.values[system.sparsity.diagonal]))):
                    return False
                continue
            self.state = self.state.moved(system.increment(scale * step))
            shift = 0.0 if scale >= 0.5 else shift
            energy = system.assemble(self.state)
        return self.converged(*self.residual())

    def _line_search(self, step: np.ndarray, scale: float, slope: float, energy: Energy) -> float:
        """Backtracking on the potential (on the residual where no potential exists); 0 when nothing
        was gained."""
        system = self.system
        floor = 1e-14 * abs(energy.potential)
        while scale > 1e-8:
            state = self.state.moved(system.increment(scale * step))
            if not system.conservative:
                return scale
            potential = system.assemble(state, ENERGY).potential
            if potential <= energy.potential + 1e-4 * scale * slope + floor:
                return scale
            scale *= 0.5
        return 0.0

    def _unstable_here(self) -> bool:
        """Whether the stiffness at the state itself is indefinite; the state is then left along its
        softest mode."""
        energy = self.system.assemble(self.state)
        if is_convex(self.system.factorise(), border_of(self.system)):
            return False
        self._leave_saddle(energy)
        return True

    def _leave_saddle(self, energy: Energy) -> None:
        """Move downhill along the softest mode of an unstable equilibrium."""
        self.escapes += 1
        if self.escapes > self.options.escapes:
            raise SimulationFailure(f"still unstable after leaving {self.escapes - 1} saddles")
        softest = softest_mode(self.system)
        if softest.eigenvalue > -rounding_of(self.system):
            raise SimulationFailure(_MECHANISM.format(softest.eigenvalue))
        mode = softest.vector
        side = self.options.side
        if (
            side is not None
            and side @ mode < 0
            or side is None
            and mode[np.argmax(np.abs(mode))] < 0
        ):
            mode = -mode
        mode = mode * (self.options.escape_rotation / np.abs(mode[self.system.is_rotation]).max())
        ahead, gain = self._lowest_along(mode, energy.potential)
        if gain >= 0.0 or side is None:
            # the preferred side is taken unless the other one is clearly lower
            back, other = self._lowest_along(-mode, energy.potential)
            ahead, gain = (back, other) if other < 1.1 * gain or gain >= 0.0 else (ahead, gain)
        if gain >= 0.0:
            raise SimulationFailure(
                "a neutral equilibrium (a mechanism, or a bifurcation point): no lower energy "
                "along "
                f"its softest mode, of eigenvalue {softest.eigenvalue:.2g}"
            )
        self.state = ahead
        system = self.system
        system.assemble(ahead)
        system.predicted_stress[:] = system.stress()
        log.debug("left a saddle: energy change %.3g", gain)

    def _lowest_along(self, mode: np.ndarray, potential: float) -> tuple[State, float]:
        """The lowest state on a ray of doubling steps, and its potential's change (not negative:
        none was lower)."""
        best, change, scale = self.state, 0.0, 1.0
        for _ in range(8):
            state = self.state.moved(self.system.increment(scale * mode))
            drop = self.system.assemble(state, ENERGY).potential - potential
            if drop < change:
                best, change, scale = state, drop, 2 * scale
            elif change < 0.0:
                break
            else:
                scale /= 8
        return best, change


def refine(system: System, equilibrium: Equilibrium, steps: int = 3) -> Equilibrium:
    """The same equilibrium converged to round-off: plain Newton steps as long as they lower the
    residual.

    For states that are kept: Exudyn's Jacobian leaves part of the joints' stiffness out, so that
    near a bifurcation it contracts slowly, and what it starts with is what it ends with.
    """
    run = Iterate(system, equilibrium.q, equilibrium.start, equilibrium.opening, NewtonOptions())
    system.set_parameters(equilibrium.q)
    energy = system.assemble(run.state)
    residual, gap = run.residual()
    best = (run.state, run.torque, energy, system.stress(), run.relative(residual))
    for _ in range(steps):
        system.factorise()
        step, change = bordered_solve(system, border_of(system), -residual, -gap)
        run.state = run.state.moved(system.increment(step))
        run.torque += float(change)
        energy = system.assemble(run.state)
        residual, gap = run.residual()
        if not run.relative(residual) < best[4]:
            break
        best = (run.state, run.torque, energy, system.stress(), run.relative(residual))
    state, torque, energy, stress, relative = best
    return replace(
        equilibrium,
        state=state,
        torque=torque,
        stress=stress,
        elastic_energy=energy.elastic,
        potential=energy.potential,
        residual=relative,
    )
