"""Small grids, and coarse copies of our own."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np


def coarse_grid(repository: Path, name: str = "05_free_form", first: int = 1) -> dict[str, Any]:
    """The content of a model's file with every second of its curves.

    first : number of the first curve that is kept
    """
    path = repository / "models" / "grids" / f"{name}.json"
    found = json.loads(path.read_text(encoding="utf-8"))
    del found["straightened"]  # that is of all curves
    for axis in "uv":
        found["network"][axis] = found["network"][axis][first::2]
    return found


def grid_data(surface: dict[str, Any], network: dict[str, Any], **more: Any) -> dict[str, Any]:
    """The content of a design file.

    surface : analytic, without its type; network : of curves on it
    more : other fields
    """
    return {
        "format": "kop_exudyn/design",
        "version": 1,
        "class": "grid",
        "name": "test",
        "material": {"young": 2.1e9, "poisson": 0.35},
        "section": {"type": "rectangle", "width": 0.004, "height": 0.03},
        "surface": {"type": "analytic", **surface},
        "network": network,
        **more,
    }


def lines(half: float, n: int) -> list[float]:
    """Parameters of n curves, evenly spread over [-half, half]."""
    return np.linspace(-half, half, n).tolist()


def isolines(half: float, n: int) -> dict[str, Any]:
    """A network of n parameter lines either way."""
    return {"type": "isolines", "u": lines(half, n), "v": lines(half, n)}


SADDLE = grid_data({"name": "paraboloid", "a": 0.9, "b": -0.7}, isolines(0.4, 4))
ARC = np.linspace(-0.6, 0.6, 4)
CYLINDER = grid_data(
    {"name": "cylinder", "radius": 0.8},
    {"type": "isolines", "u": (0.8 * ARC).tolist(), "v": lines(0.4, 3)},
)
