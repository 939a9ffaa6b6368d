"""One design simulated: its final state, confirmed by Exudyn, and how well it fits its target."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Numbers, Points
from ..checks import check_kind
from ..compiled.library import library
from ..equilibrium.engines import FAST
from ..equilibrium.engines import engine as solver_of
from ..equilibrium.equilibria import Equilibrium
from ..equilibrium.exudyn_confirm import Confirmation, confirm
from ..equilibrium.newton import refine
from ..errors import SimulationFailure
from ..scene.limits import HingeLimits
from ..structures.base import Design
from ..structures.deviation import OFF_TARGET, fit_summary
from ..structures.fitting import FitResult, TargetFitting
from ..structures.links import joint_links
from ..structures.loads import LoadCase
from ..structures.plausibility import design_doubts
from ..structures.strength import Strength, design_strength, strength_summary

if TYPE_CHECKING:
    from ..structures.loading import LoadedState
    from .load_check import LoadCheck

log = logging.getLogger(__name__)

_FAR_AWAY = 10.0  # % of the target's size
_FELT_SAG = 0.02  # of the deflection
_SLID = 5.0  # times the deviation: what isn't on the surface any more needs no such warning


@dataclass(frozen=True)
class SimulationResult:
    """The final state of one design.

    unknowns, elements : of the final state's scene
    newton_iterations, wall_s : of all solves from the input to that state, seconds without
        compilation
    equilibria, confirmations : by role; the states are Exudyn's
    fit : of the deployed joints to the target
    joints : (n, 3) positions in the coordinates of the design's own file
    loaded : the deployed state under the loads, where there are any: those of the first load case;
        see `reached`
    checks : whether each of the load cases is carried, with the states under them
    engine : what solved for the states
    """

    design: Design
    unknowns: int
    elements: int
    newton_iterations: int
    wall_s: float
    equilibria: dict[str, Equilibrium]
    confirmations: dict[str, Confirmation]
    fit: FitResult
    joints: Points
    loaded: LoadedState | None = None
    engine: str = FAST
    checks: tuple[LoadCheck, ...] = ()

    @property
    def deployed(self) -> Equilibrium:
        """The equilibrium that the design is made for."""
        return self.equilibria[self.design.fitted_role.name]

    @property
    def strength(self) -> Strength:
        """Stresses of the deployed state's rod elements, beside their limits; see `Strength`."""
        role = self.design.fitted_role.name
        return design_strength(self.design, {role: self.deployed})[role]

    @property
    def stress(self) -> Numbers:
        """(E,) equivalent stress (von Mises) of the deployed state's rod elements, in the design's
        unit of force / length^2; NaN where an element has no section."""
        return self.strength.equivalent

    @property
    def utilisation(self) -> Numbers:
        """(E,) that stress over the elastic limit; above 1 a rod yields or breaks. NaN where no
        limit is known."""
        return self.strength.utilisation

    def __repr__(self) -> str:
        kind = "stable" if self.deployed.stable else "unstable"
        return (
            f"<SimulationResult {self.design.name!r}: {kind}, "
            f"at most {self.fit.max_percent:.3g} % off target>"
        )

    @property
    def displaced_percent(self) -> float:
        """Largest distance of a joint from its own place in the target, % of the target's
        size.

        Deviations are distances from the surface: a grid that shears, or closes, may slide along
        it.
        """
        return 100 * float(self.fit.displacements.max()) / self.fit.size

    @property
    def warnings(self) -> list[str]:
        """What a user should know of the design and of where it ended, in words."""
        found = design_doubts(self.design)
        if self.fit.max_percent > OFF_TARGET:
            found += self.design.cautions
        if self.loaded is not None and (sag := self._missed_sag(self.loaded)) > _FELT_SAG:
            found.append(
                f"rods sag between the joints under {self.loaded.case.name}, by about "
                f"{100 * sag:.2g} % of the deflection more than so few elements show: set "
                '"elements_per_piece" to 8 or more'
            )
        if self.displaced_percent > max(_FAR_AWAY, _SLID * self.fit.max_percent):
            found.append(
                f"on the surface, but joints end up to {self.displaced_percent:.3g} % of its size "
                "away from their places: the structure hardly resists that motion. Hold it where "
                "its supports will be: by the field held of a grid's file, or --held at import"
            )
        return found

    @property
    def deviation(self) -> Mapping[str, float]:
        """How far the joints, and the pieces between them, are off the target: the field "fit" of
        results, see `Deviation.to_dict`."""
        return fit_summary(self.design, self.design.target, self.fit, self.deployed.state)

    def to_dict(self) -> dict[str, Any]:
        """As `kop simulate --json` prints it.

        Besides figures named as the attributes: "escapes", unstable states that were left on the
        way, so that the structure may open to another shape as well; "hinge_limits", where joints
        have limits: how many there are, how many their limits press on, and how far, rad, the worst
        is beyond its own (negative: within); "strength", by state the largest equivalent stress,
        its share of the elastic limit and the rod element where that is; "loaded", under loads, see
        `LoadedState.to_dict`.
        """
        final = self.deployed
        return {
            "design": self.design.name,
            "units": None if self.design.units is None else self.design.units.to_dict(),
            "unknowns": self.unknowns,
            "elements": self.elements,
            "engine": self.engine,
            "newton_iterations": self.newton_iterations,
            "wall_s": self.wall_s,
            "elastic_energy": final.elastic_energy,
            "stable": final.stable,
            "opening_angle": final.opening,
            "assembly_angle": next(
                (role.opening for role in self.design.roles if not role.fitted), None
            ),
            "exudyn": self.confirmations[self.design.fitted_role.name].to_dict(),
            "fit": self.deviation,
            "target_size": self.fit.size,
            "displaced_percent": self.displaced_percent,
            "escapes": final.escapes,
            **self._limits(),
            "strength": strength_summary(self.design, self.equilibria),
            **({"loaded": self._loaded(self.loaded)} if self.loaded is not None else {}),
            **(
                {"load_cases": {check.case.name: check.to_dict() for check in self.checks}}
                if self.checks
                else {}
            ),
            "joints": (self.joints + self.design.file_origin).tolist(),
        }

    def _missed_sag(self, loaded: LoadedState) -> float:
        """About how much deeper rods hang between two joints than their elements show, as a share
        of the largest deflection.

        Elements of constant curvature, n in a span, miss 1.6 / n^2 of the middle's deflection under
        an even load on two supports.
        """
        design = self.design
        scene = design.scene(design.fitted_role.name)
        bent = [len(chain.elements) for chain in scene.chains if len(chain.elements)]
        largest = loaded.deflections.max()
        if not bent or not largest or len(joint_links(scene, design.joints)) < len(design.joints):
            return 0.0  # of other structures than nets, the rods have no corner in the middle
        at_joints = np.isin(scene.node_body, design.joints)
        between = largest - loaded.deflections[at_joints].max(initial=0.0)
        return float(1.6 / (2 * min(bent)) ** 2 * between / largest)

    @property
    def reached(self) -> bool:
        """Whether the loaded state is where the growing load leads to; else the design buckles
        before all of it acts, and that state is one behind the jump."""
        return not self.checks or self.checks[0].borne

    def _loaded(self, loaded: LoadedState) -> dict[str, Any]:
        found = loaded.to_dict()
        return {
            "case": loaded.case.name,
            **found,
            "stable": found["stable"] and self.reached,
            "reached": self.reached,
        }

    def _limits(self) -> dict[str, Any]:
        """How the deployed state keeps its hinges' limits; empty where it has none."""
        scene = self.design.scene(self.design.fitted_role.name)
        limits = [term for term in scene.terms if isinstance(term, HingeLimits)]
        if not limits:
            return {}
        beyond = np.concatenate([term.beyond(self.deployed.state) for term in limits])
        touched = sum(int(term.touched(self.deployed.state).sum()) for term in limits)
        return {
            "hinge_limits": {
                "hinges": len(beyond),
                "touched": touched,
                "furthest": float(beyond.max()),
            }
        }


