"""States of designs side by side in 3D: rods as lines, joints coloured by their deviation from the
target.

Drawn in parallel projection on plain 2D axes: mplot3d neither fills its place nor keeps its lines
inside.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from ..drawing.lines import draw_lines
from ..drawing.style import FAINT, QUIET, deviation_colours, style

_ELEVATION, _AZIMUTH = np.radians(38.0), np.radians(-62.0)  # curvature in both directions shows
_WIDTH = 3.1  # inches of one state
_NEAR, _FAR = 0.13, 0.62  # grey of the nearest and the farthest rods: a cue for depth
_GREYS = 32  # of these that are told apart


@dataclass(frozen=True)
class DrawnState:
    """One state of a design.

    title : what it is called, as "direct"
    chains : list of (k, 3), the rods' nodes in order
    joints : (n, 3) ; deviation_percent : (n,) their distance to the target, % of its size
    failed : why there is no such state; the rest is empty then
    """

    title: str
    chains: Sequence[np.ndarray] = ()
    joints: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    deviation_percent: np.ndarray = field(default_factory=lambda: np.empty(0))
    failed: str | None = None


@dataclass(frozen=True)
class DrawnDesign:
    """A design, its states (columns of the figure, the same for all designs), and the rods of the
    shape wanted."""

    name: str
    states: Sequence[DrawnState]
    wanted: Sequence[np.ndarray] = ()


@dataclass(frozen=True)
class _View:
    """What a design's states are drawn in: the drawing's box (2, 2), the nearest and the farthest
    depth."""

    box: np.ndarray
    near: float
    far: float


def draw_designs(
    designs: Sequence[DrawnDesign], limit_percent: float | None = None, quantity: str = "deviation"
) -> Figure:
    """One row a design, one column a state, each row in its own scale; one scale of colours for
    all.

    The states' titles stand above the columns, or in each panel where the rows have different ones.

    limit_percent : deviation of the darkest colour; default: the largest one that is drawn
    quantity : what the colours tell
    """
    alike = len({tuple(state.title for state in design.states) for design in designs}) == 1
    columns = max(len(design.states) for design in designs)
    views = [
        _view([*design.wanted, *(chain for state in design.states for chain in state.chains)])
        for design in designs
    ]
    deviations = [state.deviation_percent for design in designs for state in design.states]
    largest = max((float(np.max(d)) for d in deviations if len(d)), default=0.0)
    norm = Normalize(0, limit_percent or largest or 1.0)
    heights = [
        float(np.clip(0.92 * _WIDTH * np.ptp(view.box[:, 1]) / np.ptp(view.box[:, 0]), 1.1, 3.6))
        + 0.65
        for view in views
    ]
    with style():
        figure = Figure(figsize=(_WIDTH * columns + 0.95, sum(heights) + 0.35))
        grid = figure.add_gridspec(
            len(designs),
            columns,
            left=0.01,
            right=1 - 0.95 / figure.get_figwidth(),
            bottom=0.005,
            top=1 - 0.33 / figure.get_figheight(),
            wspace=0.04,
            hspace=0.0,
            height_ratios=heights,
        )
        for row, (design, view) in enumerate(zip(designs, views)):
            for column, state in enumerate(design.states):
                ax = figure.add_subplot(grid[row, column])
                _draw_state(ax, state, design.wanted, view, norm)
                if not alike:
                    ax.text(0.5, 0.985, state.title, transform=ax.transAxes, ha="center", va="top")
                elif row == 0:
                    ax.set_title(state.title, loc="center", pad=4)
                if column == 0:
                    ax.text(
                        0.0, 0.985, design.name, transform=ax.transAxes, va="top", weight="bold"
                    )
        _colour_bar(
            figure, norm, quantity, beyond=limit_percent is not None and largest > limit_percent
        )
    return figure


def project(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Parallel projection of points (n, 3): places in the drawing (n, 2), and depths (n,), larger
    ones farther."""
    points = np.asarray(points, dtype=float)
    ca, sa, ce, se = np.cos(_AZIMUTH), np.sin(_AZIMUTH), np.cos(_ELEVATION), np.sin(_ELEVATION)
    right, up = np.array([-sa, ca, 0]), np.array([-se * ca, -se * sa, ce])
    return points @ np.stack([right, up], axis=1), -points @ np.array([ce * ca, ce * sa, se])


