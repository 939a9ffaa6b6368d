"""Many lines of one colour, drawn as one path."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch
from matplotlib.path import Path


def draw_lines(
    ax: Axes, lines: Sequence[np.ndarray], colour: Any, width: float, **options: Any
) -> None:
    """Lines through points (n, 2) each, in data coordinates, width in points; the axes' limits
    stay as they are.

    In files of vectors they take less than half of the time and of the room of single ones.

    options : as of a PathPatch; by default as single lines are drawn
    """
    kept = [np.asarray(line, float) for line in lines if len(line)]
    if not kept:
        return
    path = Path(np.concatenate(kept), _codes([len(line) for line in kept]))
    path.should_simplify = False
    given = {"capstyle": "butt", "joinstyle": "round", "zorder": 2, **options}
    ax.add_artist(PathPatch(path, facecolor="none", edgecolor=colour, linewidth=width, **given))


def _codes(lengths: Sequence[int]) -> np.ndarray:
    codes = np.full(sum(lengths), Path.LINETO, Path.code_type)
    codes[np.cumsum([0, *lengths[:-1]])] = Path.MOVETO
    return codes
