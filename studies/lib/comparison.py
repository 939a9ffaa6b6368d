"""Direct, unrelaxed, relaxed and assigned designs compared: rows of a table, a figure, a
sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from kop_exudyn.drawing.style import INK, PALETTE, QUIET, style
from kop_exudyn.search.buckling import buckled
from kop_exudyn.search.result import STAGES, KitResult

Row = Mapping[str, Any]

_COLOURS = {
    "direct": PALETTE["vermillion"],
    "unrelaxed": PALETTE["orange"],
    "relaxed": PALETTE["sky"],
    "assigned": PALETTE["blue"],
}
_RING, _AROUND = 110, {"marker": "o", "facecolors": "none", "edgecolors": INK, "linewidths": 1.2}
_MARKERS = {"direct": "s", "unrelaxed": "^", "relaxed": "D", "assigned": "o"}


def comparison_rows(class_name: str, result: KitResult) -> list[dict[str, Any]]:
    """One row a design: largest and mean deviations after every stage, energies, where it buckled
    or failed."""
    rows = []
    for n, design in enumerate(result.designs):
        found = {stage: result.summary(stage, n) for stage in STAGES if stage in result.stages}
        row: dict[str, Any] = {
            "class": class_name,
            "design": design.name,
            "elements": design.n_elements,
        }
        row |= {f"{stage} max %": _fit(found.get(stage), "max_percent") for stage in STAGES}
        row |= {
            f"{stage} mean %": _fit(found.get(stage), "mean_percent")
            for stage in ("direct", "assigned")
        }
        row |= {f"{stage} energy": found.get(stage, {}).get("energy_ratio") for stage in STAGES}
        row["buckled"] = (
            ", ".join(
                stage
                for stage in found
                if buckled(design, result.stages[stage].designs[n], result.references[n])
            )
            or "–"
        )
        row["failed"] = (
            ", ".join(stage for stage, summary in found.items() if "failed" in summary) or "–"
        )
        rows.append(row)
    return rows


def finding(rows: Sequence[Row]) -> str:
    """What the rows say, in a sentence or two."""
    direct, unrelaxed, assigned = (
        _values(rows, f"{stage} max %") for stage in ("direct", "unrelaxed", "assigned")
    )
    sentences = [
        f"Over {len(rows)} designs the median of the largest deviation falls from "
        f"{np.median(direct):.2g} % "
        f"(direct) and {np.median(unrelaxed):.2g} % (unrelaxed) to {np.median(assigned):.2g} % "
        f"(assigned); "
        f"the worst design ends at {max(assigned):.2g} %, after direct projection it is "
        f"{max(direct):.2g} % "
        "off."
    ]
    away = [f"{row['design']} ({row['buckled']})" for row in rows if row["buckled"] != "–"]
    sentences.append(
        f"Buckled into other states: {', '.join(away)}." if away else "None has buckled."
    )
    failed = [f"{row['design']} ({row['failed']})" for row in rows if row["failed"] != "–"]
    if failed:
        sentences.append(f"No equilibrium was found for {', '.join(failed)}.")
    return " ".join(sentences)


def draw_comparison(rows: Sequence[Row]) -> Figure:
    """Every design a line, its stages markers on a logarithmic axis of the largest deviation;
    rings: buckled."""
    stages = [stage for stage in STAGES if any(row[f"{stage} max %"] is not None for row in rows)]
    values = [row[f"{stage} max %"] for row in rows for stage in stages if row[f"{stage} max %"]]
    low, high = 0.6 * min(values), 2.0 * max(values)
    with style():
        figure = Figure(figsize=(8.5, 1.3 + 0.3 * len(rows)), layout="constrained")
        ax = figure.subplots()
        for y, row in enumerate(rows):
            _draw_row(ax, y, row, stages, high)
        ax.set(
            xscale="log",
            xlim=(low, 1.15 * high),
            ylim=(len(rows) - 0.4, -0.6),
            xlabel="largest deviation of the joints, % of the size",
        )
        ax.set_yticks(range(len(rows)), [row["design"] for row in rows])
        ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        ax.grid(axis="y", visible=False)
        _mark_classes(ax, rows, low)
        for stage in stages:
            ax.scatter([], [], color=_COLOURS[stage], marker=_MARKERS[stage], s=34, label=stage)
        ax.scatter([], [], s=_RING, label="buckled", **_AROUND)
        figure.legend(loc="outside lower center", ncols=len(stages) + 1)
    return figure


def _draw_row(ax: Axes, y: int, row: Row, stages: Sequence[str], failed_at: float) -> None:
    found = {stage: row[f"{stage} max %"] for stage in stages}
    there = [value for value in found.values() if value is not None]
    if there:
        ax.hlines(y, min(there), max(there), color="#d8d8d8", linewidth=3, zorder=1)
    for stage, value in found.items():
        missing = value is None
        x = failed_at if missing else value
        ax.scatter(
            x, y, color=_COLOURS[stage], marker="x" if missing else _MARKERS[stage], s=34, zorder=3
        )
        if stage in row["buckled"].split(", "):
            ax.scatter(x, y, s=_RING, zorder=4, **_AROUND)


def _mark_classes(ax: Axes, rows: Sequence[Row], low: float) -> None:
    """A line between classes, and the class's name at the right end of its first row."""
    names = [row["class"] for row in rows]
    for y, name in enumerate(names):
        if y == 0 or names[y - 1] != name:
            ax.axhline(y - 0.5, color=QUIET, linewidth=0.6)
            ax.annotate(
                name,
                (1.0, y),
                xycoords=("axes fraction", "data"),
                xytext=(6, 0),
                textcoords="offset points",
                va="center",
                weight="bold",
                annotation_clip=False,
            )


def _fit(summary: Mapping[str, Any] | None, name: str) -> float | None:
    return summary["fit"][name] if summary and "fit" in summary else None


def _values(rows: Sequence[Row], key: str) -> list[float]:
    return [row[key] for row in rows if row[key] is not None]
