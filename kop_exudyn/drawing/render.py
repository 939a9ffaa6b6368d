"""Pictures of solids: triangles seen in perspective, lit by a sun and by the sky, with soft
shadows.

A depth buffer finds what the camera sees (Catmull, 1974); depth buffers of many lights find what
each of them sees (Williams, 1978). The sun is a cone of lights, the sky a hemisphere of them, which
darkens corners and ground beneath things. No graphics card, no window, the same picture everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..compiled.library import address, library
from .colours import to_linear, to_srgb

_SUN, _SKY = 0.62, 0.62  # share of the light
# pixels of a light's buffer that its depth is pushed back by, against shadows of a surface on
# itself
_BIAS = 2.5
_NEAR = 1e-6


@dataclass(frozen=True)
class Body:
    """A triangle mesh with one colour a face.

    vertices (V, 3) ; faces (F, 3) ; colours (F, 3) sRGB in [0, 1]
    ground : fades into the background with the distance from the scene's middle
    """

    vertices: np.ndarray
    faces: np.ndarray
    colours: np.ndarray
    ground: bool = False

    @classmethod
    def of(
        cls, vertices: np.ndarray, faces: np.ndarray, colour: Sequence[float], ground: bool = False
    ) -> Body:
        """A mesh of one colour."""
        return cls(
            np.asarray(vertices, float),
            np.asarray(faces),
            np.tile(np.asarray(colour, float), (len(faces), 1)),
            ground,
        )


@dataclass(frozen=True)
class Camera:
    """Where the picture is taken from; z is up.

    eye, target : (3,) ; angle : of view from top to bottom, rad
    """

    eye: np.ndarray
    target: np.ndarray
    angle: float = 0.5

    def axes(self) -> np.ndarray:
        """(3, 3) rows: right, up, forward."""
        forward = np.asarray(self.target, float) - self.eye
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(right, forward), forward])


@dataclass(frozen=True)
class Light:
    """The sun's direction (towards it) and half-angle, the numbers of lights for sun and sky,
    buffer size in pixels."""

    sun: tuple[float, float, float] = (-0.45, -0.55, 1.0)
    softness: float = 0.05
    suns: int = 16
    skies: int = 64
    buffer: int = 1400


def render(
    bodies: Sequence[Body],
    camera: Camera,
    width: int,
    height: int,
    *,
    light: Light = Light(),
    background: Sequence[float] = (0.955, 0.96, 0.965),
    samples: int = 2,
) -> np.ndarray:
    """(height, width, 3) sRGB picture in [0, 1], each pixel the mean of samples x samples."""
    vertices, faces, colours, ground = _joined(bodies)
    w, h = samples * width, samples * height
    owner, depth = _seen(vertices, faces, camera, w, h)
    hit = owner >= 0
    radius, centre = _extent(vertices, faces, ground)
    one = _shared(hit, ground[np.maximum(owner, 0)] & hit, samples)
    alone = one == np.arange(len(one))  # the others have the colour of one of these
    places = np.flatnonzero(hit)[alone]
    face, at = owner.ravel()[places], _points(depth, camera, places)
    n, on_ground = _normals(vertices, faces)[face], ground[face]
    away = np.sum(n * (camera.eye - at), axis=1) < 0
    n[away] = -n[away]  # both sides of a face look alike
    lit = _light_on(at, n, vertices, faces[~ground], light, radius, centre)
    base = to_linear(np.asarray(background, float))
    colour = to_linear(colours)[face] * lit[:, None]
    far = np.linalg.norm((at[on_ground] - centre)[:, :2], axis=1) / radius
    fade = np.clip((far - 1.4) / 2.6, 0, 1)[:, None]
    fade = fade * fade * (3 - 2 * fade)
    colour[on_ground] = (1 - fade) * colour[on_ground] + fade * base
    picture = np.tile(base, (h, w, 1))
    picture[hit] = colour[(np.cumsum(alone) - 1)[one]]
    mean = picture.reshape(height, samples, width, samples, 3).mean(axis=(1, 3))
    return np.clip(to_srgb(np.clip(mean, 0, 1)), 0, 1)


def _shared(hit: np.ndarray, ground: np.ndarray, samples: int) -> np.ndarray:
    """Number, for every sample (h, w) that is hit, of the one whose colour it takes: on the ground,
    where light changes slowly, that of its pixel's first sample."""
    h, w = hit.shape
    numbers = np.full((h, w), -1)
    numbers[hit] = np.arange(np.count_nonzero(hit))
    blocks = numbers.reshape(h // samples, samples, w // samples, samples)
    soft = ground.reshape(blocks.shape)
    first = np.broadcast_to(blocks[:, :1, :, :1], blocks.shape)
    shares = soft & soft[:, :1, :, :1]
    return np.where(shares, first, blocks).reshape(h, w)[hit]


def _joined(bodies: Sequence[Body]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    offsets = np.cumsum([0, *(len(body.vertices) for body in bodies)])
    return (
        np.concatenate([body.vertices for body in bodies]),
        np.concatenate([body.faces + offset for body, offset in zip(bodies, offsets)]),
        np.concatenate([body.colours for body in bodies]),
        np.concatenate([np.full(len(body.faces), body.ground) for body in bodies]),
    )


def _extent(
    vertices: np.ndarray, faces: np.ndarray, ground: np.ndarray
) -> tuple[float, np.ndarray]:
    """Radius and middle of all but the ground."""
    own = vertices[np.unique(faces[~ground])]
    centre = 0.5 * (own.min(axis=0) + own.max(axis=0))
    return float(np.linalg.norm(own - centre, axis=1).max()), centre


def _seen(
    vertices: np.ndarray, faces: np.ndarray, camera: Camera, w: int, h: int
) -> tuple[np.ndarray, np.ndarray]:
    """Face (h, w) seen in each pixel, -1 for none, and its depth along the view."""
    local = (vertices - camera.eye) @ camera.axes().T
    z = np.maximum(local[:, 2], _NEAR)
    scale = 0.5 * h / np.tan(0.5 * camera.angle)
    xy = np.stack([0.5 * w + scale * local[:, 0] / z, 0.5 * h - scale * local[:, 1] / z], axis=1)
    visible = faces[(local[faces, 2] > 1e-3).all(axis=1)]
    numbers = np.flatnonzero((local[faces, 2] > 1e-3).all(axis=1))
    owner, inverse = _rasterise(xy, 1 / z, visible, w, h)
    return np.where(owner >= 0, numbers[np.maximum(owner, 0)], -1), 1 / np.maximum(inverse, 1e-12)


def _points(depth: np.ndarray, camera: Camera, places: np.ndarray) -> np.ndarray:
    """(m, 3) the points at the depths (h, w) of some samples, numbered row by row."""
    h, w = depth.shape
    row, column = np.divmod(places, w)
    scale = 0.5 * h / np.tan(0.5 * camera.angle)
    x, y = (column + 0.5 - 0.5 * w) / scale, -(row + 0.5 - 0.5 * h) / scale
    local = np.stack([x, y, np.ones(len(places))], axis=1) * depth.ravel()[places][:, None]
    return local @ camera.axes() + camera.eye


def _normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    n = np.cross(b - a, c - a)
    return n / np.maximum(np.linalg.norm(n, axis=1), 1e-300)[:, None]


def _light_on(
    at: np.ndarray,
    n: np.ndarray,
    vertices: np.ndarray,
    faces: np.ndarray,
    light: Light,
    radius: float,
    centre: np.ndarray,
) -> np.ndarray:
    """(m,) light on points with normals: 1 for a surface that faces the sun under the whole sky."""
    generator = np.random.default_rng(0)
    towards = np.asarray(light.sun, float) / np.linalg.norm(light.sun)
    suns = towards + light.softness * generator.standard_normal((light.suns, 3))
    total = np.zeros(len(at))
    for lights, share in ((suns, _SUN), (_hemisphere(light.skies), _SKY)):
        found, weight = np.zeros(len(at)), 0.0
        for direction in lights / np.linalg.norm(lights, axis=1)[:, None]:
            cosine = np.maximum(n @ direction, 0.0)
            found += cosine * _unshaded(
                at, n, vertices, faces, direction, light.buffer, radius, centre
            )
            weight += max(direction[2], 0.2)
        total += share * found / weight
    return 0.10 + 0.90 * total / (_SUN + _SKY) * 1.12


def _hemisphere(count: int) -> np.ndarray:
    """(count, 3) even directions above the horizon, on a golden spiral."""
    z = (np.arange(count) + 0.5) / count
    turn = np.pi * (1 + 5**0.5) * np.arange(count)
    r = np.sqrt(1 - z**2)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)


def _unshaded(
    at: np.ndarray,
    n: np.ndarray,
    vertices: np.ndarray,
    faces: np.ndarray,
    direction: np.ndarray,
    size: int,
    radius: float,
    centre: np.ndarray,
) -> np.ndarray:
    """(m,) 1 where the light from a direction reaches the points, else 0; light comes in
    parallel."""
    helper = np.array([1.0, 0, 0]) if abs(direction[0]) < 0.8 else np.array([0, 1.0, 0])
    right = np.cross(helper, direction)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(direction, right), direction])
    scale = 0.49 * size / radius

    def placed(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        local = (points - centre) @ axes.T
        return 0.5 * size + scale * local[:, :2], local[:, 2]

    xy, height = placed(vertices)
    _, nearest = _rasterise(xy, height + 10 * radius, faces, size, size)
    bias = _BIAS / scale
    xy, height = placed(at + bias * n)
    column, row = np.floor(xy).astype(int).T
    inside = (column >= 0) & (column < size) & (row >= 0) & (row < size)
    reached = np.ones(len(at))
    reached[inside] = height[inside] + 10 * radius + bias >= nearest[row[inside], column[inside]]
    return reached


def _rasterise(
    xy: np.ndarray, value: np.ndarray, faces: np.ndarray, w: int, h: int
) -> tuple[np.ndarray, np.ndarray]:
    """Face (h, w) of the largest value in each pixel (-1: none), and that value; linear over the
    picture."""
    kernels = library()
    if kernels is None:
        return _rasterise_numpy(xy, value, faces, w, h)
    xy, value = np.ascontiguousarray(xy, float), np.ascontiguousarray(value, float)
    faces = np.ascontiguousarray(faces, np.int64)
    owner, best = np.empty((h, w), np.int64), np.empty((h, w))
    kernels.rasterise(
        len(faces),
        address(faces, np.int64),
        address(xy),
        address(value),
        w,
        h,
        address(owner, np.int64),
        address(best),
    )
    return owner, best


def _rasterise_numpy(
    xy: np.ndarray, value: np.ndarray, faces: np.ndarray, w: int, h: int
) -> tuple[np.ndarray, np.ndarray]:
    owner, best = np.full((h, w), -1, np.int64), np.zeros((h, w))
    for f, corners in enumerate(faces):
        (ax, ay), (bx, by), (cx, cy) = triangle = xy[corners]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0:
            continue
        left, top = np.maximum(np.floor(triangle.min(0) - 0.5).astype(int), 0)
        right, bottom = np.minimum(np.ceil(triangle.max(0) + 0.5).astype(int), (w - 1, h - 1)) + 1
        px, py = np.arange(left, right) + 0.5, np.arange(top, bottom)[:, None] + 0.5
        u = ((bx - px) * (cy - py) - (by - py) * (cx - px)) / area
        v = ((cx - px) * (ay - py) - (cy - py) * (ax - px)) / area
        z = u * value[corners[0]] + v * value[corners[1]] + (1 - u - v) * value[corners[2]]
        window = slice(top, max(bottom, top)), slice(left, max(right, left))
        inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (z > best[window])
        best[window][inside] = z[inside]
        owner[window][inside] = f
    return owner, best
