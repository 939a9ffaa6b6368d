"""Inputs, baselines and both stages compared, design by design: rows of a table, a figure, a
sentence.

`ORDER` has what is compared: the input, on no kit's account; the baselines; then our own stages.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from kop_exudyn.drawing.style import INK, PALETTE, QUIET, style
from kop_exudyn.report.designs import DrawnDesign
from kop_exudyn.search.buckling import buckled
from kop_exudyn.search.result import STAGES, KitResult
from kop_exudyn.structures.strength import largest_utilisation

Row = Mapping[str, Any]

ORDER = ("input", *STAGES)
_COLOURS = {
    "input": QUIET,
    "direct": PALETTE["vermillion"],
    "unrelaxed": PALETTE["orange"],
    "published": PALETTE["purple"],
    "published_opened": PALETTE["purple"],
    "relaxed": PALETTE["sky"],
    "assigned": PALETTE["blue"],
}
_LEAST_SHOWN = 1e-3  # %: what deviates less is drawn here
_RING, _AROUND = 110, {"marker": "o", "facecolors": "none", "edgecolors": INK, "linewidths": 1.2}
_MARKERS = {
    "input": "|",
    "direct": "s",
    "unrelaxed": "^",
    "published": "v",
    "published_opened": "P",
    "relaxed": "D",
    "assigned": "o",
}

# stages that kits are compared with, as sentences name them
BASELINES = {"direct": "direct", "unrelaxed": "unrelaxed", "published_opened": "published method"}


def told(stage: str) -> str:
    """The name of a stage as a reader knows it."""
    return stage.replace("_", " and ")


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
        shown = {"input": result.input_summary(n), **found}
        row |= {
            f"{told(stage)} max %": _fit(summary, "max_percent") for stage, summary in shown.items()
        }
        row |= {
            f"{stage} mean %": _fit(shown.get(stage), "mean_percent")
            for stage in ("direct", "assigned")
        }
        row |= _verdict(result, n)
        row |= {
            f"{told(stage)} energy": summary.get("energy_ratio") for stage, summary in found.items()
        }
        row |= {
            f"{told(stage)} utilisation": largest_utilisation(found[stage].get("strength", {}))
            for stage in BASELINES
            if stage in found
        }
        row["buckled"] = (
            ", ".join(
                told(stage)
                for stage in found
                if buckled(design, result.stages[stage].designs[n], result.references[n])
            )
            or "–"
        )
        row["failed"] = (
            ", ".join(told(stage) for stage, summary in found.items() if "failed" in summary) or "–"
        )
        rows.append(row)
    return rows


def _verdict(result: KitResult, number: int) -> dict[str, Any]:
    """Whether a design can be built, its largest utilisation of all states, and how many samples
    of the workshop's errors snap."""
    if not result.buildable:
        return {}
    found = result.buildable[number]
    used = [value for value in (found.get("utilisation") or {}).values() if value is not None]
    tolerance = found.get("tolerance") or {}
    return {
        "buildable": found.get("verdict"),
        "utilisation": max(used) if used else None,
        "snapped": f"{tolerance['snapped']} of {tolerance['samples']}" if tolerance else None,
    }


def _beyond(row: Row, stage: str) -> str:
    """That a stage is stressed beyond the elastic limit, which the kit found here keeps."""
    used = row.get(f"{told(stage)} utilisation")
    return f", stressed to {100 * used:.0f} % of its limit" if used and used > 1 else ""


