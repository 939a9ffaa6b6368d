"""What was understood of a drawing, in figures and in words."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import InputError
from ..units import Units, plain_number, with_unit
from ..wording import counted
from .drawing import Finding
from .drawn_networks import DrawnNetwork, network_summary
from .free_ends import cut_ends

_SHOWN = 4  # findings of a kind that are told one by one


def import_figures(drawn: DrawnNetwork, units: Units | None) -> dict[str, Any]:
    """For programs: numbers of curves, pieces and joints, spans, size, units, and the place of the
    design's origin where it isn't the drawing's; lengths in the design's unit."""
    found: dict[str, Any] = {
        "pieces": len(drawn.drawing.curves),
        "curves": len(drawn.entries),
        "unit_of_the_drawing": drawn.drawing.unit,
        "scale": drawn.options.scale,
        "units": None if units is None else units.to_dict(),
        "origin": drawn.placed.get("origin"),
    }
    try:
        network = drawn.network
    except InputError as error:
        return found | {"refused": str(error)}
    cut, _ = cut_ends(network)
    ends = {"cut_ends": len(cut), "longest_cut_end": float(cut.max()) if len(cut) else None}
    return found | dict(network_summary(network)) | ends


def import_rows(
    figures: dict[str, Any],
    findings: list[Finding],
    units: Units | None,
    opening: float | None = None,
    *,
    ends_kept_by: str = "",
) -> list[tuple[str, str]]:
    """For people: rows of a name and a text.

    opening : rad, of a C-shell
    ends_kept_by : the option that keeps free ends, where the class has one
    """
    of = "of" if figures["curves"] <= figures["pieces"] else "made of"
    rows = [("curves", f"{figures['curves']} {of} {counted(figures['pieces'], 'drawn piece')}")]
    if "joints" in figures:
        rows.append(("joints", str(figures["joints"])))
        if figures["spans"]:
            ends = (figures[f"{end}_span"] for end in ("shortest", "longest"))
            shortest, longest = map(plain_number, ends)
            median = with_unit(figures["median_span"], "length", units)
            rows.append(
                ("spans", f"{figures['spans']} of {shortest} to {longest}, median {median}")
            )
        if figures["cut_ends"]:
            longest = with_unit(figures["longest_cut_end"], "length", units)
            how = f" ({ends_kept_by} keeps them)" if ends_kept_by else ""
            text = f"{counted(figures['cut_ends'], 'end')} beyond the last joints, of up to "
            rows.append(("free ends", f"{text}{longest}, cut off{how}"))
        rows.append(("size", with_unit(figures["size"], "length", units, 4)))
        if figures["mean_angle_deg"] is not None and opening is not None:
            now = figures["mean_angle_deg"]
            then = now + float(np.degrees(opening))
            rows.append(
                (
                    "opening",
                    f"{now:.4g}° between the families in the mean, to {then:.4g}° when deployed",
                )
            )
    if figures["origin"] is not None:
        at = ", ".join(f"{x:.15g}" for x in figures["origin"])
        rows.append(("origin", f"({at}) of the drawing: it lies far from (0, 0, 0)"))
    rows.append(("units", _unit_text(figures, units)))
    names = {"suspicious": "look at"}
    for kind in ("joined", "hinged", "cleaned", "skipped", "suspicious"):
        texts = [finding.text for finding in findings if finding.kind == kind]
        more = len(texts) - _SHOWN
        texts = texts[:_SHOWN] + ([f"and {more} more"] if more > 0 else [])
        rows += [(names.get(kind, kind), text) for text in texts]
    return rows


def _unit_text(figures: dict[str, Any], units: Units | None) -> str:
    drawn, scale = figures["unit_of_the_drawing"], figures["scale"]
    times = "" if scale == 1.0 else f", the drawing's coordinates times {scale:g}"
    source = "" if drawn is None else f" (the drawing says {drawn})"
    if units is None:
        return f"not known{source}{times}; --unit m, say, names the design's"
    return f"{units}{source}{times}"
