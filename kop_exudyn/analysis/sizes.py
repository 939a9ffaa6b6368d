"""How many parts are enough: kits of neighbouring sizes, and the smallest one within a deviation.

A kit of another size, with its parts split or merged (search/neighbours.py), is where the search
for the smallest kit goes on, and one start among others in a trade-off. A larger kit is never worse
than the smaller one it is compared with: where its own search ends with a larger deviation, the
smaller kit with parts of it doubled is kept.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from ..errors import InputError
from ..kit.kinds import part_kind
from ..search.checkpoints import NoStore, PrefixedStore, Store
from ..search.pool import DesignPool
from ..search.requirements import Requirements
from ..search.result import KitResult
from ..search.run import optimize_kit
from ..search.settings import EFFORTS, JobSettings
from ..search.stage_results import StageResult
from ..structures.base import Design
from ..structures.strength import largest_utilisation, strength_summary
from .reuse import counts_of, fabricated, kit_size_percent

log = logging.getLogger(__name__)

_SHARE = 0.25  # of a kind's parts, by which kits grow, and shrink at first
_FAR = 1.3  # times the deviation allowed, above which kits double, and no other start may help
_SCRATCH = "scratch"
_EXCESS = 1e-3  # of the elastic limit: what the search's tolerances leave
_MOST = 60  # parts of a kind; designs that need more share nothing worth the name


@dataclass(frozen=True)
class KitCost:
    """What a kit costs, in any unit.

    part : each part, whatever the number of its pieces (a template, a setting of the saw)
    piece : each fabricated piece, for designs that are built one after the other
    cut : each cut across a bar; a piece of a kind with lengths has two
    """

    part: float = 1.0
    piece: float = 0.0
    cut: float = 0.0

    def of(self, result: KitResult) -> float:
        """The cost of a result's kit."""
        counts = _fabricated(result)
        cuts = 2 * sum(n for kind, n in counts.items() if not part_kind(kind).angular)
        parts = sum(result.kit.sizes.values())
        return self.part * parts + self.piece * sum(counts.values()) + self.cut * cuts


@dataclass(frozen=True)
class SizedKit:
    """One kit of a trade-off.

    result : of its search
    sizes : kind -> number of parts asked for; the kit may have fewer, see `origin`
    origin : what it started from, in words
    seconds : wall time of its search
    """

    result: KitResult
    sizes: Mapping[str, int]
    origin: str
    seconds: float

    @property
    def max_percent(self) -> float:
        """The largest deviation of any design as it opens, % of its size; infinite where one can't
        be built."""
        return deviation(self.result)

    def row(self, cost: KitCost = KitCost()) -> dict[str, Any]:
        """Figures for tables: deviations in % of the targets' sizes, None where a design
        failed."""
        result = self.result
        pieces = counts_of(_plain(result.pieces()))
        designs = [result.summary("assigned", n) for n in range(len(result.designs))]
        built = [design for design in designs if "failed" not in design]
        whole = len(built) == len(designs)
        ratios = [design["energy_ratio"] for design in built]
        return {
            **dict(self.sizes),
            "parts": sum(self.sizes.values()),
            "pieces": fabricated(pieces),
            "kit size %": kit_size_percent(pieces),
            "cost": cost.of(result),
            "max %": self.max_percent if np.isfinite(self.max_percent) else None,
            "mean %": float(np.mean([d["fit"]["mean_percent"] for d in built])) if whole else None,
            "energy ratio": float(np.mean(ratios)) if whole else None,
            "largest energy ratio": max(ratios) if whole else None,
            "failed designs": len(designs) - len(built),
            "J": result.stages["assigned"].value,
            "from": self.origin,
            "equilibria": result.equilibria,
            "seconds": self.seconds,
        }


Observer = Callable[[SizedKit], None]
Examine = Callable[[DesignPool], None]


def deviation(result: KitResult) -> float:
    """The largest deviation of any design, as kept and as it opens from its assembly, % of its
    size; infinite where one can't be built."""
    found = [result.summary("assigned", n) for n in range(len(result.designs))]
    if result.redeployed:
        found += [result.redeployment(n) for n in range(len(result.designs))]
    if any("failed" in one for one in found):
        return float("inf")
    return max(one["fit"]["max_percent"] for one in found)