def finding(rows: Sequence[Row]) -> str:
    """What the rows say, in a few sentences: first what the method gains, then where it is worse
    than a baseline, then what can't be built."""
    values = {stage: _values(rows, f"{told(stage)} max %") for stage in (*BASELINES, "assigned")}
    medians = ", ".join(
        f"{np.median(values[stage]):.2g} % ({name})"
        for stage, name in BASELINES.items()
        if values[stage]
    )
    sentences = []
    stopped = [row["design"] for row in rows if row.get("buildable") not in (None, "can be built")]
    if values["assigned"]:
        built = f", {len(rows) - len(stopped)} of which can be built," if stopped else ""
        sentences.append(
            f"Over {len(rows)} designs{built} the median of the largest deviation is "
            f"{np.median(values['assigned']):.2g} % with the kit found here, as the designs open; "
            f"before: {medians}. The worst design ends at {max(values['assigned']):.2g} %."
        )
    worse = [
        f"{row['design']} ({name}: {value:.2g} %{_beyond(row, stage)}, here "
        f"{row['assigned max %']:.2g} %)"
        for row in rows
        for stage, name in BASELINES.items()
        if (value := row.get(f"{told(stage)} max %")) is not None
        and row["assigned max %"] is not None
        and value < row["assigned max %"]
    ]
    if worse:
        sentences.append(f"Worse than a baseline: {', '.join(worse)}.")
    off = [row for row in rows if (row["input max %"] or 0.0) > 0.25]
    if off:
        sentences.append(
            "Inputs that are off their targets themselves: "
            + ", ".join(f"{row['design']} ({row['input max %']:.2g} %)" for row in off)
            + "."
        )
    if any("buildable" in row for row in rows):
        sentences.append(
            f"Not to be built as they are: {', '.join(stopped)}."
            if stopped
            else "All of them open by themselves, keep below their limits and can be built."
        )
    away = [f"{row['design']} ({row['buckled']})" for row in rows if row["buckled"] != "–"]
    if away:
        sentences.append(f"Buckled into other states: {', '.join(away)}.")
    failed = [f"{row['design']} ({row['failed']})" for row in rows if row["failed"] != "–"]
    if failed:
        sentences.append(f"No equilibrium was found for {', '.join(failed)}.")
    return " ".join(sentences)


def most_changed(designs: list[DrawnDesign], number: int) -> list[DrawnDesign]:
    """The designs with the largest deviations after direct projection; failures first."""

    def deviation(design: DrawnDesign) -> float:
        state = design.states[0]
        return float("inf") if state.failed is not None else max(state.deviation_percent)

    return sorted(designs, key=deviation, reverse=True)[:number]


def draw_comparison(rows: Sequence[Row]) -> Figure:
    """Every design a line, its stages markers on a logarithmic axis of the largest deviation;
    rings: buckled."""
    stages = [
        stage for stage in ORDER if any(row.get(f"{told(stage)} max %") is not None for row in rows)
    ]
    values = [
        row[key] for row in rows for stage in stages if row.get(key := f"{told(stage)} max %")
    ]
    low, high = 0.6 * max(min(values), _LEAST_SHOWN), 2.0 * max(values)
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
            ax.scatter(
                [],
                [],
                color=_COLOURS[stage],
                marker=_MARKERS[stage],
                s=34,
                label=stage.replace("_", ", "),
            )
        ax.scatter([], [], s=_RING, label="buckled", **_AROUND)
        figure.legend(loc="outside lower center", ncols=min(len(stages) + 1, 5))
    return figure


def _draw_row(ax: Axes, y: int, row: Row, stages: Sequence[str], failed_at: float) -> None:
    found = {stage: row.get(f"{told(stage)} max %") for stage in stages}
    there = [max(value, _LEAST_SHOWN) for value in found.values() if value is not None]
    if there:
        ax.hlines(y, min(there), max(there), color="#d8d8d8", linewidth=3, zorder=1)
    for stage, value in found.items():
        missing = value is None
        x = failed_at if missing else max(value, _LEAST_SHOWN)
        ax.scatter(
            x, y, color=_COLOURS[stage], marker="x" if missing else _MARKERS[stage], s=34, zorder=3
        )
        if told(stage) in row["buckled"].split(", "):
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
    return [row[key] for row in rows if row.get(key) is not None]
