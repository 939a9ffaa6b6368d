"""Results as figures, for notebooks and scripts."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ..analysis.simulation import SimulationResult
from ..checks import check_kind
from ..search.result import KitResult
from .designs import DrawnDesign, DrawnState, draw_designs
from .kit_drawings import drawn_designs


def plot(result: SimulationResult | KitResult) -> Figure:
    """Rods in 3D, joints coloured by their deviation from the target.

    result : of a simulation: its deployed state, and the one under loads where there is one, over
        the target's joints; of a kit optimisation: every design after the direct, the relaxed and
        the assigned stage

    Returns a matplotlib figure: notebooks show it, `figure.savefig("picture.png")` keeps it.
    """
    check_kind("result", result, (SimulationResult, KitResult))
    if isinstance(result, KitResult):
        return draw_designs(drawn_designs(result))
    design, role = result.design, result.design.fitted_role.name
    scene, placement, size = design.scene(role), result.fit.placement, result.fit.size
    found = {role: result.deployed}
    if result.loaded is not None:
        found["loaded"] = result.loaded.equilibrium
    states = []
    for name, equilibrium in found.items():
        joints = equilibrium.state.positions[design.joints]
        away = result.fit.distances
        if name != role:
            before = result.deployed.state.positions[design.joints]
            away = np.linalg.norm(joints - before, axis=1)
        states.append(
            DrawnState(
                name if name == role else "loaded: deflections",
                [placement.apply(line) for line in scene.polylines(equilibrium.state)],
                placement.apply(joints),
                100 * away / size,
            )
        )
    return draw_designs([DrawnDesign(design.name, states)])
