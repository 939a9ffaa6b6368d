"""What drawn objects look like before the drawing's size is known, which tells how densely their
curves are to be seen as points."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import shown_place
from .drawing import SAG, DrawnCurve


@dataclass(frozen=True)
class Outline:
    """What an entity draws: corners (n, 3) of lines and Bezier curves, or control points, which
    tell its size; and points on it within a sag.

    layer : that it is seen on
    """

    corners: np.ndarray
    points: Callable[[float], np.ndarray]
    closed: bool = False
    layer: str | None = None


def flattened(outlines: Sequence[tuple[Outline, str]]) -> Iterator[DrawnCurve]:
    """Points on the outlines, dense enough for the size of all of them."""
    if not outlines:
        return
    say = Places.of(np.concatenate([outline.corners for outline, _ in outlines]))
    corners = np.concatenate([outline.corners for outline, _ in outlines])
    sag = SAG * float(np.linalg.norm(np.ptp(corners, axis=0)))
    for outline, label in outlines:
        points = outline.points(sag)
        closed = outline.closed and len(points) > 3
        kind, _, within = label.partition(" ")
        block = f" {within.partition(' ')[2]}" if " " in within else ""
        name = f"{kind}{block} from {say(points[0])}"
        yield DrawnCurve(points[: len(points) - closed], closed, name, outline.layer)


@dataclass(frozen=True)
class Places:
    """Points as texts, in the drawing's coordinates, with as many digits as tell them apart.

    size : of the drawing; origin (3,) : what has been taken off its coordinates
    """

    size: float
    origin: np.ndarray

    @classmethod
    def of(cls, points: np.ndarray) -> Places:
        """Of points (n, 3) that are in the drawing's own coordinates."""
        return cls(float(np.linalg.norm(np.ptp(points, axis=0))), np.zeros(3))

    def __call__(self, point: np.ndarray) -> str:
        return shown_place(self.origin + point, self.size)
