"""What a drawing shows besides laths' axes: bolts, outlines, curves far away from all others, at
another height, or upright."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from ..errors import InputError
from ..wording import counted
from .drawing import DrawnCurve, Finding
from .strips import is_narrow

# A loop around a place where two curves cross is a bolt's if it is nearly centred there, and so
# small against the way to the next crossing, or, where there is none, against the drawing.
_CENTRED, _SMALL, _SMALL_ALONE = 0.25, 0.2, 0.05
_FEW = 0.1  # of the curves: fewer that leave the plane of the others are at a wrong height


def without_bolts(
    curves: Sequence[DrawnCurve], flat: Sequence[np.ndarray], size: float
) -> tuple[list[DrawnCurve], list[np.ndarray], list[Finding]]:
    """The curves, and their points in plan, without small loops around places where two others
    cross, which show bolts or holes.

    flat : points (n, 2) of each in plan
    size : of the drawing
    """
    loops = [k for k, curve in enumerate(curves) if curve.closed]
    rest = [k for k, curve in enumerate(curves) if not curve.closed]
    if not loops or len(rest) < 2:
        return list(curves), list(flat), []
    lines = np.array([shapely.LineString(flat[k]) for k in rest])
    i, j = shapely.STRtree(lines).query(lines, predicate="intersects")
    met = shapely.intersection(lines[i[i < j]], lines[j[i < j]])
    places = np.unique(shapely.get_coordinates(met), axis=0)
    if not len(places):
        return list(curves), list(flat), []
    bolts, tree = [], shapely.STRtree(shapely.points(places))
    for k in loops:
        radius = 0.5 * float(np.ptp(flat[k], axis=0).max())
        middle = 0.5 * (flat[k].min(axis=0) + flat[k].max(axis=0))
        near = tree.query(shapely.Point(middle), predicate="dwithin", distance=radius / _SMALL)
        off = np.linalg.norm(places[near] - middle, axis=1)
        centred = (off <= _CENTRED * radius).sum()
        alone = len(places) > 1 or radius <= _SMALL_ALONE * size
        if centred == 1 and len(near) == 1 and alone:
            bolts.append(k)
    if not bolts:
        return list(curves), list(flat), []
    text = (
        f"{counted(len(bolts), 'small loop')} around places where two curves cross, as "
        "bolts and holes are "
        f"drawn, such as {curves[bolts[0]].label}"
    )
    found = Finding("skipped", text, np.array([curves[k].points.mean(axis=0) for k in bolts]))
    kept = [k for k in range(len(curves)) if k not in set(bolts)]
    return [curves[k] for k in kept], [flat[k] for k in kept], [found]


def narrow_loops(curves: Sequence[DrawnCurve], flat: Sequence[np.ndarray]) -> list[Finding]:
    """A finding where loops look like outlines of laths."""
    found = []
    for curve, points in zip(curves, flat):
        if not curve.closed:
            continue
        if is_narrow(points):
            found.append(curve)
    if not found:
        return []
    text = (
        f"{counted(len(found), 'closed curve is', 'closed curves are')} long and narrow, such as "
        f"{found[0].label}: where that is the outline of a lath, draw the lath's axis instead"
    )
    return [Finding("suspicious", text, np.array([c.points.mean(axis=0) for c in found]))]


def refuse_strays(curves: Sequence[DrawnCurve], tolerance: float, size: float) -> None:
    """Raise InputError where most curves are shorter than the tolerance, a share of a size that
    something far away from them makes."""
    lengths = [float(np.linalg.norm(np.ptp(curve.points, axis=0))) for curve in curves]
    short = sum(length <= tolerance for length in lengths)
    if 2 * short <= len(curves):
        return
    middles = np.array([curve.points.mean(axis=0) for curve in curves])
    off = np.linalg.norm(middles - np.median(middles, axis=0), axis=1) + lengths
    far = curves[int(off.argmax())]
    raise InputError(
        f"{short} of {len(curves)} curves are shorter than the tolerance of {tolerance:.3g}, a "
        f"share of the drawing's size of {size:.3g}. Leave out what is far away or far larger, as "
        f"{far.label}, or give a smaller --tolerance"
    )


def refuse_stray_heights(curves: Sequence[DrawnCurve], tolerance: float) -> None:
    """Raise InputError where nearly all curves lie in one of the planes across an axis, and a few
    leave it, as a point at a wrong height does."""
    most = max(1, int(_FEW * len(curves)))
    for axis, name in enumerate("xyz"):
        level = float(np.median(np.concatenate([curve.points[:, axis] for curve in curves])))
        off = [float(np.abs(curve.points[:, axis] - level).max()) for curve in curves]
        stray = [k for k, height in enumerate(off) if height > tolerance]
        if 0 < len(stray) <= most < len(curves) // 2:
            worst = max(stray, key=off.__getitem__)
            raise InputError(
                f"leaves the plane {name} = {level:.6g}, which {len(curves) - len(stray)} of "
                f"{len(curves)} curves lie in, by {off[worst]:.3g}",
                field=curves[worst].label,
            )


def refuse_upright(
    curves: Sequence[DrawnCurve], flat: Sequence[np.ndarray], tolerance: float
) -> None:
    """Raise InputError, naming the curve and the place, where one goes straight up in the view
    (flat, points (n, 2) of each) in which the net is read."""
    for curve, points in zip(curves, flat):
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        if not (steps <= tolerance).any():
            continue
        k = int(steps.argmin())
        raise InputError(
            "is seen as a point between {place}: nets in space are read as height fields, "
            "along the axis that they lie across most. Turn the drawing, or leave upright pieces "
            "out",
            field=curve.label,
            places=curve.points[[k, k + 1]],
        )
