"""What a cut sheet is drawn of: polylines, holes and texts in millimetres, on layers that tell
cutting from marking."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

# cut through; mark the surface; for people, on no piece
CUT, ENGRAVE, NOTES = "CUT", "ENGRAVE", "NOTES"


@dataclass(frozen=True)
class Polyline:
    """points (n, 2), x to the right, y up."""

    points: np.ndarray
    closed: bool = True
    layer: str = CUT

    def moved(self, by: np.ndarray) -> Polyline:
        return replace(self, points=self.points + by)

    @property
    def box(self) -> np.ndarray:
        """(2, 2) lowest and highest x, y."""
        return np.stack([self.points.min(axis=0), self.points.max(axis=0)])


@dataclass(frozen=True)
class Hole:
    """A circle."""

    centre: np.ndarray
    diameter: float
    layer: str = CUT

    def moved(self, by: np.ndarray) -> Hole:
        return replace(self, centre=self.centre + by)

    @property
    def box(self) -> np.ndarray:
        return np.stack([self.centre - self.diameter / 2, self.centre + self.diameter / 2])


@dataclass(frozen=True)
class Text:
    """One line of text; `at` is the middle of its height, and of its length or (align "left") its
    beginning."""

    at: np.ndarray
    height: float
    text: str
    layer: str = ENGRAVE
    align: str = "middle"

    def moved(self, by: np.ndarray) -> Text:
        return replace(self, at=self.at + by)

    @property
    def box(self) -> np.ndarray:
        """Roughly: letters are about 0.7 of their height wide."""
        width = 0.7 * self.height * len(self.text)
        left = self.at[0] - (width / 2 if self.align == "middle" else 0.0)
        return np.array(
            [[left, self.at[1] - self.height / 2], [left + width, self.at[1] + self.height / 2]]
        )


Shape = Polyline | Hole | Text


def box_of(shapes: Iterable[Shape]) -> np.ndarray:
    """(2, 2) lowest and highest x, y of all shapes."""
    boxes = np.array([shape.box for shape in shapes])
    return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])


def rectangle(left: float, bottom: float, right: float, top: float, layer: str = CUT) -> Polyline:
    """An axis-parallel rectangle, counter-clockwise."""
    return Polyline(
        np.array([[left, bottom], [right, bottom], [right, top], [left, top]], dtype=float),
        True,
        layer,
    )


@dataclass(frozen=True)
class Template:
    """What is cut of one part.

    label, name : the part's label; a line about it
    count : pieces to cut for the whole kit
    shapes : in mm, anywhere
    thickness : of the board, mm
    by_design : pieces that each design needs, where that isn't the part's own count
    """

    label: str
    name: str
    count: int
    shapes: tuple[Shape, ...]
    thickness: float
    by_design: tuple[int, ...] = ()

    @property
    def box(self) -> np.ndarray:
        """(2, 2) lowest and highest x, y."""
        return box_of(self.shapes)

    @property
    def area(self) -> float:
        """Within the outline, which is the first closed line; holes are not taken off."""
        lines = (s for s in self.shapes if isinstance(s, Polyline) and s.closed)
        x, y = next(lines).points.T
        return 0.5 * abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))))

    @property
    def size(self) -> np.ndarray:
        """(2,) width and height."""
        return np.ptp(self.box, axis=0)
