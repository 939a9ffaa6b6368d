"""Lamellas: which pieces follow each other along a rod, and which lamella lies over which.

Lamellas are numbered from 1 within their design, their pieces from 1 along them, corners included.
Where two lamellas cross, one is the *lower* and one the *upper*, seen against the joint's axis; of
lamellas on edge, the lower one's slot opens upwards. Wherever the design leaves a choice, one
family is all lower and the other all upper: then all lower lamellas are laid out first, and all
upper ones on them.
"""

from __future__ import annotations

from collections import defaultdict, deque
from dataclasses import dataclass
from functools import cached_property

from ..kit.kinds import has_joint, part_kind
from .pieces import Piece
from .placement import PlacedPieces

LOWER, UPPER = "lower", "upper"


@dataclass(frozen=True)
class Lamella:
    """pieces : straight ones and corners, in order; closed: the last leads to the first again."""

    number: int
    pieces: tuple[Piece, ...]
    closed: bool

    @property
    def straight(self) -> tuple[Piece, ...]:
        return tuple(piece for piece in self.pieces if not part_kind(piece.kind).angular)


@dataclass(frozen=True)
class Lamellas:
    """All lamellas of a design; none where its parts are no beams with a joint."""

    placed: PlacedPieces

    @cached_property
    def all(self) -> tuple[Lamella, ...]:
        """The lamellas, in the order of their first pieces."""
        following, corner_after = self._links()
        preceded = set(following.values())
        straight = [
            p
            for p in self.placed.pieces.pieces
            if has_joint(part_kind(p.kind)) and self.placed.joint_of(p) is not None
        ]
        by_number = {piece.element: piece for piece in straight}
        starts = [p.element for p in straight if p.element not in preceded]
        found: list[Lamella] = []
        used: set[int] = set()
        # loops have no start: what is left over begins at its first piece
        for start in [*starts, *by_number]:
            if start in used:
                continue
            pieces: list[Piece] = []
            here: int | None = start
            while here is not None and here not in used:
                used.add(here)
                pieces.append(by_number[here])
                if here in corner_after:
                    pieces.append(corner_after[here])
                here = following.get(here)
            found.append(Lamella(0, tuple(pieces), here == start))
        found.sort(key=lambda lamella: min(piece.element for piece in lamella.straight))
        return tuple(Lamella(n, each.pieces, each.closed) for n, each in enumerate(found, 1))

    def _links(self) -> tuple[dict[int, int], dict[int, Piece]]:
        """Element -> the straight element that follows it, and the corner in between."""
        following: dict[int, int] = {}
        corner_after: dict[int, Piece] = {}
        for parameter, corner in self.placed.corners.items():
            piece = self.placed.pieces.by_parameter.get(parameter)
            ends = [
                {p.element for p in (self.placed.chain_pieces[c] for c in side) if p is not None}
                for side in (corner.before, corner.after)
            ]
            if piece is not None and len(ends[0]) == len(ends[1]) == 1:
                before, after = ends[0].pop(), ends[1].pop()
                following[before], corner_after[before] = after, piece
        return following, corner_after

    @cached_property
    def place(self) -> dict[int, tuple[int, int]]:
        """Element -> its lamella's number, and its place along it."""
        return {
            piece.element: (lamella.number, k)
            for lamella in self.all
            for k, piece in enumerate(lamella.pieces, 1)
        }

    @cached_property
    def crossings(self) -> dict[int, tuple[Piece, Piece]]:
        """Joint -> the pieces that cross there, the lower one first."""
        found: dict[int, tuple[Piece, Piece]] = {}
        for joint, pair in self._met.items():
            first_is_lower = self._colour[self.place[pair[0].element][0]] == 0
            if self._two_coloured and not self._lifted(joint):
                pair = pair if first_is_lower else (pair[1], pair[0])
            found[joint] = pair
        return found

    @cached_property
    def layer(self) -> dict[int, str]:
        """Element -> "lower" or "upper" at its joint."""
        return {
            piece.element: layer
            for pair in self.crossings.values()
            for piece, layer in zip(pair, (LOWER, UPPER))
        }

    @cached_property
    def crosses(self) -> dict[int, Piece]:
        """Element -> the piece that it crosses."""
        pairs = self.crossings.values()
        return {a.element: b for a, b in pairs} | {b.element: a for a, b in pairs}

    @property
    def by_family(self) -> bool:
        """Whether every lamella is lower, or upper, at all of its joints."""
        sides = defaultdict(set)
        for element, layer in self.layer.items():
            sides[self.place[element][0]].add(layer)
        return all(len(side) == 1 for side in sides.values())

    @cached_property
    def _met(self) -> dict[int, tuple[Piece, Piece]]:
        """Joint -> the two pieces there, first the one on the joint's body, then the one that
        turns."""
        at: dict[int, dict[bool, Piece]] = defaultdict(dict)
        scene = self.placed.scene
        for body, joint in self.placed.joint_numbers.items():
            for chain in self.placed.touching.get(body, ()):
                piece = self.placed.chain_pieces[chain]
                if piece is not None and piece.element in self.place:
                    node = self.placed.node_at(chain, body)
                    at[joint][bool(scene.node_hinge[node] >= 0)] = piece
        return {joint: (pair[False], pair[True]) for joint, pair in at.items() if len(pair) == 2}

    def _lifted(self, joint: int) -> bool:
        """Whether the design itself says which rod is above: its rods keep off the joint's
        middle."""
        body = int(self.placed.design.joints[joint - 1])
        nodes = [self.placed.node_at(chain, body) for chain in self.placed.touching.get(body, ())]
        return any(self.placed.scene.node_offset[node, 2] != 0 for node in nodes)

    @cached_property
    def _colouring(self) -> tuple[dict[int, int], bool]:
        """Lamella -> 0 or 1, different where two cross; whether there is such a colouring."""
        crossed = defaultdict(set)
        for first, second in self._met.values():
            a, b = self.place[first.element][0], self.place[second.element][0]
            crossed[a].add(b)
            crossed[b].add(a)
        colour: dict[int, int] = {}
        fits = True
        for lamella in self.all:
            if lamella.number in colour:
                continue
            colour[lamella.number] = 0
            waiting = deque([lamella.number])
            while waiting:
                here = waiting.popleft()
                for other in sorted(crossed[here]):
                    if other not in colour:
                        colour[other] = 1 - colour[here]
                        waiting.append(other)
                    fits = fits and colour[other] != colour[here]
        return colour, fits

    @property
    def _colour(self) -> dict[int, int]:
        return self._colouring[0]

    @property
    def _two_coloured(self) -> bool:
        return self._colouring[1]
