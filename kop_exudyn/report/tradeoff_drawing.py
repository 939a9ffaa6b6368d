"""Fidelity, kit size, energy and time against the number of parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, MultipleLocator, NullFormatter

from ..analysis.tradeoff import envelope
from ..drawing.style import FAINT, PALETTE, QUIET, style

Rows = Sequence[Mapping[str, Any]]


def draw_tradeoff(rows: Rows, kind: str, knee: int | None = None) -> Figure:
    """Four panels over the number of parts, from rows of `SizedKit.row` in the order of their
    sizes; points of which several have one size aren't joined.

    kind : the column that has the numbers: a kind of parts, or "parts" for all together
    knee : number of the row that is marked
    """
    sizes = [row[kind] for row in rows]
    with style():
        figure, axes = plt.subplots(2, 2, figsize=(7.4, 5.4), layout="constrained", sharex=True)
        fit, pieces, energy, cost = axes.ravel()
        _line(fit, sizes, [row["max %"] for row in rows], "o-", "blue", "largest of all designs")
        _line(
            fit, sizes, [row["mean %"] for row in rows], "s-", "vermillion", "mean of all designs"
        )
        best = envelope([row["max %"] for row in rows])
        fit.step(
            sizes,
            np.where(np.isfinite(best), best, np.nan),
            where="post",
            color=FAINT,
            zorder=0,
            label="the best with at most so many parts",
        )
        fit.set(title="Fidelity", ylabel="deviation, % of the size", yscale="log")
        _line(pieces, sizes, [row["kit size %"] for row in rows], "o-", "blue")
        pieces.set(title="Kit size", ylabel="pieces, % of all elements", ylim=(0, None))
        _line(energy, sizes, [row["largest energy ratio"] for row in rows], "o-", "blue")
        _line(energy, sizes, [row["energy ratio"] for row in rows], "s-", "vermillion")
        energy.axhline(1, color=QUIET, linewidth=0.8, zorder=0)
        energy.set(title="Elastic energy", ylabel="relative to the input designs'")
        _line(cost, sizes, [row["seconds"] for row in rows], "o-", "blue")
        cost.set(title="Time", ylabel="wall time of each kit, s", ylim=(0, None))
        for ax in axes[1]:
            ax.set_xlabel(kind if kind == "parts" else f"{kind} parts")
            whole_numbers(ax, sizes)
        plain_log(fit)
        figure.legend(*fit.get_legend_handles_labels(), loc="outside lower center", ncols=3)
        if knee is not None:
            _mark(axes.ravel(), fit, sizes[knee], rows[knee])
    return figure


def whole_numbers(ax: Axes, sizes: Sequence[int]) -> None:
    """Ticks for numbers of parts: every fifth, or all where there are few."""
    ax.xaxis.set_major_locator(MultipleLocator(5) if max(sizes) > 10 else MaxNLocator(integer=True))


def plain_log(ax: Axes) -> None:
    """Plain numbers on a logarithmic axis that may cover little more than a decade."""
    low, high = ax.get_ylim()
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    if high < 100 * low:
        ticks = [m * 10.0**k for k in range(-9, 10) for m in (1, 2, 5)]
        ax.set_yticks([tick for tick in ticks if low <= tick <= high])
    ax.yaxis.set_minor_formatter(NullFormatter())


def _line(
    ax: Axes,
    sizes: Sequence[int],
    values: Sequence[float | None],
    form: str,
    colour: str,
    label: str | None = None,
) -> None:
    ax.plot(
        sizes,
        [np.nan if value is None else value for value in values],
        form if len(set(sizes)) == len(sizes) else form.removesuffix("-"),
        color=PALETTE[colour],
        label=label,
        markersize=4.5,
    )


def _mark(panels: Sequence[Axes], fit: Axes, size: int, row: Mapping[str, Any]) -> None:
    for ax in panels:
        ax.axvline(size, color=QUIET, linestyle=":", linewidth=1.2, zorder=0)
    if row["max %"] is not None:
        fit.plot(
            size,
            row["max %"],
            "o",
            markersize=11,
            markerfacecolor="none",
            markeredgecolor=PALETTE["black"],
        )
        fit.annotate(
            "knee",
            (size, row["max %"]),
            xytext=(-9, -9),
            textcoords="offset points",
            ha="right",
            va="top",
        )
