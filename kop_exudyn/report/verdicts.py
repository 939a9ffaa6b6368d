"""Verdicts on the designs of a kit, and their words: which can be built, and what stops the
others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..analysis.load_check import LoadCheck
from ..analysis.verdict import Buildable, VerdictSettings, judge, judge_given
from ..errors import SimulationFailure
from ..fabrication.limits import cutting_problems
from ..search.pool import DesignPool
from ..search.requirements import Requirements
from ..search.result import KitResult
from ..search.weights import Weights
from ..units import Units, in_millimetres, unit_of
from ..wording import counted

_MOST_STOPS = 2  # of a design are named in its line


def kit_verdicts(
    result: KitResult,
    settings: VerdictSettings = VerdictSettings(),
    jobs: int = 1,
    scheduler: str | None = None,
) -> list[Buildable]:
    """Whether each design of a result can be built from its kit.

    settings : tolerances, samples, safety
    jobs, scheduler : see `DesignPool`
    """
    kept, opened = result.stages["assigned"].designs, result.redeployed
    calls = {n: (kept[n], opened[n] if opened else None, settings) for n in range(len(kept))}
    with DesignPool(result.designs, jobs, scheduler) as pool:
        pool.references = list(result.references)
        found = pool.map(judge, Weights(), calls)
    verdicts = []
    for n, problems in enumerate(cutting_problems(result)):
        verdict = found[n]
        if isinstance(verdict, SimulationFailure):
            raise verdict
        verdicts.append(verdict.with_parts(problems))
    return verdicts


def give_verdicts(
    result: KitResult,
    settings: VerdictSettings = VerdictSettings(),
    jobs: int = 1,
    scheduler: str | None = None,
) -> list[Buildable]:
    """The verdicts on a result's designs, which the result then tells as data and in words; see
    `kit_verdicts`."""
    verdicts = kit_verdicts(result, settings, jobs, scheduler)
    result.buildable = [one.to_dict() for one in verdicts]
    result.verdict = verdict_lines(verdicts, result.units)
    return verdicts


def given_verdicts(
    pool: DesignPool, settings: VerdictSettings, requirements: Requirements
) -> list[Buildable]:
    """The verdicts on input designs as they are given, before a kit is sought for them.

    pool : with the input designs simulated
    settings : tolerances, samples, safety
    requirements : what of all this is asked for
    """
    asked = replace(settings, samples=min(settings.samples, requirements.samples))
    found = pool.map(
        judge_given, Weights(), dict.fromkeys(range(len(pool.designs)), (asked,)), requirements
    )
    verdicts = []
    for verdict in found.values():
        if isinstance(verdict, SimulationFailure):
            raise verdict
        left_out = {
            cause
            for cause, asked_for in (
                ("opening", requirements.opening),
                ("stress", requirements.stress),
            )
            if not asked_for
        }
        stops = tuple(stop for stop in verdict.stops if stop.cause not in left_out)
        verdicts.append(replace(verdict, stops=stops))
    return verdicts


def warning_lines(given: Sequence[Buildable]) -> list[str]:
    """What stops designs as they are given, a line each."""
    return [f"As given, {stopped(verdict)}" for verdict in given if not verdict.possible]


def verdict_lines(verdicts: Sequence[Buildable], units: Units | None = None) -> tuple[str, str]:
    """Two lines: which designs can be built from their kit; what stops the others, and what would
    help, or else what was looked at.

    units : of the designs
    """
    can = [verdict.design for verdict in verdicts if verdict.possible]
    not_ = [verdict for verdict in verdicts if not verdict.possible]
    if not not_:
        some = {1: "The design", 2: "Both designs"}.get(len(can), f"All {len(can)} designs")
        return f"{some} can be built from this kit.", _margins(verdicts, units)
    names = _listed([verdict.design for verdict in not_])
    if can:
        first = f"{_listed(can)} can be built from this kit, {names} can't."
    else:
        first = f"{names} can't be built from this kit."
    alike: dict[str, list[str]] = {}
    for verdict in not_:
        alike.setdefault(_stops(verdict), []).append(verdict.design)
    return first, " ".join(f"{', '.join(names)}: {text}." for text, names in alike.items())


def stopped(verdict: Buildable) -> str:
    """What stops a design, and what would help."""
    return f"{verdict.design}: {_stops(verdict)}."


def _stops(verdict: Buildable) -> str:
    some = ". Also ".join(map(str, verdict.stops[:_MOST_STOPS]))
    more = len(verdict.stops) - _MOST_STOPS
    return f"{some}{f'. And {more} more' if more > 0 else ''}"


def verdict_rows(
    verdicts: Sequence[Buildable], units: Units | None = None
) -> tuple[list[str], list[list[Any]]]:
    """Headings and rows of a table of all verdicts.

    units : of the designs
    """
    loaded = any(verdict.loads for verdict in verdicts)
    headings = [
        "design",
        "can be built",
        "opens within, %",
        "utilisation",
        "softest mode",
        "spread, %",
        "snapped",
        "95 % within, %",
        *(
            [
                "worst load",
                f"deflection, {unit_of('length', units)}",
                "stress under it",
                "critical factor",
            ]
            if loaded
            else []
        ),
        "parts to cut",
    ]
    rows = []
    for verdict in verdicts:
        kept = verdict.forgiveness
        rows.append(
            [
                verdict.design,
                "yes" if verdict.possible else "no",
                _moved(verdict),
                verdict.largest,
                verdict.softest,
                None if kept is None else kept.spread_percent,
                None if kept is None else f"{kept.snapped} of {kept.samples}",
                None if kept is None else kept.max_percent_p95,
                *(_worst_load(verdict) if loaded else []),
                _cutting(verdict),
            ]
        )
    return headings, rows


def _moved(verdict: Buildable) -> float | str | None:
    """How far from the state shown it opens, in %; what is below a thousandth is none."""
    moved = verdict.moved_percent
    return moved if moved is None or moved >= 1e-3 else "under 0.001"


def _worst_load(verdict: Buildable) -> list[Any]:
    """Name, deflection, utilisation under the factored loads and critical factor of the load case
    that is nearest to its limits."""
    if not verdict.loads:
        return [None, None, None, None]
    worst = max(verdict.loads, key=_use)
    deflection = None if np.isnan(worst.deflection) else worst.deflection
    factor = f"over {worst.critical:.3g}" if worst.beyond else f"{worst.critical:.3g}"
    return [worst.case.name, deflection, worst.utilisation, factor]


def _use(check: LoadCheck) -> float:
    """How much of its limits a load case uses: of stability, stress and deflection the most."""
    shares = [check.case.factor / max(check.critical, 1e-9), check.utilisation or 0.0]
    if np.isfinite(check.allowed) and not np.isnan(check.deflection):
        shares.append(check.deflection / check.allowed)
    return max(shares)


def _cutting(verdict: Buildable) -> str | None:
    if verdict.fabrication is None:
        return None
    count = len(verdict.fabrication)
    return counted(count, "problem") if count else "fine"


def _margins(verdicts: Sequence[Buildable], units: Units | None) -> str:
    """What was looked at, and how far from a limit it is."""
    found = []
    moved = [v.moved_percent for v in verdicts if v.moved_percent is not None]
    if moved:
        ends = "they end" if len(verdicts) > 1 else "it ends"
        found.append(f"opened from the assembly {ends} in the shape shown")
    used = [v.largest for v in verdicts if v.largest is not None]
    if used:
        found.append(f"stress is at most {100 * max(used):.0f} % of the elastic limit")
    if len(used) < len(verdicts):
        whose = "the others'" if used else "their" if len(verdicts) > 1 else "its"
        found.append(f"{whose} stress isn't judged (no elastic limit is given)")
    kept = [v.forgiveness for v in verdicts if v.forgiveness is not None]
    if any(one.samples for one in kept):
        worst = max(kept, key=lambda one: one.tolerance.length)
        errors = (
            f"{in_millimetres(worst.tolerance.length, units, 2)} and "
            f"{np.degrees(worst.tolerance.angle):.2g} degrees"
        )
        snapped = sum(one.snapped for one in kept)
        one_each = " (no design in more than one of a hundred)" if snapped else ""
        found.append(
            f"{snapped} of {sum(one.samples for one in kept)} samples with errors of {errors} "
            f"snap{one_each}"
        )
    if any(verdict.loads for verdict in verdicts):
        found.append("all load cases are carried")
    if all(verdict.fabrication is not None for verdict in verdicts):
        whose = "their" if len(verdicts) > 1 else "its"
        found.append(f"{whose} parts have room for their holes")
    sentence = ", ".join(found)
    return f"{sentence[:1].upper()}{sentence[1:]}." if sentence else ""


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
