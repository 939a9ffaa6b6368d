"""A new design on a kit that exists: figures over w_c, and where elements get other parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from kop_exudyn.drawing.lines import draw_lines
from kop_exudyn.drawing.style import FAINT, PALETTE, QUIET, style
from kop_exudyn.fabrication.pieces import DesignPieces
from kop_exudyn.fabrication.placement import PlacedPieces
from kop_exudyn.report.designs import project
from kop_exudyn.structures.base import Design

_STATES = (
    ("relaxed", "relaxed elements", "o-", "green"),
    ("built", "built of parts", "s-", "blue"),
    ("reassigned", "parts exchanged", "^-", "vermillion"),
)


def draw_projection(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Deviation, elastic energy, distance to the parts and changed elements over w_c, from the rows
    of a table."""
    weights = [row["w_c"] for row in rows]
    with style():
        figure, axes = plt.subplots(2, 2, figsize=(7.4, 5.4), layout="constrained", sharex=True)
        fit, energy, tight, changes = axes.ravel()
        for state, label, form, colour in _STATES:
            for ax, key in ((fit, "max %"), (energy, "energy ratio")):
                _line(ax, weights, [row[f"{state} {key}"] for row in rows], form, colour, label)
        for ax, key in ((fit, "direct max %"), (energy, "direct energy ratio")):
            if rows[0][key] is not None:
                ax.axhline(rows[0][key], color=QUIET, linestyle=":", label="direct")
        fit.set(title="Fidelity", ylabel="largest deviation, % of the size", yscale="log")
        energy.set(title="Elastic energy", ylabel="relative to the input design's", yscale="log")
        kinds = [key.removesuffix(" distance %") for key in rows[0] if key.endswith(" distance %")]
        for kind, form, colour in zip(kinds, ("o-", "s-", "^-"), ("blue", "vermillion", "green")):
            _line(tight, weights, [row[f"{kind} distance %"] for row in rows], form, colour, kind)
        tight.set(
            title="Relaxed elements to their parts", ylabel="rms distance, % of scale", yscale="log"
        )
        for state, label, form, colour in _STATES[1:]:
            _line(changes, weights, [row[f"{state} changes"] for row in rows], form, colour, label)
        changes.set(title="Other parts than direct", ylabel="elements", ylim=(0, None))
        for ax in (fit, energy, tight):
            ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            ax.yaxis.set_minor_formatter(NullFormatter())
        for ax in axes.ravel():
            ax.set_xscale("log")
        tight.legend()
        figure.legend(*fit.get_legend_handles_labels(), loc="outside lower center", ncols=4)
        for ax in axes[1]:
            ax.set_xlabel("w_c, over the weight of the fit")
    return figure


def draw_changes(design: Design, states: Sequence[tuple[str, Mapping[str, Any]]]) -> Figure:
    """The built design for several w_c; elements that have another part than after direct
    projection are coloured.

    states : (title, state as `project_design` gives it)
    """
    placed = PlacedPieces.of(DesignPieces(design, ()))
    with style():
        columns = min(len(states), 3)
        figure, axes = plt.subplots(
            -(-len(states) // columns),
            columns,
            squeeze=False,
            layout="constrained",
            figsize=(7.4, 2.3 * -(-len(states) // columns) + 0.4),
        )
        for ax in axes.ravel():
            ax.set_axis_off()
        for ax, (title, state) in zip(axes.ravel(), states):
            ax.set_title(title, loc="center")
            _draw_changed(ax, placed, state)
        handles = [
            plt.Line2D(
                [], [], color=PALETTE["vermillion"], linewidth=2, label="another linear part"
            ),
            plt.Line2D(
                [],
                [],
                color=PALETTE["blue"],
                marker="o",
                linestyle="",
                markersize=4,
                label="another angular part",
            ),
            plt.Line2D([], [], color=FAINT, linewidth=1.2, label="same part"),
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def _draw_changed(ax: Axes, placed: PlacedPieces, state: Mapping[str, Any]) -> None:
    if "positions" not in state:
        ax.text(0.5, 0.5, "no equilibrium", transform=ax.transAxes, ha="center", color=QUIET)
        return
    scene, places = placed.scene, project(np.array(state["positions"]))[0]
    changed = set(state["changed"])
    lines = [places[scene.node_body[chain.nodes]] for chain in scene.chains]
    other = [parameter in changed for parameter in scene.chain_parameters.tolist()]
    for kept in (True, False):  # changed ones above the others
        draw_lines(
            ax,
            [line for line, is_other in zip(lines, other) if is_other != kept],
            FAINT if kept else PALETTE["vermillion"],
            1.0 if kept else 1.8,
        )
    corners = [corner.body for parameter, corner in placed.corners.items() if parameter in changed]
    ax.plot(*places[corners].T, "o", color=PALETTE["blue"], markersize=2.6)
    ax.set_aspect("equal")
    ax.update_datalim(np.concatenate(lines))
    ax.autoscale_view()


def _line(
    ax: Axes, x: Sequence[float], values: Sequence[float | None], form: str, colour: str, label: str
) -> None:
    ax.plot(
        x,
        [np.nan if value is None else value for value in values],
        form,
        color=PALETTE[colour],
        label=label,
        markersize=4,
    )
