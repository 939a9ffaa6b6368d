"""Assembly drawings: a design laid out flat, every piece labelled where and as it is built in.

Rods carry their part's label along the side that is the part's side 1, and the element's number of
the assembly plan along the other one; corners carry their part's label, with "·f" where they are
built in flipped. Where lamellas cross, the upper one is drawn through. The scale is the smallest
standard one at which no label covers another.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.patches import Rectangle
from scipy.spatial import cKDTree

from ..drawing.colours import kit_colours
from ..drawing.labels import Label, place
from ..drawing.style import FAINT, INK, QUIET
from ..kit.kinds import has_joint, part_kind
from .cells import sorts_of_arms
from .lamellas import UPPER, Lamellas
from .paper import SCALES
from .pieces import PartsList, Piece
from .placement import PlacedPieces

_SIDE_ROOM = 9.0  # mm that the median side is long on paper, at least: room for its label
_CELL_ROOM = 6.0  # mm between the middles of neighbouring cells, at least
_BESIDE = 1.7  # mm from a rod's axis to the middle of the text beside it
_GAP = 1.1  # mm on either side of a crossing in which the lower rod isn't drawn
_ROD = 2.0  # points
_INSIDE = 3.0  # mm from a page's edge, where the numbers of lamellas that come in are
_ENTERING = 6.5  # points, of these
_ON_LINES = {"facecolor": "white", "edgecolor": "none", "pad": 0.6}
_ALONG = (0.5, 0.36, 0.64, 0.24, 0.76)  # places of a label along its rod
_AROUND = np.radians([45, 135, 225, 315, 0, 90, 180, 270])


@dataclass(frozen=True)
class AssemblyDrawing:
    """A design laid out flat; lengths are millimetres of the thing.

    parts, placed : what is drawn
    lines : (k, 2) nodes of every rod piece
    joints (n, 2) ; corners : places by parameter
    cells (n_cells, 3, 2) : plates, of designs whose parts are cells
    """

    parts: PartsList
    placed: PlacedPieces
    lines: list[np.ndarray]
    joints: np.ndarray
    corners: dict[int, np.ndarray]
    cells: np.ndarray

    @cached_property
    def _found(self) -> dict[float, tuple[list[Label], list[np.ndarray], int]]:
        return {}

    @property
    def name(self) -> str:
        return self.placed.design.name

    @cached_property
    def box(self) -> np.ndarray:
        """(2, 2) lowest and highest x, y."""
        points = np.concatenate([*self.lines, self.cells.reshape(-1, 2)])
        return np.stack([points.min(axis=0), points.max(axis=0)])

    @cached_property
    def lamellas(self) -> Lamellas:
        return Lamellas(self.placed)

    @cached_property
    def scale(self) -> float:
        """The smallest standard drawing in which every label finds a free place."""
        if len(self.cells):
            middles = self.cells.mean(axis=1)
            room, least = cKDTree(middles).query(middles, k=[min(2, len(middles))])[0], _CELL_ROOM
        else:
            room, least = [np.linalg.norm(line[-1] - line[0]) for line in self.lines], _SIDE_ROOM
        fitting = [s for s in SCALES if np.median(room) / s >= least] or [SCALES[0]]
        crowded: dict[float, int] = {}
        for scale in reversed(fitting):
            crowded[scale] = self.labels(scale)[2]
            if not crowded[scale]:
                return scale
        return min(crowded, key=lambda scale: (crowded[scale], -scale))

    def labels(self, scale: float) -> tuple[list[Label], list[np.ndarray], int]:
        """All labels, their places on paper (mm, from the drawing's origin), and how many of them
        cover another."""
        if scale in self._found:
            return self._found[scale]
        pieces = self.placed.pieces.pieces
        of_pieces = [label for piece in pieces for label in self._piece_labels(piece, scale)]
        found = [*self._joint_labels(scale), *self._lamella_labels(scale)]
        # labels of cells belong in their middles, those of rods leave the joints theirs
        found = of_pieces + found if len(self.cells) else found + of_pieces
        points = [*self.joints, *self.corners.values()]
        dots = [shapely.Point(at / scale).buffer(0.6, quad_segs=2) for at in points]
        # of cells the plates' edges are drawn, and no rods
        closed = [cell[[0, 1, 2, 0]] for cell in self.cells]
        rods = [shapely.LineString(line / scale) for line in closed or self.lines]
        self._found[scale] = found, *place(found, dots, rods)
        return self._found[scale]

    def _joint_labels(self, scale: float) -> Iterator[Label]:
        for number, at in enumerate(self.joints / scale, 1):
            places = [
                at + r * np.array([np.cos(turn), np.sin(turn)])
                for r in (2.2, 3.0, 4.0)
                for turn in _AROUND
            ]
            yield Label(str(number), 4.5, np.array(places), colour=QUIET)

    def _lamella_labels(self, scale: float) -> Iterator[Label]:
        """The lamella's number beyond its first end."""
        for lamella in self.lamellas.all:
            line = self._of(lamella.straight[0])
            if not line:
                continue
            first = line[0] / scale
            out = first[0] - first[-1]
            out = out / (np.linalg.norm(out) or 1.0)
            across = np.array([-out[1], out[0]])
            places = [first[0] + d * out + s * across for d in (5, 7, 9) for s in (0, 3, -3, 6, -6)]
            yield Label(f"({lamella.number})", 7.0, np.array(places), weight="bold")

    def _entering(self, scale: float, origin: np.ndarray, window: np.ndarray) -> Iterator[Label]:
        """The numbers of lamellas whose first end isn't in a window, where they come into it: on
        the side of their first end, as turns count from there. Places are on paper."""
        room = shapely.box(*(window[0] + _INSIDE), *(window[1] - _INSIDE))
        for lamella in self.lamellas.all:
            lines = [origin + line / scale for p in lamella.straight for line in self._of(p)]
            if not lines or room.contains(shapely.Point(lines[0][0])):
                continue
            inside = shapely.intersection(shapely.MultiLineString(lines), room)
            if not inside.is_empty:
                points = shapely.get_coordinates(inside)
                away = np.linalg.norm(points - lines[0][0], axis=1)
                at = points[[int(np.argmin(away))]]
                yield Label(f"({lamella.number})", _ENTERING, at, weight="bold")

    def _piece_labels(self, piece: Piece, scale: float) -> Iterator[Label]:
        label, kind = self.parts.label(piece), part_kind(piece.kind)
        if kind.angular:
            yield from self._corner_label(piece, label, scale)
            return
        lines = self._of(piece)
        if not has_joint(kind) or len(lines) != len(piece.parameters):
            own = self.cells[[piece.element - 1]] if len(self.cells) else lines
            middle = np.mean([line.mean(axis=0) for line in own], axis=0) / scale
            around = [
                middle + r * np.array([np.cos(turn), np.sin(turn)])
                for r in (2.0, 4.0)
                for turn in _AROUND
            ]
            turned = "m" if piece.variant == "mirrored" else ""
            hardware = self.placed.design.hardware
            sort = "" if hardware is None else f"·{sorts_of_arms(piece, hardware)}"
            text = f"{label}{turned}{sort}\n{piece.element}"
            yield Label(text, 5.5, np.array([middle, *around]))
            return
        for line, column in zip(lines, piece.columns):
            alone = len(lines) == 1
            if column == 0 or alone:
                side = "" if column == 0 else f"·{column + 1}"
                yield self._beside(line / scale, label + side, 6.0, INK, "bold", 1)
            if column or alone:
                yield self._beside(line / scale, str(piece.element), 5.0, QUIET, "normal", -1)

    def _corner_label(self, piece: Piece, label: str, scale: float) -> Iterator[Label]:
        at = self.corners.get(piece.parameters[0])
        if at is not None:
            text = label + ("·f" if piece.values[0] < 0 else "")
            places = [
                at / scale + r * np.array([np.cos(turn), np.sin(turn)])
                for r in (2.2, 3.2, 4.5)
                for turn in _AROUND[[5, 7, 0, 1, 2, 3, 4, 6]]
            ]
            yield Label(text, 5.0, np.array(places))

    @staticmethod
    def _beside(
        line: np.ndarray, text: str, size: float, colour: str, weight: str, first: int
    ) -> Label:
        """Text along a rod, never upside down; `first`: the side that it would rather be on."""
        step = line[-1] - line[0]
        angle = (np.degrees(np.arctan2(step[1], step[0])) + 75) % 180 - 75
        across = np.array([-np.sin(np.radians(angle)), np.cos(np.radians(angle))])
        places = [
            line[0] + t * step + side * d * across
            for d in (_BESIDE, _BESIDE + 1.8)
            for side in (first, -first)
            for t in _ALONG
        ]
        return Label(text, size, np.array(places), float(angle), colour, weight)

    def _of(self, piece: Piece) -> list[np.ndarray]:
        """The rod pieces of a piece."""
        return [
            self.lines[chain]
            for parameter in piece.parameters
            for chain in self.placed.chains.get(parameter, ())
        ]

    def draw(self, ax: Axes, scale: float, origin: np.ndarray, window: np.ndarray | None) -> None:
        """Draw on axes in mm of paper.

        origin : where the drawing's (0, 0) lies on paper
        window (2, 2) : outside of which nothing is drawn; None: everything, with no labels but
            the lamellas' numbers
        """
        shades = kit_colours(self.parts.kit.sizes)
        pieces = self.placed.chain_pieces
        upper = [
            piece is not None and self.lamellas.layer.get(piece.element) == UPPER
            for piece in pieces
        ]
        clip = None if window is None else (*window[0], *(window[1] - window[0]))
        if len(self.cells):
            self._draw_cells(ax, scale, origin, clip, shades)
        for over in (False, True) if not len(self.cells) else ():
            numbers = [k for k, above in enumerate(upper) if above == over]
            lines = [origin + self.lines[k] / scale for k in numbers]
            colours = [
                FAINT if (piece := pieces[k]) is None else shades[piece.kind][piece.part]
                for k in numbers
            ]
            if over and window is not None:
                near = map(self._near_joints, numbers, lines)
                gaps = [gap for of_rod in near for gap in of_rod]
                _add(ax, gaps, "white", _ROD * 2.6, clip)
            _add(ax, lines, colours, _ROD if window is not None else 0.8, clip)
        if window is None:
            for label in self._lamella_labels(scale):
                _write(ax, label, origin + label.places[0])
            return
        joints = origin + self.joints / scale
        inside = np.all((joints > window[0]) & (joints < window[1]), axis=1)
        ax.plot(*joints[inside].T, ls="", marker="o", ms=1.6, color=INK, zorder=4)
        corners = np.array([origin + at / scale for at in self.corners.values()]).reshape(-1, 2)
        inside = np.all((corners > window[0]) & (corners < window[1]), axis=1)
        ax.plot(*corners[inside].T, ls="", marker="D", ms=2.0, color=INK, zorder=4)
        labels, places, _ = self.labels(scale)
        for label, at in zip(labels, places):
            if np.all((origin + at > window[0] + 1) & (origin + at < window[1] - 1)):
                _write(ax, label, origin + at)
        for label in self._entering(scale, origin, window):
            _write(ax, label, label.places[0], zorder=6, bbox=_ON_LINES)

    def _draw_cells(
        self, ax: Axes, scale: float, origin: np.ndarray, clip: Any, shades: Mapping[str, Any]
    ) -> None:
        """Plates in their parts' colours, made lighter so that labels can be read on them."""
        colours = [
            0.45 * shades[piece.kind][piece.part] + 0.55 for piece in self.placed.pieces.pieces
        ]
        plates = PolyCollection(
            list(origin + self.cells / scale), facecolors=colours, edgecolors=INK, linewidths=0.4
        )
        ax.add_collection(plates, autolim=False)
        if clip is not None:
            plates.set_clip_path(Rectangle(clip[:2], *clip[2:], transform=ax.transData))

    def _near_joints(self, chain: int, line: np.ndarray) -> Iterator[np.ndarray]:
        """The bits of a rod piece next to the joints that it ends at."""
        for end, body in zip((0, -1), self.placed.ends[chain]):
            if int(body) in self.placed.joint_numbers:
                step = line[-1] - line[0]
                step = step / (np.linalg.norm(step) or 1.0) * (1 if end == 0 else -1)
                yield np.array([line[end], line[end] + _GAP * step])


def _write(ax: Axes, label: Label, at: np.ndarray, zorder: int = 5, **options: Any) -> None:
    ax.text(
        *at,
        label.text,
        size=label.size,
        rotation=label.angle,
        color=label.colour,
        weight=label.weight,
        ha="center",
        va="center" if "\n" in label.text else "center_baseline",
        rotation_mode="anchor",
        linespacing=1.15,
        zorder=zorder,
        parse_math=False,
        **options,
    )


def _add(ax: Axes, lines: Sequence[np.ndarray], colours: Any, width: float, clip: Any) -> None:
    collection = LineCollection(lines, colors=colours, linewidths=width, capstyle="butt")
    ax.add_collection(collection, autolim=False)
    if clip is not None:
        collection.set_clip_path(Rectangle(clip[:2], *clip[2:], transform=ax.transData))
