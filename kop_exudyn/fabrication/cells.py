"""Parts of cells: arms between pins, plates with hinges, drawn as they are cut; in millimetres.

Pins run along the plates' edges, across the arms. So arms are drawn from the side, where pins are
holes, and are laid up of two boards half as thick as the arm is wide. The pin at the plate lies on
one face of the arm, that at the crossing on the same (a) or on the opposite one (b). At a crossing
two arms make one straight beam that turns about the pin: each has a disc there on one of its two
boards only, so that the discs of the two lie side by side, and two more pins through both keep the
beam straight. For that all arms are drawn with the crossing's pin on the same face, and laid up
alike, board 2 on board 1: the two arms of a beam come from opposite sides, with the pin's face in
common, so that the one's lower board is on the side of the other's upper one. A plate is a triangle
with a notch at every hinge, in which the arm's lug turns, and beside it an *ear* with the pin,
whose tab sits in the plate.

All sizes follow from the thickness t of plates and arms: pins of t / 2 (or the joint
holes asked for, where these are smaller), lugs and ears of 3 t / 2, discs of 2 t, locking pins of
t / 4.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely import affinity

from ..kit.kinds import part_kind
from ..structures.hardware import CellHardware
from .options import CutOptions, tenths
from .pieces import PartsList, Piece
from .shapes import Hole, Polyline, Shape, Template, Text

_LUG = 0.75  # of the thickness: radius of lugs and ears
_DISC = 1.0  # of the thickness: radius of the discs at crossings
_LOCK = (0.65, 0.25)  # of the thickness: how far locking pins are from the axis, and their diameter
_TAB = (1.75, 3.0)  # of the thickness: where an ear's tab begins and ends, inwards from the edge
_WALL = 0.5  # of the thickness: what is left of a plate between two cuts at least
_CHORDS = 12  # of a quarter circle


def sorts_of_arms(piece: Piece, hardware: CellHardware) -> str:
    """The sorts of a cell's arms, as "a", "b" or, where they differ, "a b"; see `ArmPart`."""
    own = {arm.sort for arm in hardware.arms if arm.parameter in piece.parameters}
    return " ".join(sorted(own))


@dataclass(frozen=True)
class ArmPart:
    """Arms of one length and one sort: "a", both pins on one face, or "b", on opposite ones.

    label : as "C1 top a"
    by_design : arms of each design
    length : from pin to pin along the arm, mm
    offsets : of the pins at the plate and at the crossing from the arm's axis, mm, as boards are
        drawn
    """

    label: str
    by_design: tuple[int, ...]
    length: float
    offsets: tuple[float, float]

    @property
    def count(self) -> int:
        """Arms for the neediest design."""
        return max(self.by_design)


