"""How thick rods should be: a design's states with the same elements cut from another board.

Of rods that are bent into a given shape, stress grows about linearly with the thickness; against
loads they become stiffer with its third power. The states are solved anew for each thickness that
is looked at, so that what the shape does as stiffnesses shift is counted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..equilibrium.equilibria import Equilibrium, Start
from ..equilibrium.newton import solve
from ..equilibrium.system import System
from ..errors import SimulationFailure
from ..rods.sections import Material, Section, thickened, thickness_of
from ..scene.scene import Scene
from .base import Design
from .strength import by_section, made_of, rod_strength

_CLOSE = 0.01  # utilisation within that below what is allowed is near enough
_TRIALS = 6
_LEAST, _MOST = 0.05, 20.0  # thickness, as a multiple of the present one


def thickened_scene(scene: Scene, materials: tuple[Material, ...], share: float) -> Scene:
    """The scene with all its rods cut from boards `share` times as thick.

    materials : that the rods may be made of; an element's own is the one that explains its
        stiffness. Rods without a section stay as they are.
    """
    stiffness = scene.stiffness.copy()
    sections: dict[int, Section] = {}
    for section, elements in by_section(scene):
        thick = sections[id(section)] = thickened(section, share)
        for material in materials:
            stiffness[made_of(scene, elements, section, material)] = thick.stiffness(material)
    chains = tuple(
        chain
        if chain.section is None
        else replace(chain, section=sections.get(id(chain.section), chain.section))
        for chain in scene.chains
    )
    return replace(scene, stiffness=stiffness, chains=chains)


def resolved(scene: Scene, state: Equilibrium) -> Equilibrium:
    """The equilibrium of a scene with other stiffnesses, from one with the former ones. Raises
    SimulationFailure."""
    return solve(System(scene), state.q, Start(state.state), state.opening)


def board_of(design: Design) -> float | None:
    """Thickness of the board that a design's rods are cut from, in its unit of length; None where
    rods have no section, or different ones."""
    scene = design.scene(design.fitted_role.name)
    found = {round(thickness_of(section), 12) for section, _ in by_section(scene)}
    return found.pop() if len(found) == 1 else None


def keeping_limit(
    states: Sequence[tuple[Scene, Equilibrium]],
    materials: tuple[Material, ...],
    allowed: float = 1.0,
) -> float | None:
    """By how much thicker or thinner rods should be to use just what is allowed, as a multiple.

    states : scenes with their equilibria, at the parameters that are to be kept
    materials : that the rods may be made of
    allowed : largest utilisation, equivalent stress over elastic limit

    Returns None where no limit is known, or none is found between a twentieth and twenty times the
    present thickness.
    """

    def used(share: float) -> float | None:
        """The largest utilisation of all states."""
        found = []
        for scene, state in states:
            thick = thickened_scene(scene, materials, share)
            found.append(rod_strength(thick, resolved(thick, state), materials).largest)
        known = [value for value in found if value is not None]
        return max(known) if known else None

    share, power = 1.0, 1.0
    now: float | None = None
    last: tuple[float, float] | None = None
    for _ in range(_TRIALS):
        try:
            now = used(share)
        except SimulationFailure:
            return None
        if now is None or now <= 0:
            return None
        if allowed * (1 - _CLOSE) <= now <= allowed:
            return share
        if last is not None and share != last[0]:
            slope = np.log(now / last[1]) / np.log(share / last[0])
            power = float(np.clip(slope, 0.3, 3.0))
        last = (share, now)
        # a little below what is allowed, so that the last trial keeps to it
        share *= (allowed * (1 - _CLOSE / 2) / now) ** (1 / power)
        if not _LEAST <= share <= _MOST:
            return None
    return share if now is not None and now <= allowed else None
