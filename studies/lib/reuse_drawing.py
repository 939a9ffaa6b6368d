"""Who uses which parts, how much designs share, and how that depends on the number of parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kop_exudyn.drawing.style import INK, PALETTE, QUIET, style
from kop_exudyn.report.tradeoff_drawing import whole_numbers

_MAP = "Blues"  # ordered by brightness, for all kinds of sight


def draw_sharing(
    names: Sequence[str], counts: np.ndarray, labels: Sequence[str], jaccard: np.ndarray
) -> Figure:
    """Pieces of each part in each design, and the Jaccard index of every pair.

    counts (n, m) with part labels (m,); jaccard (n, n)
    """
    n, m = counts.shape
    with style():
        figure, (left, right) = plt.subplots(
            1,
            2,
            figsize=(3.6 + 0.27 * m + 0.45 * n, 1.6 + 0.42 * n),
            layout="constrained",
            width_ratios=(0.27 * m + 1, 0.45 * n + 1),
        )
        _table(
            left,
            counts,
            [f"{count:d}" if count else "" for count in counts.ravel()],
            labels,
            names,
            counts.max(),
        )
        left.set(title="Pieces of each part", xlabel="part")
        _table(right, jaccard, [f"{value:.2f}" for value in jaccard.ravel()], names, names, 1.0)
        right.set_title("Jaccard index")
        plt.setp(right.get_xticklabels(), rotation=35, ha="right", rotation_mode="anchor")
    return figure


def draw_subsets(subsets: Sequence[Mapping[str, Any]], names: Sequence[str]) -> Figure:
    """The reuse of every set of designs: one dot a set, one column a number of designs, the best
    and worst named."""
    sizes = sorted({len(subset["designs"]) for subset in subsets})
    with style():
        figure, ax = plt.subplots(figsize=(7.4, 3.4), layout="constrained")
        for size in sizes:
            own = sorted(
                (s for s in subsets if len(s["designs"]) == size), key=lambda s: s["reuse"]
            )
            values = [s["reuse"] for s in own]
            ax.plot(
                size + 0.12 * _spread(values),
                values,
                "o",
                color=PALETTE["blue"],
                markersize=5,
                alpha=0.75,
                markeredgewidth=0,
                label="one set of designs" if size == sizes[0] else None,
            )
            ax.hlines(
                np.mean(values),
                size - 0.22,
                size + 0.22,
                color=PALETTE["vermillion"],
                linewidth=2,
                label="mean" if size == sizes[0] else None,
            )
            for s, place in ((own[-1], 6), (own[0], -12))[: min(2, len(own))]:
                few = (
                    s["designs"]
                    if size <= len(names) / 2
                    else [k for k in range(len(names)) if k not in s["designs"]]
                )
                text = ", ".join(names[k] for k in few)
                text = text if few is s["designs"] else f"all but {text}" if few else "all"
                ax.annotate(
                    text,
                    (size, s["reuse"]),
                    xytext=(0, place),
                    textcoords="offset points",
                    ha="center",
                    fontsize=7.5,
                    color=QUIET,
                )
        ax.set(
            xlabel="designs in the set",
            ylabel="pieces used by all / by any",
            xlim=(sizes[0] - 0.5, sizes[-1] + 0.5),
        )
        ax.margins(y=0.18)
        ax.set_xticks(sizes)
        ax.legend(loc="upper right")
    return figure


def draw_reuse_over_size(rows: Sequence[Mapping[str, Any]], kind: str) -> Figure:
    """Average reuse, and kit size, against the number of parts of one kind."""
    sizes = [row[kind] for row in rows]
    with style():
        figure, (left, right) = plt.subplots(1, 2, figsize=(7.4, 3.1), layout="constrained")
        for (key, label), form, colour in zip(
            (
                ("average reuse", "all parts"),
                ("linear reuse", "linear"),
                ("angular reuse", "angular"),
            ),
            ("o-", "s--", "^:"),
            ("blue", "vermillion", "green"),
        ):
            left.plot(
                sizes,
                [row[key] for row in rows],
                form,
                color=PALETTE[colour],
                label=label,
                markersize=4.5,
            )
        left.set(title="Average reuse", ylabel="mean over all sets of designs", ylim=(0, 1))
        left.legend()
        right.plot(
            sizes, [row["kit size %"] for row in rows], "o-", color=PALETTE["blue"], markersize=4.5
        )
        right.set(title="Kit size", ylabel="pieces, % of all elements", ylim=(0, 105))
        for ax in (left, right):
            ax.set_xlabel(f"{kind} parts")
            whole_numbers(ax, sizes)
    return figure


def draw_front(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Largest deviation, and the objective, against the pieces to make, a point a weight."""
    with style():
        figure, axes = plt.subplots(1, 2, figsize=(7.4, 3.1), layout="constrained")
        labels = {"max %": "largest deviation, % of bounding box", "J": "objective"}
        for ax, (column, label) in zip(axes, labels.items()):
            for row in rows:
                if row[column] is None:
                    continue
                ax.plot(row["pieces"], row[column], "o", color=PALETTE["blue"], markersize=4.5)
                ax.annotate(
                    f"{row['weight']:g}",
                    (row["pieces"], row[column]),
                    xytext=(5, 4),
                    textcoords="offset points",
                    fontsize=8,
                )
            ax.set(xlabel="pieces to make", ylabel=label)
            ax.margins(0.15)
    return figure


def _table(
    ax: Axes,
    values: np.ndarray,
    texts: Sequence[str],
    columns: Sequence[str],
    rows: Sequence[str],
    most: float,
) -> None:
    """Cells of colours with their numbers; the text's colour stands out from its cell."""
    colours = matplotlib.colormaps[_MAP]
    ax.pcolormesh(values, cmap=_MAP, vmin=0, vmax=most, edgecolors="#e6e6e6", linewidth=1)
    for (row, column), text in zip(np.ndindex(values.shape), texts):
        dark = np.dot(colours(values[row, column] / most)[:3], (0.299, 0.587, 0.114)) < 0.55
        ax.text(
            column + 0.5,
            row + 0.5,
            text,
            ha="center",
            va="center",
            fontsize=7.5,
            color="white" if dark else INK,
        )
    ax.set(
        xticks=np.arange(len(columns)) + 0.5,
        xticklabels=columns,
        yticks=np.arange(len(rows)) + 0.5,
        yticklabels=rows,
    )
    ax.invert_yaxis()
    ax.grid(visible=False)
    ax.tick_params(length=0)
    ax.spines[:].set_visible(False)


def _spread(values: Sequence[float]) -> np.ndarray:
    """(n,) sideways places in [-1, 1] for sorted values, so that near ones don't hide each
    other."""
    return np.array(
        [(-1, 0, 1)[k % 3] if len(values) > 1 else 0 for k in range(len(values))], dtype=float
    )
