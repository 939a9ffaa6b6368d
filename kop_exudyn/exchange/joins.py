"""Which drawn pieces go on in each other, and which are hinged where their ends meet.

Many programs write every edge of a net for itself. So an end that meets another end may be a seam
within one lath, or a tip at which two laths are hinged. Angles don't tell: the laths of a scissor
that is nearly closed, or nearly open, turn little at their tips. What joining does to the two
families of laths tells: laths cross, and are hinged with, those of the other family only. Pieces
that are known to be of one family are joined, pieces of different ones hinged; and what is known
grows from the surest places to the least sure ones:

1. pieces that cross are of different families; so are neighbours of the four ends that meet around
   a joint, whose opposite ends go on in each other;
2. two ends that meet at a sharp corner are hinged;
3. of three ends that meet, two go on in each other: the straightest pair that is allowed, the
   clearest places first;
4. other two ends that meet, the straightest first: as the families say, and by the turn where they
   say nothing.

Where crossings admit no two families, as the triangles of three sets of laths do, only the turn is
left.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..errors import InputError
from .cleaning import end_groups
from .drawing import DrawnCurve

RULES = ("auto", "always", "never")
_SHARP = np.pi / 2  # rad; ends that turn by more are hinged in any case
_LARGEST_TURN = np.pi / 4  # rad; without families, pieces that turn by more are two curves
_DOUBTFUL = np.radians(25)  # around the largest turn: places that a reader should look at

End = tuple[int, int]  # number of the curve; 0: its first point, -1: its last


@dataclass(frozen=True)
class Joined:
    """Whole curves from drawn pieces.

    curves : in the order of their first pieces
    seams, tips (n, 3) : where pieces were joined, and where ends that meet stay two curves
    by_turn : places of seams and tips that only a middling turn decided, and of seams with a corner
    crowded : places where more than four ends meet, which are left as they are
    families : whether the pieces fall into two families
    """

    curves: list[DrawnCurve]
    seams: np.ndarray
    tips: np.ndarray
    by_turn: np.ndarray
    crowded: np.ndarray
    families: bool


def join_ends(
    curves: Sequence[DrawnCurve],
    crossing: Sequence[tuple[int, int]],
    tolerance: float,
    rule: str = "auto",
) -> Joined:
    """Put pieces together that go on in each other.

    crossing : pairs of pieces that cross, or one of which ends on the other
    tolerance : a length, within which ends meet
    rule : "auto", see the module; "always": all pairs of ends that turn by less than 45 degrees,
        the straightest first; "never"
    """
    decided = _Decision(curves, crossing, tolerance)
    if rule == "auto":
        decided.by_families()
    elif rule == "always":
        decided.by_turns()
    links = decided.links
    places = {
        name: np.array([curves[k].points[end] for k, end in ends]).reshape(-1, 3)
        for name, ends in (
            ("seams", [a for a, b in links.items() if a < b]),
            ("tips", decided.tips()),
            ("by_turn", decided.unsure),
            ("crowded", [decided.ends[group[0]] for group in decided.groups if len(group) > 4]),
        )
    }
    return Joined(_chained(curves, links), **places, families=not decided.families.mixed)


class Families:
    """What is known of the curves' two families: a union-find structure in which each member keeps
    its side against its parent."""

    def __init__(self, n: int):
        self._parent = list(range(n))
        self._side = [0] * n
        self._mixed = [False] * n

    @property
    def mixed(self) -> bool:
        """Whether no two families fit some of what is known."""
        return any(self._mixed)

    def differ(self, a: int, b: int) -> bool | None:
        """Whether two curves are of different families; None where that isn't known, or nothing
        fits."""
        (root, side), (other, its) = self._root(a), self._root(b)
        return bool(side ^ its) if root == other and not self._mixed[root] else None

    def relate(self, a: int, b: int, differ: bool) -> None:
        """Two curves are known to be of different families, or of one."""
        (root, side), (other, its) = self._root(a), self._root(b)
        if root == other:
            self._mixed[root] |= bool(side ^ its) != differ
            return
        self._parent[other], self._side[other] = root, side ^ its ^ differ
        self._mixed[root] |= self._mixed[other]

    def _root(self, k: int) -> tuple[int, int]:
        """The root of a member's set, and the member's side against it."""
        path, side = [], 0
        while self._parent[k] != k:
            path.append(k)
            k = self._parent[k]
        for member in reversed(path):  # short ways for the next time
            side ^= self._side[member]
            self._parent[member], self._side[member] = k, side
        return k, side


class _Decision:
    """Which ends are linked. Groups of ends that meet are dealt with one after the other."""

    def __init__(
        self,
        curves: Sequence[DrawnCurve],
        crossing: Sequence[tuple[int, int]],
        tolerance: float,
    ):
        self.curves = curves
        self.ends = [(k, e) for k, c in enumerate(curves) if not c.closed for e in (0, -1)]
        self.families = Families(len(curves))
        self.links: dict[End, End] = {}
        self.unsure: list[End] = []
        self.groups: list[list[int]] = []
        for a, b in crossing:
            self.families.relate(a, b, True)
        if self.ends:
            points = np.array([curves[k].points[e] for k, e in self.ends])
            self.inward = np.array([_inward(curves[k].points, e) for k, e in self.ends])
            groups = end_groups(points, tolerance)
            self.groups = [group.tolist() for group in groups if len(group) > 1]

    def by_families(self) -> None:
        """Decide everywhere, see the module."""
        sized = {n: [group for group in self.groups if len(group) == n] for n in (2, 3, 4)}
        for group in sized[4]:
            first, second, third, fourth = self._around(group)
            self._link(first, third)
            self._link(second, fourth)
            self._hinge(first, second)
        pairs = self._by_turn(sized[2])
        for turn, a, b in pairs:
            if turn > _SHARP:
                self._hinge(a, b)
        for ranked, group in sorted(map(self._ranked, sized[3])):
            self._decide_three(ranked, group)
        for turn, a, b in pairs:
            if turn <= _SHARP:
                self._decide_two(turn, a, b)

    def by_turns(self) -> None:
        """Link all ends that turn little, each at most once, the straightest first."""
        pairs = [pair for group in self.groups for pair in combinations(group, 2)]
        for turn, a, b in self._by_turn(pairs):
            free = self.ends[a] not in self.links and self.ends[b] not in self.links
            if free and turn <= _LARGEST_TURN:
                self._link(a, b)

    def _by_turn(self, pairs: Iterable[Sequence[int]]) -> list[tuple[float, int, int]]:
        """Pairs of ends with their turns, the straightest first."""
        return sorted((self._turn(a, b), a, b) for a, b in pairs)

    def tips(self) -> list[End]:
        """One of the ends at each place where two ends meet and aren't linked."""
        return [
            self.ends[group[0]]
            for group in self.groups
            if len(group) == 2 and self.ends[group[0]] not in self.links
        ]

    def _ranked(self, group: list[int]) -> tuple[list[tuple[float, int, int]], list[int]]:
        """The pairs of three ends, the straightest first, so that clear cases sort before others:
        by how much straighter the first pair is than the second."""
        pairs = self._by_turn(combinations(group, 2))
        lead = pairs[0][0] - pairs[1][0]
        return [(lead, -1, -1), *pairs], group

    def _decide_three(self, ranked: list[tuple[float, int, int]], group: list[int]) -> None:
        for _, a, b in ranked[1:]:
            c = next(k for k in group if k not in (a, b))
            if (
                self._differ(a, b) is not True
                and self._differ(a, c) is not False
                and self._differ(b, c) is not False
            ):
                self._link(a, b)
                self._hinge(a, c)
                return

    def _decide_two(self, turn: float, a: int, b: int) -> None:
        differ = self._differ(a, b)
        if self.ends[a][0] == self.ends[b][0]:
            differ = turn > _LARGEST_TURN
        if differ is None:
            differ = turn > _LARGEST_TURN
            if abs(turn - _LARGEST_TURN) < _DOUBTFUL:
                self.unsure.append(self.ends[a])
        elif not differ and turn > _LARGEST_TURN:
            self.unsure.append(self.ends[a])
        if differ:
            self._hinge(a, b)
        else:
            self._link(a, b)

    def _link(self, a: int, b: int) -> None:
        self.links[self.ends[a]] = self.ends[b]
        self.links[self.ends[b]] = self.ends[a]
        self.families.relate(self.ends[a][0], self.ends[b][0], False)

    def _hinge(self, a: int, b: int) -> None:
        if self.ends[a][0] == self.ends[b][0]:
            k, end = self.ends[a]
            raise InputError(
                "its ends meet at a corner at {place}: no lath is hinged with itself; draw two",
                field=self.curves[k].label,
                places=[self.curves[k].points[end]],
            )
        self.families.relate(self.ends[a][0], self.ends[b][0], True)

    def _differ(self, a: int, b: int) -> bool | None:
        return self.families.differ(self.ends[a][0], self.ends[b][0])

    def _turn(self, a: int, b: int) -> float:
        """Angle (rad) by which a curve turns that arrives by one end and leaves by the other."""
        u, v = self.inward[a], self.inward[b]
        return float(np.arctan2(np.linalg.norm(np.cross(u, v)), -(u @ v)))

    def _around(self, group: list[int]) -> list[int]:
        """Four ends in their order around the place, seen along the normal of the first one and the
        one most across it."""
        d = self.inward[group]
        normals = np.cross(d[0], d[1:])
        normal = normals[np.argmax((normals**2).sum(axis=1))]
        length = np.linalg.norm(normal)
        if not length:
            return group
        across = np.cross(normal / length, d[0])
        angles = np.arctan2(d @ across, d @ d[0]) % (2 * np.pi)
        angles[0] = 0.0
        return [group[k] for k in np.argsort(angles)]


