"""Whether a deployed design carries a load case: deflection, stress, and how far it is from giving
way.

The load grows in steps from nothing. At each, the equilibrium has to be stable, by the signs of its
pivots, and has to lead back to the one before: behind a limit point Newton's method finds a far
state that is stable as well, but the load's return doesn't undo the jump. A step that fails is
halved, until the critical factor lies between two close ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..equilibrium.equilibria import Equilibrium
from ..equilibrium.newton import NewtonOptions, solve
from ..equilibrium.system import System
from ..errors import SimulationFailure
from ..scene.scene import Scene
from ..structures.base import Design
from ..structures.loading import LoadedState, held_scene, loaded_scene, loaded_state
from ..structures.loads import LoadCase
from ..structures.opening import SAME_STATE
from ..structures.strength import beyond_limit, materials_of, rod_strength
from ..structures.thickness import resolved, thickened_scene

_HELD = ("supports", "total_force", "reactions", "largest_reaction")  # of the loaded state
_STEPS = 4  # to the factor that is asked for
_CLOSE = 1 / 64  # of the critical factor: it is located as well as that
_LEAST = 1e-6  # of the factor asked for: a smaller one is none
_BEYOND = 2.0  # times the factor asked for: so far the critical one is looked for
_NO_SADDLES = NewtonOptions(escapes=0, soften=False, max_iterations=60)
_THICKEST = 4.0  # times the present thickness: more is no mending
_TRIALS = 8  # thicknesses that are tried


@dataclass(frozen=True)
class LoadCheck:
    """A design under a load case; lengths in the design's unit.

    loaded : under the loads themselves; factored : under the loads times the case's factor. None
        where no state was found
    span : largest distance between two supports
    critical : load factor up to which the unloaded state deforms stably; it is at least this where
        `beyond`, and the exact one is not known
    failed : why a state was not found, or None
    """

    case: LoadCase
    loaded: LoadedState | None
    factored: LoadedState | None
    span: float
    critical: float
    beyond: bool
    failed: str | None = None

    @property
    def allowed(self) -> float:
        """The largest allowed deflection, inf where there is no limit."""
        return self.case.deflection.allowed(self.span)

    @property
    def deflection(self) -> float:
        """The largest one of a rod's node, NaN where no state was found."""
        return float("nan") if self.loaded is None else float(self.loaded.deflections.max())

    @property
    def utilisation(self) -> float | None:
        """The largest one under the factored loads, None where it is not known."""
        return None if self.factored is None else self.factored.strength.largest

    @property
    def stable(self) -> bool:
        """Whether the design deforms stably up to the case's factor."""
        return _bears(self.critical, self.case.factor)

    @property
    def borne(self) -> bool:
        """Whether it does up to the loads themselves."""
        return _bears(self.critical, 1.0)

    @property
    def stiff(self) -> bool:
        """Whether the deflection keeps to its limit."""
        if np.isnan(self.deflection):
            return self.allowed == np.inf and self.stable
        return not beyond_limit(self.deflection, self.allowed)

    def carried(self, safety: float = 1.0) -> bool:
        """Whether deflection, stress and stability are within their limits.

        safety : factor by which the elastic limit is divided
        """
        used = self.utilisation
        strong = used is None or not beyond_limit(safety * used)
        return self.failed is None and self.stable and self.stiff and strong

    def to_dict(self) -> dict[str, Any]:
        """As result.json has it; None for what was not found or has no limit."""
        deflection = self.deflection
        held: dict[str, Any] = dict.fromkeys(_HELD)
        if self.loaded is not None:
            state = self.loaded.to_dict()
            held = {name: state[name] for name in held}
        return {
            "factor": self.case.factor,
            **held,
            "deflection": None if np.isnan(deflection) else deflection,
            "deflection_limit": None if self.allowed == np.inf else self.allowed,
            "span": self.span,
            "utilisation": self.utilisation,
            "critical_factor": self.critical,
            "critical_factor_is_larger": self.beyond,
            "stable": self.stable,
            "failed": self.failed,
        }


