"""Small C-shells: one for tests of files, pages and commands, two for those of searches."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from kop_exudyn.io.designs import load_design
from kop_exudyn.search.dataset import Dataset
from kop_exudyn.search.events import StageEvent
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.settings import StageSettings
from kop_exudyn.search.stages import Stages
from kop_exudyn.search.weights import Weights


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


@contextmanager
def stages_of_two(
    repository: Path, settings: StageSettings, observer: Callable[[StageEvent], None]
) -> Iterator[Stages]:
    """The stages of two shells of models/small that share 4 linear and 2 angular parts."""
    shells = [
        load_design(repository / "models" / "small" / name)
        for name in ("01_sinh.json", "06_moebius.json")
    ]
    with DesignPool(shells) as pool:
        pool.prepare()
        dataset = Dataset.of_pool(pool, Weights.suiting(shells))
        yield Stages(dataset, {"linear": 4, "angular": 2}, settings, observer=observer)
