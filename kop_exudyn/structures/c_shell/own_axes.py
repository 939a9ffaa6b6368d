"""Directions that turn with a plane net and are mirrored with it, so that what is chosen by them is
the same wherever the net is drawn."""

from __future__ import annotations

import numpy as np

_ARM = 0.37  # of the longest: one that gives a net its direction
_ODD_ANGLE = np.radians(150)  # with it no model is near to being undecided
_STRETCH = 1e-7  # tells equally good triangulations apart


def own_axes(flat: np.ndarray) -> np.ndarray:
    """Axes (2, 2) that turn with a net (n, 2) and are mirrored with it: by its first points that
    are far from its middle, and from the line there, at an angle that is no symmetric net's."""
    arms = flat - flat.mean(axis=0)
    along = _first_arm(flat)
    along = along / np.hypot(*along)
    off = along[0] * arms[:, 1] - along[1] * arms[:, 0]
    side = np.sign(off[np.argmax(np.abs(off) > _ARM * np.abs(off).max())])
    across = side * np.array([-along[1], along[0]])
    c, s = np.cos(_ODD_ANGLE), np.sin(_ODD_ANGLE)
    return np.array([c * along + s * across, c * across - s * along])


def untied(flat: np.ndarray) -> np.ndarray:
    """A map (2, 2) of the plane that is the identity to 1e-7, and takes points that lie on one
    circle, as those of symmetric nets do, off it: so that they are triangulated in the same way
    however a net (n, 2) is turned. Lines stay lines. It stretches along a direction that turns with
    the net, at an odd angle to it."""
    first = _first_arm(flat)
    angle = np.arctan2(first[1], first[0]) + 0.7
    along = np.array([np.cos(angle), np.sin(angle)])
    return np.eye(2) + _STRETCH * np.outer(along, along)


def _first_arm(flat: np.ndarray) -> np.ndarray:
    """From the middle of a net (n, 2) to its first point that is far from there."""
    arms = flat - flat.mean(axis=0)
    lengths = np.hypot(*arms.T)
    return arms[np.argmax(lengths > _ARM * lengths.max())]
