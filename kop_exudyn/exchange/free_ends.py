"""Ends of laths beyond their last joints, which designs leave out unless they are asked for."""

from __future__ import annotations

import numpy as np

from ..geometry.network import CurveNetwork
from ..units import Units, with_unit
from ..wording import counted
from .drawing import Finding
from .drawn_networks import DrawnNetwork

_LONG = 0.5  # of the median span: ends that long are no mere overhang
_NEGLIGIBLE = 1e-6  # of a curve's length: less is round-off


def cut_ends(found: CurveNetwork) -> tuple[np.ndarray, np.ndarray]:
    """Lengths (k,) of what a network leaves out of its curves' ends, and their tips (k, 2)."""
    lengths, tips = [], []
    for strand in found.strands:
        curve = strand.curve
        if strand.closed:
            continue
        head = strand.stations[0] - strand.head
        tail = curve.length - strand.stations[-1] - strand.tail
        for length, station in ((head, 0.0), (tail, curve.length)):
            if length > _NEGLIGIBLE * curve.length:
                lengths.append(float(length))
                tips.append(curve.position(station))
    return np.array(lengths), np.array(tips).reshape(-1, 2)


def free_end_doubts(drawn: DrawnNetwork, units: Units | None) -> list[Finding]:
    """A finding where ends that are cut off are about as long as spans: they may be meant."""
    found = drawn.network
    lengths, tips = cut_ends(found)
    spans = np.concatenate([strand.lengths for strand in found.strands])
    if not len(lengths) or not len(spans):
        return []
    long = lengths > _LONG * np.median(spans)
    if not long.any():
        return []
    flat = np.column_stack([tips[long], np.zeros(long.sum())]) / drawn.options.scale
    longest = with_unit(float(lengths.max()), "length", units)
    kept_by = drawn.options.ends_kept_by
    how = f" ({kept_by} keeps ends)" if kept_by else ""
    ends = counted(int(long.sum()), "free end that is cut off is", "free ends that are cut off are")
    text = f"{ends} longer than half a span, up to {longest}: is no joint missing there?{how}"
    return [Finding("suspicious", text, drawn.frame.back(flat))]
