"""Figures of the benchmark: time against error, time by phase and memory against size, objective
over SQP steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from kop_exudyn.drawing.style import INK, PALETTE, style

_MARKERS = "osD^vP"
_FLOOR = 1e-6  # %: errors below are drawn there
_LIMIT_MIB = 2048


def _series(
    axes: Axes, rows: Sequence[Mapping[str, Any]], label: str, colour: str, marker: str
) -> None:
    """Medians with bars from the least to the most, numbered by elements a piece."""
    rows = [row for row in rows if row["error %"] is not None]
    if not rows:
        return
    seconds = np.array([row["seconds"] for row in rows])
    errors = np.maximum([row["error %"] for row in rows], _FLOOR)
    bars = np.array(
        [[row["seconds"] - row["least"], row["most"] - row["seconds"]] for row in rows]
    ).T
    axes.errorbar(
        seconds,
        errors,
        xerr=bars,
        fmt=f"{marker}-",
        color=colour,
        label=label,
        markersize=5,
        capsize=2,
        elinewidth=0.8,
    )
    for row, x, y in zip(rows, seconds, errors):
        axes.annotate(
            str(row["elements a piece"]),
            (x, y),
            xytext=(4, 4),
            textcoords="offset points",
            fontsize=7,
            color=colour,
        )


def error_against_time(rows: Sequence[Mapping[str, Any]], key: str = "case") -> Figure:
    """One line a value of `key`."""
    with style():
        figure, axes = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
        names = list(dict.fromkeys(row[key] for row in rows))
        for name, colour, marker in zip(names, PALETTE.values(), _MARKERS):
            _series(axes, [row for row in rows if row[key] == name], name, colour, marker)
        axes.set(
            xscale="log",
            yscale="log",
            xlabel="time, s",
            ylabel="largest joint error, % of bounding box",
        )
        axes.legend()
    return figure


def ways_compared(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """One panel a case, one line a way; ways that got nowhere are named below the axis."""
    cases = list(dict.fromkeys(row["case"] for row in rows))
    ways = list(dict.fromkeys(row["way"] for row in rows))
    with style():
        figure, panels = plt.subplots(
            1, len(cases), figsize=(3.1 * len(cases), 3.4), layout="constrained", squeeze=False
        )
        for axes, case in zip(panels[0], cases):
            lost = []
            for way, colour, marker in zip(ways, PALETTE.values(), _MARKERS):
                own = [row for row in rows if row["case"] == case and row["way"] == way]
                lost += [way] if all(row["error %"] is None for row in own) else []
                _series(axes, own, way, colour, marker)
            note = f"\n(no solution: {', '.join(lost)})" if lost else ""
            axes.set(xscale="log", yscale="log", xlabel=f"time, s{note}", title=case)
            # a decade alone has one label
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0), numticks=12))
            axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axes.xaxis.set_minor_formatter(NullFormatter())
        panels[0][0].set_ylabel("largest joint error, % of bounding box")
        handles = [
            plt.Line2D([], [], color=colour, marker=marker, label=way)
            for way, colour, marker in zip(ways, PALETTE.values(), _MARKERS)
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=len(ways))
    return figure


def scaling_figure(rows: Sequence[Mapping[str, Any]], phases: Sequence[str]) -> Figure:
    """Left: seconds of a whole solve, by phase. Right: peak memory."""
    unknowns = [row["unknowns"] for row in rows]
    with style():
        figure, (left, right) = plt.subplots(1, 2, figsize=(7.4, 3.4), layout="constrained")
        left.loglog(
            unknowns, [row["seconds"] for row in rows], "o-", color=INK, label="whole solve"
        )
        for phase, colour, marker in zip(phases, PALETTE.values(), _MARKERS[1:]):
            left.loglog(
                unknowns,
                [row[phase] for row in rows],
                f"{marker}--",
                color=colour,
                label=phase,
                markersize=4,
            )
        left.set(xlabel="unknowns", ylabel="time, s", title="Time")
        left.legend()
        peaks = [row["peak MiB"] for row in rows]
        right.plot(unknowns, peaks, "o-", color=PALETTE["blue"], label="peak of the process")
        right.axhline(
            _LIMIT_MIB, color=PALETTE["vermillion"], linestyle=":", label="allowed at 100,000"
        )
        right.set(xlabel="unknowns", ylabel="memory, MiB", ylim=(0, None), title="Memory")
        right.legend()
    return figure


def steps_figure(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Objective after each SQP step, one line a Hessian."""
    with style():
        figure, axes = plt.subplots(figsize=(5.2, 3.4), layout="constrained")
        for row, colour, marker in zip(rows, PALETTE.values(), _MARKERS):
            axes.semilogy(
                row["values"], f"{marker}-", color=colour, markersize=4, label=row["Hessian"]
            )
        axes.set(xlabel="accepted SQP steps", ylabel="objective")
        axes.legend(title="Hessian", title_fontsize=8.5)
    return figure
