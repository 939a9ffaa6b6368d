"""Where a design's pieces are in its scene: which rods and corners its parameters drive, and what
meets there."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..scene.scene import Scene
from ..scene.state import State
from ..structures.base import Design
from .pieces import DesignPieces, PartsList, Piece


@dataclass(frozen=True)
class Corner:
    """A bend that a parameter drives.

    body, hinge : where it is in the scene
    before, after : rod pieces on the body's side and behind the hinge
    """

    body: int
    hinge: int
    before: tuple[int, ...]
    after: tuple[int, ...]


@dataclass(frozen=True)
class PlacedPieces:
    """The pieces of a design in one of its scenes; rod pieces are numbered as the scene's
    chains."""

    pieces: DesignPieces
    scene: Scene

    @classmethod
    def of(cls, pieces: DesignPieces, role: str | None = None) -> PlacedPieces:
        """In the scene of a role (default: the one that is fitted to the target)."""
        return cls(pieces, pieces.design.scene(role or pieces.design.fitted_role.name))

    @property
    def design(self) -> Design:
        return self.pieces.design

    @cached_property
    def chains(self) -> dict[int, list[int]]:
        """parameter -> rod pieces whose length it is."""
        found = defaultdict(list)
        for number, parameter in enumerate(self.scene.chain_parameters.tolist()):
            if parameter >= 0:
                found[parameter].append(number)
        return dict(found)

    @cached_property
    def ends(self) -> np.ndarray:
        """(n_chains, 2) bodies at both ends of every rod piece."""
        return np.array([self.scene.node_body[chain.nodes[[0, -1]]] for chain in self.scene.chains])

    @cached_property
    def touching(self) -> dict[int, list[int]]:
        """body -> rod pieces that end there."""
        found = defaultdict(list)
        for number, pair in enumerate(self.ends):
            for body in pair:
                found[int(body)].append(number)
        return dict(found)

    @cached_property
    def corners(self) -> dict[int, Corner]:
        """parameter -> the corner whose angle it is."""
        scene, first = self.scene, 6 * self.scene.n_bodies
        found = {}
        for dof, parameter in zip(scene.driven.dofs, scene.driven.parameters):
            if dof >= first:
                found[int(parameter)] = self._corner(int(dof - first))
        return found

    def _corner(self, hinge: int) -> Corner:
        scene = self.scene
        body = int(scene.node_body[np.flatnonzero(scene.node_hinge == hinge)[0]])
        sides: tuple[list[int], list[int]] = ([], [])
        for number in self.touching.get(body, []):
            node = self.node_at(number, body)
            sides[int(scene.node_hinge[node] == hinge)].append(number)
        return Corner(body, hinge, tuple(sides[0]), tuple(sides[1]))

    @cached_property
    def joint_numbers(self) -> dict[int, int]:
        """body -> number of the joint, from 1."""
        return {int(body): number for number, body in enumerate(self.design.joints, 1)}

    @cached_property
    def corner_pieces(self) -> dict[int, Piece]:
        """body -> the corner's piece."""
        return {
            corner.body: self.pieces.by_parameter[parameter]
            for parameter, corner in self.corners.items()
            if parameter in self.pieces.by_parameter
        }

    @cached_property
    def chain_pieces(self) -> list[Piece | None]:
        """The piece that each rod piece belongs to; None for rods that no part makes."""
        return [
            self.pieces.by_parameter.get(parameter)
            for parameter in self.scene.chain_parameters.tolist()
        ]

    def joints_of(self, piece: Piece) -> list[int]:
        """Numbers of the joints that a piece's rods end at."""
        bodies = {
            int(body)
            for parameter in piece.parameters
            for chain in self.chains.get(parameter, [])
            for body in self.ends[chain]
        }
        return sorted(self.joint_numbers[body] for body in bodies if body in self.joint_numbers)

    def joint_of(self, piece: Piece) -> int | None:
        """Number of the joint that a piece carries; None where it has none, or several."""
        joints = self.joints_of(piece)
        return joints[0] if len(joints) == 1 else None

    def crossing_angles(self, state: State) -> dict[int, float]:
        """Joint -> acute angle (rad) between the two rods that cross there; only where two do."""
        tangents = self.scene.node_poses(state)[1][:, :, 0]
        found = {}
        for body, joint in self.joint_numbers.items():
            nodes = [self.node_at(number, body) for number in self.touching.get(body, ())]
            sides = {int(self.scene.node_hinge[node]): node for node in nodes}
            if len(sides) == 2:
                first, second = (tangents[node] for node in sides.values())
                found[joint] = float(np.arccos(np.clip(abs(first @ second), 0.0, 1.0)))
        return found

    def node_at(self, chain: int, body: int) -> int:
        """The node of a rod piece's end that lies on a body."""
        nodes = self.scene.chains[chain].nodes
        return int(nodes[0] if self.ends[chain, 0] == body else nodes[-1])

    def far_end(self, chain: int) -> int:
        """The body at that end of a rod piece which is not a joint of the design (the last one
        where none is)."""
        outer = [int(body) for body in self.ends[chain] if int(body) not in self.joint_numbers]
        return outer[-1] if outer else int(self.ends[chain, 1])


def sharpest_crossings(parts: PartsList) -> dict[str, np.ndarray]:
    """kind -> (m,) smallest angle (rad) at which a piece of each part crosses another, in any
    state.

    Right angles where a part crosses nothing.
    """
    found = {kind: np.full(m, np.pi / 2) for kind, m in parts.kit.sizes.items()}
    for number, pieces in enumerate(parts.designs):
        roles = pieces.design.roles
        initial = {role.name: pieces.design.scene(role.name).initial for role in roles}
        for role, state in (parts.states[number] if parts.states else initial).items():
            placed = PlacedPieces.of(pieces, role)
            angles = placed.crossing_angles(state)
            for piece in pieces.pieces:
                joint = placed.joint_of(piece)
                if joint is not None and joint in angles:
                    low = found[piece.kind]
                    low[piece.part] = min(low[piece.part], angles[joint])
    return found


def bars_needed(parts: PartsList, kind: str) -> np.ndarray:
    """(m, k_p) rods of each length of each part, for the design that needs most of them."""
    counts = np.zeros((len(parts.designs), *parts.kit[kind].shape), dtype=int)
    for row, design in enumerate(parts.designs):
        chains = PlacedPieces.of(design).chains
        for piece in design.pieces:
            if piece.kind == kind:
                for parameter, column in zip(piece.parameters, piece.columns):
                    counts[row, piece.part, column] += len(chains.get(parameter, ()))
    return counts.max(axis=0, initial=0)
