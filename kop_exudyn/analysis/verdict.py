"""Whether a design can be built from its kit: it opens by itself, keeps below the elastic limit,
forgives the workshop's errors, carries its loads, and its parts can be cut. What stops it is said
together with what would help, wherever that can be computed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..checks import check_not_negative, check_positive, check_whole
from ..equilibrium.equilibria import Equilibrium
from ..equilibrium.stability import softest_mode
from ..equilibrium.system import System
from ..errors import InputError, SimulationFailure
from ..scene.scene import Scene
from ..search.evaluation import Evaluation, distance
from ..search.objective import DesignObjective
from ..search.tolerance import Tolerance, sample_spread, usual_tolerance
from ..structures.base import Design
from ..structures.loading import supports_of
from ..structures.opening import SAME_STATE
from .load_check import LoadCheck, check_load
from .mending import Stop, about_loads, about_opening, about_stress, about_tolerance
from .tolerance import predicted_spread

OPENED = "opened"  # the state that the assembly opens into, where it is another one
_MAY_SNAP = 0.01  # of the samples
_TELLING = 100  # samples that such a share can be told by


@dataclass(frozen=True)
class VerdictSettings:
    """What a verdict is made with.

    length : standard deviation of the parts' lengths, in the designs' unit; None: the usual one,
        see `usual_tolerance`
    angle : standard deviation of the parts' angles, rad; None: the usual one
    samples : sets of errors that are solved for each design; at most one in a hundred may snap.
        Where a single one does, a hundred are solved, as fewer don't tell
    seed : of the errors
    safety : factor by which the elastic limit is divided

    Raises InputError.
    """

    length: float | None = None
    angle: float | None = None
    samples: int = 20
    seed: int = 0
    safety: float = 1.0

    def __post_init__(self) -> None:
        for name in ("length", "angle"):
            if getattr(self, name) is not None:
                check_not_negative(f"tolerance.{name}", getattr(self, name))
        check_positive("tolerance.safety", self.safety)
        check_whole("tolerance.samples", self.samples)
        check_whole("tolerance.seed", self.seed)

    def tolerance(self, design: Design) -> Tolerance:
        """That of a design's parts."""
        usual = usual_tolerance(design)
        return Tolerance(
            usual.length if self.length is None else self.length,
            usual.angle if self.angle is None else self.angle,
        )


@dataclass(frozen=True)
class Forgiveness:
    """What errors of the workshop do.

    tolerance : standard deviations of the errors
    spread_percent : root mean square displacement of the joint that moves most, to first order, %
        of the target's size
    samples, snapped : sets of errors that were solved; those that end in another state, or in none
    max_percent_p95 : 95th percentile of the samples' largest deviations, %; None without any
    confirmed : how many of the samples' equilibria Exudyn was asked for and confirmed
    """

    tolerance: Tolerance
    spread_percent: float
    samples: int
    snapped: int
    max_percent_p95: float | None
    confirmed: int = 0

    @property
    def enough(self) -> bool:
        """Whether at most one in a hundred snaps."""
        return self.snapped <= _MAY_SNAP * self.samples


@dataclass(frozen=True)
class Buildable:
    """The verdict on one design.

    design : its name
    moved_percent : distance from the state shown to the one that the assembly opens into, % of the
        target's size; None where that is not known
    utilisation : state -> equivalent stress over elastic limit, None where no limit is known
    softest : eigenvalue of the deployed state's softest mode over the input design's
    softest_on_the_way : the smallest eigenvalue of the states that it is opened through, once it
        is off the floor, over the input design's in its deployed state; None where these states
        are not known
    forgiveness : None where the design was not found
    loads : by load case
    fabrication : what stands in the way of cutting the parts; None where nothing is known of them
    stops : what makes the design unbuildable
    """

    design: str
    moved_percent: float | None = None
    utilisation: Mapping[str, float | None] = field(default_factory=dict)
    softest: float | None = None
    softest_on_the_way: float | None = None
    forgiveness: Forgiveness | None = None
    loads: tuple[LoadCheck, ...] = ()
    fabrication: tuple[str, ...] | None = None
    stops: tuple[Stop, ...] = ()

    @property
    def possible(self) -> bool:
        """Whether nothing stops it."""
        return not self.stops

    @property
    def largest(self) -> float | None:
        """The largest utilisation of all states, None where none is known."""
        known = [value for value in self.utilisation.values() if value is not None]
        return max(known) if known else None

    def with_parts(self, problems: Sequence[str] | None) -> Buildable:
        """The verdict with what stands in the way of cutting the design's parts; None where that is
        not known."""
        if problems is None:
            return self
        stops = tuple(Stop("fabrication", problem, None) for problem in problems)
        return replace(self, fabrication=tuple(problems), stops=self.stops + stops)

    def to_dict(self) -> dict[str, Any]:
        """As result.json has it."""
        kept = self.forgiveness
        opens = None
        if self.moved_percent is not None:
            same = self.moved_percent <= 100 * SAME_STATE
            opens = {"same_state": same, "moved_percent": self.moved_percent}
        return {
            "verdict": "can be built" if self.possible else "can't be built",
            "stops": [stop.to_dict() for stop in self.stops],
            "opens": opens,
            "utilisation": dict(self.utilisation),
            "margin": {
                "softest": self.softest,
                "softest_on_the_way": self.softest_on_the_way,
                "spread_percent": None if kept is None else kept.spread_percent,
            },
            "tolerance": None
            if kept is None
            else {
                "length": kept.tolerance.length,
                "angle": kept.tolerance.angle,
                "samples": kept.samples,
                "snapped": kept.snapped,
                "max_percent_p95": kept.max_percent_p95,
                "confirmed_by_exudyn": kept.confirmed,
            },
            "loads": {check.case.name: check.to_dict() for check in self.loads},
            "fabrication": None
            if self.fabrication is None
            else {"possible": not self.fabrication, "problems": list(self.fabrication)},
        }


