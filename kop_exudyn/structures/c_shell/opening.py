"""How far a C-shell can open: between closed and closed again, and every hinge for itself."""

from __future__ import annotations

import numpy as np

from ...errors import InputError, SimulationFailure
from ...geometry.network import CurveNetwork
from ...scene.state import State


def check_opening(flat: float, opening: float) -> None:
    """Raise InputError for an opening at whose end, or before, laths would pass through others."""
    if not 0.0 < flat + opening < np.pi:
        low, high = (float(np.degrees(x)) for x in (-flat, np.pi - flat))
        raise InputError(
            f"takes the mean angle between the curves from {np.degrees(flat):.4g}° "
            f"to {np.degrees(flat + opening):.4g}°: at 0 and 180° they "
            f"lie on each other; an opening between {low:.4g} and {high:.4g}° is "
            "possible",
            field="opening.angle",
            value=opening,
        )


def check_hinges(network: CurveNetwork, state: State) -> None:
    """Raise SimulationFailure, naming the joint, for a state in which curves that open have passed
    through each other, or others have turned by half a turn.

    Only the mean of the angles is prescribed; a net whose laths brace each other meets it by
    spinning the hinge that resists least.
    """
    angles = state.angles[: network.n_joints]
    turns = angles - network.opening_angles
    beyond = np.where(network.opens, np.abs(angles - 0.5 * np.pi) - 0.5 * np.pi, -np.inf)
    beyond = np.maximum(beyond, np.abs(turns) - np.pi)
    worst = int(np.argmax(beyond))
    if beyond[worst] < 0:
        return
    x = network.joints[worst]
    first, second = (
        network.strands[k].curve.field.removesuffix(".points") for k in network.pairs[worst]
    )
    raise SimulationFailure(
        f"the hinge of {first} and {second} at ({x[0]:.6g}, {x[1]:.6g}) turns by "
        f"{np.degrees(turns[worst]):.4g} degrees, which takes the two through each other: this net "
        "does not open by turning its two families, or is opened too far"
    )
