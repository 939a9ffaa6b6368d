"""Writes the C-shells of this folder: nets of other outlines and other angles than the conformal
images of a square, all with the same mean span.

ring   two families of spirals around a hole, closed on itself
fan    rays and arcs cut by a free-form outline
hexagon, triangle   lattices under a conformal map, cut by these outlines
skew   families that cross at 78 degrees before they are bent
wide   15 x 15 curves

    python models/patches/make.py            # write the files
    python models/patches/make.py --measure  # and say what share of the elastic limit each uses
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import shapely

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "conformals"))
from make import SPAN, shell, utilisations, write_design  # noqa: E402

PER_SPAN = 4  # points of a curve between neighbouring joints
Map = Callable[[np.ndarray], np.ndarray]
Line = np.ndarray  # (n,) complex, points of a curve; every PER_SPAN-th is a joint of the lattice


def lattice(columns: Sequence[float], rows: Sequence[float], outline: np.ndarray) -> list[Line]:
    """The lines of a lattice within an outline (n,) complex: of each line what lies between the
    outermost joints inside, if two or more do."""
    area = shapely.Polygon(np.c_[outline.real, outline.imag])
    u, v = np.meshgrid(columns, rows, indexing="ij")
    kept = shapely.contains_xy(area, u, v)
    while True:  # a joint needs two lines, and a line two joints
        alone = kept & ((kept.sum(axis=1, keepdims=True) < 2) | (kept.sum(axis=0) < 2))
        if not alone.any():
            break
        kept &= ~alone
    lines = []
    for x, column in zip(columns, kept):
        if column.any():
            lines.append(x + 1j * fine(np.asarray(rows)[spread(column)]))
    for y, row in zip(rows, kept.T):
        if row.any():
            lines.append(fine(np.asarray(columns)[spread(row)]) + 1j * y)
    return lines


def spread(kept: np.ndarray) -> slice:
    """From the first to the last that is kept; outlines are convex along the lattice's lines."""
    first, last = np.flatnonzero(kept)[[0, -1]]
    if not kept[first : last + 1].all():
        raise ValueError("the outline cuts a line of the lattice twice")
    return slice(first, last + 1)


def fine(values: np.ndarray) -> np.ndarray:
    """The same numbers with PER_SPAN - 1 more between neighbours."""
    at = np.arange(PER_SPAN * (len(values) - 1) + 1) / PER_SPAN
    return np.interp(at, np.arange(len(values)), values)


def polygon(corners: int, radius: float, turn: float = 0.0) -> np.ndarray:
    return radius * np.exp(1j * (turn + 2 * np.pi * np.arange(corners) / corners))


def spirals(around: int, rings: int) -> list[Line]:
    """Left and right spirals, `around` of each, that cross on that many rings: lines at 45 degrees
    under the exponential map, which closes them to a ring."""
    step = np.pi / around
    along = step * fine(np.arange(rings, dtype=float))
    starts = 2 * step * np.arange(around)
    return [along + 1j * (start + side * along) for side in (1, -1) for start in starts]


def fan() -> list[Line]:
    """Rays and arcs within an outline that a designer might draw."""
    t = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    radius = 1.02 + 0.14 * np.cos(2 * t + 0.4) + 0.07 * np.sin(3 * t)
    return lattice(*2 * (np.linspace(-1, 1, 11),), radius * np.exp(1j * t))


SQUARE = np.array([-2 - 2j, 2 - 2j, 2 + 2j, -2 + 2j])
# name -> lines of the lattice, the map that bends them, change of the mean joint angle, rad
PATCHES: dict[str, tuple[list[Line], Map, float]] = {
    "ring": (spirals(18, 7), np.exp, 0.35),
    "fan": (fan(), lambda z: np.exp(0.55 * z), 0.65),
    "hexagon": (
        lattice(*2 * (np.linspace(-1, 1, 13),), polygon(6, 1.05, 0.2)),
        lambda z: z + 0.16 * (z + 0.25) ** 3,
        0.6,
    ),
    "triangle": (
        lattice(*2 * (np.linspace(-1, 1, 13),), polygon(3, 1.45, np.pi / 12) + 0.1),
        lambda z: np.sin(0.72 * z + 0.25),
        0.7,
    ),
    "skew": (
        lattice(*2 * (np.linspace(-1, 1, 9),), SQUARE),
        lambda z: (w := z.real + np.exp(1j * np.radians(78)) * z.imag) + 0.19 * w**2,
        0.55,
    ),
    "wide": (
        lattice(*2 * (np.linspace(-1, 1, 15),), SQUARE),
        lambda z: np.tanh(0.55 * z + 0.15),
        0.7,
    ),
}


def design(name: str) -> dict:
    """The content of one design file."""
    lines, bend, opening = PATCHES[name]
    bent = [bend(line) for line in lines]
    spans = np.concatenate([np.abs(np.diff(line[::PER_SPAN])) for line in bent])
    scale = SPAN / spans.mean()
    centre = np.concatenate([line[::PER_SPAN] for line in bent]).mean()
    return shell(name, [scale * (line - centre) for line in bent], opening)


def write(folder: Path, names: Sequence[str] = tuple(PATCHES)) -> list[Path]:
    """Write the designs; returns their files."""
    return [write_design(folder / f"{name}.json", design(name)) for name in names]


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="write the designs of this folder")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"default: {' '.join(PATCHES)}")
    parser.add_argument("--measure", action="store_true", help="also deploy them")
    options = parser.parse_args(arguments)
    for file in write(Path(__file__).resolve().parent, options.names or tuple(PATCHES)):
        if options.measure:
            shares = utilisations(file).items()
            print(file.stem, ", ".join(f"{state} {share:.3f}" for state, share in shares))


if __name__ == "__main__":
    main()
