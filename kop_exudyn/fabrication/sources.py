"""What straight pieces are cut from: sheets, bars, or either.

All straight pieces of a kit are equally broad, so that the longest decides: where it fits a sheet,
all may be cut from sheets, where it fits a bar, all may be sawn from bars. A workshop needs one of
the two. Corner plates and the parts of cells always come from sheets.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..kit.kinds import part_kind
from .blanks import Blanks
from .options import CutOptions
from .shapes import Template
from .templates import templates

NO_PLATES = (
    "Corners are without plates: strips reach to the corner points, and are joined in another "
    "way, at the angle that the cut list has for the corner."
)
EITHER = (
    "Straight pieces may be sawn from bars or cut from sheets: both plans are there, choose one. "
    "Whoever chooses bars needs those sheets only that hold no straight pieces: the last ones."
)
_ROUND = 10  # mm, that sizes of sheets and bars are rounded up to


@dataclass(frozen=True)
class Sources:
    """Where the straight pieces of a kit may come from.

    sheets, bars : whether all of them fit a sheet, and a bar that there is
    note : for readers of the files, where sheets or bars won't do and the other ones will; or empty
    problem : why neither will do, and what would; or empty
    either : whether there are straight pieces and both will do: files then have both, for a
        workshop to choose
    """

    sheets: bool = True
    bars: bool = True
    note: str = ""
    problem: str = ""
    either: bool = False


def sources(blanks: Blanks) -> Sources:
    """What the straight pieces of a kit can be cut from, with the workshop's sheets and bars."""
    options, lengths = blanks.options, {label: length for label, _, length in blanks.straight}
    if not lengths:
        return Sources()
    longest = max(lengths, key=lambda label: lengths[label])
    pieces = [one for one in templates(blanks) if one.label in lengths]
    bar = max(options.stock, default=0.0)
    sheets, bars = not too_large(pieces, options), 0 < lengths[longest] <= bar
    if not sheets and not bars:
        width, height = next(one.size for one in pieces if one.label == longest)
        text = f"part {longest} of {width:.0f} x {height:.0f} mm is larger than {_room(options)}"
        remedy = sheet_for(pieces, options)
        if options.stock:
            text += f" and longer than the longest bar of {bar:g} mm"
            remedy += f" or --stock {_rounded_up(lengths[longest])}"
        return Sources(False, False, problem=f"{text}; {remedy} would do")
    note = ""
    if not sheets:
        note = (
            f"Straight pieces are sawn from bars: part {longest} of {lengths[longest]:.0f} mm is "
            f"larger than {_room(options)}. Sheets hold the other parts only; "
            f"{sheet_for(pieces, options)} would hold all."
        )
    elif options.stock and not bars:
        note = (
            f"Straight pieces are cut from sheets: part {longest} of {lengths[longest]:.0f} mm is "
            f"longer than the longest bar of {bar:g} mm."
        )
    return Sources(sheets, bars, note, either=sheets and bars and bool(options.stock))


def advice(blanks: Blanks) -> list[str]:
    """What a workshop has to know of a kit's straight pieces and corners before it begins, in
    sentences."""
    found = sources(blanks)
    angular = any(part_kind(name).angular for name in blanks.parts.kit.parts)
    said = [found.note] if found.note else []
    said += [EITHER] if found.either else []
    return said + ([NO_PLATES] if angular and not blanks.options.corners else [])


def on_sheets(blanks: Blanks) -> list[Template]:
    """What is cut from sheets: all parts, but for straight pieces where only bars hold them.

    Raises InputError where the designs' rods have different sections.
    """
    found = sources(blanks)
    straight = () if found.sheets or not found.bars else blanks.straight
    sawn = {label for label, _, _ in straight}
    return [one for one in templates(blanks) if one.label not in sawn]


def too_large(pieces: Sequence[Template], options: CutOptions) -> list[Template]:
    """Those that no sheet holds; nothing is turned, because of the grain."""
    return [piece for piece in pieces if (piece.size > options.room).any()]


def sheet_for(pieces: Sequence[Template], options: CutOptions) -> str:
    """The option that names a sheet with room for these pieces, at least as large as it is now."""
    largest = np.max([piece.size for piece in pieces], axis=0)
    needed = np.maximum(largest + np.subtract(options.sheet, options.room), options.sheet)
    width, height = (_rounded_up(side) for side in needed.tolist())
    return f"--sheet {width},{height}"


def _rounded_up(size: float) -> int:
    return math.ceil(size / _ROUND) * _ROUND


def _room(options: CutOptions) -> str:
    width, height = options.room
    return f"a sheet's {width:.0f} x {height:.0f} mm"
