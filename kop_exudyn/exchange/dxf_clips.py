"""Blocks that a DXF file shows only a part of, as XCLIP cuts them: what is outside isn't seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from ..errors import InputError, shown_place
from .outlines import Outline


@dataclass(frozen=True)
class Clip:
    """The part of an inserted block that is seen.

    block : its name
    window : in plan, in the drawing's coordinates
    inverted : whether what is inside is hidden instead
    """

    block: str
    window: shapely.Polygon
    inverted: bool


def clip_of(insert: Any, outer: Any) -> Clip | None:
    """How an insertion is clipped; None where it isn't.

    outer : the map of the block that the insertion is of into the drawing; None: it is the
        drawing's own
    """
    from ezdxf.xclip import XClip

    if insert.doc is None:
        return None
    clip = XClip(insert)
    if not clip.has_clipping_path or not clip.is_clipping_enabled:
        return None
    vertices = list(clip.get_wcs_clipping_path().vertices)
    if len(vertices) == 2:  # opposite corners
        (x0, y0), (x1, y1) = (tuple(v)[:2] for v in vertices)
        vertices = [(x0, y0, 0), (x1, y0, 0), (x1, y1, 0), (x0, y1, 0)]
    if outer is not None:
        vertices = list(outer.transform_vertices(vertices))
    window = shapely.Polygon([tuple(v)[:2] for v in vertices]).buffer(0)
    return Clip(insert.dxf.name, window, bool(clip.is_inverted_clip))


def shown(outline: Outline, clips: Sequence[Clip], label: str) -> bool:
    """Whether an outline is seen through all clips. Raises InputError naming it where a clip cuts
    it."""
    if not clips:
        return True
    sag = 1e-3 * float(np.linalg.norm(np.ptp(outline.corners, axis=0)))
    line = shapely.LineString(outline.points(sag)[:, :2])
    for clip in clips:
        inside, outside = clip.window.covers(line), clip.window.disjoint(line)
        if not inside and not outside:
            raise InputError(
                f"is cut by the clip (XCLIP) of block {clip.block}, so that a part of it isn't "
                "seen: explode the block and trim it there, or take the clip off",
                field=f"{label} from {shown_place(outline.corners[0])}",
            )
        if inside == clip.inverted:
            return False
    return True
