"""Cut sheets: all pieces of a kit laid out on boards, at true scale in millimetres.

Pieces are packed by rectpack (rectangles about them, the grain's direction kept: nothing is
turned).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..wording import counted
from .blanks import Blanks
from .options import NOTE_ROOM, CutOptions
from .shapes import NOTES, Polyline, Shape, Template, Text, rectangle
from .sources import on_sheets, sources, too_large

_NOTE_HEIGHT = 6.0  # mm
_SCALE_BAR = 100.0  # mm, to check a print with
_DIGITS = 6  # of a mm: sizes are packed as whole numbers of these


@dataclass(frozen=True)
class Sheet:
    """One board: its size in mm, its shapes from the lower left corner, and how often each part
    lies on it.

    title, thickness : what it says below its pieces
    """

    size: tuple[float, float]
    shapes: tuple[Shape, ...]
    labels: dict[str, int]
    title: str = ""
    thickness: float = 0.0


def cut_sheets(blanks: Blanks, *, force: bool = False, warning: str = "") -> list[Sheet]:
    """All pieces that the kit's neediest designs use, on as many sheets as they take; those of one
    thickness together. Straight pieces that only bars hold are left out (see `sources`); where
    either will do, the first sheets hold these alone.

    force : leave out, too, what no sheet holds
    warning : stands on every sheet, below its pieces

    Raises InputError where a piece is larger than a sheet; see also `templates`.
    """
    wanted = _wanted(blanks, force)
    straight = {label for label, _, _ in blanks.straight} if sources(blanks).either else set()
    copies = [t.count for t in wanted]
    return lay_out(wanted, copies, "cut sheet", blanks.options, warning, straight)


def template_sheets(blanks: Blanks, *, force: bool = False, warning: str = "") -> list[Sheet]:
    """One piece of every part, with its dimensions: templates to check with, or to copy by hand.

    force, warning : as of `cut_sheets`
    """
    wanted = _wanted(blanks, force)
    captioned = [
        Template(t.label, t.name, t.count, (*t.shapes, _caption(t)), t.thickness) for t in wanted
    ]
    return lay_out(captioned, [1] * len(wanted), "templates", blanks.options, warning)


def _wanted(blanks: Blanks, force: bool) -> list[Template]:
    """What sheets are laid out with."""
    wanted = on_sheets(blanks)
    left_out = {piece.label for piece in too_large(wanted, blanks.options)} if force else set()
    return [piece for piece in wanted if piece.label not in left_out]


def lay_out(
    wanted: Sequence[Template],
    copies: Sequence[int],
    title: str,
    options: CutOptions,
    warning: str = "",
    apart: Collection[str] = (),
) -> list[Sheet]:
    """Pieces on sheets, `copies` of each template.

    title : what sheets are called, by numbers; warning : stands below their pieces
    apart : labels of pieces that have sheets of their own, the first ones

    Raises InputError where a piece is larger than a sheet.
    """
    width, height = options.room
    for template in too_large(wanted, options):
        size = template.size
        raise InputError(
            f"part {template.label} ({size[0]:.0f} x {size[1]:.0f} mm) is larger than a "
            f"sheet's {width:.0f} x {height:.0f} mm",
            field="options.sheet",
            value=options.sheet,
        )
    found = []
    groups = [(template.label not in apart, -template.thickness) for template in wanted]
    for group in sorted(set(groups)):
        numbers, thickness = [k for k, own in enumerate(groups) if own == group], -group[1]
        pieces = [wanted[k] for k in numbers for _ in range(copies[k])]
        found += [(thickness, on_it) for on_it in _packed(pieces, width, height, options.apart)]
    return [
        _sheet(on_it, f"{title} {number} of {len(found)}", thickness, options, warning)
        for number, (thickness, on_it) in enumerate(found, 1)
    ]


def _packed(
    pieces: Sequence[Template], width: float, height: float, apart: float
) -> list[list[tuple[Template, float, float]]]:
    """By sheet: the pieces and their places (x, y). Rectangles grow by the distance between them,
    and so does the sheet."""
    import rectpack

    grid = 10.0**_DIGITS

    def whole(value: float) -> int:
        return int(np.ceil(value * grid - 1e-3))

    packer = rectpack.newPacker(rotation=False, sort_algo=rectpack.SORT_LSIDE)
    for k, piece in enumerate(pieces):
        packer.add_rect(*(whole(side + apart) for side in piece.size), rid=k)
    packer.add_bin(whole(width + apart) + 1, whole(height + apart) + 1, count=float("inf"))
    packer.pack()
    sheets: list[list[tuple[Template, float, float]]] = []
    for sheet, x, y, _, _, k in sorted(packer.rect_list(), key=lambda r: (r[0], r[2], r[1])):
        while len(sheets) <= sheet:
            sheets.append([])
        sheets[sheet].append((pieces[k], x / grid, y / grid))
    return sheets


def _sheet(
    pieces: Sequence[tuple[Template, float, float]],
    title: str,
    thickness: float,
    options: CutOptions,
    warning: str,
) -> Sheet:
    width, height = options.sheet
    shapes: list[Shape] = [rectangle(0.0, 0.0, width, height, NOTES)]
    labels: dict[str, int] = {}
    corner = np.array([options.margin, options.margin + NOTE_ROOM])
    for template, x, y in pieces:
        by = corner + [x, y] - template.box[0]
        shapes += [shape.moved(by) for shape in template.shapes]
        labels[template.label] = labels.get(template.label, 0) + 1
    note = f"{warning}: {title}" if warning else title
    note += f", material {thickness:g} mm thick, all lengths in mm; this line is "
    note += f"{_SCALE_BAR:g} mm long:"
    room = (width - 2 * options.margin) / Text(np.zeros(2), 1.0, note).box[1, 0] / 2
    size = min(_NOTE_HEIGHT, 2 * room)
    x, y = options.margin, options.margin
    shapes.append(Text(np.array([x, y + 2.5 * size]), size, note, NOTES, "left"))
    bar = min(_SCALE_BAR, width - 2 * options.margin)
    for ends in ([[0, 0], [bar, 0]], [[0, -2], [0, 2]], [[bar, -2], [bar, 2]]):
        shapes.append(Polyline(np.array(ends, float) + [x, y], False, NOTES))
    return Sheet(options.sheet, tuple(shapes), labels, title, thickness)


def _caption(template: Template) -> Text:
    """The part's dimensions and how often it is needed, below it."""
    low, high = template.box
    text = f"{template.label}: {template.name}, {counted(template.count, 'piece')}"
    height = min(4.0, 1.2 * (high - low)[0] / len(text))
    return Text(np.array([(low[0] + high[0]) / 2, low[1] - height]), height, text, NOTES)
