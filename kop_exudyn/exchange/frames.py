"""The plane that a drawing lies in, and its coordinates there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .drawing import DrawnCurve

_FLAT = 1e-4  # of the size: how far a drawing may leave its plane
_PLANES = ((0, 1), (0, 2), (1, 2))
_TOWARDS_US = (1.0, -1.0, 1.0)  # in the right, front and top views of CAD programs


@dataclass(frozen=True)
class Frame:
    """Axes of a plan.

    origin (3,), axes (3, 3) : rows are the plan's x and y, and the direction of heights
    height : how far the drawing leaves its plane, as a share of its size
    """

    origin: np.ndarray
    axes: np.ndarray
    height: float

    @property
    def flat(self) -> bool:
        """Whether the drawing lies in the plane."""
        return self.height <= _FLAT

    @property
    def standard(self) -> bool:
        """Whether plan coordinates are the drawing's x and y."""
        return not self.origin.any() and bool((self.axes == np.eye(3)).all())

    @property
    def tilt(self) -> float:
        """Angle (rad) between the plane and the drawing's xy plane."""
        return float(np.arccos(np.clip(abs(self.axes[2, 2]), 0, 1)))

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) in the frame: x and y in plan, and the height."""
        return (points - self.origin) @ self.axes.T

    def back(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) of the frame in the drawing."""
        return points @ self.axes + self.origin


def frame_of(curves: Sequence[DrawnCurve], size: float) -> Frame:
    """The coordinate plane that a drawing lies in (the first of xy, xz, yz), else the plane that it
    is nearest to: of tilted drawings with its own origin, in their middle. Axes are right-handed:
    a net in the xz plane, as the front views of CAD programs have it, is seen from -y.

    size : diagonal of the drawing's box
    """
    points = np.concatenate([curve.points for curve in curves])
    extent = np.ptp(points, axis=0)
    for x, y in _PLANES:
        up = 3 - x - y
        if extent[up] <= _FLAT * size:
            axes = np.eye(3)[[x, y, up]]
            axes[2] = np.cross(axes[0], axes[1]) + 0.0  # no negative zeros in files
            return Frame(np.zeros(3), axes, float(extent[up] / size))
    middle = points.mean(axis=0)
    normal = np.linalg.svd(points - middle, full_matrices=False)[2][2]
    largest = np.argmax(np.abs(normal))
    normal = normal * np.sign(normal[largest] * _TOWARDS_US[largest])
    heights = (points - middle) @ normal
    if np.ptp(heights) > _FLAT * size:  # a net in space: seen along the axis it lies across most
        up = int(np.argmax(np.abs(normal)))
        order = {2: [0, 1, 2], 1: [2, 0, 1], 0: [1, 2, 0]}[up]
        return Frame(np.zeros(3), np.eye(3)[order], float(np.ptp(heights) / size))
    along = np.array([1.0, 0.0, 0.0]) if abs(normal[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    x = along - (along @ normal) * normal
    x /= np.linalg.norm(x)
    axes = np.array([x, np.cross(normal, x), normal])
    return Frame(middle, axes, float(np.ptp(heights) / size))
