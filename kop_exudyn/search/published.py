"""The published method, for comparison: Becker, Kusupati, Suzuki and Pauly (ACM Transactions on
Graphics, 2024).

A quasi-Newton SQP (damped BFGS) over all elements, with the weight of the projection energy raised
tenfold until the clusters are tight; then every element becomes its nearest part, and the parts are
tuned, by BFGS again and with the assignment as it is. None of what goes beyond that is used: exact
Hessians, other assignments, leaps, several starts, requirements. The kit that it begins with is
that of our clustering, and its SQP is ours: the comparison is of methods, not of programs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from time import perf_counter

from .checkpoints import PrefixedStore, Store
from .dataset import Dataset
from .events import Observer
from .path import to_parts
from .requirements import Requirements
from .settings import StageSettings
from .stage_results import StageResult
from .stages import Stages

# accepted steps at most: the paper tells of 1,019 relaxed and 42 assigned steps for its largest job
RELAXED_STEPS, ASSIGNED_STEPS = 300, 100


@dataclass(frozen=True)
class Published:
    """What the published method leaves.

    led : every element its part, in the states that the designs were led to
    opened : the same parts, as the designs open from their assembly
    seconds : wall time, the input designs' simulation and the clustering left out
    """

    led: StageResult
    opened: StageResult
    seconds: float


def published_method(
    dataset: Dataset,
    parts: Mapping[str, int],
    settings: StageSettings,
    store: Store,
    observer: Observer | None = None,
    announce: Callable[[str], None] = lambda phase: None,
) -> Published:
    """Find a kit of so many parts a kind as the paper does.

    dataset : the designs; parts : kind -> number of parts
    settings : schedule, tolerances, bounds, constraints and rescues are taken from these
    store : checkpoints go there under names that begin with "published-"
    """
    own = replace(
        settings,
        hessian="bfgs",
        relaxed_steps=RELAXED_STEPS,
        assigned_steps=ASSIGNED_STEPS,
        reassignments=0,
        leaps=0,
        redeployments=0,
        effort="quick",
        requirements=Requirements.none(),
    )
    stages = Stages(dataset, parts, own, PrefixedStore(store, "published-"), observer)
    kit, _ = stages.rule.first(dataset.groups, stages.q0, stages.projection, own)
    begin = perf_counter()
    announce("published method: relaxed stage")
    relaxed, built = to_parts(stages, stages.relaxed(kit))
    announce("published method: assigned stage")
    led = stages.confirmed(stages.assigned(built))
    seconds = perf_counter() - begin
    led = replace(led, steps=relaxed.steps + led.steps)
    opened = stages.confirmed(replace(led, designs=stages.redeployed(led), jumps=[]))
    return Published(led, opened, seconds)
