"""Robustness of a kit's designs: the task that measures it, its figures and its table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator

from kop_exudyn.analysis.tolerance import robustness
from kop_exudyn.drawing.style import CYCLE, style
from kop_exudyn.errors import SimulationFailure
from kop_exudyn.io.designs import load_design
from kop_exudyn.io.saved_runs import load_run
from kop_exudyn.report.designs import DrawnDesign, DrawnState
from kop_exudyn.report.kit_drawings import drawn_state
from kop_exudyn.search.tolerance import relative_tolerance

Found = Mapping[str, Any]  # see `robustness`


def robustness_of_run(
    run: Path,
    files: Sequence[Path],
    share: float,
    angle: float,
    factors: Sequence[float],
    samples: Sequence[int],
) -> dict[str, Any]:
    """Robustness of all assigned designs of a finished run, with what is needed to draw them.

    run : its result.json; files : of its designs
    share, angle : standard deviations, of lengths as a share of the median one, of angles in rad
    factors : multiples of them; samples : of each factor
    """
    result = load_run(run.parent, [load_design(file) for file in files])
    found = []
    for design, outcome in zip(result.designs, result.stages["assigned"].designs):
        if isinstance(outcome, SimulationFailure):
            continue
        state = drawn_state(design, outcome, "assigned")
        found.append(
            robustness(design, outcome, relative_tolerance(design, share, angle), factors, samples)
            | {
                "chains": [np.round(chain, 5) for chain in state.chains],
                "joints": np.round(state.joints, 5),
            }
        )
    return {"designs": found}


def draw_agreement(classes: Mapping[str, Sequence[Found]]) -> Figure:
    """Displacement against the size of errors, and what the prediction misses of it; one column a
    class.

    Hollow markers: some of the samples snapped.
    """
    with style():
        figure = Figure(figsize=(3.3 * len(classes) + 0.4, 6.2), layout="constrained")
        panels = figure.subplots(2, len(classes), sharey="row", sharex=True, squeeze=False)
        for column, (name, designs) in enumerate(classes.items()):
            top, bottom = panels[:, column]
            for k, found in enumerate(designs):
                _draw_design(top, bottom, found, CYCLE[k % len(CYCLE)], "os^Dvp*"[k % 7])
            top.set_title(name)
            top.legend(fontsize=7.5, loc="upper left")
            bottom.set_xlabel("size of errors, multiples of the tolerance")
            for ax in (top, bottom):
                ax.set(xscale="log", yscale="log")
                ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
                ax.xaxis.set_major_locator(LogLocator(numticks=9))
                ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        panels[0, 0].set_ylabel("rms displacement of the joints,\n% of the size")
        panels[1, 0].set_ylabel("missed by the prediction,\nshare of the displacement")
    return figure


def _draw_design(top, bottom, found: Found, colour: str, marker: str) -> None:
    sizes = found["sizes"]
    factors = [size["factor"] for size in sizes]
    top.plot(
        factors, [size["predicted_rms_percent"] for size in sizes], color=colour, linewidth=1.2
    )
    for size in sizes:
        if "sampled_rms_percent" in size:
            top.plot(
                size["factor"],
                size["sampled_rms_percent"],
                color=colour,
                marker=marker,
                markersize=4.5,
                markerfacecolor="white" if size["snapped"] else colour,
            )
    top.plot(
        [], [], color=colour, marker=marker, markersize=4.5, linewidth=1.2, label=found["design"]
    )
    kept = [size for size in sizes if "linear_error" in size]
    bottom.plot(
        [size["factor"] for size in kept],
        [size["linear_error"] for size in kept],
        color=colour,
        marker=marker,
        markersize=4.5,
        linewidth=1.2,
    )


def table_rows(classes: Mapping[str, Sequence[Found]]) -> list[dict[str, Any]]:
    """One row a design, at the tolerance itself."""
    rows = []
    for name, designs in classes.items():
        for found in designs:
            size = min(found["sizes"], key=lambda size: abs(size["factor"] - 1))
            deviations = size.get("max_percent")
            rows.append(
                {
                    "class": name,
                    "design": found["design"],
                    "predicted rms %": size["predicted_rms_percent"],
                    "sampled rms %": size.get("sampled_rms_percent"),
                    "worst joint, predicted %": size["predicted_worst_percent"],
                    "worst joint, sampled %": size.get("sampled_worst_percent"),
                    "by lengths, %": 100
                    * sum(s for kind, s in found["shares"].items() if kind != "angular"),
                    "planned max %": found["planned_max_percent"],
                    "95 % below %": float(np.quantile(deviations, 0.95)) if deviations else None,
                    "samples": size["samples"],
                    "snapped": size["snapped"],
                    "failed": size["failed"],
                }
            )
    return rows


def drawn_spreads(classes: Mapping[str, Sequence[Found]], number: int = 3) -> list[DrawnDesign]:
    """A row a class: the `number` designs whose joints are displaced most, coloured by how far each
    joint is."""
    drawn = []
    for name, designs in classes.items():
        most = sorted(designs, key=lambda found: -np.linalg.norm(found["joints_percent"]))[:number]
        drawn.append(
            DrawnDesign(
                "",
                [
                    DrawnState(
                        f"{name}: {found['design']}",
                        [np.array(chain) for chain in found["chains"]],
                        np.array(found["joints"]),
                        np.array(found["joints_percent"]),
                    )
                    for found in most
                ],
            )
        )
    return drawn
