"""The parts of a kit as small drawings at one scale, with what they measure and how many each
design needs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..drawing.colours import kit_colours
from ..errors import InputError
from ..fabrication.blanks import Blanks
from ..fabrication.limits import usual_options
from ..fabrication.pieces import PartsList, parts_list_of
from ..fabrication.shapes import CUT, Hole, Polyline, Shape, Template, box_of, rectangle
from ..fabrication.svg import shape_element
from ..fabrication.templates import templates
from ..kit.kinds import PartKind, has_joint, part_kind
from ..search.result import KitResult
from ..units import unit_of
from ..wording import counted

_WIDEST = 300.0  # pixels: of the largest drawing
_LEAST = 6.0  # pixels: what is thinner is drawn at a larger scale
_NEUTRAL = (0.72, 0.71, 0.69)  # of pieces that belong to no part, such as plates
_LEG = 1.0  # of an angle's legs, times the mean part


@dataclass(frozen=True)
class PartDrawing:
    """A line of the table of parts.

    label, about : its name, and what it measures
    svg : the drawing; width : of it in pixels
    counts : pieces that each design needs; empty where only the kit's total is known
    total : pieces to make for the kit
    """

    label: str
    about: str
    svg: str
    width: float
    counts: tuple[int, ...]
    total: int


def part_drawings(result: KitResult) -> tuple[list[PartDrawing], bool]:
    """All parts of a kit, as they are cut where the workshop's drawings can be made, otherwise as
    axes with joints; and whether they are drawn as they are cut."""
    parts = parts_list_of(result)
    try:
        if result.units is None:
            raise InputError("without units nothing can be cut", field="units", value=None)
        blanks = Blanks(parts, result.units.length, usual_options(result.designs))
        shapes = templates(blanks)
    except InputError:
        return list(_drawn(_axes(parts), parts)), False
    return list(_drawn(shapes, parts)), True


def part_rows(drawings: Sequence[PartDrawing], parts: PartsList) -> list[PartDrawing]:
    """A row for each part: the pieces that are made for one part, such as the boards of a cell's
    arms, become one row with the largest of them drawn; its counts are those of the part."""
    kinds = {
        label: (kind, k) for kind, labels in parts.labels.items() for k, label in enumerate(labels)
    }
    groups: dict[str, list[PartDrawing]] = {}
    for one in drawings:
        part = one.label.split(" ")[0]
        groups.setdefault(part if part in kinds else one.label, []).append(one)
    rows = []
    for label, pieces in groups.items():
        if len(pieces) == 1:
            rows += pieces
            continue
        kind, k = kinds[label]
        widest = max(pieces, key=lambda one: one.width)
        rows.append(
            PartDrawing(
                label,
                f"{counted(len(pieces), 'board')}, {_together([one.about for one in pieces])}",
                widest.svg,
                widest.width,
                tuple(int(n) for n in parts.counts[kind][:, k]),
                int(parts.needed()[kind][k]),
            )
        )
    return rows


def _together(texts: Sequence[str]) -> str:
    """ "32.0 and 33.5 from pin to pin" of several texts that differ in their first word."""
    different = list(dict.fromkeys(texts))
    ends = {text.partition(" ")[2] for text in different}
    if len(ends) > 1:
        return "; ".join(different)
    firsts = [text.partition(" ")[0] for text in different]
    return f"{' and '.join(firsts)} {ends.pop()}"


def _drawn(shapes: Iterable[Template], parts: PartsList) -> Iterable[PartDrawing]:
    shapes = list(shapes)
    colours = kit_colours(parts.kit.sizes)
    of_label = {
        label: (kind, k) for kind, labels in parts.labels.items() for k, label in enumerate(labels)
    }
    widest = max(float(template.size[0]) for template in shapes)
    for template in shapes:
        kind, k = of_label.get(template.label, ("", 0))
        # what is made for one part, such as a cell's arms, has its label before its own name
        of_part = of_label.get(template.label.split(" ")[0])
        colour = colours[of_part[0]][of_part[1]] if of_part else np.array(_NEUTRAL)
        scale = _WIDEST / widest if widest > 0 else 1.0
        width, height = template.size
        scale = max(scale, min(_WIDEST / width, _LEAST / height)) if height and width else scale
        counts = tuple(int(n) for n in parts.counts[kind][:, k]) if kind else template.by_design
        yield PartDrawing(
            template.label,
            template.name,
            _svg(template, colour, scale),
            scale * float(width),
            counts,
            int(parts.needed()[kind][k]) if kind else template.count,
        )


def _svg(template: Template, colour: np.ndarray, scale: float) -> str:
    """The outline filled, holes white, engravings left out."""
    cut = [s for s in template.shapes if getattr(s, "layer", CUT) == CUT]
    box = box_of(cut)
    low, (width, height) = box[0], np.ptp(box, axis=0)
    pad = 1.0 / scale
    fill = "#" + "".join(f"{round(255 * float(c)):02x}" for c in colour)
    lines = []
    for number, shape in enumerate(cut):
        hole = isinstance(shape, Hole) or (number > 0 and _within(shape, cut[0]))
        lines.append(
            f'<g fill="{"#ffffff" if hole else fill}" stroke="#222222" '
            f'stroke-width="{0.7 / scale:.4g}">'
            f"{shape_element(shape.moved(pad - low), height + 2 * pad, fill)}</g>"
        )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{scale * width + 2:.1f}" '
        f'height="{scale * height + 2:.1f}" '
        f'viewBox="0 0 {width + 2 * pad:.5g} {height + 2 * pad:.5g}">{"".join(lines)}</svg>'
    )


def _within(shape: Shape, outline: Shape) -> bool:
    inner, outer = shape.box, outline.box
    return bool((inner[0] >= outer[0]).all() and (inner[1] <= outer[1]).all())


def _axes(parts: PartsList) -> Iterable[Template]:
    """Parts of which no board is known: bars with their joints, angles, and bars beside each
    other."""
    lengths = [
        np.abs(values).ravel()
        for kind, values in parts.kit.parts.items()
        if not part_kind(kind).angular
    ]
    leg = _LEG * float(np.mean(np.concatenate(lengths))) if lengths else 1.0
    for name, values in parts.kit.parts.items():
        kind = part_kind(name)
        for k, row in enumerate(values):
            yield Template(
                parts.labels[name][k],
                _measures(kind, row, unit_of("length", parts.kit.units)),
                int(parts.needed()[name][k]),
                _axis_shapes(kind, row, leg),
                0.0,
            )


def _axis_shapes(kind: PartKind, row: np.ndarray, leg: float) -> tuple[Shape, ...]:
    half = 0.05 * leg
    if kind.angular:
        turn = float(row[0])
        middle = np.array([[-leg, 0.0], [0.0, 0.0], leg * np.array([np.cos(turn), np.sin(turn)])])
        normals = np.array(
            [[0.0, 1.0], [-np.sin(turn / 2), np.cos(turn / 2)], [-np.sin(turn), np.cos(turn)]]
        )
        normals[1] /= max(abs(np.cos(turn / 2)), 0.2)
        return (
            Polyline(np.concatenate([middle + half * normals, (middle - half * normals)[::-1]])),
        )
    if has_joint(kind):
        first, second = np.abs(row[:2])
        bar = rectangle(0.0, -half, float(first + second), half)
        return bar, Hole(np.array([first, 0.0]), half)
    return tuple(
        rectangle(0.0, -3.0 * half * j - half, float(abs(value)), -3.0 * half * j + half)
        for j, value in enumerate(row)
    )


def _measures(kind: PartKind, row: np.ndarray, unit: str) -> str:
    if kind.angular:
        return ", ".join(f"{np.degrees(v):.2f}°" for v in row)
    return ", ".join(f"{n} = {v:.4g}" for n, v in zip(kind.parameter_names, row)) + f" {unit}"
