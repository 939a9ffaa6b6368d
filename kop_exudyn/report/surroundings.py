"""What stands around a design in a picture of it: the ground, a person, a scale bar; and how a
design is laid on the ground."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

from ..drawing.render import Body
from ..exchange.meshes import tube

PERSON_HEIGHT = 1.72  # m
_PAPER, _INK = (0.965, 0.962, 0.955), (0.22, 0.23, 0.26)
_STANDS = 0.7  # cosine between the flattest direction and z
_LIGHT = (0.70, 0.71, 0.73)  # fields of a scale bar
JOINT_COLOUR = (0.30, 0.31, 0.33)


def upright(points: np.ndarray) -> np.ndarray:
    """Rotation that lays the points' flattest direction along z, bulging upwards.

    None is needed where that direction is nearer to z than to the ground: the design stands as its
    file says.
    """
    centred = points - points.mean(axis=0)
    axes = np.linalg.svd(centred[:: max(1, len(points) // 20000)], full_matrices=False)[2]
    normal = axes[2]
    if abs(normal[2]) > _STANDS:
        return np.eye(3)
    heights = centred @ normal
    # the rim is farther from the mean than the crown, and has to be below
    if abs(heights.min()) < heights.max():
        normal = -normal
    return np.stack([axes[0], np.cross(normal, axes[0]), normal])


def ground(half: float) -> Body:
    """A square floor in many triangles, so that those behind the camera can be left out."""
    x = np.linspace(-half, half, 61)
    vertices = np.stack([*np.meshgrid(x, x), np.zeros((61, 61))], axis=-1).reshape(-1, 3)
    corner = (61 * np.arange(60)[:, None] + np.arange(60)).ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + 1, corner + 62], axis=1),
            np.stack([corner, corner + 62, corner + 61], axis=1),
        ]
    )
    return Body.of(vertices, faces, _PAPER, ground=True)


def balls(centres: np.ndarray, diameter: float) -> Body:
    """Small spheres at the joints, as one body."""
    turn = (np.arange(42) + 0.5) / 42
    longitude = np.pi * (1 + 5**0.5) * np.arange(42)
    r = 2 * np.sqrt(turn * (1 - turn))
    sphere = (
        0.5
        * diameter
        * np.stack([r * np.cos(longitude), r * np.sin(longitude), 1 - 2 * turn], axis=1)
    )
    faces = ConvexHull(sphere).simplices
    vertices = (centres[:, None] + sphere).reshape(-1, 3)
    every = (faces[None] + len(sphere) * np.arange(len(centres))[:, None, None]).reshape(-1, 3)
    return Body.of(vertices, every, JOINT_COLOUR)


def scale_bar(start: np.ndarray, along: np.ndarray, length: float, breadth: float) -> Body:
    """A flat bar on the ground from a place along a direction, five dark and light fields."""
    across = breadth * np.array([-along[1], along[0], 0.0])
    lift = np.array([0.0, 0.0, 0.15 * breadth])
    stations = start + length * np.linspace(0, 1, 6)[:, None] * along + lift
    vertices = np.concatenate([stations, stations + across])
    first = np.arange(5)
    faces = np.concatenate(
        [
            np.stack([first, first + 1, first + 7], axis=1),
            np.stack([first, first + 7, first + 6], axis=1),
        ]
    )
    colours = np.where((first % 2 == 0)[:, None], _INK, _LIGHT)
    return Body(vertices, faces, np.concatenate([colours, colours]))


def person(place: np.ndarray, facing: float, height: float = PERSON_HEIGHT) -> Body:
    """A standing person who looks along an azimuth (rad).

    height : 1.72 m in the picture's unit of length

    A stack of ellipses for legs, coat and head, as in an architect's model.
    """
    profile = np.array(
        [  # height, half-width and half-depth, m
            [0.00, 0.085, 0.12],
            [0.05, 0.085, 0.10],
            [0.45, 0.10, 0.085],
            [0.80, 0.165, 0.11],
            [1.00, 0.165, 0.115],
            [1.22, 0.19, 0.12],
            [1.38, 0.215, 0.115],
            [1.43, 0.15, 0.085],
            [1.46, 0.058, 0.06],
            [1.50, 0.06, 0.065],
            [1.54, 0.072, 0.085],
            [1.61, 0.08, 0.098],
            [1.68, 0.066, 0.08],
            [1.72, 0.02, 0.03],
        ]
    )
    turn = np.linspace(0, 2 * np.pi, 20, endpoint=False)
    rings = np.stack(
        [
            profile[:, None, 1] * np.cos(turn),
            profile[:, None, 2] * np.sin(turn),
            np.broadcast_to(profile[:, None, 0], (len(profile), 20)),
        ],
        axis=2,
    )
    outline = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    c, s = np.cos(facing + 0.5 * np.pi), np.sin(facing + 0.5 * np.pi)  # shoulders across
    turned = rings.reshape(-1, 3) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]])
    return Body.of(height / PERSON_HEIGHT * turned + place, tube(len(profile), outline), _INK)