def check_load(design: Design, unloaded: Equilibrium, case: LoadCase) -> LoadCheck:
    """What becomes of the deployed design's equilibrium under a load case.

    Raises InputError where a density is missing or the supports don't hold the design.
    """
    return _check(design, unloaded, case, None, _BEYOND)


def critical_factor(
    design: Design,
    unloaded: Equilibrium,
    case: LoadCase,
    most: float,
    scene: Scene | None = None,
) -> float:
    """The largest factor, up to `most`, by which a case's loads may be multiplied so that the
    unloaded state deforms stably: a lower bound, at most a sixty-fourth of itself below; 0 for less
    than a millionth of the case's factor.

    scene : of the unloaded state; default: the design's own
    """
    _, held = held_scene(design, unloaded, case, scene)

    def led(factor: float, start: Equilibrium) -> Equilibrium:
        system = System(loaded_scene(design, held, unloaded, case, factor))
        return solve(system, unloaded.q, start, unloaded.opening, _NO_SADDLES)

    here, factor, step = unloaded, 0.0, case.factor / _STEPS
    while factor < most * (1 - 1e-12) and step >= max(_CLOSE * factor, _LEAST * case.factor):
        ahead = min(factor + step, most)
        try:
            found = led(ahead, here)
            missed = _apart(design, led(factor, found), here)
        except SimulationFailure:
            missed = np.inf
        if missed > SAME_STATE:
            step /= 2
        else:
            here, factor = found, ahead
    return factor


def carrying_thickness(
    design: Design, unloaded: Equilibrium, case: LoadCase, safety: float = 1.0
) -> tuple[float, float | None] | None:
    """By how much thicker the rods should be to carry a load case, as a multiple of their present
    thickness, and their utilisation then, with and without the loads (None where unknown).

    Rods that are bent into their shape are stressed the more the thicker they are. Where no
    thickness keeps to all limits, the first is returned that is stiff and stable enough, whose
    utilisation is beyond what is allowed. Returns None where not even four times the thickness is
    stiff enough.
    """
    materials = materials_of(design)
    stiff: tuple[float, float | None] | None = None
    for share in _THICKEST ** (np.arange(1, _TRIALS + 1) / _TRIALS):
        scene = thickened_scene(design.scene(design.fitted_role.name), materials, share)
        try:
            state = resolved(scene, unloaded)
        except SimulationFailure:
            continue
        check = _check(design, state, case, scene, 1.0)
        if check.failed is not None or not (check.stable and check.stiff):
            continue
        both = (check.utilisation, rod_strength(scene, state, materials).largest)
        known = [value for value in both if value is not None]
        found = float(share), max(known) if known else None
        if found[1] is None or safety * found[1] <= 1:
            return found
        stiff = stiff or found
    return stiff


def _check(
    design: Design, unloaded: Equilibrium, case: LoadCase, scene: Scene | None, beyond: float
) -> LoadCheck:
    supports, _ = held_scene(design, unloaded, case, scene)
    x = unloaded.state.positions[design.joints[supports]]
    span = float(np.linalg.norm(x[:, None] - x[None], axis=2).max())
    most = max(beyond * case.factor, 1.0)
    critical = critical_factor(design, unloaded, case, most, scene)
    failed: str | None = None
    loaded: LoadedState | None = None
    factored: LoadedState | None = None
    try:
        if _bears(critical, 1.0):
            loaded = loaded_state(design, unloaded, case, scene)
        if _bears(critical, case.factor):
            factored = (
                loaded
                if case.factor == 1.0
                else loaded_state(design, unloaded, case.times(case.factor), scene)
            )
    except SimulationFailure as failure:
        failed = str(failure)
    return LoadCheck(case, loaded, factored, span, critical, _bears(critical, most), failed)


def _bears(critical: float, factor: float) -> bool:
    return critical * (1 + 1e-9) >= factor


def _apart(design: Design, a: Equilibrium, b: Equilibrium) -> float:
    """The largest distance of a joint in two states of a held design, as a share of its size."""
    x, y = (e.state.positions[design.joints] for e in (a, b))
    return float(np.linalg.norm(x - y, axis=1).max()) / design.target.size
