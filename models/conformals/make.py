"""Writes ten C-shell designs: images of one uniform 9 x 9 grid under ten conformal maps, in comparable scales.

    python models/conformals/make.py

A conformal map turns a uniform grid into a curved one whose lines still cross at right angles and whose cells stay
nearly square, so that it keeps opening like a scissor grid. Every design is scaled to the same mean span.
"""
from __future__ import annotations

import json
from pathlib import Path

import numpy as np

JOINTS = 9  # a side
MEAN_SPAN = 0.2
POINTS_A_SPAN = 3

# name: (map of the square |x|, |y| <= 0.8, change of the mean joint angle in rad)
MAPS = {
    "sinh": (lambda z: np.sinh(0.8 * z) / 0.8, 0.60),
    "tanh": (lambda z: np.tanh(0.7 * z) / 0.7, 0.55),
    "exp": (lambda z: np.exp(0.6 * z) / 0.6, 0.60),
    "cubic": (lambda z: z + 0.12 * z**3, 0.60),
    "sine": (lambda z: np.sin(0.9 * z) / 0.9, 0.60),
    "moebius": (lambda z: z / (1 - 0.3 * z), 0.55),
    "log": (lambda z: np.log(z + 2.2), 0.60),
    "root": (lambda z: np.sqrt(z + 1.8), 0.60),
    "square": (lambda z: z + 0.14 * z**2, 0.55),
    "joukowski": (lambda z: (z + 2.4) + 1.2 / (z + 2.4), 0.60),
}


def curves(conformal) -> list[np.ndarray]:
    """Points (n, 2) along the images of both families of grid lines."""
    stations = np.linspace(-0.8, 0.8, JOINTS)
    along = np.linspace(-0.8, 0.8, POINTS_A_SPAN * (JOINTS - 1) + 1)
    lines = [along + 1j * s for s in stations] + [s + 1j * along for s in stations]
    images = [conformal(line) for line in lines]
    spans = [np.abs(np.diff(image[::POINTS_A_SPAN])) for image in images]
    scale = MEAN_SPAN / np.mean(spans)
    centre = np.mean([image.mean() for image in images])
    return [scale * np.column_stack([(image - centre).real, (image - centre).imag]) for image in images]


def design(name: str, conformal, opening: float) -> dict:
    return {
        "format": "kop_exudyn/design", "version": 1, "class": "c_shell", "name": name,
        "material": {"young": 2.1e9, "poisson": 0.35, "density": 900.0, "elastic_limit": 4.0e7},
        "section": {"type": "rectangle", "width": 0.03, "height": 0.004},
        "curves": [{"type": "spline", "points": np.round(line, 9).tolist(), "closed": False}
                   for line in curves(conformal)],
        "crossings": "find", "free_ends": False, "rod_offset": 0.0,
        "opening": {"angle": opening, "side": "up"}, "elements_per_piece": 2,
    }


if __name__ == "__main__":
    folder = Path(__file__).parent
    for number, (name, (conformal, opening)) in enumerate(MAPS.items(), start=1):
        text = json.dumps(design(name, conformal, opening))
        (folder / f"{number:02d}_{name}.json").write_text(text + "\n")
