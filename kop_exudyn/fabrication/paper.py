"""Pages for printing: A4 or A3 across, drawn in millimetres, with title block and scale bar."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure

from ..drawing.labels import text_extent
from ..drawing.lines import draw_lines
from ..drawing.style import FAINT, INK, QUIET, WARNING, show_dollars, style
from ..errors import InputError
from ..files.files import write_bytes
from ..provenance import __version__

PAPERS = {"a4": (297.0, 210.0), "a3": (420.0, 297.0)}  # mm, across
# Millimetres of a thing that one millimetre on paper shows: those that rulers have, and some
# between: every page has its own bar, and much of a page may stay empty otherwise.
_STEPS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 7.5)
SCALES = (0.1, 0.2, 0.5, *(step * power for power in (1.0, 10.0, 100.0) for step in _STEPS), 1000.0)

_MM = 1 / 25.4
_BORDER = 10.0  # mm of paper around the frame
_BLOCK = 16.0  # mm that the title block is high
_BAR = 60.0  # mm, at most, of the scale bar on paper
_NOTE = 7.5  # points
_ROUND = (1, 2, 5)
_BOUGHT = ("diameter_mm", "joint_hole_mm", "bolt_hole_mm")  # columns of sizes that tools have


@dataclass
class Page:
    """One page: its axes are millimetres on paper, from the lower left corner.

    low, high (2,) : corners of the room for drawings, above the title block
    """

    paper: str
    heading: str
    scale: float | None = None
    figure: Figure = field(init=False)
    ax: Axes = field(init=False)
    _lines: dict[tuple, list[np.ndarray]] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        width, height = PAPERS[self.paper]
        with style():
            self.figure = Figure(figsize=(width * _MM, height * _MM))
            self.ax = self.figure.add_axes((0, 0, 1, 1))
        self.ax.set(xlim=(0, width), ylim=(0, height))
        self.ax.set_axis_off()

    @property
    def low(self) -> np.ndarray:
        return np.array([_BORDER + 3.0, _BORDER + _BLOCK + 3.0])

    @property
    def high(self) -> np.ndarray:
        return np.array(PAPERS[self.paper]) - _BORDER - 3.0

    @property
    def room(self) -> np.ndarray:
        """Width and height for drawings, mm."""
        return self.high - self.low

    def line(self, points: Any, colour: str = INK, width: float = 0.25, **options: Any) -> None:
        """A line through points (n, 2); width in mm, options as of a PathPatch."""
        key = (colour, width * 72 * _MM, *sorted(options.items()))
        self._lines.setdefault(key, []).append(np.asarray(points, float))

    def note(self, text: str) -> float:
        """Paragraphs at the top, within the page's width; the height that they take, mm."""
        lines = [line for one in text.split("\n") for line in wrapped(one, _NOTE, self.room[0])]
        self.text(self.low[0], self.high[1], "\n".join(lines), _NOTE, va="top", color=QUIET)
        return text_extent("\n".join(lines), _NOTE)[1] + 3.0

    def finish(self) -> Figure:
        """The figure, with all lines: collected, they are drawn much faster than one by one."""
        for (colour, width, *options), lines in self._lines.items():
            draw_lines(self.ax, lines, colour, width, **dict(options))
        self._lines.clear()
        return self.figure

    def text(self, x: float, y: float, text: str, size: float = 7.0, **options: Any) -> None:
        """A text; size in points."""
        self.ax.text(x, y, text, size=size, parse_math=False, **options)


