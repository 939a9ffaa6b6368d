"""What a search is asked for: whether it can be met at all, before anything is simulated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..errors import InputError
from ..kit.cluster import cluster
from ..kit.kinds import part_kind
from ..kit.parts import Kit
from ..kit.stock import Missing, Stock
from ..structures.base import Design
from ..structures.stacking import (
    group_designs,
    parameter_offsets,
    stacked_groups,
    stacked_parameters,
)
from ..units import Units, common_units, unit_of
from ..wording import counted
from .cluster import check_cluster
from .settings import JobSettings, StageSettings
from .weights import Weights

_FAR_OFF = 30.0  # times an element: parts that are all longer are in another unit


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
    groups, q = stacked_groups(designs), stacked_parameters(designs)
    for kind, parts in kit.parts.items():
        own = [g.indices for g in groups if g.kind == kind and g.indices.size]
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
