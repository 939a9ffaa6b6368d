"""Design files with a load that suits each: snow under which the design as given deflects by as
much as is allowed."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from kop_exudyn.errors import InputError, SimulationFailure
from kop_exudyn.io.designs import load_design
from kop_exudyn.io.rescaling import relocated
from kop_exudyn.structures.base import Design
from kop_exudyn.structures.loading import loaded_state
from kop_exudyn.structures.loads import LoadCase
from kop_exudyn.units import Units

SPAN_OVER = 200
FACTOR = 1.5  # for strength and stability
_SMALL = 0.1  # of the deflection that is allowed: so far it grows with the load
_DIGITS = 2


def with_snow(files: list[Path], folder: Path) -> Path:
    """Copies of design files in a folder, with a load case each; without one where the design is
    not held by its supports, or gives way.

    Snow is a multiple of the design's own weight: that under which the design as given would
    deflect by its span over `SPAN_OVER` if deflections grew as they do with small loads. Some
    deflect a little more.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for file in files:
        content = relocated(json.loads(file.read_text(encoding="utf-8")), file.parent, folder)
        times = _as_much_as_allowed(load_design(file))
        if times is not None:
            gravity = [0.0, 0.0, -times * _gravity(load_design(file))]
            case = {"name": "snow", "gravity": gravity, "factor": FACTOR}
            content["load_cases"] = [{**case, "deflection": {"span_over": SPAN_OVER}}]
        (folder / file.name).write_text(json.dumps(content), encoding="utf-8")
    return folder


def _as_much_as_allowed(design: Design) -> float | None:
    """The multiple of its own weight, to two digits; None where there is none."""
    unloaded = design.deploy()[design.fitted_role.name]
    times = 1.0
    try:
        for _ in range(3):
            case = LoadCase(gravity=np.array([0.0, 0.0, -times * _gravity(design)]))
            loaded = loaded_state(design, unloaded, case)
            x = unloaded.state.positions[design.joints[loaded.supports]]
            span = float(np.linalg.norm(x[:, None] - x[None], axis=2).max())
            used = float(loaded.deflections.max()) * SPAN_OVER / span
            if used < 2 * _SMALL:
                break
            times *= _SMALL / used
    except (InputError, SimulationFailure):
        return None
    return float(f"{times / used:.{_DIGITS - 1}e}") if used > 0 else None


def _gravity(design: Design) -> float:
    """Standard gravity in a design's unit of length, over s^2."""
    units = design.units or Units("m")
    return 9.81 / units.metres
