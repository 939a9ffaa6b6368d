"""Where the time of an optimisation goes: seconds by phase of every accepted step, one panel a
stage."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from kop_exudyn.drawing.style import INK, PALETTE, QUIET, style

from .phases import StepCost

# The phases of mechanics in one family of hues, those of optimisation in another; neighbours differ
# in brightness.
_COLOURS = {
    "assembly": PALETTE["blue"],
    "factorisation": PALETTE["sky"],
    "Newton, rest": "#b7dcf2",
    "sensitivities": PALETTE["vermillion"],
    "target fitting": "#f3c7a3",
    "Exudyn": PALETTE["green"],
    "projection": PALETTE["purple"],
    "QP": PALETTE["orange"],
    "rest": "#cfcfcf",
}


def draw_costs(steps: Sequence[StepCost], titles: Mapping[str, str]) -> Figure:
    """Stacked seconds of every step, and the number of equilibria above it; stages as panels on one
    scale."""
    stages = [stage for stage in titles if any(step.stage == stage for step in steps)]
    counts = [sum(step.stage == stage for step in steps) for stage in stages]
    with style():
        figure = Figure(figsize=(9.5, 4.6), layout="constrained")
        widths = [max(count, 0.35 * max(counts)) for count in counts]
        panels = figure.subplots(
            2,
            len(stages),
            sharey="row",
            sharex="col",
            squeeze=False,
            width_ratios=widths,
            height_ratios=(1, 2.6),
        )
        for column, stage in enumerate(stages):
            own = [step for step in steps if step.stage == stage]
            _draw_equilibria(panels[0, column], own, titles[stage])
            _draw_seconds(panels[1, column], own)
        panels[0, 0].set_ylabel("equilibria")
        panels[1, 0].set_ylabel("wall time of the step, s")
        handles, labels = panels[1, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=5)
    return figure


def _draw_equilibria(ax, steps: Sequence[StepCost], title: str) -> None:
    ax.bar(
        np.arange(1, len(steps) + 1), [step.equilibria for step in steps], width=0.8, color=QUIET
    )
    ax.set_title(title)
    ax.set_ylim(bottom=0)


def _draw_seconds(ax, steps: Sequence[StepCost]) -> None:
    places, base = np.arange(1, len(steps) + 1), np.zeros(len(steps))
    for phase, colour in _COLOURS.items():
        values = np.array([step.seconds.get(phase, 0.0) for step in steps])
        ax.bar(places, values, bottom=base, width=0.8, color=colour, label=phase, linewidth=0)
        base += values
    for first in [k for k in range(1, len(steps)) if steps[k].sqp != steps[k - 1].sqp]:
        ax.axvline(first + 0.5, color=INK, linewidth=0.8, linestyle=(0, (4, 3)))
    ax.set_xlabel("accepted steps")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
