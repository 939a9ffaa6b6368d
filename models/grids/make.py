"""Writes orthogonal grids on six surfaces, and the mesh file that one of them uses.

    python models/grids/make.py

Grids keep to their surface without supports when their lamellas' normal curvature varies or changes
sign. Straight lamellas (asymptotic lines) and equally curved ones (on a sphere) would let the
hinges turn freely: the asymptotic net in models/grids_hard is held at its boundary. And lamellas
that the surface twists (geodesic torsion) untwist, which drew grids up to 1.3 % off their surfaces.
So all networks in models/grids run along curvature lines or near them: lines of u and v are such on
the minimal surfaces and on the dome; on the vault, the sum of a wave in x and one in y, nearly so;
on the saddle the lines are traced.

What is left of their deviation (up to 0.4 % of the size) goes when the lamellas are fitted to their
surfaces, one design alone, before the files are written.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from kop_exudyn.search.input_fit import fit_input
from kop_exudyn.search.weights import Weights
from kop_exudyn.structures.base import design_from_dict

FOLDER = Path(__file__).resolve().parent
JOINTS = 8  # a side, about


def lines(half: float, count: int = JOINTS, grading: float = 0.0) -> list[float]:
    """Numbers from -half to half, with positive grading denser in the middle."""
    t = np.linspace(-1, 1, count)
    return np.round(half * (t + grading * t**3) / (1 + grading), 9).tolist()


def isolines(u: list[float], v: list[float]) -> dict:
    return {"type": "isolines", "u": u, "v": v}


def curvature_lines(half: float, reach: float) -> dict:
    """Lines through points up to `half` from the middle on both axes, traced as far as `reach`."""
    return {
        "type": "curvature",
        "domain": [[-reach, -reach], [reach, reach]],
        "points": [[u, 0.0] for u in lines(half)],
        "second_points": [[0.0, v] for v in lines(half)],
    }


def asymptotic_lines(half: float, count: int, domain: list[list[float]]) -> dict:
    """Both lines through each of some points of the first axis, traced as far as the domain."""
    points = [[u, 0.0] for u in lines(half, count)]
    return {"type": "asymptotic", "domain": domain, "points": points, "second_points": points}


def geodesics(half: float, reach: float) -> dict:
    """Lines that leave both axes at right angles, up to `half` from the middle."""
    of_u = [[u, 0.0, 0.5 * np.pi] for u in lines(half)]
    of_v = [[0.0, v, 0.0] for v in lines(half)]
    domain = [[-reach, -reach], [reach, reach]]
    return {"type": "geodesics", "domain": domain, "through": of_u + of_v}


def analytic(name: str, **coefficients) -> dict:
    return {"type": "analytic", "name": name, **coefficients}


WAVES = [[0.45, -0.4, 0.0, 0.6], [-0.25, 0.6, 0.05, 0.5]]  # height, centre, width
SKEW_SADDLE = [[0, 0, -0.5], [0, 0.15], [0.35], [0.2]]
GRIDS = {
    "dome": (
        analytic("paraboloid", a=-0.7, b=-0.4),
        isolines(lines(0.8, 9, 0.3), lines(0.8, 9, -0.2)),
    ),
    "saddle": (analytic("polynomial", coefficients=SKEW_SADDLE), curvature_lines(0.75, 1.15)),
    "enneper": (analytic("enneper", scale=1.4), isolines(lines(0.48), lines(0.48))),
    "catenoid": (analytic("catenoid", scale=1.0), isolines(lines(0.85, 9), lines(0.75, 8))),
    "free_form": (analytic("gaussians", bumps=WAVES), isolines(lines(0.8, 9), lines(0.8, 9))),
    "mesh": (
        {"type": "mesh", "file": "vault.obj", "chart": "conformal"},
        isolines(lines(0.78, 9), lines(0.72)),
    ),
}

PEAKS = [[0.7, -0.35, 0.1, 0.45], [-0.45, 0.5, -0.2, 0.4], [0.25, 0.2, 0.6, 0.35]]
# in models/grids_hard: curvature that varies strongly; straight upright strips, which only supports
# keep from turning; lamellas that bend upright only
HARD = {
    "peaks": (analytic("gaussians", bumps=PEAKS), isolines(lines(0.9, 10), lines(0.9, 10))),
    "asymptotic": (
        analytic("catenoid", scale=1.0),
        asymptotic_lines(1.2, 9, [[-1.25, -0.8], [1.25, 0.8]]),
        "boundary",
    ),
    "geodesic": (analytic("gaussians", bumps=WAVES), geodesics(0.7, 0.95)),
}


def design(name: str, surface: dict, network: dict, held: str | None = None) -> dict:
    return {
        "format": "kop_exudyn/design",
        "version": 1,
        "class": "grid",
        "name": name,
        "units": {"length": "m", "force": "N"},
        "material": {"young": 2.1e9, "poisson": 0.35, "density": 900.0, "elastic_limit": 4.0e7},
        "section": {"type": "rectangle", "width": 0.004, "height": 0.03},
        "surface": surface,
        "network": network,
        **({"held": held} if held else {}),
        "elements_per_piece": 2,
    }


def fitted(content: dict) -> dict:
    """The same grid with its lamellas fitted to the surface: what a kit takes from it is then the
    kit's."""
    grid = design_from_dict(content, str(FOLDER / "design.json"))
    found = fit_input(grid, Weights(fit=1e6, energy=0.02))
    values = grid.straight.numbering.split(found.q, digits=7)
    return {**content, "straightened": values}


