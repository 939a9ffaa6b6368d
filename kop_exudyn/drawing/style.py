"""One look for all figures: colours that colour-blind readers tell apart, readable sizes, vector
and pixel files."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import matplotlib
from matplotlib.artist import Artist
from matplotlib.axis import Axis
from matplotlib.colors import Colormap, ListedColormap
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import FixedFormatter, FuncFormatter
from PIL import Image

from ..files.files import write_bytes

# Okabe and Ito, "Color Universal Design" (2008), without their yellow, which is too faint for lines
# on white.
PALETTE = {
    "blue": "#0072b2",
    "vermillion": "#d55e00",
    "green": "#009e73",
    "purple": "#cc79a7",
    "sky": "#56b4e9",
    "orange": "#e69f00",
    "black": "#222222",
}
CYCLE = tuple(PALETTE.values())
# text and main lines; axes and notes; what is compared with
INK, QUIET, FAINT, WARNING = "#222222", "#6b6b6b", "#c9c9c9", "#b3261e"

# The formulas in our own labels, and those of matplotlib's logarithmic axes.
_FORMULA = re.compile(r"\$(w_c|10\^\{-?\d+\}|\\mathdefault\{[^$]*\})\$")

_SETTINGS = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.edgecolor": QUIET,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.7,
    "xtick.color": QUIET,
    "ytick.color": QUIET,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.6,
    "text.color": INK,
    "figure.facecolor": "white",
    "figure.autolayout": False,  # of the caller's: figures are placed once, by their own engine
    "savefig.facecolor": "white",
    "savefig.dpi": 200,
    # the same figure gives the same bytes: no random ids in SVG files
    "svg.hashsalt": "kop_exudyn",
    "svg.fonttype": "path",
}


@contextmanager
def style() -> Iterator[None]:
    """Settings in which figures are made and saved; those of the caller's own figures stay as they
    are."""
    with matplotlib.rc_context(_SETTINGS):
        yield


def deviation_colours() -> Colormap:
    """From light (on the target) to dark (far off it); brightness alone tells the order."""
    return ListedColormap(
        matplotlib.colormaps["inferno_r"]([0.08 + 0.80 * k / 255 for k in range(256)]),
        name="deviation",
    )


def figure_bytes(figure: Figure, suffix: str) -> bytes:
    """The figure as "svg", "pdf" or "png", without the date.

    Its parts are placed once, before it is drawn first, and stay where they are: to place them
    takes as long as to draw them, and all its files look the same.
    """
    metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}, "png": {"Software": None}}[
        suffix
    ]
    buffer = io.BytesIO()
    show_dollars(figure)
    with style():
        if figure.get_layout_engine() is not None:
            figure.draw_without_rendering()
            figure.set_layout_engine(None)  # with "none" it would be drawn twice to be placed
        figure.savefig(buffer, format=suffix, metadata=metadata)
    return buffer.getvalue()


def show_dollars(figure: Figure) -> None:
    """Let texts with dollar signs that are not this project's own formulas, as the names of
    designs may have them, be drawn as they are; matplotlib would read, or fail to read, TeX."""
    for text in _texts(figure):
        if "$" in _FORMULA.sub("", text.get_text()):
            text.set_parse_math(False)


def _texts(artist: Artist) -> Iterator[Text]:
    """The texts of a figure; those of ticks only where a name may be one: numbers have no dollar
    signs, and to make all ticks takes as long as to draw them."""
    if isinstance(artist, Text):
        yield artist
    named = not isinstance(artist, Axis) or isinstance(
        artist.get_major_formatter(), (FixedFormatter, FuncFormatter)
    )
    for child in artist.get_children() if named else (artist.label, artist.offsetText):
        yield from _texts(child)


def with_palette(png: bytes, colours: int) -> bytes:
    """The PNG with so many colours at most: line drawings look the same at a third of the size."""
    with Image.open(io.BytesIO(png)) as image:
        few = image.convert("RGB").quantize(colours, dither=Image.Dither.NONE)
        buffer = io.BytesIO()
        few.save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def save_figure(
    figure: Figure,
    path: str | Path,
    suffixes: Sequence[str] = ("svg",),
    *,
    overwrite: bool = False,
) -> list[Path]:
    """Write PATH.svg, and PATH.pdf or PATH.png if asked for; `path` has no ending. InputError when
    one can't be written."""
    path = Path(path)
    return [
        write_bytes(
            path.with_name(f"{path.name}.{suffix}"),
            figure_bytes(figure, suffix),
            overwrite=overwrite,
        )
        for suffix in suffixes
    ]
