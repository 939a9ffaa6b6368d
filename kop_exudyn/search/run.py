"""The whole search: from input designs to one kit, all baselines and both stages. No pages here."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, astuple, replace
from itertools import count
from time import perf_counter
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..errors import InputError
from ..kit.cluster import cluster
from ..kit.kinds import part_kind
from ..kit.optimality import clustering_gaps
from ..kit.parts import Kit
from ..kit.stock import Missing, Stock
from ..structures.base import Design
from ..structures.serving import served_by
from ..structures.stacking import (
    group_designs,
    parameter_offsets,
    stacked_groups,
    stacked_parameters,
)
from ..structures.strength import materials_of
from ..units import Units, common_units, unit_of, unnamed_units
from ..wording import counted
from . import demands
from .checkpoints import NoStore, Store
from .cluster import check_cluster
from .dataset import Dataset
from .evaluation import Evaluation
from .events import UNRELAXED, Observer, StageEvent
from .forgiving import proven
from .levelling import level, proved, worst
from .neighbours import resized
from .opening import opened_stage
from .path import from_neighbour, to_parts
from .pool import DesignPool
from .published import published_method
from .requirements import Requirements
from .result import KitResult
from .settings import JobSettings, StageSettings
from .stage_results import StageResult
from .stages import Stages
from .starts import Starts, assigned_from_starts, forgiving_from_starts
from .weights import Weights

log = logging.getLogger(__name__)

_FAR_OFF = 30.0  # times an element: parts that are all longer are in another unit


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


def kinds_of(parts: Mapping[str, int] | None, kit: Kit | Stock | None) -> list[str]:
    """The kinds of parts that are sought or given."""
    given = kit.kit if isinstance(kit, Stock) else kit
    return list(parts or {}) if given is None else list(given.sizes)


def check_types(designs: Sequence[Design], kit: Kit | Stock | None, settings: JobSettings) -> None:
    """Raise InputError for what is no list of designs, no kit and no settings."""
    if isinstance(designs, (str, Design)) or not all(isinstance(d, Design) for d in designs):
        raise InputError("expected a list of designs, see load_design", field="designs")
    if not len(designs):
        raise InputError("expected one design or more", field="designs")
    if kit is not None and not isinstance(kit, (Kit, Stock)):
        raise InputError("expected a Kit or a Stock, see load_kit", field="kit", value=kit)
    if not isinstance(settings, JobSettings):
        raise InputError("expected JobSettings", field="settings", value=type(settings).__name__)
    if not isinstance(settings.stages, StageSettings):
        raise InputError(
            "expected StageSettings", field="settings.stages", value=type(settings.stages).__name__
        )
    if settings.weights is not None and not isinstance(settings.weights, Weights):
        raise InputError(
            "expected Weights (Weights.of takes names and numbers)",
            field="settings.weights",
            value=type(settings.weights).__name__,
        )


def check_start(designs: Sequence[Design], start: Sequence[Sequence[float]]) -> None:
    """Raise InputError unless there are finite elements (nq,) for each of the designs."""
    shapes = [np.shape(own) for own in start]
    if shapes != [design.parameters.shape for design in designs]:
        raise InputError(
            "expected the parameters of each design, as its own are",
            field="start",
            value=shapes,
        )
    if not all(np.isfinite(np.asarray(own, float)).all() for own in start):
        raise InputError("must be finite", field="start")


def check_request(
    designs: Sequence[Design],
    parts: Mapping[str, int] | None,
    kit: Kit | Stock | None,
    settings: JobSettings,
) -> None:
    """Raise InputError for what can't be met whatever the simulations say: too many parts or none,
    a kit without a kind that a design is made of, bounds that exclude each other, constraints on
    other parameters, designs of one name, weights of other designs, a cluster that can't be
    used."""
    if (parts is None) == (kit is None):
        raise InputError("give either numbers of parts or a kit", field="parts")
    if twice := {a.name for n, a in enumerate(designs) for b in designs[:n] if a.name == b.name}:
        raise InputError(
            "two designs have this name, by which results tell them apart",
            field="designs",
            value=sorted(twice)[0],
        )
    weights = settings.design_weights
    if weights is not None and len(weights) != len(designs):
        raise InputError(
            f"are {len(weights)}, for {counted(len(designs), 'design')}", field="design_weights"
        )
    if settings.scheduler is not None:
        check_cluster(settings.scheduler)
    units = common_units({design.name: design.units for design in designs})
    if kit is not None:
        given = kit.kit.units if isinstance(kit, Stock) else kit.units
        what = "stock" if isinstance(kit, Stock) else "kit"
        named = {f"the {what}": given, "the designs": units}
        units = common_units(named, f"designs and {what}s")
        _check_lengths(designs, kit.kit if isinstance(kit, Stock) else kit, what, units)
    constraints, n_q = settings.stages.constraints, parameter_offsets(designs)[-1]
    if constraints is not None and constraints.A.shape[1] != n_q:
        raise InputError(
            f"are on {constraints.A.shape[1]} parameters, the designs have {n_q}",
            field="constraints",
        )
    if isinstance(kit, Kit):
        _check_kinds(designs, kit)
        return
    groups, q = stacked_groups(designs), stacked_parameters(designs)
    if isinstance(kit, Stock):
        missing = kit.missing(groups, q, group_designs(designs))
        if missing:
            raise InputError(_lacks(missing, designs, kit, units), field="stock")
        return
    cluster(groups, q, dict(parts or {}), bounds=settings.stages.bounds, restarts=1)


def _check_lengths(designs: Sequence[Design], kit: Kit, what: str, units: Units | None) -> None:
    """Raise InputError for parts that are all much longer, or shorter, than any element that they
    could serve: they are in another unit."""
    q = stacked_parameters(designs)
    for kind, parts in kit.parts.items():
        own = [g.indices for g in stacked_groups(designs) if g.kind == kind and g.indices.size]
        if part_kind(kind).angular or not own:
            continue
        elements = np.concatenate([np.abs(q[indices]).max(axis=1) for indices in own])
        lengths = np.abs(parts).max(axis=1)
        if not elements.max() or (
            lengths.min() <= _FAR_OFF * elements.max()
            and lengths.max() >= elements.min() / _FAR_OFF
        ):
            continue
        unit = "" if units is None else f" {units.length}"
        raise InputError(
            f"all {kind} parts are {np.median(lengths) / np.median(elements):.3g} times as long as "
            f"the designs' elements, of about {np.median(elements):.3g}{unit}: are they in another "
            f"unit? A {what}'s file says in which its lengths are",
            field=what,
            value=f"{np.median(lengths):.6g}{unit}",
        )


def described_job(
    designs: Sequence[Design],
    parts: Mapping[str, int] | None,
    kit: Kit | Stock | None,
    settings: JobSettings,
) -> dict[str, Any]:
    """All that the result depends on, as plain data; the processes that work on it are not part of
    it."""
    constraints = settings.stages.constraints
    values = asdict(replace(settings, stages=replace(settings.stages, constraints=None)))
    values["weights"] = settings.weights and settings.weights.to_dict()
    if constraints is not None:
        rows = sp.csr_array(constraints.A)
        rows.sort_indices()
        numbers = (rows.indptr, rows.indices, rows.data, constraints.lower, constraints.upper)
        values["stages"]["constraints"] = {"rows": constraints.rows, "digest": digest(*numbers)}
    del values["jobs"], values["scheduler"]
    if not any(part_kind(name).penalty is not None for name in kinds_of(parts, kit)):
        del values["stages"]["slit_cost"]
    given: dict[str, Any] = {}
    if isinstance(kit, Stock):
        given = {"stock": kit.to_dict(), "together": kit.together}
        kit = kit.kit
    if kit is not None:
        given |= {"kit": kit.to_dict()}
    sizes = dict(parts or {}) if kit is None else kit.sizes
    return {"designs": [design.name for design in designs], "parts": sizes, **values, **given}


def digest(*arrays: np.ndarray) -> str:
    """SHA-256 of arrays of numbers."""
    return hashlib.sha256(
        b"".join(np.ascontiguousarray(a, dtype=float).tobytes() for a in arrays)
    ).hexdigest()


def design_digest(design: Design) -> str:
    """SHA-256 of all numbers that a design's states and target depend on. May simulate it, for a
    target that comes of that, and raise SimulationFailure."""
    arrays: list[Any] = [design.parameters, design.joints, design.target.positions]
    arrays += [design.target.surface.vertices]
    for role in design.roles:
        scene = design.scene(role.name)
        arrays += [
            *(scene.stiffness, scene.rest_strain, scene.length_constant, scene.length_factor),
            *(scene.node_frame, scene.node_offset, scene.pinned, scene.driven.constants),
            *(scene.initial.positions, scene.initial.rotations, scene.initial.angles),
            [np.nan if role.opening is None else role.opening],
        ]
    for material in materials_of(design):
        arrays += [[np.nan if value is None else value for value in astuple(material)]]
    for case in design.load_cases:
        given = (case.gravity, case.line, case.area, case.plan, case.joints, case.forces)
        limits = (case.factor, case.deflection.absolute, case.deflection.span_over)
        numbers = [np.nan if value is None else value for value in (*given, *limits)]
        arrays += [*numbers, [] if case.supports is None else case.supports]
    return digest(*(np.asarray(array, float) for array in arrays))


def _check_kinds(designs: Sequence[Design], kit: Kit) -> None:
    for design in designs:
        for kind in dict.fromkeys(group.kind for group in design.groups):
            if kind not in kit.sizes:
                raise InputError(
                    f"the kit has no {kind} parts, which {design.name} is made of",
                    field="kit",
                    value=", ".join(kit.sizes),
                )


def _lacks(
    missing: Sequence[Missing], designs: Sequence[Design], stock: Stock, units: Units | None
) -> str:
    """What a stock lacks, in words: how many pieces of which kind, and of which parts best."""
    found = []
    for one in missing:
        whose = "all designs together" if one.design is None else designs[one.design].name
        missed = counted(one.number, f"{one.kind} piece is", f"{one.kind} pieces are")
        text = f"{missed} missing for {whose}"
        if one.copies is not None:
            parts = stock.kit[one.kind]
            quantity = "angle" if part_kind(one.kind).angular else "length"
            unit = unit_of(quantity, units)
            best = ", ".join(
                f"{count} of ({', '.join(f'{value:.6g}' for value in parts[k])}) {unit}"
                for k, count in enumerate(one.copies)
                if count
            )
            text += f" (best of the parts that are there: {best})"
        found.append(text)
    return "doesn't suffice: " + "; ".join(found)