def first(ring: int) -> int:
    """Number of a ring's first vertex; the middle is ring 0."""
    return 1 + 3 * ring * (ring - 1) if ring else 0


def vault(path: Path, rings: int = 20) -> None:
    """An asymmetric vault on a hexagonal outline: concentric rings of triangles."""
    points, triangles = [(0.0, 0.0)], []
    for ring in range(1, rings + 1):
        corners = [
            ring * np.array([np.cos(k * np.pi / 3), np.sin(k * np.pi / 3)]) for k in range(7)
        ]
        points += [
            tuple(a + (b - a) * s / ring) for a, b in zip(corners, corners[1:]) for s in range(ring)
        ]
    x, y = 1.35 * np.array(points).T / rings
    for ring in range(1, rings + 1):
        for side in range(6):
            for s in range(ring):
                a, b = (first(ring) + (side * ring + s + k) % (6 * ring) for k in (0, 1))
                inner = 6 * (ring - 1)
                c = first(ring - 1) + (side * (ring - 1) + s) % inner if inner else 0
                triangles.append((a, b, c))
                if s < ring - 1:
                    d = first(ring - 1) + (side * (ring - 1) + s + 1) % inner
                    triangles.append((b, d, c))
    z = 0.28 * np.cos(2.1 * x + 0.3) + 0.35 * np.cos(1.5 * y - 0.2)
    rows = [f"v {a:.5f} {b:.5f} {c:.5f}" for a, b, c in zip(x, y, z)]
    rows += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in triangles]
    path.write_text("\n".join(rows) + "\n")


def write(path: Path, *described: Any) -> None:
    """described : as for `design`."""
    content = fitted(design(*described))
    values = json.dumps(content.pop("straightened"))
    head = json.dumps(content, indent=1)
    path.parent.mkdir(exist_ok=True)
    path.write_text(f'{head[:-2]},\n "straightened": {values}\n}}\n', encoding="utf-8")


def main() -> None:
    vault(FOLDER / "vault.obj")
    for number, (name, grid) in enumerate(GRIDS.items(), start=1):
        write(FOLDER / f"{number:02d}_{name}.json", name, *grid)
    for name, grid in HARD.items():
        write(FOLDER.parent / "grids_hard" / f"{name}.json", name, *grid)


if __name__ == "__main__":
    main()
