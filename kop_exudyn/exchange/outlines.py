"""What drawn objects look like before the drawing's size is known, which tells how densely their
curves are to be seen as points."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

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
    corners = np.concatenate([outline.corners for outline, _ in outlines])
    sag = SAG * float(np.linalg.norm(np.ptp(corners, axis=0)))
    for outline, label in outlines:
        points = outline.points(sag)
        closed = outline.closed and len(points) > 3
        kind, _, within = label.partition(" ")
        block = f" {within.partition(' ')[2]}" if " " in within else ""
        name = f"{kind}{block} from {place_of(points[0])}"
        yield DrawnCurve(points[: len(points) - closed], closed, name, outline.layer)


def place_of(point: Iterable[float]) -> str:
    return f"({', '.join(f'{value:.6g}' for value in point)})"
