"""Assembly drawings: a design laid out flat, every piece labelled where and as it is built in.

Rods carry their part's label along the side that is the part's side 1, and the element's number of
the assembly plan along the other one; corners carry their part's label, with "-" where they are
built in flipped.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from ..drawing.colours import kit_colours
from ..drawing.style import FAINT, INK, QUIET, save_figure, style
from ..files.files import file_stem, make_folder
from ..kit.kinds import part_kind
from ..scene.state import State
from ..search.objective import Evaluation
from ..search.result import KitResult
from .pieces import PartsList, Piece, parts_list_of
from .placement import PlacedPieces

_SIDE_ROOM = 0.42  # inches that the median side is long on paper: room for its label
_LEAST, _MOST = 8.0, 45.0  # inches of the drawing's longer side
_MARGIN = 0.6  # inches


def save_assembly_drawings(
    result: KitResult,
    folder: str | Path,
    *,
    suffixes: Sequence[str] = ("svg", "pdf"),
    overwrite: bool = False,
) -> list[Path]:
    """Write assembly_DESIGN.svg and .pdf for every design of a result; returns their paths.

    Drawn in the assembled state where the design has one, as it is built from the kit; the input
    design's state stands in where no equilibrium of the assigned design was found. Raises
    InputError when a file can't be written.
    """
    parts, folder, done = parts_list_of(result), make_folder(folder), []
    for design, reference, outcome in zip(
        result.designs, result.references, result.stages["assigned"].designs
    ):
        role = next(
            (role.name for role in design.roles if not role.fitted), design.fitted_role.name
        )
        found = outcome if isinstance(outcome, Evaluation) else reference
        figure = draw_assembly(parts, design.name, found.equilibria[role].state, role)
        done += save_figure(
            figure, folder / f"assembly_{file_stem(design.name)}", suffixes, overwrite=overwrite
        )
    return done


@dataclass(frozen=True)
class _Sheet:
    """Rods in the plane: their nodes (k, 2), joints (n, 2) and corners by parameter."""

    lines: list[np.ndarray]
    joints: np.ndarray
    corners: dict[int, np.ndarray]


def draw_assembly(parts: PartsList, name: str, state: State, role: str) -> Figure:
    """The drawing of one design.

    state, role : the state in which it is drawn, seen across its mean plane from the side to which
        joint axes point: that of the flat assembly where the design has one, otherwise the deployed
        one
    Raises InputError for a design that isn't there.
    """
    parts.needed([name])
    placed = PlacedPieces.of(next(d for d in parts.designs if d.design.name == name), role)
    sheet = _flattened(placed, state)
    size = _paper(sheet)
    with style():
        figure = Figure(figsize=size)
        left, bottom = _MARGIN / size[0], _MARGIN / size[1]
        ax = figure.add_axes((left, bottom, 1 - 2 * left, 1 - 2 * bottom))
        ax.set_axis_off()
        ax.set_aspect("equal")
        _draw_rods(ax, parts, placed, sheet)
        for piece in placed.pieces.pieces:
            _label(ax, parts, placed, sheet, piece)
        _draw_joints(ax, sheet)
        figure.text(left, 1 - 0.35 / size[1], name, size=11, weight="bold", va="center")
        figure.text(left, 0.3 / size[1], _explanation(placed), size=7.5, color=QUIET, va="center")
    return figure


def _flattened(placed: PlacedPieces, state: State) -> _Sheet:
    """Projected along the direction in which the joints extend least; the longest extent lies
    across the paper."""
    scene = placed.scene
    x, joints = scene.node_poses(state)[0], state.positions[placed.design.joints]
    centre = joints.mean(axis=0)
    right, _, normal = np.linalg.svd(joints - centre)[2]
    if normal @ state.rotations[placed.design.joints][:, :, 2].mean(axis=0) < 0:
        normal = -normal
    axes = np.stack([right, np.cross(normal, right)], axis=1)
    flat = (x - centre) @ axes
    return _Sheet(
        [flat[chain.nodes] for chain in scene.chains],
        (joints - centre) @ axes,
        {p: (state.positions[c.body] - centre) @ axes for p, c in placed.corners.items()},
    )


def _paper(sheet: _Sheet) -> tuple[float, float]:
    """Width and height in inches."""
    sides = [np.linalg.norm(line[-1] - line[0]) for line in sheet.lines]
    extent = np.ptp(np.concatenate(sheet.lines), axis=0)
    scale = np.clip(_SIDE_ROOM / np.median(sides) * extent.max(), _LEAST, _MOST) / extent.max()
    width, height = scale * extent + 2 * _MARGIN
    return max(width, 5.0), max(height, 2.0)


def _draw_rods(ax: Axes, parts: PartsList, placed: PlacedPieces, sheet: _Sheet) -> None:
    shades = kit_colours(parts.kit.sizes)
    colours = [
        FAINT if piece is None else shades[piece.kind][piece.part] for piece in placed.chain_pieces
    ]
    ax.add_collection(LineCollection(sheet.lines, colors=colours, linewidths=2.2, capstyle="butt"))
    ax.autoscale_view()


def _draw_joints(ax: Axes, sheet: _Sheet) -> None:
    ax.scatter(*sheet.joints.T, s=34, color="white", edgecolors=INK, linewidths=0.7, zorder=4)
    for number, (x, y) in enumerate(sheet.joints, 1):
        ax.text(x, y, str(number), size=3.6, ha="center", va="center", zorder=5)


def _label(ax: Axes, parts: PartsList, placed: PlacedPieces, sheet: _Sheet, piece: Piece) -> None:
    label, kind = parts.label(piece), part_kind(piece.kind)
    if kind.angular:
        if piece.parameters[0] in sheet.corners:
            at, corner = sheet.corners[piece.parameters[0]], placed.corners[piece.parameters[0]]
            ax.plot(*at, marker="D", ms=2.2, color=INK, zorder=4)
            line = sheet.lines[(corner.before or corner.after)[0]]
            ax.annotate(
                ("-" if piece.values[0] < 0 else "") + label,
                at,
                5.5 * _beside(line)[1],
                textcoords="offset points",
                size=4.2,
                ha="center",
                va="center",
                color=INK,
            )
        return
    chains = [chain for parameter in piece.parameters for chain in placed.chains.get(parameter, ())]
    if placed.joint_of(piece) is None or len(chains) != len(piece.parameters):
        middle = np.mean([sheet.lines[chain].mean(axis=0) for chain in chains], axis=0)
        turned = " mirrored" if piece.variant == "mirrored" else ""
        ax.text(
            *middle,
            f"{label}{turned}\n{piece.element}",
            size=5.5,
            ha="center",
            va="center",
            color=INK,
        )
        return
    for chain, column in zip(chains, piece.columns):
        if column == 0 or len(chains) == 1:
            side = "" if column == 0 else f"·{column + 1}"
            _along(ax, sheet.lines[chain], label + side, 5.2, INK, "bold")
        if column or len(chains) == 1:
            _along(
                ax,
                sheet.lines[chain],
                str(piece.element),
                4.2,
                QUIET,
                "normal",
                below=len(chains) == 1,
            )


def _along(
    ax: Axes,
    line: np.ndarray,
    text: str,
    size: float,
    colour: str,
    weight: str,
    below: bool = False,
) -> None:
    """Text beside a line's middle, along it, never upside down."""
    angle, across = _beside(line)
    across = (-4.5 if below else 4.5) * across
    ax.annotate(
        text,
        (line[0] + line[-1]) / 2,
        across,
        textcoords="offset points",
        size=size,
        ha="center",
        va="center",
        rotation=angle,
        rotation_mode="anchor",
        color=colour,
        weight=weight,
    )


def _beside(line: np.ndarray) -> tuple[float, np.ndarray]:
    """Degrees at which text along a line can be read, upright lines all from the same side; unit
    vector to above it."""
    step = line[-1] - line[0]
    angle = (np.degrees(np.arctan2(step[1], step[0])) + 75) % 180 - 75
    return angle, np.array([-np.sin(np.radians(angle)), np.cos(np.radians(angle))])


def _explanation(placed: PlacedPieces) -> str:
    kinds = {piece.kind for piece in placed.pieces.pieces}
    if any(placed.joint_of(piece) is not None for piece in placed.pieces.pieces):
        text = (
            "bold: part, along its side 1 (·2: only its side 2 is used); grey: number of the "
            "element in the "
            "assembly plan; circles: joints"
        )
    else:
        text = "part, and below it the number of the element in the assembly plan; circles: joints"
    return text + (
        "; diamonds: corners, - for flipped" if any(part_kind(k).angular for k in kinds) else ""
    )
