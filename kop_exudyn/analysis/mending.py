"""What stops a design from being built, and what would help: a thinner or thicker section, tighter
work, less load. What is said to help has been computed for the design's own elements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..equilibrium.equilibria import Equilibrium
from ..errors import SimulationFailure
from ..scene.scene import Scene
from ..search.evaluation import Evaluation
from ..search.objective import DesignObjective
from ..search.tolerance import Tolerance, sample_spread
from ..structures.base import Design
from ..structures.opening import SAME_STATE
from ..structures.strength import beyond_limit, design_strength, materials_of, rod_strength
from ..structures.thickness import board_of, keeping_limit
from ..units import in_millimetres
from .load_check import LoadCheck, carrying_thickness

_HALVINGS = 3  # of the tolerance, until nothing snaps


@dataclass(frozen=True)
class Stop:
    """One reason why a design can't be built.

    cause : "not found", "opening", "stress", "tolerance", "load" or "fabrication"
    why : in words, without the design's name
    helps : what would mend it, in words; None where nothing is known
    case : name of the load case that it is about; None for other causes
    """

    cause: str
    why: str
    helps: str | None
    case: str | None = None

    def to_dict(self) -> dict[str, str | None]:
        return {"cause": self.cause, "why": self.why, "helps": self.helps}

    def __str__(self) -> str:
        return self.why if self.helps is None else f"{self.why}; {self.helps}"


def about_opening(
    opened: Evaluation | SimulationFailure, moved_percent: float | None, given: bool = False
) -> list[Stop]:
    """Whether the assembly opens into the state shown.

    moved_percent : how far from it it ends, % of the target's size
    given : whether it is the design as given, which no parts can help
    """
    some = "a smaller opening" if given else "more parts"
    helps = f"{some}, or a thinner section, leave it fewer shapes to open into"
    if isinstance(opened, SimulationFailure):
        return [Stop("opening", f"does not open from its assembly: {opened}", helps)]
    if moved_percent is not None and moved_percent > 100 * SAME_STATE:
        why = f"opens into another shape, {moved_percent:.2g} % of its size from the one shown"
        return [Stop("opening", why, helps)]
    return []


def about_stress(
    design: Design,
    states: Mapping[str, tuple[Scene, Equilibrium]],
    inputs: Mapping[str, Equilibrium] | None,
    safety: float = 1.0,
) -> tuple[dict[str, float | None], list[Stop]]:
    """Utilisation by state; and whether it keeps to the limit, and which section would.

    states : by name, those that a builder sees, with their scenes
    inputs : by role, equilibria of the design as given; None where the states are its own
    safety : factor by which the elastic limit is divided
    """
    materials = materials_of(design)
    utilisation = {
        name: rod_strength(scene, state, materials).largest
        for name, (scene, state) in states.items()
    }
    known = {name: value for name, value in utilisation.items() if value is not None}
    if not known or not beyond_limit(safety * max(known.values())):
        return utilisation, []
    worst = max(known, key=lambda name: known[name])
    limit = "its elastic limit" if safety == 1 else f"its elastic limit over {safety:g}"
    where = worst if " " in worst else f"{worst} state"  # stations: "opened by 50%"
    why = f"stressed to {_share(safety * known[worst])} of {limit} ({where})"
    if inputs is not None:
        as_given = [found.largest for found in design_strength(design, inputs).values()]
        own = max((value for value in as_given if value is not None), default=0.0)
        if beyond_limit(safety * own):
            why += f", and the design as given to {_share(safety * own)}"
    beyond = [states[name] for name, value in known.items() if value > 0.5 * known[worst]]
    share = keeping_limit(beyond, materials, 1 / safety)
    if share is None:
        helps = "no thickness near its own keeps the limit: open it less, or bend it less"
    else:
        helps = f"{_section(design, share)} would keep it"
        helps += " with the same parts" if inputs is not None else ""
    return utilisation, [Stop("stress", why, helps)]


def about_tolerance(
    objective: DesignObjective,
    kept: Evaluation,
    tolerance: Tolerance,
    snapped: int,
    samples: int,
    seed: int = 0,
    given: bool = False,
) -> list[Stop]:
    """What to say where errors of the workshop make a design snap.

    tolerance : with which so many of the samples snapped
    seed : of these samples
    given : whether it is the design as given, which no parts can help
    """
    more = "a thinner section helps" if given else "more parts help"
    design = objective.design
    why = (
        f"snaps into another shape in {snapped} of {samples} samples with errors of "
        f"{_errors(design, tolerance)}"
    )
    for halving in range(1, _HALVINGS + 1):
        smaller = tolerance.scaled(0.5**halving)
        found = sample_spread(design, kept, smaller, samples, seed, objective=objective)
        if not any(sample.snapped or sample.failed for sample in found):
            helps = f"none with errors of {_errors(design, smaller)}; or else {more}"
            return [Stop("tolerance", why, helps)]
    return [Stop("tolerance", why, f"even an eighth of these errors is too much; {more}")]


def about_loads(
    design: Design, deployed: Equilibrium, checks: Sequence[LoadCheck], safety: float = 1.0
) -> list[Stop]:
    """Whether each load case is carried, and what would carry it.

    deployed : the equilibrium without loads
    """
    found = []
    for check in checks:
        if check.carried(safety):
            continue
        why = " and ".join(_failing(design, check, safety))
        helps = _carrying(design, deployed, check, safety)
        name = check.case.name
        found.append(Stop("load", f"under {name} it {why}", helps, name))
    return found


def _failing(design: Design, check: LoadCheck, safety: float) -> list[str]:
    found = []
    if not check.stable:
        found.append(
            f"gives way at {check.critical:.2g} times the load ({check.case.factor:g} is asked for)"
        )
    elif check.failed is not None:
        found.append(f"was not found: {check.failed}")
    if check.loaded is not None and not check.stiff:
        moved, allowed = _apart(check.deflection, check.allowed, design)
        found.append(f"deflects by {moved} ({allowed} is allowed)")
    used = check.utilisation
    if used is not None and beyond_limit(safety * used):
        found.append(f"is stressed to {_share(safety * used)} of its elastic limit")
    return found


def _carrying(design: Design, deployed: Equilibrium, check: LoadCheck, safety: float) -> str:
    """What would carry the load."""
    thicker = carrying_thickness(design, deployed, check.case, safety)
    if thicker is None:
        return "not even four times the thickness carries it: more supports, or less load"
    share, used = thicker
    helps = f"{_section(design, share)} would carry it"
    if used is not None and beyond_limit(safety * used):
        helps = (
            f"{_section(design, share)} would be stiff enough, but stressed to "
            f"{_share(safety * used)} of its elastic limit: more supports, less load, or a "
            "flatter shape"
        )
    return helps


def _share(used: float) -> str:
    """A share beyond 1 in percent, with as many digits as show that it is beyond."""
    return f"{100 * used:.0f} %" if used >= 1.01 else f"{100 * used:.6g} %"


def _apart(value: float, limit: float, design: Design) -> tuple[str, str]:
    """Two lengths in words, with as many digits as tell them apart."""
    words = [[in_millimetres(x, design.units, n) for x in (value, limit)] for n in (3, 4, 5, 6, 9)]
    return next(((a, b) for a, b in words if a != b), (words[-1][0], words[-1][1]))


def _section(design: Design, share: float) -> str:
    """A section of another thickness, beside the present one."""
    thickness = board_of(design)
    if thickness is None:
        return f"sections {share:.2g} times as thick"
    wanted, present = (
        in_millimetres(value, design.units) for value in (share * thickness, thickness)
    )
    return f"a section {wanted} instead of {present} thick"


def _errors(design: Design, tolerance: Tolerance) -> str:
    return (
        f"{in_millimetres(tolerance.length, design.units, 2)} and "
        f"{np.degrees(tolerance.angle):.2g} degrees"
    )
