"""Do designs suit each other? What each is like by itself, and which ones make a kit expensive.

The price of a kit is told by the projection energy of the inputs (kit/projection.py) at some
numbers of parts: it needs no simulation. What a design's elements share in it, how near the others'
elements would be to their parts without it, and what another size of it would bring, are
clusterings each. They say which designs don't fit in, not how well the designs will be built.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import SimulationFailure
from ..kit.cluster import cluster
from ..kit.elements import collect
from ..kit.groups import ElementGroup
from ..kit.kinds import part_kind
from ..search.input_fit import fit_input
from ..structures.base import Design, can_be_rescaled
from ..structures.deviation import OFF_TARGET
from ..structures.stacking import group_designs, stacked_groups, stacked_parameters
from ..structures.strength import beyond_limit
from .simulation import simulate

_DIVIDE = 1.4  # elements that many times as long as the others' would rather be divided
_WORTH = 0.05  # of the energy; what gains less is no advice
_TRIED = 7  # sizes between the smallest and the largest, then as many again about the best one
_RESTARTS = 3


@dataclass(frozen=True)
class ElementCost:
    """One element far from its part.

    kind, number : the element, numbered from 1 within its design as in assembly plans
    parameters : its lengths or its angle; part : those of the nearest part
    percent : of the whole projection energy
    """

    kind: str
    number: int
    parameters: list[float]
    part: list[float]
    percent: float


@dataclass
class DesignCheck:
    """One design.

    failed : why it can't be simulated, None where it can: then it opens into a stable state
    max_percent, mean_percent, max : its own deviation from its target, % of its size; in units
    fitted_percent : the largest deviation after `fit_input`, None where that wasn't tried
    displaced_percent : how far joints slid along the target
    utilisation : by state, the largest equivalent stress over the elastic limit; None if unknown
    elements_percent, energy_percent : what its elements are of all, and of the projection energy
    others_gain_percent : by how much the others' projection energy would fall without it
    length_ratio : median length of its elements over that of the other designs'; None without any
    best_scale, scale_gain_percent : the size that suits the others best, and by how much that
        lowers the projection energy of lengths; 1 and 0 for classes that have one size
    expensive : elements that cost most
    cautions : what its class has to say of it, see `Design.cautions`
    """

    name: str
    failed: str | None = None
    max_percent: float | None = None
    mean_percent: float | None = None
    max: float | None = None
    fitted_percent: float | None = None
    displaced_percent: float | None = None
    utilisation: dict[str, float | None] = field(default_factory=dict)
    elements_percent: float = 0.0
    energy_percent: float = 0.0
    others_gain_percent: float = 0.0
    length_ratio: float | None = None
    best_scale: float = 1.0
    scale_gain_percent: float = 0.0
    expensive: list[ElementCost] = field(default_factory=list)
    cautions: list[str] = field(default_factory=list)

    @property
    def problems(self) -> list[str]:
        """What is wrong with the design by itself, in words."""
        if self.failed is not None:
            return [f"doesn't open: {self.failed}"]
        found = []
        if self.max_percent is not None and self.max_percent > OFF_TARGET:
            better = (
                ""
                if self.fitted_percent is None
                else f"; its own parameters could bring that to {self.fitted_percent:.2g} % "
                "(kop fit does that; the search for a kit goes there by itself)"
            )
            found.append(f"is {self.max_percent:.2g} % off its own target{better}")
        over = {
            role: u for role, u in self.utilisation.items() if u is not None and beyond_limit(u)
        }
        found += [
            f"is stressed to {100 * u:.0f} % of the elastic limit ({role}): bending stress goes "
            f"with the thickness, so {100 / u:.0f} % of it would just do"
            for role, u in over.items()
        ]
        return found

    @property
    def advice(self) -> list[str]:
        """What would suit the kit, in words."""
        found = []
        ratio = self.length_ratio
        if ratio is not None and max(ratio, 1 / ratio) >= _DIVIDE:
            more = "more" if ratio > 1 else "fewer"
            found.append(
                f"its elements are {ratio:.2g} times as long as the others': divide its curves "
                f"into {ratio:.2g} times as many pieces ({more} curves across), or rescale it"
            )
        if self.scale_gain_percent >= 100 * _WORTH:
            found.append(
                f"{self.best_scale:.3g} times as large it would suit the others: "
                f"{self.scale_gain_percent:.0f} % less projection energy"
            )
        return found

    def to_dict(self) -> dict[str, Any]:
        """As `kop check --json` prints it."""
        own = {key: value for key, value in vars(self).items() if key != "expensive"}
        return {
            **own,
            "expensive": [vars(element) for element in self.expensive],
            "problems": self.problems,
            "advice": self.advice,
        }


def check_designs(
    designs: Sequence[Design],
    parts: Mapping[str, int],
    *,
    scales: tuple[float, float] = (0.8, 1.25),
    shown: int = 3,
    fit: bool = True,
) -> list[DesignCheck]:
    """Check every design by itself, and against the others for a kit of so many parts a kind.

    scales : the smallest and the largest size that is tried for each design
    shown : how many expensive elements of each design are named
    fit : whether `fit_input` is tried for designs that are off their targets

    A design that can't be simulated is told so; the rest is told of it all the same. Raises
    InputError for numbers of parts that can't be.
    """
    found = [DesignCheck(design.name, cautions=design.cautions) for design in designs]
    _add_shares(found, designs, parts, shown)  # refuses impossible numbers before all else
    for check, design in zip(found, designs):
        _simulate(check, design, fit)
    if len(designs) > 1:
        energy = _energy(designs, parts)
        for check, design in zip(found, designs):
            _add_without(check, design, designs, parts)
            check.length_ratio = _length_ratio(design, designs)
            if not can_be_rescaled(design):
                continue
            others = {other.name: 1.0 for other in designs}
            scale, value = _best_scale(design, designs, parts, scales, others)
            check.best_scale = scale
            check.scale_gain_percent = 100 * (1 - value / energy) if energy > 0 else 0.0
    return found


def harmonised(
    designs: Sequence[Design], parts: Mapping[str, int], scales: tuple[float, float]
) -> tuple[dict[str, float], float, float]:
    """Sizes by name at which the designs suit each other best, and the projection energies before
    and after.

    scales : the smallest and the largest size. The first design keeps its own, the others get
        theirs one after the other, twice.
    """
    sizes = {design.name: 1.0 for design in designs}
    before = after = _energy(designs, parts)
    for _ in range(2):
        for design in designs[1:]:
            scale, value = _best_scale(design, designs, parts, scales, sizes)
            if value < after:
                sizes[design.name], after = scale, value
    return sizes, before, after


def _simulate(check: DesignCheck, design: Design, fit: bool) -> None:
    """What the design is like by itself."""
    try:
        result = simulate(design, warn=False)
    except SimulationFailure as failure:
        check.failed = str(failure)
        return
    check.max_percent, check.mean_percent = result.fit.max_percent, result.fit.mean_percent
    new = [told for told in result.warnings if told not in check.cautions]
    check.cautions = [*check.cautions, *new]
    check.displaced_percent = result.displaced_percent
    data = result.to_dict()
    check.max, strength = data["fit"]["max"], data["strength"]
    check.utilisation = {role: state["utilisation"] for role, state in strength.items()}
    if fit and result.fit.max_percent > OFF_TARGET:
        with suppress(SimulationFailure):  # then there is nothing to tell
            check.fitted_percent = fit_input(design, max_steps=10).fit.max_percent


def _stacked(
    designs: Sequence[Design], sizes: Mapping[str, float] | None = None
) -> tuple[list[ElementGroup], np.ndarray, np.ndarray]:
    """Groups, parameters at these sizes (default: 1), and the number of each group's design."""
    groups, owner = stacked_groups(designs), group_designs(designs)
    q = stacked_parameters(designs).astype(float)
    for group, number in zip(groups, owner.tolist()):
        if sizes is not None and not part_kind(group.kind).angular:
            q[group.indices] *= sizes[designs[number].name]
    return groups, q, owner


