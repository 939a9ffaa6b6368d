"""Whether a kit can be built: what would stop a workshop, or break what it made, in sentences."""

from __future__ import annotations

from collections.abc import Iterator

from ..errors import InputError, SimulationFailure
from ..search.result import KitResult
from ..structures.strength import beyond_limit
from .blanks import Blanks
from .sources import sheet_for, sources, too_large
from .templates import templates


def obstacles(result: KitResult, blanks: Blanks | None = None) -> list[str]:
    """What is wrong with building a result's designs, one sentence each, naming the design or part.

    blanks : what is cut; None for a result that is only looked at
    Of designs, what their verdicts say that came with the result. Of results without verdicts: a
    design is in the way when it was not found, when it is stressed beyond its limit in a state that
    is built, or when its parts open into another state than the one shown. A part is, when it has
    no room for its holes or does not fit a sheet or bar.
    """
    found = [*_of_designs(result)]
    if blanks is not None:
        found += [*blanks.problems, *_of_boards(blanks)]
    return found


def refuse(found: list[str]) -> None:
    """Raise InputError unless nothing is in the way."""
    if found:
        more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        raise InputError(
            f"can't be built: {found[0]}{more}; --force (force=True) writes the files anyway"
        )


def _of_designs(result: KitResult) -> Iterator[str]:
    for design, verdict in zip(result.designs, result.buildable):
        for stop in verdict["stops"]:
            if stop["cause"] != "fabrication":  # asked of what is cut, with the options at hand
                helps = f" ({stop['helps']})" if stop["helps"] else ""
                yield f"{design.name}: {stop['why']}{helps}"
    if result.buildable:
        return
    for number, design in enumerate(result.designs):
        summary = result.summary("assigned", number)
        if "failed" in summary:
            yield f"{design.name} was not found: {summary['failed']}"
            continue
        for state, strength in summary["strength"].items():
            used = strength["utilisation"]
            if beyond_limit(used):
                yield (
                    f"{design.name} is stressed to {100 * used:.0f} % of its elastic limit in its "
                    f"{state} state"
                )
        if result.redeployed:
            opened = result.redeployment(number)
            if isinstance(result.redeployed[number], SimulationFailure):
                yield f"{design.name} does not open by itself: {opened['failed']}"
            elif not opened["same_state"]:
                yield (
                    f"{design.name} opens into another state, {opened['moved_percent']:.1f} % of "
                    "its size from the one shown"
                )


def _of_boards(blanks: Blanks) -> Iterator[str]:
    """Pieces that no sheet and no bar is large enough for."""
    source, options = sources(blanks), blanks.options
    if source.problem:
        yield source.problem
    straight = {label for label, _, _ in blanks.straight}
    wanted = [one for one in templates(blanks) if source.problem or one.label not in straight]
    width, height = options.room
    large = too_large(wanted, options)
    for piece in sorted(large, key=lambda one: -float(one.size.max())):  # largest first
        if piece.label not in straight:
            yield (
                f"part {piece.label} of {piece.size[0]:.0f} x {piece.size[1]:.0f} mm is larger "
                f"than a sheet's {width:.0f} x {height:.0f} mm; {sheet_for(large, options)} "
                "would do"
            )