def _view(chains: Sequence[np.ndarray]) -> _View:
    places, depths = project(np.concatenate(chains) if chains else np.array([[0.0] * 3, [1.0] * 3]))
    low, high = places.min(axis=0), places.max(axis=0)
    margin = 0.03 * np.linalg.norm(high - low)
    return _View(np.stack([low - margin, high + margin]), float(depths.min()), float(depths.max()))


def _draw_state(
    ax: Axes, state: DrawnState, wanted: Sequence[np.ndarray], view: _View, norm: Normalize
) -> None:
    ax.set_axis_off()
    if state.failed is not None:
        ax.text(
            0.5,
            0.5,
            "no equilibrium:\n" + textwrap.fill(state.failed, 34),
            transform=ax.transAxes,
            ha="center",
            va="center",
            color=QUIET,
        )
        return
    (left, bottom), (right, top) = view.box
    room = 0.12 * (top - bottom)  # for the name above and the figures below
    ax.set(xlim=(left, right), ylim=(bottom - room, top + room), aspect="equal")
    if wanted:
        draw_lines(ax, [project(chain)[0] for chain in wanted], FAINT, 0.7)
    _draw_rods(ax, state.chains, view)
    places, depths = project(state.joints)
    order = np.argsort(-depths)  # nearer joints over farther ones
    ax.scatter(
        *places[order].T,
        c=np.asarray(state.deviation_percent)[order],
        cmap=deviation_colours(),
        norm=norm,
        s=15,
        edgecolors="#222222",
        linewidths=0.3,
        zorder=3,
    )
    if len(state.deviation_percent):
        worst, mean = np.max(state.deviation_percent), np.mean(state.deviation_percent)
        ax.text(
            0.5,
            0.012,
            f"max {worst:.2g} %   mean {mean:.2g} %",
            transform=ax.transAxes,
            ha="center",
            color=QUIET,
            size=8.5,
        )


def _draw_rods(ax: Axes, chains: Sequence[np.ndarray], view: _View) -> None:
    """Every element a line, the farther the lighter, the nearer over the farther."""
    if not chains:
        return
    ends = np.concatenate(
        [np.stack([chain[:-1], chain[1:]], axis=1) for chain in map(np.asarray, chains)]
    )
    places, depths = project(ends.reshape(-1, 3))
    depth = depths.reshape(-1, 2).mean(axis=1)
    order = np.argsort(-depth)
    share = (depth[order] - view.near) / (view.far - view.near or 1.0)
    levels = np.round(np.clip(share, 0, 1) * (_GREYS - 1))
    lines = places.reshape(-1, 2, 2)[order]
    for level in np.unique(levels)[::-1]:  # in the same order: the farther, the lighter
        grey = _NEAR + (_FAR - _NEAR) * level / (_GREYS - 1)
        draw_lines(ax, lines[levels == level], str(grey), 1.0, capstyle="round")


def _colour_bar(figure: Figure, norm: Normalize, quantity: str, beyond: bool) -> None:
    width, height = figure.get_figwidth(), figure.get_figheight()
    length = min(2.4, 0.7 * height)
    place = figure.add_axes(
        (1 - 0.8 / width, 0.5 - 0.5 * length / height, 0.12 / width, length / height)
    )
    bar = figure.colorbar(
        ScalarMappable(norm, deviation_colours()), cax=place, extend="max" if beyond else "neither"
    )
    bar.set_label(f"{quantity}, % of size")
    bar.outline.set_visible(False)