@dataclass(frozen=True)
class CellParts:
    """All arms, plates and ears of a kit of cells.

    parts : the kit and its pieces; scale : millimetres of the designs' unit
    """

    parts: PartsList
    scale: float
    options: CutOptions

    @cached_property
    def hardware(self) -> tuple[CellHardware, ...]:
        """By design."""
        found = [pieces.design.hardware for pieces in self.parts.designs]
        return tuple(each for each in found if each is not None)

    @property
    def thickness(self) -> float:
        return self.scale * self.hardware[0].thickness

    @property
    def width(self) -> float:
        return self.scale * self.hardware[0].width

    @property
    def pin(self) -> float:
        """Diameter of pins at plates and crossings."""
        return min(self.options.joint_hole, self.thickness / 2)

    @property
    def problems(self) -> tuple[str, ...]:
        """What stands in the way of making them."""
        sizes = {
            tuple(round(self.scale * v, 4) for v in (h.edge, h.thickness, h.width, h.arm_position))
            for h in self.hardware
        }
        if len(sizes) > 1:
            return ("designs with plates or arms of different sizes share no cells",)
        h, t, c = self.hardware[0], self.thickness, self.options.clearance
        least = abs(self.scale * h.arm_position) - self.width / 2 - t - 2 * c
        room = self.scale * h.edge / 2 - _TAB[1] * t / np.sqrt(3)
        found = []
        if (
            least < -room
            or abs(self.scale * h.arm_position) + self.width / 2 > self.scale * h.edge / 2
        ):
            found.append(
                f"arms {self.width:g} mm wide have no room at plate edges of "
                f"{self.scale * h.edge:.1f} mm"
            )
        else:
            found += self._plate_problems()
        short = [
            arm for arm in self.arms if arm.length < (_DISC + _LUG) * t + self.options.clearance
        ]
        return (
            *found,
            *(
                f"part {arm.label}: {arm.length:.1f} mm are too short for its lug and disc"
                for arm in short
            ),
        )

    @cached_property
    def arms(self) -> tuple[ArmPart, ...]:
        """Arms by part, length and sort."""
        found = []
        for sort in sorted(set().union(*self.counts)):
            kind, part, name, letter = sort
            label = f"{self.parts.labels[kind][part]} {name} {letter}"
            column = self._columns(kind).index(name)
            length = self.scale * float(self.parts.kit.parts[kind][part, column])
            side = self.thickness / 2
            by_design = tuple(counts[sort] for counts in self.counts)
            found.append(
                ArmPart(label, by_design, length, (side if letter == "b" else -side, -side))
            )
        return tuple(found)

    @cached_property
    def counts(self) -> tuple[Counter[tuple], ...]:
        """By design: (kind, part, name of the length, "a" or "b") -> arms."""
        found = []
        for pieces, hardware in zip(self.parts.designs, self.hardware):
            counts: Counter[tuple] = Counter()
            for arm in hardware.arms:
                piece: Piece = pieces.by_parameter[arm.parameter]
                column = piece.columns[piece.parameters.index(arm.parameter)]
                name = self._columns(piece.kind)[column]
                counts[piece.kind, piece.part, name, arm.sort] += 1
            found.append(counts)
        return tuple(found)

    @property
    def plates(self) -> int:
        return max(h.plates for h in self.hardware)

    @property
    def hinges(self) -> int:
        """Arms of the neediest design: each has a hinge at a plate."""
        return max(len(h.arms) for h in self.hardware)

    @staticmethod
    def _columns(kind: str) -> tuple[str, ...]:
        return part_kind(kind).parameter_names

    def templates(self) -> list[Template]:
        """What is cut: the plate, the ear, and two boards of every arm."""
        found = [self._plate(), self._ear()]
        for arm in self.arms:
            found += [self._board(arm, with_disc) for with_disc in (True, False)]
        return found

    def _board(self, arm: ArmPart, with_disc: bool) -> Template:
        """One of an arm's two boards: x along the arm from the plate's pin, y across it."""
        t, c, length = self.thickness, self.options.clearance, arm.length
        at_plate, at_crossing = (np.array([x, y]) for x, y in zip((0.0, length), arm.offsets))
        end = length if with_disc else max(length - _DISC * t - c, t)  # see `problems`
        shape = shapely.union_all([
            shapely.box(0.0, -t / 2, end, t / 2),
            _round(at_plate, _LUG * t),
            *([_round(at_crossing, _DISC * t)] if with_disc else []),
        ])  # fmt: skip
        shapes: list[Shape] = [_outline(shape), Hole(at_plate, self.pin)]
        if with_disc:
            reach, lock = (share * t for share in _LOCK)
            shapes.append(Hole(at_crossing, self.pin))
            shapes += [Hole(at_crossing + [s * reach, 0.0], lock) for s in (-1, 1)]
        number = 1 if with_disc else 2
        height = min(0.6 * t, 1.2 * end / len(arm.label))
        label = f"{arm.label}{number}"
        shapes.append(Text(np.array([length / 2, 0.0]), height, label))
        name = f"{tenths(length)} from pin to pin"
        board = round(self.width / 2, 6)
        return Template(label, name, arm.count, tuple(shapes), board, arm.by_design)

    def _plate(self) -> Template:
        """A plate, seen from outside: a triangle, on each edge a notch for arm and ear, and the
        slot of the ear's tab."""
        t, edge = self.thickness, self.scale * self.hardware[0].edge
        inradius = edge / (2 * np.sqrt(3))
        shape, slots = self._plate_cuts
        shapes: list[Shape] = [_outline(shape), *map(_outline, slots)]
        shapes.append(Text(np.zeros(2), min(0.3 * inradius, 5.0), "P"))
        name = f"edge {tenths(edge)}, hinge pins along the edges at the inner face"
        by_design = tuple(h.plates for h in self.hardware)
        return Template("P", name, self.plates, tuple(shapes), t, by_design)

    @cached_property
    def _plate_cuts(self) -> tuple[shapely.Geometry, list[shapely.Geometry]]:
        """A plate's outline, and the slots in it. Tips at its corners that would hang on less than
        the least wall are cut off."""
        h, t, c = self.hardware[0], self.thickness, self.options.clearance
        edge, at, ear = self.scale * h.edge, self.scale * h.arm_position, self._ear_at()
        inradius = edge / (2 * np.sqrt(3))
        sides = [at - self.width / 2 - c, at + self.width / 2 + c, ear - t / 2 - c, ear + t / 2 + c]
        notch = shapely.box(min(sides), -inradius - 1.0, max(sides), -inradius + _LUG * t + c)
        slot = shapely.box(
            ear - t / 2 - c / 2,
            -inradius + _TAB[0] * t - c / 2,
            ear + t / 2 + c / 2,
            -inradius + _TAB[1] * t + c / 2,
        )
        notches, slots = (
            [affinity.rotate(cut, 120 * k, origin=(0, 0)) for k in range(3)]
            for cut in (notch, slot)
        )
        triangle = shapely.Polygon(
            [[-edge / 2, -inradius], [edge / 2, -inradius], [0.0, 2 * inradius]]
        )
        thin = _WALL * t / 2
        whole = _largest(triangle - shapely.union_all(notches), triangle)
        core = _largest(whole.buffer(-thin, join_style="mitre"), whole)
        shape = _largest(core.buffer(thin, join_style="mitre") & whole, whole)
        return shape, slots

    def _plate_problems(self) -> list[str]:
        """What is too thin in a plate to hold its ears."""
        shape, slots = self._plate_cuts
        t, c = self.thickness, self.options.clearance
        if not all(shape.contains(slot) for slot in slots):
            wall = 0.0
        else:
            wall = min(shape.exterior.distance(slot) for slot in slots)
            wall = min([wall, *(a.distance(b) for a, b in zip(slots, slots[1:] + slots[:1]))])
        if wall >= _WALL * t:
            return []
        return [
            f"plates of {tenths(self.scale * self.hardware[0].edge)} mm have walls of only "
            f"{wall:.2g} mm beside the ears' slots, at a clearance of {c:g} mm: at least "
            f"{tenths(_WALL * t)} mm, half of their thickness, hold a tab"
        ]

    def _ear_at(self) -> float:
        """Place of an ear's middle along a plate's edge: beside the arm, on the edge's middle's
        side. The plate is drawn with an edge below, where counter-clockwise is to the right."""
        at, c = self.scale * self.hardware[0].arm_position, self.options.clearance
        step = self.width / 2 + c + self.thickness / 2
        return at - step if at > 0 else at + step

    def _ear(self) -> Template:
        """An ear from the side: the pin in (0, 0), the plate above y = 0 and left of x = 0."""
        t = self.thickness
        shape = shapely.union_all([
            _round(np.zeros(2), _LUG * t),
            shapely.box(-(_TAB[1] + 0.25) * t, -_LUG * t, 0.0, 0.0),
            shapely.box(-_TAB[1] * t, 0.0, -_TAB[0] * t, t),
        ])  # fmt: skip
        shapes: tuple[Shape, ...] = (
            _outline(shape),
            Hole(np.zeros(2), self.pin),
            Text(np.array([-1.6 * t, -0.38 * t]), 0.45 * t, "E"),
        )
        by_design = tuple(len(h.arms) for h in self.hardware)
        return Template("E", "hinge beside an arm", self.hinges, shapes, t, by_design)


def _largest(shape: shapely.Geometry, otherwise: shapely.Polygon) -> shapely.Polygon:
    """Its largest part; another shape where nothing is left."""
    parts = [p for p in shapely.get_parts(shape) if isinstance(p, shapely.Polygon) and p.area]
    return max(parts, key=shapely.area, default=otherwise)


def _round(centre: np.ndarray, radius: float) -> shapely.Polygon:
    return shapely.Point(centre).buffer(radius, quad_segs=_CHORDS)


def _outline(shape: shapely.Geometry) -> Polyline:
    return Polyline(np.array(shape.exterior.coords[:-1]))