def _inward(points: np.ndarray, end: int) -> np.ndarray:
    """Unit direction (3,) in which a curve leaves one of its ends."""
    step = points[1] - points[0] if end == 0 else points[-2] - points[-1]
    return step / np.linalg.norm(step)


def _chained(curves: Sequence[DrawnCurve], links: dict[End, End]) -> list[DrawnCurve]:
    starts = [
        (k, end)
        for k, curve in enumerate(curves)
        for end in (0, -1)
        if curve.closed or (k, end) not in links
    ]
    starts += [(k, 0) for k in range(len(curves))]  # loops have no end to start from
    found, used = [], set()
    for start in starts:
        if start[0] in used:
            continue
        chain = list(_chain(start, links))
        used |= {k for k, _ in chain}
        found.append((min(k for k, _ in chain), _put_together(curves, chain, links)))
    return [curve for _, curve in sorted(found, key=lambda entry: entry[0])]


def _chain(start: End, links: dict[End, End]) -> Iterator[End]:
    """The pieces that follow each other, each by the end at which it begins."""
    here = start
    while True:
        yield here
        following = links.get((here[0], -1 if here[1] == 0 else 0))
        if following is None or following[0] == start[0]:
            return
        here = following


def _put_together(
    curves: Sequence[DrawnCurve], chain: Sequence[End], links: dict[End, End]
) -> DrawnCurve:
    first = curves[chain[0][0]]
    if first.closed or len(chain) == 1 and chain[0] not in links:
        return first
    pieces = [curves[k].points if end == 0 else curves[k].points[::-1] for k, end in chain]
    points = np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])])
    closed = chain[0] in links  # the end where it began goes on as well
    label = first.label if len(chain) == 1 else f"{first.label} and {len(chain) - 1} more"
    return DrawnCurve(points[:-1] if closed else points, closed, label, first.layer)
