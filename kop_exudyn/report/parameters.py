"""Parts and elements in parameter space: how the elements gathered at the parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..drawing.style import FAINT, PALETTE, style
from ..wording import counted

_CLOUD_COLOURS = (FAINT, PALETTE["blue"], PALETTE["green"])
_PART = PALETTE["vermillion"]


@dataclass(frozen=True)
class ElementCloud:
    """Elements of one kind after one stage.

    full : (n, k) parameters of elements with as many as a part has, in the parts' standard form
    ends : (m,) parameters of elements that have only one of a part's several
    """

    label: str
    full: np.ndarray
    ends: np.ndarray = field(default_factory=lambda: np.empty(0))


@dataclass(frozen=True)
class PartSpace:
    """One kind: its parts (m, k), the elements of one or more stages (the earliest first), the
    parameters' names, the unit of lengths."""

    kind: str
    parameter_names: Sequence[str]
    parts: np.ndarray
    clouds: Sequence[ElementCloud]
    unit: str = ""

    def axis(self, number: int) -> str:
        """The name of a parameter with its unit."""
        unit = "degrees" if self.kind == "angular" else self.unit
        return ", ".join(filter(None, (self.parameter_names[number], unit)))


def draw_parameters(spaces: Sequence[PartSpace]) -> Figure:
    """One panel a kind: two parameters as a plane, with end elements as marks along its axes; one
    as a histogram.

    Of kinds with more parameters the first two are shown. Angles (kind "angular") are shown in
    degrees.
    """
    with style():
        figure = Figure(figsize=(4.75 * len(spaces), 4.4), layout="constrained")
        for ax, space in zip(figure.subplots(1, len(spaces), squeeze=False)[0], spaces):
            ax.set_title(f"{space.kind}: {counted(len(space.parts), 'part')}")
            if np.shape(space.parts)[1] == 1:
                _draw_line(ax, space)
            else:
                _draw_plane(ax, space)
    return figure


def _draw_plane(ax: Axes, space: PartSpace) -> None:
    """Parts are sorted by length, so that the lower right half stays free for the legend."""
    parts = np.asarray(space.parts)[:, :2]
    values = np.concatenate(
        [parts.ravel(), *(v for c in space.clouds for v in (c.full[:, :2].ravel(), c.ends))]
    )
    low, high = values.min(), values.max()
    span = high - low or 1.0
    low, high = low - 0.16 * span, high + 0.06 * span  # below: room for the end elements' marks
    ax.set(
        xlim=(low, high),
        ylim=(low, high),
        aspect="equal",
        xlabel=space.axis(0),
        ylabel=space.axis(1),
    )
    ax.axline((low, low), slope=1, color=FAINT, linewidth=0.8, zorder=0.5)
    for cloud, colour in zip(space.clouds, _CLOUD_COLOURS):
        ax.plot(*cloud.full[:, :2].T, ".", color=colour, markersize=4, alpha=0.8, label=cloud.label)
    ax.plot(
        *parts.T,
        "o",
        color="none",
        markeredgecolor=_PART,
        markeredgewidth=1.6,
        markersize=10,
        label="parts",
    )
    for number, place in enumerate(parts, 1):
        ax.annotate(
            str(number), place, xytext=(6, -9), textcoords="offset points", size=7.5, color=_PART
        )
    _draw_ends(ax, space)
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 0.09), handletextpad=0.4)


def _draw_ends(ax: Axes, space: PartSpace) -> None:
    """Marks along the lower and the left edge: an end element's length may be either side of a
    part."""
    rows = [
        (cloud, colour) for cloud, colour in zip(space.clouds, _CLOUD_COLOURS) if len(cloud.ends)
    ]
    for row, (cloud, colour) in enumerate(rows):
        place = np.full(len(cloud.ends), 0.02 + 0.035 * row)
        label = "end elements" if row == len(rows) - 1 else None
        ax.plot(
            cloud.ends,
            place,
            "|",
            color=colour,
            markersize=7,
            label=label,
            transform=ax.get_xaxis_transform(),
        )
        ax.plot(
            place, cloud.ends, "_", color=colour, markersize=7, transform=ax.get_yaxis_transform()
        )


def _draw_line(ax: Axes, space: PartSpace) -> None:
    unit = 180 / np.pi if space.kind == "angular" else 1.0
    parts = unit * np.asarray(space.parts)[:, 0]
    values = [unit * cloud.full[:, 0] for cloud in space.clouds]
    everything = np.concatenate([parts, *values])
    edges = np.linspace(everything.min(), everything.max() + 1e-9 * (1 + abs(everything.max())), 61)
    for cloud, value, colour, fill in zip(
        space.clouds, values, _CLOUD_COLOURS, ("bar", "step", "step")
    ):
        ax.hist(value, edges, color=colour, label=cloud.label, histtype=fill, linewidth=1.4)
    height = ax.get_ylim()[1]
    margin = 0.03 * np.ptp(edges)
    ax.set(xlim=(edges[0] - margin, edges[-1] + margin), ylim=(0, 1.32 * height))
    for part in parts:
        ax.axvline(
            part,
            ymax=1.05 / 1.32,
            color=_PART,
            linewidth=1.1,
            linestyle=(0, (2, 1.5)),
            label="parts" if part == parts[0] else None,
        )
    for number, place in zip(np.argsort(parts) + 1, _spread(np.sort(parts), 0.035 * np.ptp(edges))):
        ax.text(place, 1.06 * height, str(number), ha="center", va="bottom", size=7.5, color=_PART)
    ax.set(xlabel=space.axis(0), ylabel="elements")
    ax.grid(False, axis="x")
    ax.legend(
        loc="upper center",
        ncols=len(space.clouds) + 1,
        handlelength=1.3,
        columnspacing=1.2,
        handletextpad=0.4,
    )


def _spread(places: np.ndarray, gap: float) -> np.ndarray:
    """Sorted places moved as little as it takes to stand `gap` apart, for labels that would
    overlap."""
    # pooling adjacent violators: places minus their rank times the gap have to ascend
    ranks = gap * np.arange(len(places))
    blocks: list[list[float]] = []
    for value in places - ranks:
        blocks.append([value])
        while len(blocks) > 1 and np.mean(blocks[-2]) > np.mean(blocks[-1]):
            last = blocks.pop()
            blocks[-1] += last
    return np.concatenate([np.full(len(block), np.mean(block)) for block in blocks]) + ranks
