"""Coarse copies of our grids."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


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
