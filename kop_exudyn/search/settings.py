"""What a search is run with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..checks import (
    check_choice,
    check_flag,
    check_not_negative,
    check_positive,
    check_whole,
    numbers,
)
from ..errors import InputError
from ..kit.kinds import Bounds, kind_names, part_kind
from ..sqp.constraints import LinearConstraints
from .requirements import Requirements
from .weights import Weights


@dataclass(frozen=True)
class Effort:
    """How much is tried, see starts.py.

    clusterings : seeds that the search under each model begins with; 0: no such search
    shakes : of each
    built : kits of each model from which the designs are built
    optimised : starts, that of the relaxed stage among them, from which the assigned stage runs
    exchanges : assignments that differ by one or two elements of the best kit's, which are
        optimised in the end, see exchange.py
    """

    clusterings: int
    shakes: int
    built: int
    optimised: int
    exchanges: int = 0


EFFORTS = {
    "quick": Effort(0, 0, 0, 1),
    "normal": Effort(3, 5, 2, 2),
    "thorough": Effort(8, 10, 8, 8, 24),
}


# as the schema of study files has it
_POSITIVE = (
    "tight",
    "relaxed_tolerance",
    "last_tolerance",
    "round_tolerance",
    "assigned_tolerance",
    "reassigned_tolerance",
    "slit_cost",
)
_COUNTS = ("relaxed_steps", "assigned_steps", "round_steps", "path_steps", "restarts")
_FROM_ZERO = ("reassignments", "leaps", "redeployments", "rescues", "growth", "seed")


@dataclass(frozen=True)
class StageSettings:
    """Settings of the stages.

    schedule : values of w_c, one after the other; default: 0.1, 1, 10 and 100 times the weight of
        the fit, so that the balance of fit and projection is the same whatever the weights
    tight : largest rms distance of elements to their parts, relative to the kind's scale, at which
        raising w_c ends
    relaxed_steps, assigned_steps, round_steps : accepted SQP steps at most: for each w_c, for an
        assigned stage (or baseline) without reassignments, for each round of one with them
    relaxed_tolerance, last_tolerance, round_tolerance, assigned_tolerance : the SQPs of the relaxed
        stage before the last w_c, with the last one, those of rounds in the assigned stage, and its
        last one end when steps promise or gain less than this share of J
    reassignments : rounds of the assigned stage in which elements get other parts (see
        reassign.py), at most; a round that gains less than `reassigned_tolerance` of J is the last
    leaps : how often, after these rounds, many elements get other parts at once whatever J does,
        and two more rounds from there; what is no better is undone, and a gain below
        `reassigned_tolerance` is the last, see `assigned_stage`
    redeployments : how often, after the assigned stage, the stage goes on from where the designs
        open into, where that is another state, see `opened_stage` in assigned.py
    path_steps : steps of the watched path between the stages
    rescues : how often w_c is raised by ten when a design fails on that path, or snaps and there
        are no reassignments
    growth : how often then, when raising w_c didn't help, every kind gets one part more
    restarts, seed : of the clustering
    bounds : kind -> (lower, upper) of the parts, besides the natural ones
    constraints : on the elements of all designs, see `on_elements`; the baselines "direct" and
        "unrelaxed" keep to them as far as their parts can
    hessian : "exact" or "bfgs"
    reuse : what fewer pieces are worth that have to be made so that the designs can be built one
        after the other: for 1 % less of them the objective may rise by this many %. Results are
        compared by J times the share of fabricated pieces to this power
    levelling : share of a design's size. In the end the parts are tuned once more with deviations
        beyond it counting with their fourth power, and the result kept where the largest deviation
        of all designs falls by it, see levelling.py; 0: not
    slit_cost : of slit parts, over the weight of the fit: where the slits of a kit are as long as
        the median element, J is larger by half of this times that weight, and with the slits'
        mean square. 1e-3: slits of a tenth of that length count like joints 0.2 % of a design's
        size away from its target
    effort : "quick", "normal" or "thorough": from how many starts the assigned stage runs, see
        starts.py
    requirements : that the kit's designs have to meet, see there; not those of the baselines

    Raises InputError, with the field and its value.
    """

    schedule: Sequence[float] | None = None
    tight: float = 1e-3
    relaxed_steps: int = 25
    assigned_steps: int = 40
    round_steps: int = 15
    relaxed_tolerance: float = 3e-3
    last_tolerance: float = 5e-4
    round_tolerance: float = 2e-3
    assigned_tolerance: float = 1e-4
    reassignments: int = 4
    reassigned_tolerance: float = 2e-2
    leaps: int = 3
    redeployments: int = 4
    path_steps: int = 10
    rescues: int = 2
    growth: int = 0
    restarts: int = 20
    seed: int = 0
    bounds: Bounds | None = None
    constraints: LinearConstraints | None = None
    hessian: str = "exact"
    reuse: float = 0.0
    levelling: float = 1e-3
    slit_cost: float = 1e-3
    effort: str = "normal"
    requirements: Requirements = Requirements()

    def __post_init__(self) -> None:
        if self.schedule is not None:
            given = numbers("schedule", self.schedule)
            if not given:
                raise InputError("must be one number or more", field="schedule")
            for n, weight in enumerate(given):
                check_positive(f"schedule[{n}]", weight)
            object.__setattr__(self, "schedule", given)
        for name in _POSITIVE:
            check_positive(name, getattr(self, name))
        for name in _COUNTS:
            check_whole(name, getattr(self, name), least=1)
        for name in _FROM_ZERO:
            check_whole(name, getattr(self, name))
        check_choice("hessian", self.hessian, ("exact", "bfgs"))
        check_choice("effort", self.effort, tuple(EFFORTS))
        check_not_negative("reuse", self.reuse)
        check_not_negative("levelling", self.levelling)
        for kind in self.bounds or {}:
            check_choice("bounds", kind, kind_names())
            part_kind(kind).bounds(self.bounds)
        for name, expected in (("constraints", LinearConstraints), ("requirements", Requirements)):
            value = getattr(self, name)
            if not isinstance(value, expected) and not (value is None and name == "constraints"):
                raise InputError(f"must be {expected.__name__}", field=name, value=value)


@dataclass(frozen=True)
class JobSettings:
    """What a search is run with.

    weights : of the objective's terms, default: the fit weight that suits the designs' class, see
        `Design.fit_weight`
    design_weights : how much each design counts (default: all the same)
    stages : settings of the stages
    jobs : processes
    scheduler : address of a Dask scheduler, whose workers are used instead of processes, or None
    baselines : also compute the unrelaxed baseline
    published : also find a kit by the published method, see published.py

    Raises InputError, with the field and its value.
    """

    weights: Weights | None = None
    design_weights: Sequence[float] | None = None
    stages: StageSettings = StageSettings()
    jobs: int = 2
    baselines: bool = True
    published: bool = False
    scheduler: str | None = None

    def __post_init__(self) -> None:
        if self.design_weights is not None:
            given = numbers("design_weights", self.design_weights)
            for n, weight in enumerate(given):
                check_positive(f"design_weights[{n}]", weight)
            object.__setattr__(self, "design_weights", given)
        check_whole("jobs", self.jobs, least=1)
        check_flag("baselines", self.baselines)
        check_flag("published", self.published)
