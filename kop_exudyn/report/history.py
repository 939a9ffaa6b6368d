"""How the objective and its terms fell, step by step, in the SQP stages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ..drawing.style import CYCLE, INK, QUIET, style

_LABEL = 8.0  # points, of the stretches' labels
_PANELS = 0.85  # of a figure's width, that its panels have
_SHOWN = 1e-7  # of the largest value drawn; smaller ones would only stretch the axis


@dataclass(frozen=True)
class HistoryStep:
    """The objective after one accepted step.

    terms : its parts by name; their sum is the objective
    weight : w_c of the projection energy at that step, None without one
    round : of the assigned stage, before which elements got other parts; None without rounds
    """

    terms: Mapping[str, float]
    weight: float | None = None
    round: int | None = None

    @property
    def stretch(self) -> str:
        """What the steps have in common that belong to one SQP, as it is written above them."""
        if self.round is not None:
            return f"round {self.round}"
        return f"$w_c$ = {_power(self.weight)}" if self.weight is not None else ""

    @property
    def value(self) -> float:
        return sum(self.terms.values())


@dataclass(frozen=True)
class History:
    """One stage's accepted steps in order."""

    title: str
    steps: Sequence[HistoryStep]


def draw_history(histories: Sequence[History]) -> Figure:
    """One panel a stage, logarithmic, on one scale; a line where w_c changes or a round begins says
    so."""
    names = list(
        dict.fromkeys(
            name for history in histories for step in history.steps for name in step.terms
        )
    )
    colours = {name: CYCLE[k % len(CYCLE)] for k, name in enumerate(names)}
    steps = [max(len(history.steps), 1) for history in histories]
    widths = [max(width, 0.45 * max(steps)) for width in steps]  # a short stage stays readable
    with style():
        figure = Figure(figsize=(9.5, 3.7), layout="constrained")
        panels = figure.subplots(
            1, len(histories), sharey=True, width_ratios=widths, squeeze=False
        )[0]
        for ax, history, width in zip(panels, histories, widths):
            share = _PANELS * 72 * figure.get_figwidth() * width / sum(widths)
            _draw_stage(ax, history, colours, share)
        panels[0].set_yscale("log")
        panels[0].set_ylabel("objective and its terms")
        _limit_below(panels[0], histories)
        handles = {
            label: handle for ax in panels for handle, label in zip(*ax.get_legend_handles_labels())
        }
        figure.legend(
            handles.values(), handles.keys(), loc="outside lower center", ncols=len(handles) or 1
        )
    return figure


def _draw_stage(ax: Axes, history: History, colours: Mapping[str, str], width: float) -> None:
    """width : of the panel, about, in points"""
    ax.set_title(history.title)
    ax.set_xlabel("accepted steps")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    count = len(history.steps)
    if not count:
        ax.text(0.5, 0.5, "no steps were needed", transform=ax.transAxes, ha="center", color=QUIET)
        return
    ax.set_xlim(0.4, count + 0.6)
    marker = "o" if count < 60 else None
    for name, colour in colours.items():
        if any(name in step.terms for step in history.steps):
            ax.plot(
                *_broken(history.steps, name),
                color=colour,
                label=name,
                marker=marker,
                markersize=2.5,
                linewidth=1.2,
            )
    ax.plot(
        *_broken(history.steps),
        color=INK,
        label="objective",
        marker=marker,
        markersize=3.5,
        linewidth=2.2,
    )
    _mark_stretches(ax, history, width / count)


def _broken(steps: Sequence[HistoryStep], name: str | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Step numbers and a term's values (default: the sum), with a gap where the next SQP begins: J
    may jump there."""
    places, values = [], []
    for number, step in enumerate(steps, 1):
        if number > 1 and step.stretch != steps[number - 2].stretch:
            places.append(number - 0.5)
            values.append(np.nan)
        places.append(number)
        values.append(step.value if name is None else step.terms.get(name, np.nan))
    return np.array(places), np.array(values)


def _mark_stretches(ax: Axes, history: History, step: float) -> None:
    """A line between the steps of two SQPs, and what each was for at the top of its stretch; of
    stretches so short that their labels would cover each other, the first ones are named.

    step : points of paper between two steps
    """
    first, free = 1, 0.0
    for label, run in groupby(history.steps, key=lambda step: step.stretch):
        count = len(list(run))
        if label and first > 1:
            ax.axvline(first - 0.5, color=QUIET, linewidth=0.9, linestyle=(0, (4, 3)), zorder=0)
        if label and first >= free:
            free = first + 1.3 * _LABEL / step
            ax.text(
                first - 0.5 + 0.008 * len(history.steps),
                0.985,
                label,
                color=QUIET,
                size=_LABEL,
                transform=ax.get_xaxis_transform(),
                va="top",
                rotation=90 if count < 0.25 * len(history.steps) else 0,
            )
        first += count


def _limit_below(ax: Axes, histories: Sequence[History]) -> None:
    values = np.array(
        [
            value
            for history in histories
            for step in history.steps
            for value in (step.value, *step.terms.values())
        ]
    )
    values = values[values > 0]
    if len(values):
        ax.set_ylim(bottom=max(values.min(), _SHOWN * values.max()) / 2, top=values.max() * 6)


def _power(weight: float) -> str:
    """10^3 for 1000, the plain number where it is no power of ten."""
    exponent = np.log10(weight) if weight > 0 else np.nan
    return (
        f"$10^{{{round(exponent)}}}$"
        if abs(exponent - np.round(exponent)) < 1e-9
        else f"{weight:g}"
    )