def simulate(
    design: Design, loads: LoadCase | None = None, engine: str = FAST, *, warn: bool = True
) -> SimulationResult:
    """Deploy a design and have Exudyn confirm its states, the one under loads included.

    Parameters
    ----------
    loads : default: the design's own
    engine : what solves for the states: "fast", this package's solver, or "exudyn", Exudyn from
        the same starts (see `equilibrium.exudyn_solver`), which takes longer. Target surfaces of
        C-shells, which are made by a simulation of their smooth design, are the fast solver's
    warn : log the result's `warnings`

    Raises
    ------
    SimulationFailure
        a state isn't found, is unstable, or isn't confirmed
    InputError
        no design, an unknown engine, or loads that the design can't have (see `loaded_state`)
    """
    check_kind("design", design, Design, "see load_design")
    loads = design.loads if loads is None else loads
    check_kind("loads", loads, LoadCase)
    solve = solver_of(engine)
    library()  # compiled now, where it has to be
    begin = perf_counter()
    try:
        equilibria = dict(design.deploy() if engine == FAST else design.deploy(solve=solve))
        wall_s = perf_counter() - begin
        target = design.target
        confirmations = {}
        for role in design.roles:
            name, found = role.name, equilibria[role.name]
            if engine == FAST:
                found = refine(design.systems[name], found)
            confirmations[name] = confirm(design.scene(name), found, opening=role.opening)
            equilibria[name] = replace(found, state=confirmations[name].state)
    except SimulationFailure as failure:
        doubts = "".join(f"; {doubt}" for doubt in design_doubts(design))
        raise SimulationFailure(failure.reason + doubts, where=failure.where).within(
            design.name
        ) from None
    fitted = design.fitted_role.name
    joints = design.report_positions(confirmations[fitted].state)
    fit = TargetFitting(target).minimum_zone(confirmations[fitted].state.positions[design.joints])
    system = design.systems[fitted]
    cases = design.load_cases if loads is design.loads else (loads,) * (not loads.empty)
    loaded, checks = _under_loads(design, equilibria[fitted], cases, engine)
    result = SimulationResult(
        design,
        system.n_unknowns,
        len(system.scene.elements),
        sum(eq.iterations for eq in equilibria.values()),
        wall_s,
        equilibria,
        confirmations,
        fit,
        joints,
        loaded,
        engine,
        checks,
    )
    for warning in result.warnings if warn else ():
        log.warning("%s: %s", design.name, warning)
    return result


def _under_loads(
    design: Design, unloaded: Equilibrium, cases: Sequence[LoadCase], engine: str
) -> tuple[LoadedState | None, tuple[LoadCheck, ...]]:
    """The state under the first case, and whether each is carried. A state that isn't found is
    none where growing loads don't lead to it, as a check says."""
    if not cases:
        return None, ()
    from ..structures.loading import loaded_state  # most designs are simulated without
    from .load_check import check_load

    checks = tuple(check_load(design, unloaded, case) for case in cases)
    first = checks[0]
    if engine == FAST and first.loaded is not None:
        return first.loaded, checks
    try:
        return loaded_state(design, unloaded, cases[0], engine=engine), checks
    except SimulationFailure:
        if first.borne:
            raise
        return None, checks