def judge(
    objective: DesignObjective,
    kept: Evaluation | SimulationFailure,
    opened: Evaluation | SimulationFailure | None = None,
    settings: VerdictSettings = VerdictSettings(),
    given: bool = False,
) -> Buildable:
    """The verdict on a design that is built from a kit; of its parts nothing is said yet, see
    `Buildable.with_parts`.

    Parameters
    ----------
    objective : of the design
    kept : the design's evaluation as it is shown, or why there is none
    opened : of the state that its assembly opens into by itself, or why it opens into none; None
        where that was not looked at
    settings : tolerances and safety
    given : whether it is the design as given, see `judge_given`
    """
    design = objective.design
    if isinstance(kept, SimulationFailure):
        helps = "more or other parts of each kind, or another seed, may find one"
        return Buildable(design.name, stops=(Stop("not found", f"no state: {kept}", helps),))
    stops = []
    moved: float | None = None
    states = {role: (design.scene(role), state) for role, state in kept.equilibria.items()}
    on_the_way: dict[str, tuple[Scene, Equilibrium]] = {}
    if opened is not None:
        if isinstance(opened, Evaluation):
            moved = 100 * distance(design, opened, kept)
            on_the_way = _way(design, opened)
            if moved > 100 * SAME_STATE:
                role = design.fitted_role.name
                states[OPENED] = (design.scene(role), opened.equilibria[role])
        stops += about_opening(opened, moved, given)
    inputs = objective.reference.equilibria
    utilisation, beyond = about_stress(
        design, {**states, **on_the_way}, None if given else inputs, settings.safety
    )
    stops += beyond
    forgiveness = _forgiveness(objective, kept, settings)
    if not forgiveness.enough:
        stops += about_tolerance(
            objective,
            kept,
            forgiveness.tolerance,
            forgiveness.snapped,
            forgiveness.samples,
            settings.seed,
            given,
        )
    deployed = kept.equilibria[design.fitted_role.name]
    checks = []
    for case in design.load_cases:
        try:
            # supports stay those of the design as given, whatever its shape has become
            held = supports_of(design, inputs[design.fitted_role.name], case)
            checks.append(check_load(design, deployed, replace(case, supports=held)))
        except InputError as error:
            stops.append(Stop("load", f"{case.name}: {error}", None, case.name))
    stops += about_loads(design, deployed, checks, settings.safety)
    role = design.fitted_role.name
    as_given = _softness(design.scene(role), inputs[role])
    risen = _risen(design)
    on_way = [_softness(*one) for name, one in on_the_way.items() if name in risen]
    return Buildable(
        design.name,
        moved,
        utilisation,
        _softness(*states[role]) / as_given,
        min(on_way) / as_given if on_way else None,
        forgiveness,
        tuple(checks),
        None,
        tuple(stops),
    )


def judge_given(
    objective: DesignObjective, settings: VerdictSettings = VerdictSettings()
) -> Buildable:
    """The verdict on a design as given: what stops it, no kit can mend.

    objective : of the design, which requires that it opens by itself where that is to be looked at
    settings : tolerances and safety
    """
    kept = objective.judge(objective.design.parameters, dict(objective.reference.equilibria))
    opened: Evaluation | SimulationFailure
    try:
        opened = objective.opened(kept)
    except SimulationFailure as failure:
        opened = failure
    return judge(objective, kept, opened, settings, given=True)


def _way(design: Design, opened: Evaluation) -> dict[str, tuple[Scene, Equilibrium]]:
    """By station, the states that a design is opened through, with their scenes; empty where they
    are not known.

    Those of a design without stations are of a path that is loaded otherwise, to be looked at for
    its rods' stress only.
    """
    if design.way is None:
        scene = design.scene(design.fitted_role.name)
        passed = list(design.opened_through(opened.q, opened.equilibria).items())
        return {name: (scene, state) for name, state in passed[:-1]}
    if not opened.way:
        return {}
    stations = zip(design.way.stations, opened.way)
    return {station.name: (design.scene(station.scene), state) for station, state in stations}


def _risen(design: Design) -> set[str]:
    """Names of the stations from where nothing but the opening moves a design: before that, an
    assembly on the floor is lifted by hand."""
    if design.way is None:
        return set()
    stations = design.way.stations
    first = next((n for n, station in enumerate(stations) if station.lifted is not None), 0)
    return {station.name for station in stations[first:]}


def _softness(scene: Scene, state: Equilibrium) -> float:
    """The eigenvalue of a state's softest mode, energy / rad^2."""
    system = System(scene)
    system.set_parameters(state.q)
    system.assemble(state.state)
    return softest_mode(system).eigenvalue


def _forgiveness(
    objective: DesignObjective, kept: Evaluation, settings: VerdictSettings
) -> Forgiveness:
    design = objective.design
    tolerance = settings.tolerance(design)
    samples = sample_spread(
        design, kept, tolerance, settings.samples, settings.seed, objective=objective
    )
    if sum(sample.lost for sample in samples) == 1 and len(samples) < _TELLING:
        samples = sample_spread(
            design, kept, tolerance, _TELLING, settings.seed, objective=objective
        )
    deviations = [sample.max_percent for sample in samples if sample.max_percent is not None]
    return Forgiveness(
        tolerance,
        predicted_spread(design, kept, tolerance).worst_percent,
        len(samples),
        sum(sample.lost for sample in samples),
        float(np.percentile(deviations, 95)) if deviations else None,
        sum(sample.confirmed for sample in samples),
    )
