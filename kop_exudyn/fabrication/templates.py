"""Shapes of parts as they are cut, drawn from their `blanks`; in millimetres."""

from __future__ import annotations

import numpy as np

from .blanks import Blanks, CornerPlate, Strip
from .options import tenths
from .shapes import ENGRAVE, Hole, Polyline, Shape, Template, Text, rectangle

_ARC = 12  # chords of half a circle at a slide's end


def templates(blanks: Blanks) -> list[Template]:
    """The shapes of all parts that a design needs: plates, strips, then plain bars.

    Raises InputError where the designs' rods have different sections.
    """
    bars = [bar_template(bar.label, bar.length, bar.count, blanks) for bar in blanks.bars]
    cells = [] if blanks.cells is None else blanks.cells.templates()
    return [*map(plate_template, blanks.plates), *map(strip_template, blanks.strips), *bars, *cells]


def strip_template(strip: Strip) -> Template:
    """A strip, x = 0 at the sawn end of side 1; its axis is engraved."""
    half, length, joint = strip.board.breadth / 2, strip.cut_length, strip.hole_from_end
    shapes: list[Shape] = []
    if strip.slot is None:
        shapes += [rectangle(0.0, -half, length, half), Hole(np.array([joint, 0.0]), strip.hole)]
    else:
        width, floor = strip.slot / 2, half - strip.slot_depth
        shapes.append(
            Polyline(
                np.array(
                    [
                        [0.0, -half],
                        [length, -half],
                        [length, half],
                        [joint + width, half],
                        [joint + width, floor],
                        [joint - width, floor],
                        [joint - width, half],
                        [0.0, half],
                    ]
                )
            )
        )
    shapes += _bolt_holes(strip, joint)
    shapes.append(Polyline(np.array([[0.0, 0.0], [length, 0.0]]), False, ENGRAVE))
    # what is free below the joint's hole
    free = half - (0.0 if strip.hole is None else strip.hole / 2)
    height = min(0.3 * strip.board.breadth, 0.2 * strip.sides[0], 0.7 * free)
    # the label below the axis at the joint, "1" on side 1 just beyond what a corner plate covers
    reach = (max(strip.bolts) if strip.bolts else strip.setback) - strip.setback
    shapes += [
        Text(np.array([joint, 0.5 * free - half]), height, strip.label),
        Text(np.array([reach + 0.6 * height, -0.5 * half]), 0.8 * height, "1"),
    ]
    name = f"{tenths(length)} long, joint {tenths(joint)} from end 1"
    return Template(strip.label, name, strip.count, tuple(shapes), strip.board.thickness)


def _bolt_holes(strip: Strip, joint: float) -> list[Shape]:
    """The bolts' holes; of a strip that adapts, slots from there towards the joint, one where two
    would leave less than a hole's diameter between them."""
    if not strip.slide:
        return [Hole(np.array([x, 0.0]), strip.bolt_hole) for x in strip.bolt_stations]
    spans: list[list[float]] = []
    for x in strip.bolt_stations:
        start, end = sorted((x, x + (strip.slide if x < joint else -strip.slide)))
        same_side = spans and (spans[-1][1] < joint) == (end < joint)
        if same_side and start < spans[-1][1] + 2 * strip.bolt_hole:
            spans[-1][1] = max(spans[-1][1], end)
        else:
            spans.append([start, end])
    return [_long_hole(start, end, strip.bolt_hole) for start, end in spans]


def _long_hole(start: float, end: float, width: float) -> Polyline:
    """A hole that a bolt slides in between two places on the axis."""
    radius = width / 2
    turns = np.linspace(-np.pi / 2, np.pi / 2, _ARC + 1)
    right = np.stack([end + radius * np.cos(turns), radius * np.sin(turns)], axis=1)
    left = np.stack([start - radius * np.cos(turns), -radius * np.sin(turns)], axis=1)
    return Polyline(np.concatenate([right, left]))


def plate_template(plate: CornerPlate) -> Template:
    """A corner plate: its strips' axes meet in (0, 0), the second one turned by the angle."""
    angle, half, leg = plate.angle, plate.board.breadth / 2, plate.leg
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
        Hole(side * at * direction, plate.bolt_hole)
        for side, direction in zip((-1, 1), along)
        for at in plate.bolts
    ]
    height = min(0.3 * plate.board.breadth, 0.3 * leg)
    text = Text(np.array([0.0, -0.5 * half]), height, plate.label)
    shapes: tuple[Shape, ...] = (
        Polyline(np.array(outline)),
        *holes,
        Polyline(axis, False, ENGRAVE),
        text,
    )
    name = f"{np.degrees(angle):.2f} deg, legs {tenths(leg)}"
    return Template(plate.label, name, plate.count, shapes, plate.board.thickness)


def bar_template(label: str, length: float, count: int, blanks: Blanks) -> Template:
    """A plain bar."""
    half = blanks.board.breadth / 2
    height = min(blanks.board.breadth / 2, 1.2 * length / len(label))
    shapes = (rectangle(0.0, -half, length, half), Text(np.array([length / 2, 0.0]), height, label))
    return Template(label, f"{tenths(length)} long", count, shapes, blanks.board.thickness)
