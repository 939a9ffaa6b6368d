"""Drawn nets as files, and what `kop import` needs besides to make designs of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kop_exudyn.exchange.drawing import DrawnCurve

GRID = """# three lines across two
v -0.2 0 5
v 2.2 0 5
v -0.2 1 5
v 2.2 1 5
v 0 -0.2 5
v 0 1.2 5
v 1 -0.2 5
v 1.1 0.5 5
v 1 1.2 5
v 2 -0.2 5
v 2 1.2 5
l 1 2
l 3 4
l 5 6
l 7/1 8/2 \\
  9/3
l -2 -1
"""
OPTIONS = ("--opening", "30deg", "--section", "0.02,0.01", "--material", "2.1e9,0.35")


def saved(document: Any, path: Path) -> Path:
    """Where a DXF document is saved."""
    document.saveas(path)
    return path


def piece(*points: Sequence[float]) -> DrawnCurve:
    """A curve through points (n, 2)."""
    return DrawnCurve(
        np.array([[*point, 0.0] for point in points], float), False, f"from {points[0]}"
    )
