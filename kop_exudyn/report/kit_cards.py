"""What a reader of a kit's page sees first: every design as it stands, with the verdict on it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from PIL import Image

from ..analysis.load_check import LoadCheck
from ..analysis.verdict import Buildable
from ..search.result import KitResult
from ..structures.strength import beyond_limit, largest_utilisation
from ..units import Units, in_millimetres
from .kit_picture import png
from .page import Card

PERCENT = (
    "Deviations are distances from the target surface, with each design placed where its largest "
    "one is least, in % of the target's size (√3 times its mean width, about the diagonal of its "
    "bounding box)"
)


def design_cards(
    result: KitResult, verdicts: Sequence[Buildable], pictures: Sequence[Image.Image | None]
) -> list[Card]:
    """A card for each design.

    verdicts : on the designs, or none
    pictures : of the designs, see `kit_pictures`
    """
    cards = []
    for n, (design, picture) in enumerate(zip(result.designs, pictures)):
        verdict = verdicts[n] if verdicts else None
        summary = result.summary("assigned", n)
        badge, good = _badge(verdict, summary)
        cards.append(
            Card(
                design.name,
                badge,
                good,
                _lines(result, n, summary, verdict),
                None if picture is None else png(picture),
                f"{design.name}, built from the kit, every part in its colour",
            )
        )
    return cards


def percent_explained(result: KitResult) -> str:
    """The sentence that says once what deviations in percent are of, with each design's
    size."""
    sizes = "; ".join(
        f"{design.name} {in_millimetres(float(reference.target.size), result.units, 4)}"
        for design, reference in zip(result.designs, result.references)
    )
    return f"{PERCENT} ({sizes})."


def deviation_words(result: KitResult) -> str:
    """How far the built designs are off at most, the worst of them: joints, and the rods between
    where these are farther off; "" where no design was found."""
    fits = [result.summary("assigned", n).get("fit") for n in range(len(result.designs))]
    known = [fit for fit in fits if fit is not None]

    def within(name: str) -> str:
        percent = max(fit[f"{name}_percent"] for fit in known)
        length = in_millimetres(max(fit[name] for fit in known), result.units)
        return f"within {percent:.2g} % ({length})"

    if not known:
        return ""
    text = f"every joint {within('max')} of its target"
    if max(fit["pieces_max"] for fit in known) > max(fit["max"] for fit in known):
        text += f", the rods between them {within('pieces_max')}"
    return text


def deviation_line(result: KitResult) -> str:
    """`deviation_words` as a sentence."""
    words = deviation_words(result)
    keeps = "they keep" if len(result.designs) > 1 else "it keeps"
    return f"Built, {keeps} {words}." if words else ""


def deviation_rows(result: KitResult) -> tuple[list[str], list[list[Any]]]:
    """Headings and rows: how far each built design is from its target, in percent and in units."""
    unit = "mm" if result.units is not None else "units of length"
    scale = 1.0 if result.units is None else 1000 * result.units.metres
    headings = [
        "design",
        "joints, max %",
        f"joints, max {unit}",
        "joints, mean %",
        "between joints, max %",
        f"between joints, max {unit}",
        "between joints, mean %",
    ]
    rows: list[list[Any]] = []
    for n, design in enumerate(result.designs):
        fit = result.summary("assigned", n).get("fit")
        rows.append(
            [design.name, *[None] * 6]
            if fit is None
            else [
                design.name,
                fit["max_percent"],
                scale * fit["max"],
                fit["mean_percent"],
                fit["pieces_max_percent"],
                scale * fit["pieces_max"],
                fit["pieces_mean_percent"],
            ]
        )
    return headings, rows


def _badge(verdict: Buildable | None, summary: dict[str, Any]) -> tuple[str, bool | None]:
    if "failed" in summary:
        return "no equilibrium", False
    if verdict is None:
        return "not judged", None
    return ("can be built", True) if verdict.possible else ("can't be built", False)


def _lines(
    result: KitResult, n: int, summary: dict[str, Any], verdict: Buildable | None
) -> list[tuple[str, str, bool]]:
    counted = result.pieces()[n]
    different = " + ".join(
        f"{np.count_nonzero(counts)} {kind}" for kind, counts in counted.items() if counts.any()
    )
    total = sum(int(counts.sum()) for counts in counted.values())
    lines = [("pieces", f"{total}, of {different} parts", False)]
    if "fit" in summary:
        lines += _off(summary["fit"], result.units)
    largest = _largest(verdict, summary)
    if largest is not None:
        lines.append(
            ("stress", f"{100 * largest:.0f} % of the elastic limit", beyond_limit(largest))
        )
    if verdict is not None:
        lines += _opening(verdict)
        failing = {stop.case for stop in verdict.stops}
        lines += [_load(check, result.units, check.case.name in failing) for check in verdict.loads]
    return lines


def _load(check: LoadCheck, units: Units | None, bad: bool) -> tuple[str, str, bool]:
    """What a load case does, its stress under the factored loads."""
    if not check.stable or check.loaded is None:
        return "loads", f"{check.case.name}: fails at {check.critical:.3g} times", True
    text = f"{check.case.name}: deflects {in_millimetres(check.deflection, units)}"
    if check.utilisation is not None:
        text += f", stress {100 * check.utilisation:.0f} % of the limit"
    return "loads", text, bad


def _off(fit: dict[str, float], units: Units | None) -> list[tuple[str, str, bool]]:
    def told(name: str) -> str:
        return f"at most {fit[f'{name}_percent']:.2g} %, {in_millimetres(fit[name], units)}"

    lines = [("joints off", told("max"), False)]
    if fit["pieces_max"] != fit["max"]:
        lines.append(("between them", told("pieces_max"), False))
    return lines


def _largest(verdict: Buildable | None, summary: dict[str, Any]) -> float | None:
    """The largest utilisation: of all states on the way where a verdict knows them."""
    if verdict is not None and verdict.largest is not None:
        return verdict.largest
    return largest_utilisation(summary.get("strength", {}))


def _opening(verdict: Buildable) -> list[tuple[str, str, bool]]:
    if any(stop.cause == "opening" for stop in verdict.stops):
        moved = verdict.moved_percent
        where = "not by itself" if moved is None else f"{moved:.2g} % away from the one wanted"
        return [("opens", where, True)]
    return [] if verdict.moved_percent is None else [("opens", "into the wanted shape", False)]
