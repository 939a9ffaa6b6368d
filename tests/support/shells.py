"""A small C-shell for tests of files, pages and commands."""

from __future__ import annotations

from typing import Any


def shell_data(name: str, bow: float = 0.1, **changes: Any) -> dict[str, Any]:
    """The content of a design file: two curves across three.

    bow : how far the curves bend, so that designs differ
    changes : fields that are other than usual
    """
    along = [[[-1.2, y - bow], [0, y], [1.2, y - 0.1]] for y in (-0.5, 0.4)]
    across = [[[x, -0.9], [x * 1.1 + bow / 5, 0], [x, 0.9]] for x in (-0.8, 0.05, 0.7)]
    data = {
        "format": "kop_exudyn/design",
        "version": 1,
        "class": "c_shell",
        "name": name,
        "opening": {"angle": 0.3},
        "free_ends": False,
        "material": {"young": 2.1e9, "poisson": 0.35, "elastic_limit": 4e7},
        "section": {"type": "rectangle", "width": 0.03, "height": 0.004},
        "curves": [{"type": "spline", "points": points} for points in along + across],
    }
    return data | changes
