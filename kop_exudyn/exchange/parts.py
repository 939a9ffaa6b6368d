"""Which drawn curves hang together, and what to do about those that don't: frames, legends,
dimensions and second nets are drawn beside most nets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..wording import counted
from .contacts import plan_lines
from .drawing import DrawnCurve, Finding

_FEWEST = 4  # curves of what may be a net
_NAMED = 3  # curves, or layers, that a message names


def parts_of(
    curves: Sequence[DrawnCurve], flat: Sequence[np.ndarray], tolerance: float
) -> list[list[int]]:
    """Numbers of the curves that hang together, the largest part first.

    flat : points (n, 2) of each in plan
    tolerance : a length, within which curves meet
    """
    lines = plan_lines(curves, flat)
    pairs = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=tolerance)
    graph = coo_array((np.ones(pairs.shape[1]), pairs), shape=(len(lines),) * 2)
    count, label = connected_components(graph, directed=False)
    parts = [np.flatnonzero(label == k).tolist() for k in range(count)]
    return sorted(parts, key=lambda part: (-len(part), part[0]))


def largest_part(
    curves: list[DrawnCurve], flat: list[np.ndarray], tolerance: float
) -> tuple[list[DrawnCurve], list[np.ndarray], list[Finding]]:
    """The curves of the largest part, their points in plan, and what was left out."""
    parts = parts_of(curves, flat, tolerance)
    if len(parts) == 1:
        return curves, flat, []
    kept = parts[0]
    out = sorted(k for part in parts[1:] for k in part)
    text = (
        f"{counted(len(out), 'curve is not', 'curves are not')} connected with the largest part, "
        f"of {len(kept)}: "
        f"{_listed([curves[k].label for k in out])}"
    )
    places = np.array([curves[k].points.mean(axis=0) for k in out])
    found = Finding("skipped", text, places)
    return [curves[k] for k in kept], [flat[k] for k in kept], [found]


def advice(
    curves: Sequence[DrawnCurve], flat: Sequence[np.ndarray], tolerance: float
) -> str | None:
    """What to do about a drawing of several parts, in words; None where it is one."""
    parts = parts_of(curves, flat, tolerance)
    if len(parts) == 1:
        return None
    if len(parts[0]) < max(_FEWEST, 2 * len(parts[1])):
        sizes = ", ".join(str(len(part)) for part in parts[:_NAMED])
        more = " ..." if len(parts) > _NAMED else ""
        return (
            f"the parts have {sizes}{more} curves: do all laths meet others (--tolerance)? "
            "--largest-part reads the first of these parts alone"
        )
    text = f"{len(parts[0])} of {counted(len(curves), 'curve')} hang together"
    first = {curves[k].layer for k in parts[0]} - {None}
    rest = {curves[k].layer for part in parts[1:] for k in part}
    if first and not first & rest:
        wanted = " ".join(f"--layer '{name}'" for name in sorted(map(str, first))[:_NAMED])
        return f"{text}: {wanted} reads them alone, and so does --largest-part"
    return (
        f"{text}: --largest-part reads them alone; or leave out what is no lath, or draw it on a "
        "layer of its own (--layer)"
    )


def _listed(labels: Sequence[str]) -> str:
    more = len(labels) - _NAMED
    return ", ".join(labels[:_NAMED]) + (f" and {more} more" if more > 0 else "")
