"""The whole search: from input designs to one kit, all baselines and both stages. No pages here."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import count
from time import perf_counter

import numpy as np

from ..kit.optimality import clustering_gaps
from ..kit.parts import Kit
from ..kit.stock import Stock
from ..structures.base import Design
from ..structures.serving import served_by
from ..units import common_units, unnamed_units
from . import demands
from .checkpoints import NoStore, Store
from .dataset import Dataset
from .evaluation import Evaluation
from .events import UNRELAXED, Observer, StageEvent
from .forgiving import proven
from .job import described_job
from .levelling import level, proved, worst
from .neighbours import resized
from .opening import opened_stage
from .path import from_neighbour, to_parts
from .pool import DesignPool
from .published import published_method
from .request import check_request, check_start, check_types, kinds_of
from .requirements import Requirements
from .result import KitResult
from .settings import JobSettings
from .stage_results import StageResult
from .stages import Stages
from .starts import Starts, assigned_from_starts, forgiving_from_starts
from .weights import Weights

log = logging.getLogger(__name__)


def optimize_kit(
    designs: Sequence[Design],
    parts: Mapping[str, int] | None = None,
    *,
    kit: Kit | Stock | None = None,
    start: Sequence[Sequence[float]] | StageResult | None = None,
    beside: StageResult | None = None,
    settings: JobSettings = JobSettings(),
    store: Store | None = None,
    observer: Observer | None = None,
    announce: Callable[[str], None] = lambda phase: None,
    examine: Callable[[DesignPool], None] = lambda pool: None,
) -> KitResult:
    """Find a kit of so many parts a kind for all designs; or build the designs from a given kit.

    Parameters
    ----------
    designs : what is to be built
    parts : kind -> number of parts of the kit that is sought; with "slit" in place of "linear",
        linear elements are made of slit parts (see `served_by`)
    kit : instead of `parts`: a kit whose parts stay as they are, or a stock of them, of which no
        more pieces are used than there are
    start : by design, elements (nq,) that a neighbouring kit realises, in place of the direct
        projection, the baseline and the relaxed stage: the elements are clustered anew, and the
        assigned stage begins there. Or the assigned stage of a neighbouring kit itself, whose parts
        are split and merged until there are as many as asked for
    beside : the assigned stage of a neighbouring kit, which becomes one more start beside those
        that are looked for from scratch
    settings : weights, stages, processes
    store : keeps checkpoints, from which an interrupted run goes on
    observer : sees every accepted step
    announce : is told the phases' names
    examine : looks at the input designs, once they are simulated and before any kit is sought

    Raises
    ------
    InputError
        for impossible requests, before anything is simulated
    SimulationFailure
        when an input design can't be simulated
    """
    begin = perf_counter()
    check_types(designs, kit, settings)
    designs = served_by(designs, kinds_of(parts, kit))
    check_request(designs, parts, kit, settings)
    if start is not None and not isinstance(start, StageResult):
        check_start(designs, start)
    if kit is not None:
        given = kit.kit.units if isinstance(kit, Stock) else kit.units
        named = {design.name: design.units for design in designs}
        if doubt := unnamed_units({"the kit": given, "the designs": common_units(named)}):
            log.warning("%s", doubt)
    sought: Mapping[str, int] | Kit | Stock = kit if kit is not None else dict(parts or {})
    events: list[StageEvent] = []

    def observe(event: StageEvent) -> None:
        events.append(event)
        if observer is not None:
            observer(event)

    with DesignPool(designs, settings.jobs, settings.scheduler) as pool:
        announce("input designs")
        pool.prepare()
        examine(pool)
        weights = settings.weights or Weights.suiting(designs)
        dataset = Dataset.of_pool(pool, weights, settings.design_weights)
        free = replace(settings.stages, requirements=Requirements.none())
        baselines = Stages(dataset, sought, free, store, observe)
        stages = Stages(dataset, sought, settings.stages, store, observe)
        result = KitResult(list(designs), pool.references, events=events)
        found, begin_search = result.stages, perf_counter()
        if isinstance(start, StageResult):
            announce("splitting and merging parts")
            result.at_parts = stages.confirmed(resized(stages, start, dict(parts or {})))
        elif start is not None:
            announce("path from the neighbouring kit")
            result.at_parts = from_neighbour(stages, np.concatenate(list(start)))
        else:
            announce("direct projection")
            found["direct"] = baselines.direct()
            if settings.baselines and kit is None:
                announce("unrelaxed baseline")
                found["unrelaxed"] = baselines.assigned(found["direct"], UNRELAXED)
            if settings.published and kit is None:
                published = published_method(
                    dataset,
                    dict(parts or {}),
                    settings.stages,
                    store or NoStore(),
                    observer,
                    announce,
                )
                found["published"], found["published_opened"] = published.led, published.opened
                result.seconds["published"] = published.seconds
            begin_search = perf_counter()
            announce("relaxed stage")
            relaxed = stages.relaxed(found["direct"].kit)
            announce("path to the parts")
            found["relaxed"], result.at_parts = to_parts(stages, relaxed)
        announce("assigned stage")
        bases = []
        if "relaxed" in found and all(isinstance(d, Evaluation) for d in found["relaxed"].designs):
            bases = [stages.inputs(), found["relaxed"].evaluations]
        neighbours = []
        if beside is not None:
            neighbours = [resized(stages, beside, dict(parts or {}))]
        starts = assigned_from_starts(stages, result.at_parts, bases, neighbours)
        announce("deployment of the assigned designs")
        opened = opened_stage(
            stages,
            starts.best,
            result.at_parts,
            last_resorts=False,
            seen=[each for seen in starts.seen.values() for each in seen],
        )
        announce("errors of the workshop and largest deviations")
        forgiving = forgiving_from_starts(stages, starts, opened, result.at_parts)
        rivals = [found[name] for name in ("direct", "unrelaxed") if name in found]
        numbers = count(1)
        levelled = _levelled(stages, forgiving, numbers, rivals)
        found["assigned"] = _surer(stages, starts, levelled, result.at_parts, numbers, rivals)
        result.tried = starts.tried
        result.seconds["search"] = perf_counter() - begin_search
        found.update({stage: _confirmed(stages, outcome) for stage, outcome in found.items()})
        result.redeployed = stages.redeployed(found["assigned"])
        if "direct" in found:
            announce("bound on the clustering")
            result.clustering = clustering_gaps(
                dataset.groups,
                dataset.parameters,
                found["direct"].kit,
                bounds=settings.stages.bounds,
                penalties=stages.projection.penalties,
            )
        result.peak_memory_mb = pool.peak_memory_mb()
    result.equilibria = dataset.tally.equilibria
    result.newton_iterations = dataset.tally.newton_iterations
    result.seconds["confirmation"] = dataset.tally.confirmation_s
    result.wall_s = perf_counter() - begin
    result.settings = described_job(designs, parts, kit, settings) | {"jobs": settings.jobs}
    return result


def _levelled(
    stages: Stages,
    result: StageResult,
    numbers: Iterator[int],
    rivals: Sequence[StageResult] = (),
) -> StageResult:
    """The result levelled, or as it is, proved with more errors; or from a rival, where that meets
    all that is required and its largest deviation is smaller: of designs that hardly differ, what
    is nearest may be as good as what is searched for."""
    found = _own_level(stages, result, numbers)
    whole = [rival for rival in rivals if rival.value is not None]
    if found.value is None or not whole:
        return found
    sure, secured = stages.confirmed(found), demands.secured(stages)  # and placed best
    for rival in whole:
        if worst(stages.confirmed(rival).designs) >= worst(sure.designs):
            continue
        other = proved(stages, secured.confirmed(secured.kept(secured.weighed(rival))), sure)
        if other is not None:
            log.info("a baseline is nearer to the target: %.3g %%", worst(other.designs))
            other = replace(other, steps=found.steps, jumps=found.jumps)
            found = _own_level(stages, other, numbers)
            sure = stages.confirmed(found)
    return found


def _surer(
    stages: Stages,
    starts: Starts,
    result: StageResult,
    before: StageResult | None,
    numbers: Iterator[int],
    rivals: Sequence[StageResult],
) -> StageResult:
    """What other starts lead to, levelled, where designs of a result aren't proved to forgive; the
    same one where that leaves as many."""
    lost = demands.unproved(stages, result) if result.value is not None else ()
    if not lost:
        return result
    names = [stages.dataset.designs[n].name for n in lost]
    log.info("in more sets of errors %s snap in the end: trying other starts", ", ".join(names))
    tried = list(starts.tried)
    other = forgiving_from_starts(stages, starts, result, before, sure=True)
    if other is result:
        return result
    other = _levelled(stages, other, numbers, rivals)
    if other.value is not None and len(demands.unproved(stages, other)) < len(lost):
        return other
    starts.tried[:] = tried
    return result


def _own_level(stages: Stages, result: StageResult, numbers: Iterator[int]) -> StageResult:
    """The result proved with more errors, and levelled from there."""
    found = level(stages, proven(stages, result), numbers)
    return proven(stages, found) if found.snapping else found


def _confirmed(stages: Stages, outcome: StageResult) -> StageResult:
    """What a stage left, at Exudyn's solutions: the steps of its optimisation aren't confirmed.

    The objective is as the stage has it, of the relaxed one with the projection's energy.
    """
    found = stages.confirmed(outcome)
    return found if found.value is None else replace(found, value=outcome.value)
