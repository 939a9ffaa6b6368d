"""Slit parts: what is left of the projection energy, how long slits get, and what the designs
gain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from kop_exudyn.drawing.style import FAINT, INK, PALETTE, style
from kop_exudyn.report.tradeoff_drawing import whole_numbers

_FORMS = ("o", "s", "^", "D", "v", "P", "X")


def draw_slits(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Projection energy, mean slit length and largest deviation against the number of parts, a line
    a cost of slits; and deviation against slit length. Rows: parts, cost (None: no slits),
    projection energy, mean slit %, max %.
    """
    costs = list(dict.fromkeys(row["cost"] for row in rows))
    with style():
        figure, axes = plt.subplots(2, 2, figsize=(7.4, 5.8), layout="constrained")
        energy, slit, fit, gain = axes.ravel()
        for number, cost in enumerate(costs):
            own = [row for row in rows if row["cost"] == cost]
            look = _look(number, len(costs), cost)
            for ax, x, y in (
                (energy, "parts", "projection energy"),
                (slit, "parts", "mean slit %"),
                (fit, "parts", "max %"),
                (gain, "mean slit %", "max %"),
            ):
                ax.plot(
                    _numbers(own, x),
                    _numbers(own, y),
                    **(look | ({"linestyle": ""} if ax is gain else {})),
                )
        energy.set(
            title="Projection energy", ylabel="relative to squared median length", yscale="log"
        )
        slit.set(title="Optimal slit length", ylabel="mean, % of median length", ylim=(0, None))
        fit.set(title="Fidelity", ylabel="largest deviation, % of the size", yscale="log")
        gain.set(
            title="Fidelity against slit length",
            xlabel="mean slit length, % of median length",
            ylabel="largest deviation, % of the size",
            yscale="log",
        )
        for ax in (energy, slit, fit):
            ax.set_xlabel("linear parts")
            whole_numbers(ax, [row["parts"] for row in rows])
        for ax in (fit, gain):
            _plain(ax)
        figure.legend(
            *energy.get_legend_handles_labels(),
            loc="outside lower center",
            ncols=min(len(costs), 5),
            title="cost of slits",
        )
    return figure


def draw_lengths(lengths: np.ndarray, kits: Sequence[tuple[str, np.ndarray]]) -> Figure:
    """The lengths of all elements, and below them those that the parts of some kits realise, a line
    a part.

    lengths : (n,) ; kits : (title, (m, 3) parts: two lengths and the slit's)
    """
    with style():
        figure, (top, bottom) = plt.subplots(
            2,
            1,
            figsize=(7.4, 2.2 + 0.75 * len(kits)),
            layout="constrained",
            sharex=True,
            height_ratios=(1.3, 0.75 * len(kits)),
        )
        top.hist(lengths, bins=60, color="#9ecae1", edgecolor="white", linewidth=0.3)
        top.set(ylabel="sides of elements", title="Lengths to realise, and what parts realise")
        for row, (_, parts) in enumerate(kits):
            lines = row + 0.36 * np.linspace(-1, 1, len(parts) + 2)[1:-1]
            for y, part in zip(lines, parts[np.argsort(parts[:, :2].mean(axis=1))]):
                bottom.hlines(y, *np.sort(part[:2]), color=FAINT, linewidth=0.8, zorder=1)
                bottom.hlines(
                    [y, y],
                    part[:2],
                    part[:2] + part[2],
                    color=PALETTE["blue"],
                    linewidth=3,
                    alpha=0.6,
                )
                bottom.plot(part[:2], [y, y], linestyle="", marker="|", color=INK, markersize=6)
        bottom.set(
            yticks=range(len(kits)),
            yticklabels=[title for title, _ in kits],
            ylim=(len(kits) - 0.5, -0.5),
            xlabel="length from joint to corner, m",
        )
        bottom.grid(axis="y", visible=False)
    return figure


def _look(number: int, count: int, cost: float | None) -> dict[str, Any]:
    """No slits: black; the cheaper slits are, the lighter."""
    colour = INK if cost is None else matplotlib.colormaps["viridis"](number / max(count, 2) * 0.9)
    return {
        "marker": _FORMS[number % len(_FORMS)],
        "markersize": 4.5,
        "color": colour,
        "linestyle": "--" if cost is None else "-",
        "label": "no slits" if cost is None else f"{cost:g}",
    }


def _numbers(rows: Sequence[Mapping[str, Any]], key: str) -> list[float]:
    return [np.nan if row[key] is None else row[key] for row in rows]


def _plain(ax: Axes) -> None:
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.yaxis.set_minor_formatter(NullFormatter())
