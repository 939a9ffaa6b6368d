"""How two ways of taking steps compare: the objective against points tried and seconds, in both
stages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from kop_exudyn.drawing.style import CYCLE, style
from kop_exudyn.report.designs import DrawnState
from kop_exudyn.report.kit_drawings import drawn_state
from kop_exudyn.search.events import StageEvent
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.search.result import KitResult


@dataclass(frozen=True)
class Course:
    """The accepted steps of one stage: objective after each, points tried and seconds until then
    (all (n,)).

    starts : numbers of the steps with which an SQP began; the objective may jump there, as its
        weight w_c changes
    """

    values: np.ndarray
    trials: np.ndarray
    seconds: np.ndarray
    starts: np.ndarray


def course(events: Sequence[StageEvent], stage: str) -> Course:
    """The course of a stage; seconds are those of its SQPs, without the paths and projections
    between them."""
    own = [event for event in events if event.stage == stage]
    first = [k for k, event in enumerate(own) if k == 0 or event.sqp != own[k - 1].sqp]
    return Course(
        np.array([event.record.value for event in own]),
        np.cumsum([event.record.trials for event in own]),
        np.cumsum([sum(event.record.seconds.values()) for event in own]),
        np.array(first, dtype=int),
    )


def course_rows(name: str, result: KitResult) -> list[dict[str, Any]]:
    """One row a stage: steps, points tried, seconds and the objective at its end."""
    rows = []
    for stage in ("relaxed", "assigned"):
        found = course(result.events, stage)
        if len(found.values):
            rows.append(
                {
                    "Hessian": name,
                    "stage": stage,
                    "steps": len(found.values),
                    "points tried": found.trials[-1],
                    "seconds": found.seconds[-1],
                    "s per step": found.seconds[-1] / len(found.values),
                    "objective": result.stages[stage].value,
                }
            )
    return rows


def input_states(result: KitResult, title: str) -> list[DrawnState]:
    """The designs as given, as `drawn_state` draws the others."""
    return [
        drawn_state(
            design,
            DesignObjective(design, reference=reference).judge(
                design.parameters, dict(reference.equilibria)
            ),
            title,
        )
        for design, reference in zip(result.designs, result.references)
    ]


def draw_courses(courses: Mapping[str, Mapping[str, Course]]) -> Figure:
    """name -> stage -> course; rows of panels are stages, columns what it cost."""
    stages = list(dict.fromkeys(stage for found in courses.values() for stage in found))
    with style():
        figure = Figure(figsize=(9.0, 2.9 * len(stages)), layout="constrained")
        panels = figure.subplots(len(stages), 2, sharey="row", squeeze=False)
        for row, stage in zip(panels, stages):
            for ax, (label, read) in zip(
                row, {"points tried": "trials", "seconds": "seconds"}.items()
            ):
                for k, (name, found) in enumerate(courses.items()):
                    if stage in found:
                        _draw(
                            ax,
                            found[stage],
                            getattr(found[stage], read),
                            name,
                            CYCLE[k],
                            "os^D"[k % 4],
                        )
                ax.set(yscale="log", xlabel=label)
            row[0].set_title(stage)
            row[0].set_ylabel("objective J")
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels) or 1)
    return figure


def _draw(ax, found: Course, places: np.ndarray, name: str, colour: str, marker: str) -> None:
    """One line an SQP: between two of them the objective itself changes."""
    for k, (values, xs) in enumerate(
        zip(np.split(found.values, found.starts[1:]), np.split(places, found.starts[1:]))
    ):
        ax.plot(
            xs,
            values,
            color=colour,
            marker=marker,
            markersize=3.5,
            linewidth=1.3,
            label=name if k == 0 else None,
        )
        if k:
            ax.axvline(xs[0], color=colour, linewidth=0.5, alpha=0.35, zorder=0)
