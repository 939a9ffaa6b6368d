"""Writes the ten designs of this folder: one square grid under ten conformal maps, with the same
mean span.

A conformal map keeps the grid's right angles, so each image is a net that can open like a scissor
grid, with spans and curvatures of its own. Run it from anywhere:

    python models/conformals/make.py            # write the files
    python models/conformals/make.py --measure  # and say what share of the elastic limit each uses

Stress grows with the section's thickness. Breadth over thickness, and what a map has of symmetry,
decide how far apart the first modes out of the plane lie. Where they lie together, the size of the
opening steps chooses between them: so it was with 30 x 4 mm and sinh(0.64 z).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

JOINTS = 9  # a side
POINTS_PER_SPAN = 4
SPAN = 0.2  # mean distance of neighbouring joints, m
DIGITS = 9
MATERIAL = {"young": 2.1e9, "poisson": 0.35, "density": 900.0, "elastic_limit": 4.0e7}
SECTION = {"type": "rectangle", "width": 0.012, "height": 0.002, "joint_hole": 0.003}

Map = Callable[[np.ndarray], np.ndarray]
# Each map on the square [-1, 1]^2, where none of them has a singular or critical point; and the
# change of the mean joint angle, rad: well past the bifurcation out of the plane, well before the
# next one.
MAPS: dict[str, tuple[Map, float]] = {
    "sinh": (lambda z: np.sinh(0.64 * z + 0.2), 0.75),
    "tanh": (lambda z: np.tanh(0.56 * z), 0.80),
    "exp": (lambda z: np.exp(0.48 * z), 0.60),
    "cubic": (lambda z: z + 0.077 * z**3, 0.60),
    "sine": (lambda z: np.sin(0.72 * z), 0.50),
    "moebius": (lambda z: z / (1 - 0.24 * z), 0.65),
    "log": (lambda z: np.log(z + 2.75), 0.75),
    "root": (lambda z: np.sqrt(z + 2.25), 0.90),
    "square": (lambda z: z + 0.112 * z**2, 0.85),
    "joukowski": (lambda z: (w := z + 3.0) + 1.875 / w, 0.60),
}


def design(name: str, image: Map, opening: float) -> dict:
    """The design file's content for one map."""
    joints = np.linspace(-1, 1, JOINTS)
    along = np.linspace(-1, 1, POINTS_PER_SPAN * (JOINTS - 1) + 1)
    lines = [image(along + 1j * y) for y in joints] + [image(x + 1j * along) for x in joints]
    at_joints = np.array([line[::POINTS_PER_SPAN] for line in lines])
    scale = SPAN / np.abs(np.diff(at_joints, axis=1)).mean()
    centre = at_joints[:JOINTS].mean()
    return shell(name, [scale * (line - centre) for line in lines], opening)


def shell(name: str, curves: Sequence[np.ndarray], opening: float) -> dict:
    """The content of the design file of a C-shell.

    curves : points of each, complex, m; opening : change of the mean joint angle, rad
    """
    return {
        "format": "kop_exudyn/design",
        "version": 1,
        "class": "c_shell",
        "name": name,
        "units": {"length": "m", "force": "N"},
        "material": MATERIAL,
        "section": SECTION,
        "curves": [
            {"type": "spline", "points": rounded(curve), "closed": False} for curve in curves
        ],
        "crossings": "find",
        "free_ends": False,
        "rod_offset": 0.0,
        "opening": {"angle": opening, "side": "up"},
        "elements_per_piece": 2,
    }


def rounded(points: np.ndarray) -> list[list[float]]:
    """Complex points as pairs of short decimals, without negative zeros."""
    return [
        [round(float(z.real), DIGITS) + 0.0, round(float(z.imag), DIGITS) + 0.0] for z in points
    ]


def write(folder: Path) -> list[Path]:
    """Write all designs; returns their files."""
    files = []
    for number, (name, (image, opening)) in enumerate(MAPS.items(), 1):
        path = folder / f"{number:02d}_{name}.json"
        files.append(write_design(path, design(name, image, opening)))
    return files


def write_design(path: Path, content: dict) -> Path:
    """Write a design file with a line for every curve; returns it."""
    curves = ",\n  ".join(json.dumps(curve) for curve in content.pop("curves"))
    head = json.dumps(content, indent=1)
    path.write_text(f'{head[:-2]},\n "curves": [\n  {curves}\n ]\n}}\n', encoding="utf-8")
    return path


def utilisations(file: Path) -> dict[str, float]:
    """State -> the largest share of the elastic limit that a design uses in it: assembled ("rest"),
    deployed, and the largest on the way as its smooth net opens."""
    from kop_exudyn.io.designs import load_design
    from kop_exudyn.structures.strength import design_strength, materials_of, rod_strength

    design = load_design(file)
    found = {role: s.largest for role, s in design_strength(design, design.deploy()).items()}
    opening = [
        rod_strength(design.smooth, state, materials_of(design)).largest
        for state in design.smooth_path
    ]
    return {**found, "opening": max(opening)}


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="write the designs of this folder")
    parser.add_argument(
        "--measure", action="store_true", help="also deploy them; print utilisations"
    )
    measure = parser.parse_args(arguments).measure
    for file in write(Path(__file__).resolve().parent):
        if measure:
            shares = utilisations(file).items()
            print(file.stem, ", ".join(f"{state} {share:.3f}" for state, share in shares))


if __name__ == "__main__":
    main()