def _energy(
    designs: Sequence[Design], parts: Mapping[str, int], sizes: Mapping[str, float] | None = None
) -> float:
    """Projection energy of weight 1 of kinds that sizes matter for."""
    groups, q, _ = _stacked(designs, sizes)
    chosen = [group for group in groups if not part_kind(group.kind).angular]
    own = {group.kind: parts[group.kind] for group in chosen}
    return sum(cluster(chosen, q, own, restarts=_RESTARTS).energy.values())


def _best_scale(
    design: Design,
    designs: Sequence[Design],
    parts: Mapping[str, int],
    scales: tuple[float, float],
    sizes: Mapping[str, float],
) -> tuple[float, float]:
    """The size of one design of least energy, the others at these sizes, and that energy."""
    tried: dict[float, float] = {}

    def at(scale: float) -> float:
        if scale not in tried:
            tried[scale] = _energy(designs, parts, {**sizes, design.name: scale})
        return tried[scale]

    low, high = scales
    for scale in (sizes[design.name], *np.geomspace(low, high, _TRIED).tolist()):
        at(scale)
    step = (high / low) ** (1 / (_TRIED - 1))
    best = min(tried, key=at)
    for scale in np.geomspace(max(low, best / step), min(high, best * step), _TRIED).tolist():
        at(scale)
    best = min(tried, key=at)
    return best, at(best)


