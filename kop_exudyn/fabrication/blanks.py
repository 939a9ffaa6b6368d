"""What is made of every part, in millimetres: the one source of cut lists, sheets and drawings.

A *strip* is a straight piece with its joint. Its axis runs from corner point to corner point, but
it is sawn shorter: at corners strips are set back by as much as the sharpest corner of the kit
needs, so that any two strips fit at any corner, and a *corner plate* on their sides joins them,
bolted twice to each. All places on a strip are measured along its axis from its sawn end of
side 1. Where the joint's axis passes through the board, the joint is a hole; where it lies in the
board (lamellas on edge), it is a slot to the middle that takes the crossing lamella.

A slot with straight walls has to let a lamella of thickness t pass at the angle phi through a board
as thick: it is t (1 + |cos phi|) / sin phi wide, for the sharpest crossing at which the part
serves.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import InputError
from ..kit.kinds import PartKind, has_joint, part_kind
from .cells import CellParts
from .options import CutOptions, millimetres
from .pieces import PartsList
from .placement import PlacedPieces, bars_needed, sharpest_crossings

_LEG = 1.5  # of the breadth: how far a corner plate reaches along a strip
_LEG_SHARE = 0.5  # at most, of the shortest side
_EDGE = 1.5  # hole diameters that a hole's middle keeps from an edge, at least
_END = 3.0  # hole diameters that a bolt keeps from a strip's sawn end, where there is room
_APART = 2.0  # hole diameters between the middles of two holes
_SHARPEST = 3.0  # rad: two strips can't be mitred at sharper corners
_LEAST_CROSSING = np.radians(15)  # lamellas that cross at less have no slot worth its name


@dataclass(frozen=True)
class Board:
    """What strips are cut from.

    breadth, thickness : mm
    on_edge : whether the joints' axes lie in the board
    material : what designs call it; empty where they don't say
    """

    breadth: float
    thickness: float
    on_edge: bool
    material: str = ""

    @property
    def section(self) -> str:
        """As cut lists have it: breadth by thickness."""
        return f"{self.breadth:g} x {self.thickness:g}"


@dataclass(frozen=True)
class Strip:
    """A straight piece. Lengths in mm.

    label, count : the part, and how many pieces of it to make
    sides : along the axis from the joint to the corner points of side 1 and side 2; the longest
        ones, where the part adapts
    slide : by how much shorter either side may be built in; its bolt holes are as much longer
    setback : by which either end is sawn off before its corner point, at the side's full length
    bolts : distances of bolts from their corner point
    slot : width of the slot at the joint, or None for a hole
    hole, bolt_hole : diameters
    """

    label: str
    count: int
    board: Board
    sides: tuple[float, float]
    slide: float
    setback: float
    bolts: tuple[float, ...]
    slot: float | None
    hole: float
    bolt_hole: float

    @property
    def cut_length(self) -> float:
        """From sawn end to sawn end."""
        return sum(self.sides) - 2 * self.setback

    @property
    def hole_from_end(self) -> float:
        """Middle of the joint, from the sawn end of side 1."""
        return self.sides[0] - self.setback

    @property
    def bolt_stations(self) -> tuple[float, ...]:
        """Middles of all bolt holes (of slides: at the side's full length), increasing."""
        near = [at - self.setback for at in self.bolts]
        return tuple(sorted(near + [self.cut_length - at for at in near]))

    @property
    def slot_depth(self) -> float:
        """Half the breadth: two crossing lamellas end flush."""
        return self.board.breadth / 2


@dataclass(frozen=True)
class CornerPlate:
    """A plate on the sides of two strips; mm, rad.

    angle : by which the second strip turns against the first
    leg : reach along either strip from the corner point
    bolts : distances of its holes from the corner point
    """

    label: str
    count: int
    board: Board
    angle: float
    leg: float
    bolts: tuple[float, ...]
    bolt_hole: float


@dataclass(frozen=True)
class Bar:
    """A plain bar of a part that is a set of bars; length in mm."""

    label: str
    count: int
    length: float


@dataclass(frozen=True)
class Corners:
    """How all strips meet: set back, and bolted at these distances from the corner point; mm."""

    setback: float = 0.0
    leg: float = 0.0
    bolts: tuple[float, ...] = ()


@dataclass(frozen=True)
class Blanks:
    """All that is made for a kit.

    parts : the kit, and its pieces in the designs
    unit : the designs' unit of length
    options : the workshop's
    """

    parts: PartsList
    unit: str
    options: CutOptions = CutOptions()

    @cached_property
    def scale(self) -> float:
        """Millimetres of the designs' unit. Raises InputError for one that isn't known."""
        return millimetres(self.unit)

    @cached_property
    def board(self) -> Board:
        """The one board that all rods made of parts are cut from.

        Raises InputError where designs have different ones, or rods no section.
        """
        found: dict[Board, str] = {}
        for design in self.parts.designs:
            placed = PlacedPieces.of(design)
            material = str(getattr(getattr(design.design, "material", None), "name", "") or "")
            for chain, piece in zip(placed.scene.chains, placed.chain_pieces):
                if piece is None:
                    continue
                if chain.section is None:
                    raise InputError(
                        "its rods have no cross-section to cut",
                        source=design.design.name,
                        field="section",
                    )
                y, z = (
                    round(float(side), 6)
                    for side in self.scale * np.ptp(chain.section.outline, axis=0)
                )
                board = Board(max(y, z), min(y, z), z > y, material)
                found.setdefault(board, design.design.name)
        if len(found) > 1:
            sizes = "; ".join(f"{name}: {board.section} mm" for board, name in found.items())
            raise InputError(
                f"designs with different rods need cut sheets of their own ({sizes}): give them "
                "one section and material, or make a kit of each",
                field="section",
            )
        return next(iter(found))

    @cached_property
    def corners(self) -> Corners:
        """How strips meet at corners; nothing where there are none, or no plates are wanted."""
        angles, sides = self._angles, self._sides
        if not (self.options.corners and len(angles) and len(sides)):
            return Corners()
        d, breadth = self.options.bolt_hole, self.board.breadth
        # where strips are built in shorter than they can be, they must not meet at their corner
        slides = [float(v[2]) for k, _, _, v, _ in self._needed() if has_joint(k) and len(v) > 2]
        setback = setback_of(breadth, float(angles.max()))
        setback += self.scale * max(slides, default=0.0)
        leg = min(_LEG * breadth, _LEG_SHARE * float(sides.min()))
        # where that is too long for the shortest side, `problems` says so
        leg = max(leg, setback + (2 * _EDGE + _APART) * d)
        first = setback + float(np.clip((leg - setback) / 3, _EDGE * d, _END * d))
        return Corners(setback, leg, (first, leg - _EDGE * d))

    @cached_property
    def strips(self) -> tuple[Strip, ...]:
        """Strips of all linear parts that a design needs."""
        return tuple(self._strips())

    @cached_property
    def plates(self) -> tuple[CornerPlate, ...]:
        """Plates of all corners that a design needs."""
        if not self.corners.bolts:
            return ()
        return tuple(
            CornerPlate(
                label,
                count,
                self.board,
                float(value[0]),
                self.corners.leg,
                self.corners.bolts,
                self.options.bolt_hole,
            )
            for kind, label, count, value, _ in self._needed()
            if kind.angular
        )

    @cached_property
    def cells(self) -> CellParts | None:
        """Arms and plates, of kits whose designs say what their cells are made of."""
        if all(pieces.design.hardware is not None for pieces in self.parts.designs):
            return CellParts(self.parts, self.scale, self.options)
        return None

    @cached_property
    def bars(self) -> tuple[Bar, ...]:
        """Plain bars of parts that are sets of bars, as many as the design with most of them needs;
        none where it is known how such parts are made (see `cells`)."""
        if self.cells is not None:
            return ()
        return tuple(
            Bar(f"{label} {name}", int(count), float(self.scale * length))
            for kind, label, _, value, number in self._needed()
            if not kind.angular and not has_joint(kind)
            for name, length, count in zip(
                kind.parameter_names, value, bars_needed(self.parts, kind.name)[number]
            )
            if count
        )

    @property
    def straight(self) -> tuple[tuple[str, int, float], ...]:
        """Label, pieces to make and length (mm) of every strip and plain bar."""
        return (
            *((strip.label, strip.count, strip.cut_length) for strip in self.strips),
            *((bar.label, bar.count, bar.length) for bar in self.bars),
        )

    @property
    def problems(self) -> tuple[str, ...]:
        """What stands in the way of cutting these parts, one sentence each; empty where nothing
        does."""
        return tuple(sentence for _, sentence in self.problems_by_part)

    @cached_property
    def problems_by_part(self) -> tuple[tuple[str | None, str], ...]:
        """The `problems`, each with the label of the part that has it, None for those of all."""
        return tuple(self._problems())

    def check(self) -> None:
        """Raise InputError with the first of the `problems`."""
        if self.problems:
            raise InputError(self.problems[0], field="options")

    @cached_property
    def _angles(self) -> np.ndarray:
        values = [v.ravel() for kind, _, _, v, _ in self._needed() if kind.angular]
        return np.abs(np.concatenate([np.empty(0), *values]))

    @cached_property
    def _crossings(self) -> dict[str, np.ndarray]:
        return sharpest_crossings(self.parts)

    @cached_property
    def _sides(self) -> np.ndarray:
        """Lengths (mm) of all sides that end at a corner."""
        values = [v[:2] for kind, _, _, v, _ in self._needed() if has_joint(kind)]
        return self.scale * np.concatenate([np.empty(0), *values])

    def _needed(self) -> Iterator[tuple[PartKind, str, int, np.ndarray, int]]:
        """Kind, label, pieces, parameters and number of every part that a design needs."""
        needed = self.parts.needed()
        for name, values in self.parts.kit.parts.items():
            for number, value in enumerate(values):
                if count := int(needed[name][number]):
                    yield part_kind(name), self.parts.labels[name][number], count, value, number

    def _strips(self) -> Iterator[Strip]:
        for kind, label, count, value, number in self._needed():
            if not has_joint(kind):
                continue
            l1, l2, slide = self.scale * np.array([*value, 0.0])[:3]
            yield Strip(
                label,
                count,
                self.board,
                (float(l1 + slide), float(l2 + slide)),
                float(slide),
                self.corners.setback,
                self.corners.bolts,
                self._slot(kind.name, number),
                self.options.joint_hole,
                self.options.bolt_hole,
            )

    def _slot(self, kind: str, number: int) -> float | None:
        """Width of a part's slot, None where its joint is a hole."""
        if not self.board.on_edge:
            return None
        angle = max(self._crossings[kind][number], _LEAST_CROSSING)
        width = self.board.thickness * (1 + np.cos(angle)) / np.sin(angle)
        return float(width + self.options.clearance)

    def _problems(self) -> Iterator[tuple[str | None, str]]:
        if self.cells is not None:
            yield from ((None, problem) for problem in self.cells.problems)
        if not self.strips:
            return
        corners, d, breadth = self.corners, self.options.bolt_hole, self.board.breadth
        if corners.bolts and self._angles.max() > _SHARPEST:
            yield (
                None,
                f"corners of {np.degrees(self._angles.max()):.0f} degrees are too sharp for strips "
                "joined by a plate",
            )
        if corners.bolts and 2 * _EDGE * d > breadth:
            yield None, f"bolt holes of {d:g} mm are too wide for strips {breadth:g} mm broad"
        for strip in self.strips:
            joint = strip.hole if strip.slot is None else strip.slot
            if strip.slot is None and 2 * _EDGE * joint > breadth:
                yield (
                    strip.label,
                    f"part {strip.label}: a joint hole of {joint:g} mm is too wide for strips "
                    f"{breadth:g} mm broad",
                )
            if corners.bolts:
                room = min(strip.sides) - strip.slide - joint / 2 - d / 2
                least = corners.bolts[-1] + (_EDGE - 0.5) * d
                if room < least:
                    yield (
                        strip.label,
                        f"part {strip.label}: its shorter side of {min(strip.sides):.1f} mm is "
                        f"too short for its holes: the plates' last bolt is "
                        f"{corners.bolts[-1]:.1f} mm from the corner, the joint takes "
                        f"{joint / 2:.1f} mm",
                    )
        if self.board.on_edge:
            for kind, label, _, _, number in self._needed():
                angle = self._crossings[kind.name][number] if has_joint(kind) else np.inf
                if angle < _LEAST_CROSSING:
                    yield (
                        label,
                        f"part {label} crosses another at {np.degrees(angle):.0f} degrees: too "
                        "sharp for a slot",
                    )


def setback_of(breadth: float, angle: float) -> float:
    """By how much strips so broad are sawn off before corners of an angle (rad); mm."""
    return breadth / 2 * float(np.tan(min(angle, _SHARPEST) / 2))


def least_side(breadth: float, angle: float, joint: float, options: CutOptions) -> float:
    """The shortest side, from joint to corner point, that has room for all holes; mm.

    breadth : of the strips
    angle : of the sharpest corner, rad
    joint : diameter of the joint's hole, or width of its slot
    """
    if not options.corners:
        return joint / 2
    room = (2 * _EDGE + _APART) * options.bolt_hole
    return setback_of(breadth, angle) + room + joint / 2
