"""One state of one design, with all that files say about its rods: part, element, deviation,
stress.

Deployed states, and those under loads, lie where the joints of the unloaded one fit the target
best; assembly states where they were simulated.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..analysis.simulation import SimulationResult
from ..drawing.colours import kit_colours, part_colours
from ..equilibrium.equilibria import Equilibrium
from ..fabrication.pieces import PartsList
from ..fabrication.placement import PlacedPieces
from ..scene.scene import Scene
from ..search.evaluation import Evaluation
from ..structures.base import Design, Target
from ..structures.fitting import FitResult, Placement
from ..structures.strength import Strength, materials_of, rod_strength

_GREY = np.array([0.62, 0.62, 0.62])  # rods that no part makes
_STAYS = Placement(np.eye(3), np.zeros(3))


@dataclass(frozen=True)
class DesignState:
    """One state.

    name : of the state, as "deployed", "rest" or "loaded"
    scene, equilibrium : what was solved
    parts, elements : by rod piece, the part's label ("" without one) and the element's number (0)
    colours (n_chains, 3) : sRGB by rod piece
    placement : where it fits its target, both seen from `design.origin`
    target : the surface that it is compared with; None for states that aren't
    """

    design: Design
    name: str
    scene: Scene
    equilibrium: Equilibrium
    parts: tuple[str, ...]
    elements: np.ndarray
    colours: np.ndarray
    placement: Placement
    target: Target | None

    @cached_property
    def points(self) -> np.ndarray:
        """(N, 3) nodes of all rods, where files have them."""
        return self.placed(self.scene.node_poses(self.equilibrium.state)[0])

    def placed(self, points: np.ndarray) -> np.ndarray:
        """Points (n, 3) of the simulation where files have them: placed, in the user's
        coordinates."""
        return self.placement.apply(points) + self.design.origin

    @property
    def surface(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Vertices (V, 3) and faces (F, 3) of the target where files have them; None without
        one."""
        if self.target is None:
            return None
        return self.target.vertices + self.design.origin, self.target.faces

    @cached_property
    def axes(self) -> np.ndarray:
        """(N, 3, 3) the nodes' axes as columns: along the rod, and the section's two."""
        return self.placement.rotation @ self.scene.node_poses(self.equilibrium.state)[1]

    @cached_property
    def strength(self) -> Strength:
        return rod_strength(self.scene, self.equilibrium, materials_of(self.design))

    @cached_property
    def deviations(self) -> np.ndarray:
        """(N,) distances of the nodes from the target; NaN without one, and for designs whose rods
        lie beside it."""
        if self.target is None or self.design.beside_target:
            return np.full(len(self.points), np.nan)
        here = self.placement.apply(self.scene.node_poses(self.equilibrium.state)[0])
        return np.sqrt(self.target.surface.closest(here).squared_distances)

    @property
    def lines(self) -> list[np.ndarray]:
        """(k, 3) points along every rod piece."""
        return [self.points[chain.nodes] for chain in self.scene.chains]

    @cached_property
    def names(self) -> list[str]:
        """What every rod piece is called: part, element, and its number."""
        return [
            " ".join(filter(None, (part, f"element {n}" if n else "", f"rod {k}")))
            for k, (part, n) in enumerate(zip(self.parts, self.elements))
        ]

    def of_rod(self, chain: int) -> dict[str, Any]:
        """What is known of one rod piece: design, state, part, element, its largest deviation (in
        the design's unit of length) and utilisation, None where these are unknown."""
        piece = self.scene.chains[chain]
        used = self.strength.utilisation[piece.elements]
        off = self.deviations[piece.nodes]
        return {
            "design": self.design.name,
            "state": self.name,
            "part": self.parts[chain] or None,
            "element": int(self.elements[chain]) or None,
            "deviation": float(np.nanmax(off)) if np.isfinite(off).any() else None,
            "utilisation": float(np.nanmax(used)) if np.isfinite(used).any() else None,
        }

    @property
    def metres(self) -> float:
        """Metres of the design's unit of length; 1 where it names none."""
        return 1.0 if self.design.units is None else self.design.units.metres


def states_of_kit(
    parts: PartsList, number: int, outcome: Evaluation, target: Target
) -> Iterator[DesignState]:
    """The states of a kit's design, built from its parts."""
    pieces = parts.designs[number]
    shades = kit_colours(parts.kit.sizes)
    for role, equilibrium in outcome.equilibria.items():
        placed = PlacedPieces.of(pieces, role)
        chains = placed.chain_pieces
        fitted = role == pieces.design.fitted_role.name
        yield DesignState(
            pieces.design,
            role,
            placed.scene,
            equilibrium,
            tuple("" if piece is None else parts.label(piece) for piece in chains),
            np.array([0 if piece is None else piece.element for piece in chains], int),
            np.array([_GREY if p is None else shades[p.kind][p.part] for p in chains]),
            outcome.fit.placement if fitted else _STAYS,
            target if fitted else None,
        )


def states_of_simulation(result: SimulationResult) -> Iterator[DesignState]:
    """The states of a simulated design, the one under its loads included; no rod is of a part."""
    design, role = result.design, result.design.fitted_role.name
    found: dict[str, tuple[Scene, Equilibrium]] = {
        name: (design.scene(name), equilibrium) for name, equilibrium in result.equilibria.items()
    }
    if result.loaded is not None:
        found["loaded"] = (design.scene(role), result.loaded.equilibrium)
    for name, (scene, equilibrium) in found.items():
        yield _plain(design, name, scene, equilibrium, result.fit, name in (role, "loaded"))


def _plain(
    design: Design, name: str, scene: Scene, equilibrium: Equilibrium, fit: FitResult, fitted: bool
) -> DesignState:
    """A state of a design that no parts are assigned to; rods are coloured by their kind."""
    numbers, kinds = _elements(design)
    shades = dict(
        zip(dict.fromkeys(kinds.values()), part_colours(max(len(set(kinds.values())), 1)))
    )
    elements = np.array([numbers.get(int(p), 0) for p in scene.chain_parameters], int)
    colours = [shades[kinds[n]] if n else _GREY for n in elements.tolist()]
    return DesignState(
        design,
        name,
        scene,
        equilibrium,
        ("",) * len(scene.chains),
        elements,
        np.array(colours),
        fit.placement if fitted else _STAYS,
        design.target if fitted else None,
    )


def _elements(design: Design) -> tuple[Mapping[int, int], Mapping[int, str]]:
    """Parameter -> number of its element, and element -> its kind, numbered as in kits."""
    numbers: dict[int, int] = {}
    kinds: dict[int, str] = {}
    for group in design.groups:
        for row in group.indices:
            kinds[len(kinds) + 1] = group.kind
            numbers |= {int(parameter): len(kinds) for parameter in row}
    return numbers, kinds