def _length_ratio(design: Design, designs: Sequence[Design]) -> float | None:
    """Median length of a design's elements over that of the others'."""

    def lengths(of: Sequence[Design]) -> np.ndarray:
        found = [
            np.abs(d.parameters[g.indices].ravel())
            for d in of
            for g in d.groups
            if not part_kind(g.kind).angular
        ]
        return np.concatenate(found) if found else np.empty(0)

    own, others = lengths([design]), lengths([other for other in designs if other is not design])
    if not len(own) or not len(others) or not math.isfinite(np.median(own)):
        return None
    return float(np.median(own) / np.median(others))


def _numbers(design: Design, kind: str) -> list[int]:
    """Numbers of a design's elements of one kind, in the order of its groups."""
    found: list[int] = []
    first = 1
    for group in design.groups:
        end = first + len(group.indices)
        found += range(first, end) if group.kind == kind else ()
        first = end
    return found


def _add_shares(
    checks: Sequence[DesignCheck],
    designs: Sequence[Design],
    parts: Mapping[str, int],
    shown: int,
) -> None:
    """What each design's elements share in the projection energy, and the dearest of them."""
    groups, q, owner = _stacked(designs)
    found = cluster(groups, q, parts)
    elements = collect(groups, q)
    realised = found.assignment.realise(found.kit, q)
    whole = sum(found.energy.values())
    total = sum(design.n_elements for design in designs)
    dearest: list[list[ElementCost]] = [[] for _ in designs]
    counted: dict[tuple[int, str], int] = {}
    for group, part, number in zip(groups, found.assignment.part, owner):
        e = elements[group.kind]
        squared = np.sum((q - realised)[group.indices] ** 2, axis=1)
        percent = 100 * squared / (2 * e.n * e.scale**2) / whole if whole > 0 else 0 * squared
        checks[number].energy_percent += float(percent.sum())
        checks[number].elements_percent += 100 * len(squared) / total
        first = counted.get((number, group.kind), 0)
        counted[number, group.kind] = first + len(squared)
        for k in np.argsort(-percent)[:shown]:
            dearest[number].append(
                ElementCost(
                    group.kind,
                    _numbers(designs[number], group.kind)[first + int(k)],
                    q[group.indices[k]].tolist(),
                    found.kit[group.kind][part[k]].tolist(),
                    float(percent[k]),
                )
            )
    for check, costs in zip(checks, dearest):
        check.expensive = sorted(costs, key=lambda cost: -cost.percent)[:shown]


def _add_without(
    check: DesignCheck, design: Design, designs: Sequence[Design], parts: Mapping[str, int]
) -> None:
    """By how much the others' energy would fall, were this design built of other parts."""
    groups, q, owner = _stacked(designs)
    number = list(designs).index(design)
    rest = [group for group, n in zip(groups, owner) if n != number]
    kinds = {group.kind for group in rest}
    scales = {kind: e.scale for kind, e in collect(groups, q).items()}
    few = {
        kind: min(parts[kind], sum(len(g.indices) for g in rest if g.kind == kind))
        for kind in kinds
    }
    kits = [
        cluster(of, q, sizes, restarts=_RESTARTS).kit
        for of, sizes in ((groups, parts), (rest, few))
    ]
    elements = collect(rest, q, scales)
    together, alone = (
        sum(e.energy(kit[kind], e.nearest(kit[kind])) for kind, e in elements.items())
        for kit in kits
    )
    check.others_gain_percent = 100 * (1 - alone / together) if together > 0 else 0.0
