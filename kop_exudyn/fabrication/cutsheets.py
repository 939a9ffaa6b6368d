"""Cut sheets: all pieces of a kit laid out on boards, at true scale in millimetres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from .pieces import PartsList
from .shapes import NOTES, Polyline, Shape, Text, rectangle
from .templates import CutOptions, Template, templates

_NOTE_HEIGHT = 6.0  # mm
_NOTE_ROOM = 14.0  # mm at the sheet's lower edge, for the notes
_SCALE_BAR = 100.0  # mm, to check a print with


@dataclass(frozen=True)
class Sheet:
    """One board: its size in mm, its shapes from the lower left corner, and how often each part
    lies on it."""

    size: tuple[float, float]
    shapes: tuple[Shape, ...]
    labels: dict[str, int]


def cut_sheets(parts: PartsList, unit: str, options: CutOptions = CutOptions()) -> list[Sheet]:
    """All pieces that the kit's neediest designs use, on as many sheets as they take.

    unit : the designs' unit of length
    Raises InputError where a piece is larger than a sheet; see also `templates`.
    """
    wanted = templates(parts, unit, options)
    return lay_out(wanted, [t.count for t in wanted], "cut sheet", options)


def template_sheets(parts: PartsList, unit: str, options: CutOptions = CutOptions()) -> list[Sheet]:
    """One piece of every part, with its dimensions: templates to check with, or to copy by hand."""
    wanted = templates(parts, unit, options)
    captioned = [
        Template(t.label, t.name, t.count, (*t.shapes, _caption(t)), t.thickness) for t in wanted
    ]
    return lay_out(captioned, [1] * len(wanted), "templates", options)


def lay_out(
    wanted: Sequence[Template], copies: Sequence[int], title: str, options: CutOptions
) -> list[Sheet]:
    """Rows of pieces, the tallest first and the longest first within them, each in the first row
    with room for it."""
    width, height = (
        options.sheet[0] - 2 * options.margin,
        options.sheet[1] - 2 * options.margin - _NOTE_ROOM,
    )
    order = sorted(range(len(wanted)), key=lambda k: tuple(-_size(wanted[k])[::-1]))
    rows: list[_Row] = []
    for k in order:
        size = _size(wanted[k])
        if size[0] > width or size[1] > height:
            raise InputError(
                f"part {wanted[k].label} ({size[0]:.0f} x {size[1]:.0f} mm) is larger than a "
                f"sheet's "
                f"{width:.0f} x {height:.0f} mm",
                field="options.sheet",
                value=options.sheet,
            )
        for _ in range(copies[k]):
            row = next(
                (r for r in rows if r.length + size[0] <= width and r.height >= size[1]), None
            )
            if row is None:
                row = _Row(size[1])
                rows.append(row)
            row.add(wanted[k], size[0], options.gap)
    sheets = _stack(rows, height, options.gap)
    return [
        _sheet(on_it, f"{title} {number} of {len(sheets)}", wanted, options)
        for number, on_it in enumerate(sheets, 1)
    ]


class _Row:
    """Pieces beside each other: (template, x)."""

    def __init__(self, height: float):
        self.height, self.length = height, 0.0
        self.pieces: list[tuple[Template, float]] = []

    def add(self, template: Template, width: float, gap: float) -> None:
        self.pieces.append((template, self.length))
        self.length += width + gap


def _size(template: Template) -> np.ndarray:
    return np.ptp(template.box, axis=0)


def _stack(rows: Sequence[_Row], height: float, gap: float) -> list[list[tuple[_Row, float]]]:
    """Rows over each other, each with its height on its sheet."""
    sheets: list[list[tuple[_Row, float]]] = []
    y = np.inf
    for row in rows:
        if y + row.height > height:
            sheets.append([])
            y = 0.0
        sheets[-1].append((row, y))
        y += row.height + gap
    return sheets


def _sheet(
    rows: Sequence[tuple[_Row, float]], title: str, wanted: Sequence[Template], options: CutOptions
) -> Sheet:
    width, height = options.sheet
    shapes: list[Shape] = [rectangle(0.0, 0.0, width, height, NOTES)]
    labels: dict[str, int] = {}
    for row, y in rows:
        for template, x in row.pieces:
            by = np.array([options.margin + x, options.margin + _NOTE_ROOM + y]) - template.box[0]
            shapes += [shape.moved(by) for shape in template.shapes]
            labels[template.label] = labels.get(template.label, 0) + 1
    thickness = ", ".join(f"{t:g}" for t in sorted({template.thickness for template in wanted}))
    note = (
        f"{title}, material thickness {thickness} mm, all lengths in mm; "
        f"this line is {_SCALE_BAR:g} mm long:"
    )
    y = options.margin
    start = options.margin + Text(np.zeros(2), _NOTE_HEIGHT, note).box[1, 0] + _NOTE_HEIGHT
    shapes.append(Text(np.array([options.margin, y]), _NOTE_HEIGHT, note, NOTES, "left"))
    shapes.append(Polyline(np.array([[start, y], [start + _SCALE_BAR, y]]), False, NOTES))
    return Sheet(options.sheet, tuple(shapes), labels)


def _caption(template: Template) -> Text:
    """The part's dimensions and how often it is needed, below it."""
    low, high = template.box
    text = f"{template.label}: {template.name}, {template.count} pieces"
    height = min(4.0, 1.2 * (high - low)[0] / len(text))
    return Text(np.array([(low[0] + high[0]) / 2, low[1] - height]), height, text, NOTES)
