"""Colours of parts and of values, for everything that is drawn in three dimensions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

# From OKLab to the cube roots of cone responses, and from these to linear sRGB (B. Ottosson, "A
# perceptual color space for image processing", 2020).
_TO_CONES = np.array(
    [
        [1, 0.3963377774, 0.2158037573],
        [1, -0.1055613458, -0.0638541728],
        [1, -0.0894841775, -1.2914855480],
    ]
)
_TO_LINEAR = np.array(
    [
        [4.0767416621, -3.3077115913, 0.2309699292],
        [-1.2684380046, 2.6097574011, -0.3413193965],
        [-0.0041960863, -0.7034186147, 1.7076147010],
    ]
)

# Lightness alternates: neighbours in hue then differ for those who tell hues apart badly, and on
# grey prints.
_LIGHTNESS = (0.62, 0.78, 0.50)
_CHROMA = 0.13
_FIRST_HUE = 0.6  # rad
_KIND_SHIFT = 0.35  # rad of hue between the first colours of kinds

# Dark to bright on a light ground: matplotlib's "inferno", reversed and cut as in the figures, at
# seven places.
_SCALE = np.array(
    [
        [0.973, 0.880, 0.373],
        [0.988, 0.694, 0.093],
        [0.971, 0.507, 0.042],
        [0.896, 0.342, 0.164],
        [0.763, 0.221, 0.283],
        [0.586, 0.148, 0.404],
        [0.375, 0.080, 0.433],
    ]
)


def part_colours(n: int, shift: float = 0.0) -> np.ndarray:
    """(n, 3) sRGB in [0, 1]: hues all around the circle, starting `shift` rad further."""
    hue = _FIRST_HUE + shift + 2 * np.pi * np.arange(n) / max(n, 1)
    light = np.array([_LIGHTNESS[k % len(_LIGHTNESS)] for k in range(n)])
    lab = np.stack([light, _CHROMA * np.cos(hue), _CHROMA * np.sin(hue)], axis=1)
    return to_srgb(np.clip((lab @ _TO_CONES.T) ** 3 @ _TO_LINEAR.T, 0, 1))


def kit_colours(sizes: Mapping[str, int]) -> dict[str, np.ndarray]:
    """kind -> (m, 3) sRGB of its m parts, the same wherever the kit is drawn; kinds start at
    different hues."""
    return {
        kind: part_colours(m, number * _KIND_SHIFT)
        for number, (kind, m) in enumerate(sizes.items())
    }


def value_colours(shares: np.ndarray) -> np.ndarray:
    """(..., 3) sRGB of shares (...) of the scale's length: light for 0, dark for 1; NaN is grey."""
    shares = np.asarray(shares, float)
    known = np.clip(np.where(np.isnan(shares), 0, shares), 0, 1)
    places = np.linspace(0, 1, len(_SCALE))
    colours = np.stack([np.interp(known, places, channel) for channel in _SCALE.T], axis=-1)
    return np.where(np.isnan(shares)[..., None], 0.6, colours)


def to_srgb(linear: np.ndarray) -> np.ndarray:
    """Linear RGB as sRGB (IEC 61966-2-1)."""
    return np.where(
        linear <= 0.0031308,
        12.92 * linear,
        1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055,
    )


def to_linear(srgb: np.ndarray) -> np.ndarray:
    """sRGB as linear RGB."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
