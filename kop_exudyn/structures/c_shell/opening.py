"""How the smooth design of a C-shell opens, and how far it can: between closed and closed again,
and every hinge for itself."""

from __future__ import annotations

import numpy as np

from ...arrays import Vector
from ...equilibrium.equilibria import Equilibrium
from ...equilibrium.newton import NewtonOptions
from ...equilibrium.newton import solve as fast
from ...equilibrium.system import System
from ...errors import InputError, SimulationFailure, shown_place
from ...geometry.network import CurveNetwork
from ...scene.state import State
from ..base import Solve
from .own_axes import own_axes

_ON_EACH_OTHER = 1e-6  # rad: laths whose mean angle is smaller
_OPENING_STEP = 0.1  # rad of mean joint angle a step


def check_opening(flat: float, opening: float) -> None:
    """Raise InputError for an opening at whose end, or before, laths would pass through others."""
    if not _ON_EACH_OTHER < flat + opening < np.pi - _ON_EACH_OTHER:
        low, high = (float(np.degrees(x)) for x in (-flat, np.pi - flat))
        raise InputError(
            f"takes the mean angle between the curves from {np.degrees(flat):.4g}° "
            f"to {np.degrees(flat + opening):.4g}°: at 0 and 180° they "
            f"lie on each other; an opening between {low:.4g} and {high:.4g}° is "
            "possible",
            field="opening.angle",
            value=opening,
        )


def check_hinges(network: CurveNetwork, state: State, middle: Vector) -> None:
    """Raise SimulationFailure, naming the joint, for a state in which curves that open have passed
    through each other, or others have turned by half a turn.

    Only the mean of the angles is prescribed; a net whose laths brace each other meets it by
    spinning the hinge that resists least.

    middle (3,) : where the network's coordinates begin in those of its file
    """
    angles = state.angles[: network.n_joints]
    turns = angles - network.opening_angles
    beyond = np.where(network.opens, np.abs(angles - 0.5 * np.pi) - 0.5 * np.pi, -np.inf)
    beyond = np.maximum(beyond, np.abs(turns) - np.pi)
    worst = int(np.argmax(beyond))
    if beyond[worst] < 0:
        return
    x = network.joints[worst] + middle[:2]
    first, second = (
        network.strands[k].curve.field.removesuffix(".points") for k in network.pairs[worst]
    )
    raise SimulationFailure(
        f"the hinge of {first} and {second} at {shown_place(x, network.size)} turns by "
        f"{np.degrees(turns[worst]):.4g} degrees, which takes the two through each other: this net "
        "does not open by turning its two families, or is opened too far"
    )


def open_up(
    system: System, flat: float, opening: float, side: int, solve: Solve = fast
) -> list[Equilibrium]:
    """Open a smooth design by its mean opening angle, through the bifurcation to the chosen side of
    the plane.

    flat : the mean angle of the flat network, the scene's initial state; solve : an engine's

    Returns the states of growing angles, the flat one first. Just beyond the bifurcation, rings and
    other nets of many folds may move without resistance from one way off the plane to another: a
    step at which no state is found is taken together with the next. Raises SimulationFailure where
    none is found at the end.
    """
    scene = system.scene
    steps = max(1, int(np.ceil(abs(opening) / _OPENING_STEP - 1e-9)))
    heights = np.zeros(scene.n_dofs)
    heights[: 6 * scene.n_bodies].reshape(-1, 6)[:, 2] = side * _bulge(scene.initial.positions)
    options = NewtonOptions(side=heights[system.sparsity.free])
    path = [solve(system, np.empty(0), None, flat, options)]
    for step in range(1, steps + 1):
        angle = flat + opening * step / steps
        try:
            path.append(solve(system, np.empty(0), path[-1], angle, options))
        except SimulationFailure as failure:
            if step < steps:
                continue
            raise failure.within(f"smooth design, mean opening angle {angle:.3f} rad") from None
    return path


def _bulge(x: np.ndarray) -> np.ndarray:
    """A height field (n,) that no symmetric buckling mode, even or odd, is orthogonal to: for
    choosing a side. It turns with the net, and is mirrored with it, so that a saddle, whose two
    sides are alike, rises to the same one wherever it is drawn."""
    y = (x[:, :2] - x[:, :2].mean(axis=0)) @ own_axes(x[:, :2]).T
    y = y / np.hypot(*y.T).max()
    r = (y**2).sum(axis=1)
    height = r + 0.7 * (y[:, 0] ** 2 - y[:, 1] ** 2) + r * (0.3 * y[:, 0] + 0.18 * y[:, 1])
    return height - height.mean()
