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
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from scipy.spatial import cKDTree

from ..drawing.colours import kit_colours
from ..drawing.labels import Label, place
from ..drawing.style import FAINT, INK, QUIET, save_figure, style
from ..files.files import file_stem, make_folder
from ..kit.kinds import has_joint, part_kind
from ..scene.state import State
from .assembly import stands_on_edge
from .cells import sorts_of_arms
from .lamellas import UPPER, Lamellas
from .options import millimetres
from .paper import SCALES, Book, fitting_scale, scale_name
from .pieces import PartsList, Piece
from .placement import PlacedPieces

_SIDE_ROOM = 9.0  # mm that the median side is long on paper, at least: room for its label
_CELL_ROOM = 6.0  # mm between the middles of neighbouring cells, at least
_BESIDE = 1.7  # mm from a rod's axis to the middle of the text beside it
_GAP = 1.1  # mm on either side of a crossing in which the lower rod isn't drawn
_ROD = 2.0  # points
_OVERLAP = 12.0  # mm that neighbouring pages share
_EDGE = 3.0  # mm at a page's edge in which labels may be missing
_MARGIN = 12.0  # mm around the drawing on a sheet of its own
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
        window (2, 2) : outside of which nothing is drawn; None: everything, without labels
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
            return
        joints = origin + self.joints / scale
        inside = np.all((joints > window[0]) & (joints < window[1]), axis=1)
        ax.plot(*joints[inside].T, ls="", marker="o", ms=1.6, color=INK, zorder=4)
        corners = np.array([origin + at / scale for at in self.corners.values()]).reshape(-1, 2)
        inside = np.all((corners > window[0]) & (corners < window[1]), axis=1)
        ax.plot(*corners[inside].T, ls="", marker="D", ms=2.0, color=INK, zorder=4)
        labels, places, _ = self.labels(scale)
        for label, at in zip(labels, places):
            x, y = origin + at
            if np.all(([x, y] > window[0] + 1) & ([x, y] < window[1] - 1)):
                ax.text(
                    x,
                    y,
                    label.text,
                    size=label.size,
                    rotation=label.angle,
                    color=label.colour,
                    weight=label.weight,
                    ha="center",
                    va="center" if "\n" in label.text else "center_baseline",
                    rotation_mode="anchor",
                    linespacing=1.15,
                    zorder=5,
                    parse_math=False,
                )

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


def _add(ax: Axes, lines: Sequence[np.ndarray], colours: Any, width: float, clip: Any) -> None:
    collection = LineCollection(lines, colors=colours, linewidths=width, capstyle="butt")
    ax.add_collection(collection, autolim=False)
    if clip is not None:
        collection.set_clip_path(Rectangle(clip[:2], *clip[2:], transform=ax.transData))


def assembly_drawing(parts: PartsList, name: str, unit: str) -> AssemblyDrawing:
    """The drawing of one design, as it is assembled.

    Lamellas are drawn in the state in which they are put together: the flat one, where the design
    has one, else the deployed one. Parts of other kinds are drawn where the design's geometry has
    them before anything is opened. Seen across its mean plane, from the side to which joint axes
    point; the longest extent lies across the paper.

    unit : the designs' unit of length
    Raises InputError for a design that isn't there.
    """
    scale, number = millimetres(unit), parts.row_of(name)
    pieces = parts.designs[number]
    design = pieces.design
    role = next((role.name for role in design.roles if not role.fitted), design.fitted_role.name)
    placed = PlacedPieces.of(pieces, role)
    flat = any(has_joint(part_kind(piece.kind)) for piece in pieces.pieces)
    state = parts.states[number][role] if parts.states and flat else placed.scene.initial
    if design.hardware is not None:  # a scene begins with what holds it where that is in the end
        positions = state.positions.copy()
        positions[design.joints] = design.hardware.joints
        state = State(positions, state.rotations, state.angles)
    return flattened(parts, placed, state, scale)


def flattened(
    parts: PartsList, placed: PlacedPieces, state: State, scale: float = 1.0
) -> AssemblyDrawing:
    """A state projected along the direction in which the joints extend least, as narrow as it can
    be.

    scale : millimetres of the design's unit of length
    """
    scene = placed.scene
    x, joints = scene.node_poses(state)[0], state.positions[placed.design.joints]
    centre = joints.mean(axis=0)
    right, _, normal = np.linalg.svd(joints - centre)[2]
    if normal @ state.rotations[placed.design.joints][:, :, 2].mean(axis=0) < 0:
        normal = -normal
    plane = np.stack([right, np.cross(normal, right)], axis=1)
    axes = scale * plane @ _turn_across((joints - centre) @ plane)
    flat = (x - centre) @ axes
    return AssemblyDrawing(
        parts,
        placed,
        [flat[chain.nodes] for chain in scene.chains],
        (joints - centre) @ axes,
        {p: (state.positions[c.body] - centre) @ axes for p, c in placed.corners.items()},
        _plates(placed, centre, axes),
    )


def _turn_across(points: np.ndarray) -> np.ndarray:
    """(2, 2) turn after which points (n, 2) @ it take the smallest rectangle, its long side lying
    across."""
    around = shapely.minimum_rotated_rectangle(shapely.MultiPoint(points))
    if around.geom_type != "Polygon":
        return np.eye(2)
    corners = np.array(around.exterior.coords)
    sides = np.diff(corners[:3], axis=0)
    x, y = sides[np.argmax(np.linalg.norm(sides, axis=1))]
    length = np.hypot(x, y) * (1 if x >= 0 else -1)
    return np.array([[x, -y], [y, x]]) / length


def _plates(placed: PlacedPieces, centre: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """(n_cells, 3, 2) plates of a design of cells; none of others."""
    hardware = placed.design.hardware
    if hardware is None:
        return np.zeros((0, 3, 2))
    corners = np.dstack([hardware.corners, np.full(hardware.corners.shape[:2], centre[2])])
    return (corners - centre) @ axes


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
    drawing: AssemblyDrawing, folder: str | Path, *, overwrite: bool = False
) -> list[Path]:
    """Write assembly_DESIGN.svg, all of it on one sheet; returns its path.

    Raises InputError when a file can't be written.
    """
    stem = make_folder(folder) / f"assembly_{file_stem(drawing.name)}"
    return save_figure(draw_assembly(drawing), stem, ("svg",), overwrite=overwrite)


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
        return f"{text} · diamonds: corners (·f: flipped, turned over)"
    return (
        f"{text}\ndiamonds: corners, bent so that the lamella rises towards you at its ends (·f: "
        "flipped, it falls away)"
    )


def _neighbours(place: np.ndarray, names: Mapping[tuple[int, ...], int]) -> str:
    """Which parts lie to the left, right, above and below a place.

    names : number of the part at each place that has one, columns and rows counted from below
    """
    sides = {"left": (-1, 0), "right": (1, 0), "above": (0, 1), "below": (0, -1)}
    near = {side: names.get(tuple((place + step).tolist())) for side, step in sides.items()}
    return ", ".join(f"{side} {number}" for side, number in near.items() if number is not None)