@dataclass
class Book:
    """Pages that belong together.

    paper : of `PAPERS`
    title : what all of them are about
    warning : stands on every page, in red
    """

    paper: str
    title: str
    warning: str = ""
    pages: list[Page] = field(default_factory=list)

    def __post_init__(self) -> None:
        if self.paper not in PAPERS:
            raise InputError(
                f"unknown paper (known: {', '.join(PAPERS)})", field="paper", value=self.paper
            )

    def page(self, heading: str, scale: float | None = None) -> Page:
        """A new page at the end.

        scale : millimetres that one on paper shows; None for pages that aren't to scale
        """
        self.pages.append(Page(self.paper, heading, scale))
        return self.pages[-1]

    def table(self, heading: str, rows: Sequence[dict[str, Any]], note: str = "") -> None:
        """Rows of equal columns, on as many pages as they take; under the first one a note."""
        known = (name for row in rows for name, value in row.items() if value is not None)
        columns = list(dict.fromkeys(known))
        cells = [[_cell(name, row.get(name)) for name in columns] for row in rows]
        right = [_is_numeric(row.get(name) for row in rows) for name in columns]
        heads = [_head(name) for name in columns]
        size, widths = _fitting(heads, cells, Page(self.paper, "").room[0])
        step = 1.9 * size * 25.4 / 72
        ends = np.array([[0.0, 0.0], [sum(widths), 0.0]])  # of the rules
        number = 0
        while number < len(cells) or number == 0:
            page = self.page(heading)
            y = page.high[1] - step
            if note and number == 0:
                y -= page.note(note)
            lines_high = max(head.count("\n") for head in heads)
            y -= step * 0.75 * lines_high
            _row(page, heads, widths, right, y, size, weight="bold")
            page.line(ends + [page.low[0], y - step / 3], QUIET)
            while number < len(cells) and y - 1.4 * step > page.low[1]:
                y -= step
                _row(page, cells[number], widths, right, y, size)
                page.line(ends + [page.low[0], y - step / 3], FAINT, 0.1)
                number += 1
            if not cells:
                break

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write all pages as one PDF. Raises InputError when the file exists or can't be
        written."""
        buffer = BytesIO()
        # no dates: the same kit gives the same bytes
        with style(), PdfPages(buffer, metadata={"CreationDate": None, "Title": self.title}) as pdf:
            for number, page in enumerate(self.pages, 1):
                _frame(page, self.title, number, len(self.pages), self.warning)
                figure = page.finish()
                show_dollars(figure)
                pdf.savefig(figure)
        return write_bytes(path, buffer.getvalue(), overwrite=overwrite)


def scale_name(scale: float) -> str:
    """As drawings have it: "1:5", "2:1"."""
    return f"1:{scale:g}" if scale >= 1 else f"{1 / scale:g}:1"


def fitting_scale(size: np.ndarray, room: np.ndarray, least: float = 1.0) -> float:
    """The largest drawing: the first of `SCALES` at which a size (mm) fits a room (mm).

    least : by default nothing is drawn larger than it is
    """
    scales = [scale for scale in SCALES if scale >= least]
    return next((s for s in scales if (np.asarray(size) / s <= room).all()), scales[-1])


def wrapped(text: str, size: float, room: float) -> list[str]:
    """The lines of a text, broken between words where it is wider than the room in mm."""
    lines = [""]
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}" if lines[-1] else word
        if lines[-1] and text_extent(longer, size)[0] > room:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines


def _frame(page: Page, title: str, number: int, of: int, warning: str) -> None:
    """Border and title block: what, scale with its bar, which page."""
    width, height = PAPERS[page.paper]
    left, right, bottom, top = _BORDER, width - _BORDER, _BORDER, height - _BORDER
    block = bottom + _BLOCK
    page.line(
        [[left, bottom], [right, bottom], [right, top], [left, top], [left, bottom]], width=0.5
    )
    page.line([[left, block], [right, block]], width=0.5)
    middle, last = left + 0.45 * (right - left), right - 62.0
    for x in (middle, last):
        page.line([[x, bottom], [x, block]])
    page.text(
        left + 3, bottom + 10.5, _cut(title, 10, middle - left - 6), 10, weight="bold", va="center"
    )
    page.text(left + 3, bottom + 4.5, _cut(page.heading, 8.5, middle - left - 6), 8.5, va="center")
    page.text(last + 3, bottom + 10.5, f"Page {number} of {of}", 8.5, va="center")
    if warning:
        page.text(left, top + 4.0, warning, 9, weight="bold", va="center", color=WARNING)
    paper = f"{page.paper.upper()}, lengths in mm · kop_exudyn {__version__}"
    page.text(last + 3, bottom + 4.5, paper, 6.5, va="center", color=QUIET)
    if page.scale is None:
        page.text(middle + 3, bottom + 7.5, "Not to scale", 8.5, va="center", color=QUIET)
        return
    page.text(
        middle + 3,
        bottom + 10.5,
        f"Scale {scale_name(page.scale)} when printed at 100 %",
        8.5,
        va="center",
    )
    _scale_bar(page, middle + 4, bottom + 5.0)


def _scale_bar(page: Page, x: float, y: float) -> None:
    """A bar of a round length with its ends named, beside and below nothing else."""
    assert page.scale is not None
    most = _BAR * page.scale
    power = 10.0 ** np.floor(np.log10(most))
    length = max(k * power for k in _ROUND if k * power <= most)
    end = x + length / page.scale
    for k in range(4):  # quarters, alternately filled
        low, high = x + k * (end - x) / 4, x + (k + 1) * (end - x) / 4
        page.ax.fill(
            [low, high, high, low],
            [y, y, y + 1.2, y + 1.2],
            facecolor=INK if k % 2 == 0 else "white",
            edgecolor=INK,
            lw=0.5,
        )
    page.text(x, y - 0.8, "0", 6, va="top", ha="center")
    page.text(end, y - 0.8, f"{length:g} mm", 6, va="top", ha="center")


def _fitting(heads: list[str], cells: list[list[str]], room: float) -> tuple[float, list[float]]:
    """Size of the text (points) and widths of the columns (mm) with which a table fits."""
    size = 9.0
    while True:
        widths = [
            max(
                text_extent(head, size, "bold")[0],
                *(text_extent(row[k], size)[0] for row in cells),
                4.0,
            )
            + 0.45 * size
            for k, head in enumerate(heads)
        ]
        if sum(widths) <= room or size <= 3.5:
            return size, widths
        size -= 0.5


def _row(
    page: Page,
    cells: Sequence[str],
    widths: Sequence[float],
    right: Sequence[bool],
    y: float,
    size: float,
    **options: Any,
) -> None:
    """Cells beside each other, numbers on the right of their columns."""
    x = page.low[0]
    for cell, width, to_right in zip(cells, widths, right):
        at = x + width - 0.45 * size if to_right else x
        align = "right" if to_right else "left"
        page.text(at, y, cell, size, va="baseline", ha=align, linespacing=1.1, **options)
        x += width


def _is_numeric(values: Iterable[Any]) -> bool:
    given = [value for value in values if value is not None]
    return bool(given) and all(isinstance(value, (int, float)) for value in given)


def _head(name: str) -> str:
    """A column's name as people read it: words below each other, the unit last."""
    for unit in ("mm", "deg", "m2", "m"):
        if name.endswith(f"_{unit}"):
            words = name.removesuffix(f"_{unit}").replace("_", "\n")
            return f"{words}\n[{unit.replace('2', '²')}]"
    return name.replace("_", "\n")


def _cell(name: str, value: Any) -> str:
    """A value as it is printed: 0.1 mm, 0.01 degrees; drills and pins as they are bought."""
    if value is None:
        return ""
    if isinstance(value, float) and not name.endswith(_BOUGHT):
        digits = {"mm": 1, "deg": 2, "m": 2, "m2": 3}.get(name.rpartition("_")[2])
        # + 0.0: what is rounded to nothing has no sign
        return f"{value:g}" if digits is None else f"{round(value, digits) + 0.0:.{digits}f}"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _cut(text: str, size: float, room: float) -> str:
    """The text, cut where it is too long."""
    if text_extent(text, size, "bold")[0] <= room:
        return text
    while len(text) > 1 and text_extent(text + "…", size, "bold")[0] > room:
        text = text[:-1]
    return text + "…"
