"""Drawings of parts for the workshop: dimensioned strips and plates, sheets, and bars to saw."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..drawing.labels import text_extent
from ..drawing.style import FAINT, INK, QUIET
from ..wording import counted
from .blanks import Blanks, CornerPlate, Strip
from .cutsheets import Sheet
from .options import tenths
from .paper import Book, Page, fitting_scale
from .shapes import CUT, ENGRAVE, NOTES, Hole, Polyline, Shape, Template, Text
from .stock import Bar, StockPlan
from .templates import plate_template, strip_template

_COLOURS = {CUT: INK, ENGRAVE: QUIET, NOTES: FAINT}
_DIMENSION = 6.0  # points
_SHORT, _ROW = 5.5, 2.9  # points, and mm of a page, of what stands under short pieces
_ASIDE = 2  # of such texts that may stand beside their pieces' span, rather than in one more row
_STEP = 3.0  # mm between dimensions that stand side by side
_NUMBERS = 14.0  # mm of a page for the numbers of bars
_STRIPS_A_PAGE = 5  # at least, where the paper is high enough
_STRIP_ROOM = 34.0  # mm of a page below and above a strip: caption and dimensions
_STRIP_LEAST = 12.0  # mm of a page that a strip itself has at least


def strip_pages(book: Book, blanks: Blanks) -> None:
    """Every strip with its dimensions from the sawn end of side 1."""
    strips = blanks.strips
    if not strips:
        return
    longest = max(strip.cut_length for strip in strips)
    room = Page(book.paper, "").room
    down = max(1, min(_STRIPS_A_PAGE, int(room[1] // (_STRIP_ROOM + _STRIP_LEAST))))
    height = room[1] / down - _STRIP_ROOM
    size = np.array([longest, strips[0].board.breadth])
    scale = fitting_scale(size, np.array([room[0] - 10.0, height]))
    page, y = None, 0.0
    for strip in strips:
        height = strip.board.breadth / scale + _STRIP_ROOM
        if page is None or y - height < page.low[1]:
            page = book.page("Strips: dimensions from the sawn end of side 1", scale)
            y = page.high[1]
        y -= height
        _strip(page, strip, np.array([page.low[0] + 5.0, y + _STRIP_ROOM - 8.0]), scale)


def plate_pages(book: Book, blanks: Blanks) -> None:
    """Corner plates, at full size where the paper allows."""
    plates = [plate_template(plate) for plate in blanks.plates]
    if not plates:
        return
    room = Page(book.paper, "").room
    size = np.max([np.ptp(plate.box, axis=0) for plate in plates], axis=0)
    scale = fitting_scale(size, room - [10.0, 20.0])
    names = [f"{plate.label}: {plate.name}" for plate in plates]
    numbers = [counted(plate.count, "piece") for plate in plates]
    offsets = [f"second axis ends {_aside(plate)} mm off the first" for plate in blanks.plates]
    words = max(text_extent(text, 7.5, "bold")[0] for text in (*names, *offsets))
    cell = np.maximum(size / scale + [10.0, 20.0], [words + 6.0, 0.0])
    across, down = (max(int(n), 1) for n in room // cell)
    note = blanks.plates[0]
    for first in range(0, len(plates), across * down):
        page = book.page("Corner plates", scale)
        page.note(
            f"Bolt holes {note.bolt_hole:g} mm, "
            f"{_list(note.bolts)} mm from the corner point along either axis; "
            f"{note.board.thickness:g} mm thick. Both legs are alike: the label's side is the "
            "outside of the bend. Bolt plates to the faces that look away from crossing lamellas."
        )
        for k, plate in enumerate(plates[first : first + across * down]):
            corner = page.low + cell * [k % across, down - 1 - k // across]
            at = corner + [cell[0] / 2, 15.5 + size[1] / scale / 2]
            _template(page, plate, at - np.mean(plate.box, axis=0) / scale, scale)
            for text, below, weight in (
                (names[first + k], 9.5, "bold"),
                (numbers[first + k], 6.0, "normal"),
                (offsets[first + k], 2.5, "normal"),
            ):
                x, y = corner + [cell[0] / 2, below]
                page.text(x, y, text, 7.5, ha="center", va="center", weight=weight)


def cell_pages(book: Book, blanks: Blanks) -> None:
    """Plate, ear and both boards of every arm, at full size where the paper allows."""
    if blanks.cells is None:
        return
    cells, wanted = blanks.cells, blanks.cells.templates()
    room = Page(book.paper, "").room
    size = np.max([template.size for template in wanted], axis=0)
    scale = fitting_scale(size, room - [12.0, 30.0])
    note = (
        f"Pins {cells.pin:g} mm, along the plates' edges. Plates are seen from outside; ears sit "
        "on their inner faces. Arms are laid up of two boards, labels up: 2, without a disc, on 1, "
        "which has one. So at a crossing the discs of two arms lie side by side, locked by two "
        f"pins of {cells.thickness / 4:g} mm."
    )
    page, at, below = None, np.zeros(2), 0.0
    for template in sorted(wanted, key=lambda t: -t.size[1]):
        width, height = np.maximum(template.size / scale, [26.0, 0.0]) + [6.0, 13.0]
        if page is None or at[0] + width > page.high[0]:
            at = np.array([page.low[0] if page else 0.0, below])
            if page is None or at[1] - height < page.low[1]:
                page = book.page("Plates, ears and arms", scale)
                at = np.array([page.low[0], page.high[1] - page.note(note) - 2.0])
            below = at[1] - height
        middle = at + [width / 2, -template.size[1] / scale / 2]
        _template(page, template, middle - np.mean(template.box, axis=0) / scale, scale)
        text = f"{template.label}: {counted(template.count, 'piece')}"
        under = at[1] - template.size[1] / scale - 3.0
        page.text(middle[0], under, text, 7, ha="center", va="center", weight="bold")
        page.text(middle[0], under - 3.5, template.name.split(",")[0], 6, ha="center", va="center")
        at = at + [width, 0.0]


def sheet_pages(book: Book, sheets: Sequence[Sheet]) -> None:
    """Every cut sheet, as large as the paper allows: what comes from the machine, to check and to
    sort. Those that are alike are on one page."""
    for alike in _runs([(sheet.labels, _cuts(sheet)) for sheet in sheets]):
        sheet = sheets[alike[0]]
        room = Page(book.paper, "").room
        scale = fitting_scale(np.array(sheet.size), room - [0.0, 6.0])
        title = _title([sheets[k].title for k in alike])
        about = f"{sheet.thickness:g} mm thick, {sheet.size[0]:g} x {sheet.size[1]:g} mm"
        page = book.page(f"{title[0].upper()}{title[1:]}, {about}", scale)
        for shape in sheet.shapes:
            if isinstance(shape, Text) and shape.layer != NOTES:
                _text(page, shape, page.low, scale, INK)
            elif shape.layer != NOTES or (isinstance(shape, Polyline) and shape.closed):
                _shape(page, shape, page.low, scale)


def stock_pages(book: Book, blanks: Blanks, plan: StockPlan | None) -> None:
    """Which pieces are sawn from which bar."""
    if plan is None:
        return
    room = Page(book.paper, "").room
    longest = max(bar.length for bar in plan.bars)
    scale = fitting_scale(np.array([longest, 1.0]), np.array([room[0] - 44.0, 1e9]))
    page, y = None, 0.0
    for alike in _runs([(bar.length, bar.pieces) for bar in plan.bars]):
        bar = plan.bars[alike[0]]
        pieces = _laid_out(bar, scale, blanks.options.kerf)
        below = [(left + step / 2, under) for left, step, _, under in pieces if under]
        rows = _rows(below, room[0])
        if page is None or y - 11.0 - _ROW * rows < page.low[1]:
            page = book.page(f"Bars to saw, {blanks.board.section} mm", scale)
            noted = page.note(
                f"{counted(len(plan.bars), 'bar')}: {_lengths(plan)}; "
                f"{plan.length / 1000:.2f} m in all, "
                f"{100 * plan.used:.0f} % of it used; no plan needs less than "
                f"{plan.least / 1000:.2f} m. "
                f"Kerf {blanks.options.kerf:g} mm. Saw from the left; lengths in mm.",
            )
            y = page.high[1] - noted - 2.0
        y -= 10.0
        x = page.low[0] + _NUMBERS
        numbers = f"{alike[0] + 1}" + (f"–{alike[-1] + 1}" if len(alike) > 1 else "")
        page.text(page.low[0], y + 2.0, numbers, 8, va="center", weight="bold")
        page.line(
            [
                [x, y],
                [x + bar.length / scale, y],
                [x + bar.length / scale, y + 4.0],
                [x, y + 4.0],
                [x, y],
            ],
            QUIET,
        )
        for left, step, inside, _ in pieces:
            page.ax.fill(
                [x + left, x + left + step, x + left + step, x + left],
                [y, y, y + 4, y + 4],
                facecolor="#f1ede4",
                edgecolor=INK,
                lw=0.6,
            )
            page.text(x + left + step / 2, y + 1.9, inside, 6.5, ha="center", va="center")
        if below:
            _under(page, [(x + middle, text) for middle, text in below], rows, y)
        page.text(
            page.low[0] + _NUMBERS + 2.0 + bar.length / scale,
            y + 2.0,
            f"of {bar.length:g}, "
            + (f"{len(alike)} alike, " if len(alike) > 1 else "")
            + f"left {bar.left:.0f}",
            6.5,
            va="center",
            color=QUIET,
        )
        y -= _ROW * rows


def _laid_out(bar: Bar, scale: float, kerf: float) -> list[tuple[float, float, str, str]]:
    """For each piece of a bar on the page: where it begins and how wide it is, mm from the bar's
    left end, what is written in it, and what under it as there is no room."""
    found, left = [], 0.0
    for label, length in bar.pieces:
        step = length / scale
        inside, under = f"{label}  {tenths(length)}", ""
        if text_extent(inside, 6.5)[0] > step - 1:
            named = text_extent(label, 6.5)[0] <= step - 0.5
            inside, under = (label, tenths(length)) if named else ("", inside)
        found.append((left, step, inside, under))
        left += step + kerf / scale
    return found


def _room_of(texts: Sequence[tuple[float, str]]) -> float:
    """What each of them takes in a row, mm."""
    return max(text_extent(text, _SHORT)[0] for _, text in texts) + 1.5


def _rows(texts: Sequence[tuple[float, str]], width: float) -> int:
    """In how many rows texts stand near to their middles, from left to right; width : of the page's
    room, mm."""
    if not texts:
        return 0
    wide = _room_of(texts)
    span = min(texts[-1][0] - texts[0][0] + _ASIDE * wide, width - wide)
    return int(np.ceil((len(texts) - 1) * wide / span)) or 1


def _under(page: Page, texts: Sequence[tuple[float, str]], rows: int, y: float) -> None:
    """Texts in rows under a bar's lower edge at y, with lines from the middles of what they are
    about."""
    wide = _room_of(texts)
    low, high, apart = page.low[0] + wide / 2, page.high[0] - wide / 2, wide / rows
    places = _spread([middle for middle, _ in texts], apart)
    least = low + apart * np.arange(len(texts))
    places = np.maximum(places - max(places[-1] - high, 0.0), least)
    for number, ((middle, text), place) in enumerate(zip(texts, places)):
        under = y - _ROW * (1 + number % rows)
        page.line(
            [[middle, y], [middle, y - 0.6], [place, y - 1.6], [place, under + 1.1]], QUIET, 0.1
        )
        page.text(place, under, text, _SHORT, ha="center", va="center")


def _lengths(plan: StockPlan) -> str:
    """ "5 of 4800 mm, 12 of 2400 mm": the bars of a plan, the longest first."""
    return ", ".join(f"{number} of {length:g} mm" for length, number in plan.counts.items())


def _runs(items: Sequence[Any]) -> list[list[int]]:
    """The numbers of items, those that follow each other and are equal together."""
    found: list[list[int]] = []
    for number, item in enumerate(items):
        if found and items[found[-1][-1]] == item:
            found[-1].append(number)
        else:
            found.append([number])
    return found


def _title(titles: Sequence[str]) -> str:
    """ "cut sheets 3 to 5 of 11, alike" of sheets called "cut sheet 3 of 11" and so on."""
    if len(titles) == 1:
        return titles[0]
    first, last = (title.split() for title in (titles[0], titles[-1]))
    name, number, of = " ".join(first[:-3]), first[-3], first[-1]
    return f"{name}s {number} to {last[-3]} of {of}, alike"


def _cuts(sheet: Sheet) -> list[tuple[str, list[float]]]:
    """What is cut on a sheet, as plain numbers."""
    return [
        (shape.layer, np.round(shape.box, 6).ravel().tolist())
        for shape in sheet.shapes
        if shape.layer == CUT
    ]


def _strip(page: Page, strip: Strip, at: np.ndarray, scale: float) -> None:
    """A strip with its caption above and its dimensions below; `at` is the lower left corner."""
    template, half = strip_template(strip), strip.board.breadth / 2
    origin = at + [0.0, half / scale]
    _template(page, template, origin, scale)
    top = at[1] + strip.board.breadth / scale
    joint = (
        f"joint hole {strip.hole:g} mm"
        if strip.slot is None
        else f"slot {tenths(strip.slot)} mm wide, {tenths(strip.slot_depth)} mm deep"
    )
    adapts = f"; sides {tenths(strip.slide)} mm adjustable" if strip.slide else ""
    page.text(at[0], top + 2.0, f"{strip.label}", 10, weight="bold")
    page.text(
        at[0] + 14.0,
        top + 2.0,
        f"{counted(strip.count, 'piece')}, {strip.board.section} mm: "
        f"{tenths(strip.cut_length)} long, {joint}, bolt holes {strip.bolt_hole:g} mm{adapts}",
        8,
    )
    stations = [0.0, *strip.bolt_stations, strip.hole_from_end, strip.cut_length]
    stations = sorted(stations)
    places = _spread([at[0] + s / scale for s in stations], _STEP)
    for station, x in zip(stations, places):
        on = at[0] + station / scale
        main = station in (strip.hole_from_end, strip.cut_length)
        page.line(
            [[on, at[1] - 0.8], [on, at[1] - 2.0], [x, at[1] - 6.0], [x, at[1] - 7.0]], QUIET, 0.15
        )
        page.text(
            x,
            at[1] - 7.5,
            tenths(station),
            _DIMENSION,
            rotation=90,
            ha="center",
            va="top",
            weight="bold" if main else "normal",
        )


def _spread(wanted: Sequence[float], apart: float) -> np.ndarray:
    """Increasing places as near to the wanted ones as they can be at that distance: least squares,
    by pooling those that are too near (isotonic regression)."""
    shifted = np.array(wanted) - apart * np.arange(len(wanted))
    blocks: list[tuple[float, int]] = []
    for value in shifted:
        blocks.append((float(value), 1))
        while len(blocks) > 1 and blocks[-2][0] > blocks[-1][0]:
            (b, n), (a, m) = blocks.pop(), blocks.pop()
            blocks.append(((a * m + b * n) / (m + n), m + n))
    flat = np.concatenate([np.full(n, value) for value, n in blocks])
    return flat + apart * np.arange(len(wanted))


def _template(page: Page, template: Template, origin: np.ndarray, scale: float) -> None:
    for shape in template.shapes:
        _shape(page, shape, origin, scale)


def _shape(page: Page, shape: Shape, origin: np.ndarray, scale: float) -> None:
    """A shape (mm) on paper, its (0, 0) at the origin."""
    colour = _COLOURS[shape.layer]
    if isinstance(shape, Polyline):
        points = np.concatenate([shape.points, shape.points[:1]]) if shape.closed else shape.points
        style = "-" if shape.layer == CUT else (0, (8, 2, 2, 2))
        page.line(origin + points / scale, colour, 0.25 if shape.layer == CUT else 0.13, ls=style)
    elif isinstance(shape, Hole):
        turns = np.linspace(0, 2 * np.pi, 33)
        circle = shape.diameter / 2 * np.stack([np.cos(turns), np.sin(turns)], axis=1)
        page.line(origin + (shape.centre + circle) / scale, colour)
    else:
        _text(page, shape, origin, scale, colour)


def _text(page: Page, shape: Text, origin: np.ndarray, scale: float, colour: str) -> None:
    x, y = origin + shape.at / scale
    size = shape.height / scale / 0.72 * 72 / 25.4  # capital letters are 0.72 of the font size high
    align = "center" if shape.align == "middle" else "left"
    if size >= 2.0:
        page.text(x, y, shape.text, size, color=colour, ha=align, va="center_baseline")


def _aside(plate: CornerPlate) -> str:
    """How far the end of a plate's second axis is off the line of the first: to lay it out by a
    square instead of by degrees."""
    return tenths(abs(plate.leg * np.sin(plate.angle)))


def _list(values: Sequence[float]) -> str:
    return " and ".join(tenths(value) for value in values)
