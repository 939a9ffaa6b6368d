"""Assembly drawings on paper: on pages of a book, or on a sheet of their own size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from matplotlib.figure import Figure

from ..drawing.style import QUIET, save_figure, style
from ..files.files import file_stem, make_folder
from ..kit.kinds import has_joint, part_kind
from .assembly import stands_on_edge
from .assembly_drawing import AssemblyDrawing
from .paper import SCALES, Book, fitting_scale, scale_name
from .placement import PlacedPieces

_OVERLAP = 12.0  # mm that neighbouring pages share
_EDGE = 3.0  # mm at a page's edge in which labels may be missing
_MARGIN = 12.0  # mm around the drawing on a sheet of its own


def assembly_pages(book: Book, drawing: AssemblyDrawing) -> None:
    """The drawing on pages: all of it first, then, where that is more than one page, its parts."""
    page = book.page(f"Assembly of {drawing.name}")
    low, room = page.low + [0.0, 6.0], page.room - [0.0, 6.0]
    size = np.ptp(drawing.box, axis=0)
    # as large as one page allows, and larger where labels need it
    page.scale = scale = min(drawing.scale, fitting_scale(size, room - 14.0, SCALES[0]))
    if (size / scale <= room - 14.0).all():
        origin = low + room / 2 - drawing.box.mean(axis=0) / scale
        drawing.draw(page.ax, scale, origin, np.array([low, low + room]))
        page.text(page.low[0], page.low[1], explanation(drawing.placed), 7, color=QUIET)
        return
    inner = room - _OVERLAP
    counts, scale = _tiles(size, inner, scale)
    page.scale = fitting_scale(size, room - 4.0)
    origin = low + room / 2 - drawing.box.mean(axis=0) / page.scale
    drawing.draw(page.ax, page.scale, origin, None)
    page.text(page.low[0], page.low[1], explanation(drawing.placed), 7, color=QUIET)
    corner = drawing.box.mean(axis=0) / scale - (counts * inner + _OVERLAP) / 2
    drawn = shapely.union_all(
        [shapely.LineString(line / scale) for line in drawing.lines]
        + [shapely.Polygon(cell / scale) for cell in drawing.cells]
    )
    places = [
        np.array([column, row]) for row in reversed(range(counts[1])) for column in range(counts[0])
    ]
    tiles = [corner + at * inner for at in places]  # lower left, on paper at the drawing's scale
    kept = _needed(drawn, [shapely.box(*at, *(at + room)) for at in tiles])
    names = {tuple(places[k].tolist()): number for number, k in enumerate(kept, 1)}
    page.heading += f": where its {len(kept)} pages are"
    for number, tile in enumerate((tiles[k] for k in kept), 1):
        lower, upper = (origin + at * scale / page.scale for at in (tile, tile + room))
        ring = np.array([lower, [upper[0], lower[1]], upper, [lower[0], upper[1]], lower])
        page.line(ring, QUIET, 0.15)
        x, y = (lower + upper) / 2
        page.text(x, y, str(number), 16, color=QUIET, ha="center", va="center", alpha=0.6)
        one = book.page(f"Assembly of {drawing.name}, part {number} of {len(kept)}", scale)
        drawing.draw(one.ax, scale, low - tile, np.array([low, low + room]))
        beside = _neighbours(places[kept[number - 1]], names)
        note = f"{_OVERLAP:g} mm are shared with the next parts: {beside}"
        one.text(one.low[0], one.low[1], note, 7, color=QUIET)


def _needed(drawn: Any, windows: Sequence[Any]) -> list[int]:
    """Numbers of the windows that show something of a drawing that no other one shows."""
    kept = [k for k, window in enumerate(windows) if drawn.intersects(window)]
    for k in list(kept):
        others = [windows[other].buffer(-_EDGE) for other in kept if other != k]
        if drawn.intersection(windows[k]).difference(shapely.union_all(others)).is_empty:
            kept.remove(k)
    return kept


def _tiles(size: np.ndarray, inner: np.ndarray, scale: float) -> tuple[np.ndarray, float]:
    """How many pages across and down a drawing takes, and its scale there: the largest drawing on
    as many pages as the scale that is asked for needs.

    size : of the thing, mm; inner : what a page adds to the one before, mm
    """

    def pages(at: float) -> np.ndarray:
        return np.maximum(np.ceil((size / at + 14.0 - _OVERLAP) / inner), 1).astype(int)

    wanted = pages(scale)
    larger = [s for s in SCALES if s <= scale and (pages(s) == wanted).all()]
    return wanted, min(larger)


def save_assembly_drawing(
    drawing: AssemblyDrawing, folder: str | Path, stem: str = "", *, overwrite: bool = False
) -> list[Path]:
    """Write assembly_DESIGN.svg, all of it on one sheet; returns its path.

    stem : of the design's name, default: see `file_stem`

    Raises InputError when a file can't be written.
    """
    path = make_folder(folder) / f"assembly_{stem or file_stem(drawing.name)}"
    return save_figure(draw_assembly(drawing), path, ("svg",), overwrite=overwrite)


def draw_assembly(drawing: AssemblyDrawing) -> Figure:
    """The whole drawing on one sheet of its own size."""
    scale = drawing.scale
    width, height = np.ptp(drawing.box, axis=0) / scale + 2 * _MARGIN
    width, height = max(width, 130.0), height + 12.0
    with style():
        figure = Figure(figsize=(width / 25.4, height / 25.4))
        ax = figure.add_axes((0, 0, 1, 1))
        ax.set(xlim=(0, width), ylim=(0, height))
        ax.set_axis_off()
        origin = np.array([width / 2, height / 2]) - drawing.box.mean(axis=0) / scale
        drawing.draw(ax, scale, origin, np.array([[0.0, 0.0], [width, height]]))
        title = f"{drawing.name}, scale {scale_name(scale)}"
        ax.text(_MARGIN, height - 6.0, title, size=11, weight="bold", va="center", parse_math=False)
        ax.text(_MARGIN, 5.0, explanation(drawing.placed), size=6.5, color=QUIET, va="center")
    return figure


def explanation(placed: PlacedPieces) -> str:
    """What the labels mean."""
    kinds = {piece.kind for piece in placed.pieces.pieces}
    if any(has_joint(part_kind(kind)) for kind in kinds):
        text = (
            "bold: part, along its side 1 (·2: only its side 2 is used) · grey: element, joint · "
            "(n): lamella · drawn through: the upper lamella"
        )
    else:
        text = (
            "part (m: mirrored, top and bottom change places; ·a, ·b: the sort of its arms), below "
            "it the element · grey: joint · seen from above"
        )
    if not any(part_kind(kind).angular for kind in kinds):
        return text
    if not stands_on_edge(placed):
        return (
            f"{text} · seen from above\n"
            "diamonds: corner plates; walking along the lamella from its number: label up, right "
            "of the axis, it turns left (·f: flipped, label down, left of the axis, it turns right)"
        )
    return (
        f"{text} · seen from above\n"
        "diamonds: corner plates, label in their lower half: the lamella rises towards you at its "
        "ends (·f: flipped, label in the upper half, it falls away)"
    )


def _neighbours(place: np.ndarray, names: Mapping[tuple[int, ...], int]) -> str:
    """Which parts lie to the left, right, above and below a place.

    names : number of the part at each place that has one, columns and rows counted from below
    """
    sides = {"left": (-1, 0), "right": (1, 0), "above": (0, 1), "below": (0, -1)}
    near = {side: names.get(tuple((place + step).tolist())) for side, step in sides.items()}
    return ", ".join(f"{side} {number}" for side, number in near.items() if number is not None)
