"""Labels that don't overlap: every one takes the first of its places that is still free."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import shapely
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath

MM_A_POINT = 25.4 / 72
_ROOM = 0.25  # mm around a label
_LINE = 1.25  # distance of lines of text, in sizes


@dataclass(frozen=True)
class Label:
    """A text that wants a place.

    text : one line or several
    size : points
    places (k, 2) : of its middle, mm, the best first
    angle : degrees, about its middle
    """

    text: str
    size: float
    places: np.ndarray
    angle: float = 0.0
    colour: str = "black"
    weight: str = "normal"

    @property
    def extent(self) -> tuple[float, float]:
        """Width and height in mm, as it is drawn."""
        return text_extent(self.text, self.size, self.weight)

    def box(self, at: np.ndarray) -> shapely.Polygon:
        """The rectangle that it takes at a place."""
        width, height = (side / 2 + _ROOM / 2 for side in self.extent)
        turn = np.radians(self.angle)
        along = width * np.array([np.cos(turn), np.sin(turn)])
        across = height * np.array([-np.sin(turn), np.cos(turn)])
        return shapely.polygons(
            [at - along - across, at + along - across, at + along + across, at - along + across]
        )


def text_extent(text: str, size: float, weight: str = "normal") -> tuple[float, float]:
    """Width and height of a text in mm."""
    lines = text.split("\n")
    width = max((_width(line, weight) for line in lines), default=0.0)
    height = 1.0 + _LINE * (len(lines) - 1)
    return size * width * MM_A_POINT, size * height * MM_A_POINT


@cache
def _width(line: str, weight: str) -> float:
    """Of a line of text, in sizes; outlines grow with the size."""
    if not line.strip():
        return 0.0
    font = FontProperties(family="DejaVu Sans", size=1.0, weight=weight)
    return float(TextPath((0, 0), line, prop=font).get_extents().width)


def place(
    labels: Sequence[Label],
    taken: Iterable[shapely.Geometry] = (),
    avoid: Sequence[shapely.Geometry] = (),
) -> tuple[list[np.ndarray], int]:
    """Places of the labels' middles, and how many of them found none that is free.

    taken : what labels keep off besides each other
    avoid : what they keep off where they can
    Those that come first choose first; one that finds no place stands at its best one.
    """
    cells: dict[tuple[int, int], list[shapely.Geometry]] = defaultdict(list)
    side = 2 * max((max(label.extent) for label in labels), default=1.0)
    lines = shapely.STRtree(list(avoid))

    def around(shape: shapely.Geometry) -> list[tuple[int, int]]:
        low_x, low_y, high_x, high_y = np.floor(np.array(shape.bounds) / side).astype(int)
        return [(i, j) for i in range(low_x, high_x + 1) for j in range(low_y, high_y + 1)]

    def keep(shape: shapely.Geometry) -> None:
        for cell in around(shape):
            cells[cell].append(shape)

    def is_free(box: shapely.Geometry) -> bool:
        near = [other for cell in around(box) for other in cells[cell]]
        return not near or not shapely.intersects(box, near).any()

    for shape in taken:
        keep(shape)
    found, crowded = [], 0
    for label in labels:
        boxes = [label.box(at) for at in label.places]
        free = [k for k, box in enumerate(boxes) if is_free(box)]
        clear = (k for k in free if not len(lines.query(boxes[k], "intersects")))
        chosen = next(clear, free[0] if free else 0)
        crowded += not free
        keep(boxes[chosen])
        found.append(np.asarray(label.places[chosen], float))
    return found, crowded