def unmet(result: KitResult, required: Requirements) -> list[str]:
    """In words, by which designs a kit misses what is required of it: that they open by themselves
    into the states found, that these keep below the elastic limit, and that errors of the workshop
    don't make them snap.

    A design that is stressed beyond it as given can't be helped by a kit, and is left out.
    """
    found = []
    for n, design in enumerate(result.designs):
        opened = result.redeployment(n) if result.redeployed else {"same_state": True}
        if required.opening and not opened.get("same_state", False):
            found.append(f"{design.name} opens into another state")
        if required.samples and n in result.stages["assigned"].snapping:
            found.append(f"{design.name} snaps with errors of the workshop")
        if not required.stress:
            continue
        given = (
            largest_utilisation(strength_summary(design, result.references[n].equilibria)) or 0.0
        )
        used = largest_utilisation(result.summary("assigned", n).get("strength", {})) or 0.0
        if required.safety * given <= 1 < required.safety * used - _EXCESS:
            found.append(f"{design.name} is stressed to {used:.2f} of its limit")
    return found


def smallest_kit(
    designs: Sequence[Design],
    limit: float,
    first: Mapping[str, int],
    *,
    settings: JobSettings = JobSettings(),
    cost: KitCost = KitCost(),
    accepts: Callable[[KitResult], bool] = lambda result: True,
    store: Store | None = None,
    observer: Observer = lambda kit: None,
    announce: Callable[[str], None] = lambda text: None,
    examine: Examine = lambda pool: None,
) -> tuple[SizedKit | None, list[SizedKit]]:
    """The cheapest kit found from which all designs can be built within a deviation.

    limit : largest deviation, % of each design's box; the requirements of the settings have to be
        met as well, see `unmet`
    first : kind -> number of parts of the kit that the search begins with
    cost : what is to be small
    accepts : further conditions on a kit
    store : keeps checkpoints of every size, from which an interrupted search goes on
    observer, announce : are told every kit, and what is being done
    examine : looks at the input designs before the first kit is sought, see `optimize_kit`

    From a kit that is good enough, parts of the dearest kind are merged away, a quarter of them at
    first, then fewer, until no kind can do with one part less. Where one part less ends just above
    the deviation, it is sought once more from scratch, as what a kit ends at depends on where it
    began. A kit that isn't good enough grows by a quarter of every kind until it is; one that is
    far from it doubles.

    Returns the kit, None where none was found up to 60 parts of a kind, and all kits in the order
    in which they were looked at.
    """
    if not limit > 0:
        raise InputError("expected a positive deviation in %", field="max_deviation", value=limit)
    chain = _Chain(designs, settings, store, observer, announce, examine)

    required = settings.stages.requirements

    def other_start(kit: SizedKit) -> bool:
        known = any(k.sizes == kit.sizes and k.origin == _SCRATCH for k in chain.kits)
        return limit < kit.max_percent <= _FAR * limit and not known

    def good(kit: SizedKit) -> bool:
        return kit.max_percent <= limit and not unmet(kit.result, required) and accepts(kit.result)

    now = chain.kit(dict(first))
    most = {kind: min(_MOST, count) for kind, count in _elements(designs).items()}
    while not good(now):
        far = np.isfinite(now.max_percent) and now.max_percent > _FAR * limit
        share = 1.0 if far else _SHARE
        sizes = {k: min(most[k], n + max(1, round(share * n))) for k, n in now.sizes.items()}
        if sizes == now.sizes:
            return None, chain.kits
        now = chain.kit(sizes, now)
    blocked: dict[str, int] = {}  # kind -> the step that failed last
    while True:
        steps = {
            kind: min(max(1, round(_SHARE * n)), blocked.get(kind, n) // 2 or 1, n - 1)
            for kind, n in now.sizes.items()
            if n > 1 and blocked.get(kind) != 1
        }
        if not steps:
            return now, chain.kits
        kind = max(steps, key=lambda k: (steps[k], now.sizes[k]))
        trial = chain.kit({**now.sizes, kind: now.sizes[kind] - steps[kind]}, now)
        if steps[kind] == 1 and other_start(trial):
            trial = chain.kit(trial.sizes)
        if good(trial) and cost.of(trial.result) <= cost.of(now.result):
            now = trial
        else:
            blocked[kind] = steps[kind]


def trade_off(
    designs: Sequence[Design],
    sizes: Iterable[Mapping[str, int]],
    *,
    settings: JobSettings = JobSettings(),
    store: Store | None = None,
    observer: Observer = lambda kit: None,
    announce: Callable[[str], None] = lambda text: None,
    examine: Examine = lambda pool: None,
) -> list[SizedKit]:
    """Kits of these sizes, the smallest first; no kit deviates more than a smaller one before it.

    sizes : kind -> number of parts, from small to large. Each is searched from scratch, with the
        next larger kit as one more start (with effort "quick" the largest only, and the others from
        the next larger one alone), and again from the next smaller one where it is worse than that
    store, observer, announce, examine : see `smallest_kit`
    """
    wanted = [dict(size) for size in sizes]
    chain = _Chain(designs, settings, store, observer, announce, examine)
    kits: list[SizedKit] = []
    anew = EFFORTS[settings.stages.effort].clusterings > 0
    for size in reversed(wanted):
        kits.insert(0, chain.kit(size, kits[0] if kits else None, anew=anew))
    for n in range(1, len(kits)):
        smaller, larger = kits[n - 1], kits[n]
        if larger.max_percent <= smaller.max_percent or not _all_larger(larger, smaller):
            continue
        again = chain.kit(larger.sizes, smaller)
        best = min((larger, again), key=lambda kit: kit.max_percent)
        if best.max_percent > smaller.max_percent:
            best = SizedKit(smaller.result, larger.sizes, "that of fewer parts", again.seconds)
        kits[n] = best
    return kits


class _Chain:
    """Searches one after the other, each with its own checkpoints."""

    def __init__(
        self,
        designs: Sequence[Design],
        settings: JobSettings,
        store: Store | None,
        observer: Observer,
        announce: Callable[[str], None],
        examine: Examine,
    ):
        self.examine = examine
        self.designs, self.settings = designs, settings
        self.store, self.observer, self.announce = store or NoStore(), observer, announce
        self.kits: list[SizedKit] = []

    def kit(
        self, sizes: Mapping[str, int], start: SizedKit | None = None, anew: bool = False
    ) -> SizedKit:
        """A kit of these sizes, from another one, from scratch, or (`anew`) from both."""
        shown = _listed(sizes)
        self.announce(shown)
        begin = perf_counter()
        before: StageResult | None = None
        if start is not None and np.isfinite(start.max_percent):
            before = start.result.stages["assigned"]
        counts = "-".join(map(str, sizes.values()))
        own = PrefixedStore(self.store, f"{len(self.kits)}-{counts}-")
        result = optimize_kit(
            self.designs,
            sizes,
            start=None if anew else before,
            beside=before if anew else None,
            settings=self.settings,
            store=own,
            announce=lambda phase: self.announce(f"{shown}: {phase}"),
            examine=(lambda pool: None) if self.kits else self.examine,
        )
        merged = any(one.kept and one.origin == "neighbour" for one in result.tried)
        led = start if before is not None and (merged or not anew) else None
        origin = _SCRATCH if led is None else _listed(led.sizes)
        if led is not None and not anew:
            # what the whole chain began with: it is what this kit is compared with
            earlier = {s: led.result.stages[s] for s in ("direct", "relaxed")}
            result.stages = {**earlier, **result.stages}
            result.clustering = led.result.clustering
            relaxed = [event for event in led.result.events if event.stage == "relaxed"]
            result.events = [*relaxed, *result.events]
        found = SizedKit(result, dict(sizes), origin, perf_counter() - begin)
        log.info("%s parts: largest deviation %.3g %%", shown, found.max_percent)
        self.kits.append(found)
        self.observer(found)
        return found


def _listed(sizes: Mapping[str, int]) -> str:
    return ", ".join(f"{count} {kind}" for kind, count in sizes.items())


def _fabricated(result: KitResult) -> dict[str, int]:
    """Kind -> pieces to make so that each of the designs can be built at a time."""
    pieces = _plain(result.pieces())
    return {kind: fabricated(counts_of(pieces, kind)) for kind in result.kit.parts}


def _plain(pieces: Sequence[Mapping[str, np.ndarray]]) -> list[dict[str, list[int]]]:
    return [{kind: counts.tolist() for kind, counts in own.items()} for own in pieces]


def _elements(designs: Sequence[Design]) -> dict[str, int]:
    """Kind -> elements of all designs."""
    found: dict[str, int] = {}
    for design in designs:
        for group in design.groups:
            found[group.kind] = found.get(group.kind, 0) + len(group.indices)
    return found


def _all_larger(one: SizedKit, other: SizedKit) -> bool:
    return all(one.sizes[kind] >= count for kind, count in other.sizes.items())
