"""Shapes of parts: strips with their joint, corner plates that hold two strips at an angle, plain
bars.

A strip is cut from a board as thick as the rods' thin side. Where the joint's axis passes through
the board the joint is a hole; where it lies in the board (lamellas on edge) it is a slot to the
middle, into which the crossing lamella's slot fits. Strips end at corners: they are set back there
by as much as the sharpest corner of the kit needs, so that any two strips fit at any corner, and a
plate on their sides joins them, bolted twice to each.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..kit.kinds import part_kind
from .cutlist import has_joint, millimetres
from .pieces import PartsList
from .placement import PlacedPieces, bars_needed
from .shapes import ENGRAVE, Hole, Polyline, Shape, Text, box_of, rectangle

_LEG = 1.5  # of the breadth: how far a corner plate reaches along a strip
_LEG_SHARE = 0.5  # at most, of the shortest side
_EDGE = 1.5  # hole diameters that a hole keeps from an edge


@dataclass(frozen=True)
class CutOptions:
    """Sizes in mm.

    sheet : width and height of a sheet
    gap : between pieces; margin : to the sheet's edge
    joint_hole, bolt_hole : diameters
    clearance : by which slots are wider than the board is thick
    corners : whether strips are prepared for corner plates
    """

    sheet: tuple[float, float] = (1000.0, 600.0)
    gap: float = 5.0
    margin: float = 15.0
    joint_hole: float = 4.0
    bolt_hole: float = 3.0
    clearance: float = 0.2
    corners: bool = True

    def __post_init__(self) -> None:
        for name in ("gap", "margin", "joint_hole", "bolt_hole", "clearance"):
            if not 0 <= getattr(self, name) < np.inf:
                raise InputError(
                    "must not be negative", field=f"options.{name}", value=getattr(self, name)
                )
        if not all(0 < side < np.inf for side in self.sheet):
            raise InputError(
                "a sheet has a positive width and height", field="options.sheet", value=self.sheet
            )


@dataclass(frozen=True)
class Board:
    """What rods are cut from: breadth and thickness in mm; on edge: the joints' axis lies in the
    board."""

    breadth: float
    thickness: float
    on_edge: bool


@dataclass(frozen=True)
class Template:
    """What is cut of one part.

    label, name : the part's label; a line about it
    count : pieces to cut for the whole kit
    shapes : in mm, anywhere
    thickness : of the board, mm
    """

    label: str
    name: str
    count: int
    shapes: tuple[Shape, ...]
    thickness: float

    @property
    def box(self) -> np.ndarray:
        """(2, 2) lowest and highest x, y."""
        return box_of(self.shapes)


def templates(parts: PartsList, unit: str, options: CutOptions = CutOptions()) -> list[Template]:
    """The shapes of all parts that a design needs, kind by kind.

    unit : the designs' unit of length Raises InputError where the designs' rods have different
    sections, or the corners are too sharp for strips this broad.
    """
    scale, needed = millimetres(unit), parts.needed()
    board = _board(parts, scale)
    corner = _CornerPlates.of(parts, scale, board, options)
    found = []
    for kind, values in parts.kit.parts.items():
        for number, value in enumerate(values):
            label, count = parts.labels[kind][number], int(needed[kind][number])
            if not count:
                continue
            if part_kind(kind).angular:
                found += corner.plates(label, count, value)
            elif has_joint(part_kind(kind)):
                found.append(_strip(label, count, scale * value, board, corner, options))
            else:
                found += _bars(parts, kind, number, scale * value, board)
    return found


def _board(parts: PartsList, scale: float) -> Board:
    """The one board that all rods made of parts are cut from."""
    found: dict[tuple[float, float, bool], str] = {}
    for design in parts.designs:
        placed = PlacedPieces.of(design)
        for chain, piece in zip(placed.scene.chains, placed.chain_pieces):
            if piece is None:
                continue
            if chain.section is None:
                raise InputError(
                    "its rods have no cross-section to cut",
                    source=design.design.name,
                    field="section",
                )
            y, z = scale * np.ptp(chain.section.outline, axis=0)
            found.setdefault(
                (round(float(max(y, z)), 6), round(float(min(y, z)), 6), bool(z > y)),
                design.design.name,
            )
    if len(found) > 1:
        sizes = "; ".join(f"{name}: {b:g} x {t:g} mm" for (b, t, _), name in found.items())
        raise InputError(
            f"designs with different rods need cut sheets of their own ({sizes})", field="section"
        )
    return Board(*next(iter(found)))


def _strip(
    label: str,
    count: int,
    lengths: np.ndarray,
    board: Board,
    corner: _CornerPlates,
    options: CutOptions,
) -> Template:
    """A strip, x = 0 at the end of side 1; its axis is marked at its true length, from corner to
    corner."""
    l1, l2, slit = (*lengths, 0.0)[:3]
    total, joint, half = l1 + l2 + 2 * slit, l1 + slit, board.breadth / 2
    shapes: list[Shape] = []
    left, right = corner.setback, total - corner.setback
    if board.on_edge:
        width = (board.thickness + options.clearance) / 2
        outline = [
            [left, -half],
            [right, -half],
            [right, half],
            [joint + width, half],
            [joint + width, 0.0],
            [joint - width, 0.0],
            [joint - width, half],
            [left, half],
        ]
        shapes.append(Polyline(np.array(outline)))
    else:
        shapes += [
            rectangle(left, -half, right, half),
            Hole(np.array([joint, 0.0]), options.joint_hole),
        ]
    shapes += [
        Hole(np.array([x, 0.0]), options.bolt_hole) for at in corner.bolts for x in (at, total - at)
    ]
    shapes.append(Polyline(np.array([[0.0, 0.0], [total, 0.0]]), False, ENGRAVE))
    height = min(0.3 * board.breadth, 0.2 * l1)
    reach = corner.bolts[-1] if corner.bolts else corner.setback
    # the label below the axis at the joint, "1" on side 1 just beyond what a corner plate covers
    shapes += [
        Text(np.array([joint, -0.5 * half]), height, label),
        Text(np.array([reach + 0.6 * height, -0.5 * half]), 0.8 * height, "1"),
    ]
    name = f"l1 {l1:.2f}, l2 {l2:.2f}" + (f", slit {slit:.2f}" if slit else "")
    return Template(label, name, count, tuple(shapes), board.thickness)


def _bars(
    parts: PartsList, kind: str, number: int, lengths: np.ndarray, board: Board
) -> list[Template]:
    """One plain bar for each length of a part, in as many pieces as the design with most of them
    needs."""
    found, half = [], board.breadth / 2
    for name, length, count in zip(
        part_kind(kind).parameter_names, lengths, bars_needed(parts, kind)[number]
    ):
        label = f"{parts.labels[kind][number]} {name}"
        height = min(0.5 * board.breadth, 1.2 * length / len(label))
        shapes = (
            rectangle(0.0, -half, length, half),
            Text(np.array([length / 2, 0.0]), height, label),
        )
        found.append(Template(label, f"{length:.2f}", int(count), shapes, board.thickness))
    return [bar for bar in found if bar.count]


@dataclass(frozen=True)
class _CornerPlates:
    """How all strips meet at corners: set back, and bolted at these distances from the corner
    point."""

    board: Board
    hole: float
    leg: float = 0.0
    setback: float = 0.0
    bolts: tuple[float, ...] = ()

    @classmethod
    def of(cls, parts: PartsList, scale: float, board: Board, options: CutOptions) -> _CornerPlates:
        kinds: Mapping[str, np.ndarray] = parts.kit.parts
        angles = np.concatenate(
            [np.empty(0), *(np.abs(v).ravel() for k, v in kinds.items() if part_kind(k).angular)]
        )
        sides = np.concatenate(
            [np.empty(0), *(v[:, :2].ravel() for k, v in kinds.items() if not part_kind(k).angular)]
        )
        if not (options.corners and len(angles) and len(sides)):
            return cls(board, options.bolt_hole)
        shortest, sharpest, d = scale * float(sides.min()), float(angles.max()), options.bolt_hole
        leg = min(_LEG * board.breadth, _LEG_SHARE * shortest)
        setback = board.breadth / 2 * np.tan(min(sharpest, 3.0) / 2)
        first, last = setback + _EDGE * d, leg - _EDGE * d
        if last < first + 2 * d:
            raise InputError(
                f"corners of up to {np.degrees(sharpest):.0f} degrees leave no room for plates on "
                f"sides of "
                f"{shortest:.1f} mm and strips {board.breadth:g} mm broad: cut them without "
                f"corner plates",
                field="options.corners",
            )
        return cls(board, d, leg, setback, (first, last))

    def plates(self, label: str, count: int, value: np.ndarray) -> list[Template]:
        """The plate of one corner: its strips' axes meet in (0, 0), the second one turned by the
        angle."""
        if not self.bolts:
            return []
        angle, half, leg = float(value[0]), self.board.breadth / 2, self.leg
        along = np.array([[1.0, 0.0], [np.cos(angle), np.sin(angle)]])
        across = np.array([[0.0, 1.0], [-np.sin(angle), np.cos(angle)]])
        mitre = half / np.cos(angle / 2) * np.array([-np.sin(angle / 2), np.cos(angle / 2)])
        outline = [
            -leg * along[0] - half * across[0],
            -mitre,
            leg * along[1] - half * across[1],
            leg * along[1] + half * across[1],
            mitre,
            -leg * along[0] + half * across[0],
        ]
        axis = np.array([-leg * along[0], [0.0, 0.0], leg * along[1]])
        holes = [
            Hole(side * at * direction, self.hole)
            for side, direction in zip((-1, 1), along)
            for at in self.bolts
        ]
        height = min(0.3 * self.board.breadth, 0.3 * leg)
        text = Text(np.array([0.0, -0.5 * half]), height, label)
        shapes: tuple[Shape, ...] = (
            Polyline(np.array(outline)),
            *holes,
            Polyline(axis, False, ENGRAVE),
            text,
        )
        return [
            Template(label, f"{np.degrees(angle):.2f} deg", count, shapes, self.board.thickness)
        ]
