"""A page that shows what was understood of a drawing: curves by family, joints, where pieces were
joined, where ends are hinged, and what looks wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Wedge

from ..drawing.style import FAINT, PALETTE, QUIET, style
from ..errors import InputError
from ..exchange.drawing import Finding
from ..exchange.drawn_networks import DrawnNetwork
from ..geometry.network import CurveNetwork
from ..units import Units, unit_of
from ..wording import counted
from .designs import project
from .page import Page

_FAMILIES = (PALETTE["blue"], PALETTE["vermillion"])
# kind of a finding -> marker, colour, what it is called
_MARKS = {
    "joined": ("s", PALETTE["green"], "joined"),
    "hinged": ("D", PALETTE["purple"], "hinged tip"),
    "cleaned": ("P", PALETTE["orange"], "cleaned"),
    "suspicious": ("o", "#c00000", "look at"),
}
_NUMBER_OFF = 9.0  # points that a curve's number is off its end
_MOST_LABELS = 60  # curves that are named in the drawing
_SECTOR = 0.28  # of the median span, radius of the opening's sectors
_MOST_SECTORS = 400


def net_preview(
    name: str,
    drawn: DrawnNetwork,
    rows: Sequence[tuple[str, str]],
    findings: Sequence[Finding],
    units: Units | None,
    refused: str | None = None,
) -> Page:
    """The page of a drawn net.

    rows : the summary, as `import_rows` gives it
    refused : why no design comes of it, where that is so
    """
    lead = f"{counted(len(drawn.entries), 'curve was', 'curves were')} understood."
    if refused is not None:
        lead = f"No design comes of this drawing: {refused}"
    page = Page(f"What was read of {name}", lead)
    page.table(["", "read"], [list(row) for row in rows])
    unit = unit_of("length", units)
    page.section("The net in plan").figure(
        _plan_figure(drawn, findings, unit),
        "Curves by family, numbered as in the design file; dots: joints. Filled sectors show the "
        "angle that is the opening: a positive one widens them. "
        f"Coordinates in {unit}.",
        alt="The net in plan, with its joints and with marks where something was done or looks "
        "wrong",
    )
    if not drawn.frame.flat:
        page.section("The net in space").figure(
            _space_figure(drawn, unit),
            "The curves as they are drawn.",
            alt="The curves in a parallel projection",
        )
    if findings:
        page.section("What was done, and what to look at").table(
            ["what", "how", "where"],
            [[_title(finding.kind), finding.text, _where(finding)] for finding in findings],
        )
    return page


def umbrella_preview(name: str, data: Mapping[str, Any], rows: Sequence[tuple[str, str]]) -> Page:
    """The page of an umbrella mesh's design file: its base mesh, and the surface it is for."""
    unit = data["units"]["length"]
    page = Page(
        f"What was read of {name}", f"An umbrella mesh of {counted(len(data['lengths']), 'cell')}."
    )
    page.table(["", "read"], [list(row) for row in rows])
    page.section("The cells before they open").figure(
        _base_figure(data, unit),
        f"One triangle a cell, darker where its arms are longer; coordinates in {unit}.",
        alt="The base mesh in plan",
    )
    if "target" in data:
        page.section("The surface that it opens into").figure(
            _target_figure(data["target"], unit),
            "The target, and where its X joints belong.",
            alt="The target surface in a parallel projection",
        )
    return page


def _title(kind: str) -> str:
    return _MARKS[kind][2] if kind in _MARKS else kind


def _where(finding: Finding) -> str:
    shown = ["(" + ", ".join(f"{x:.5g}" for x in place) + ")" for place in finding.places[:2]]
    more = len(finding.places) - len(shown)
    return " ".join(shown) + (f" and {more} more" if more > 0 else "")


def _plan_figure(drawn: DrawnNetwork, findings: Sequence[Finding], unit: str) -> Figure:
    try:
        net: CurveNetwork | None = drawn.network
    except InputError:
        net = None
    lines = [_smooth(drawn, net, k) for k in range(len(drawn.entries))]
    family = _family(net, len(lines))
    box = np.concatenate(lines)
    width, height = np.maximum(np.ptp(box, axis=0), 1e-9 * np.ptp(box))
    with style():
        # one figure serves wide and narrow windows: the page scales it
        figure = Figure(figsize=(8.2, float(np.clip(7.4 * height / width + 1.0, 3.0, 10.0))))
        ax = figure.add_subplot()
        ax.set(aspect="equal", xlabel=f"x, {unit}", ylabel=f"y, {unit}")
        colours = [_FAMILIES[side] if side >= 0 else QUIET for side in family]
        ax.add_collection(LineCollection(lines, colors=colours, linewidths=1.5, zorder=2))
        if net is not None:
            _sectors(ax, net)
            size = float(np.clip(900 / net.n_joints, 3, 22))
            ax.scatter(*net.joints.T, s=size, color="#222222", zorder=4)
        if len(lines) <= _MOST_LABELS:
            for number, line in enumerate(lines):
                ax.annotate(
                    str(number),
                    line[0],
                    xytext=tuple(_NUMBER_OFF * _outwards(line)),
                    textcoords="offset points",
                    size=7,
                    color=colours[number],
                    ha="center",
                    va="center",
                )
        _marks(ax, drawn, findings)
        ax.margins(0.06)
        ax.autoscale_view()
    return figure


def _outwards(line: np.ndarray) -> np.ndarray:
    """(2,) direction in which a curve (n, 2) would go on beyond its first end: curves that meet
    there have different ones, so that their numbers stand apart."""
    step = line[0] - line[min(len(line) - 1, 1 + len(line) // 20)]
    length = np.linalg.norm(step)
    return step / length if length > 0 else np.array([-1.0, 0.0])


def _smooth(drawn: DrawnNetwork, net: CurveNetwork | None, number: int) -> np.ndarray:
    """Points (n, 2) along a curve, on its spline where it has one."""
    if net is None:
        return np.array(drawn.entries[number]["points"], float)
    curve = net.strands[number].curve
    points = curve.position(curve.stations)
    return np.concatenate([points, points[:1]]) if curve.closed else points


def _family(net: CurveNetwork | None, n: int) -> list[int]:
    """0 or 1 by the joints' first and second curves; -1 where that isn't clear."""
    if net is None:
        return [-1] * n
    found = [-1] * n
    for (a, b), opens in zip(net.pairs.tolist(), net.opens):
        if opens:
            found[a], found[b] = 0, 1
    return found


def _sectors(ax: Axes, net: CurveNetwork) -> None:
    """The angles from the first family to the second one, on both sides of every joint."""
    spans = np.concatenate([strand.lengths for strand in net.strands])
    if not len(spans) or net.n_joints > _MOST_SECTORS:
        return
    radius = _SECTOR * float(np.median(spans))
    for place, first, angle, opens in zip(
        net.joints, net.directions[:, 0], net.opening_angles, net.opens
    ):
        for turn in (0.0, 180.0) if opens else ():
            start = float(np.degrees(first)) + turn
            wedge = Wedge(
                (float(place[0]), float(place[1])),
                radius,
                start,
                start + float(np.degrees(angle)),
                facecolor=PALETTE["sky"],
                alpha=0.35,
                linewidth=0,
                zorder=1,
            )
            ax.add_patch(wedge)


def _marks(ax: Axes, drawn: DrawnNetwork, findings: Sequence[Finding]) -> None:
    for kind, (marker, colour, label) in _MARKS.items():
        places = [f.places for f in findings if f.kind == kind and len(f.places)]
        if not places:
            continue
        at = drawn.options.scale * drawn.frame(np.concatenate(places))[:, :2]
        ax.scatter(
            *at.T,
            s=70 if kind == "suspicious" else 38,
            marker=marker,
            facecolors="none",
            edgecolors=colour,
            linewidths=1.4,
            zorder=5,
            label=f"{label}: {len(at)}",
        )
    if ax.get_legend_handles_labels()[0]:
        ax.legend(loc="upper left", bbox_to_anchor=(0.0, 1.09), ncols=4, borderaxespad=0.0)


def _space_figure(drawn: DrawnNetwork, unit: str) -> Figure:
    lines = [project(drawn.options.scale * curve.points)[0] for curve in drawn.curves]
    return _projected(lines, [], unit)


def _base_figure(data: Mapping[str, Any], unit: str) -> Figure:
    vertices, faces = np.array(data["base"]["vertices"]), np.array(data["base"]["faces"])
    lengths = np.array(data["lengths"]).mean(axis=1)
    with style():
        figure = Figure(figsize=(7.4, 5.6))
        ax = figure.add_subplot()
        cells = PolyCollection(
            vertices[faces], array=lengths, cmap="Blues", edgecolors=QUIET, linewidths=0.8
        )
        ax.add_collection(cells)
        ax.set(aspect="equal", xlabel=f"x, {unit}", ylabel=f"y, {unit}")
        ax.autoscale_view()
        figure.colorbar(cells, ax=ax, label=f"arm length, {unit}")
    return figure


def _target_figure(target: Mapping[str, Any], unit: str) -> Figure:
    vertices, faces = np.array(target["vertices"], float), np.array(target["faces"])
    edges = np.unique(np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    lines = list(project(vertices)[0][edges])
    known = [place for place in target.get("crossings", []) if place is not None]
    return _projected(lines, known, unit)


def _projected(lines: Sequence[np.ndarray], points: Sequence[Any], unit: str) -> Figure:
    with style():
        figure = Figure(figsize=(7.4, 5.0))
        ax = figure.add_subplot()
        ax.set_axis_off()
        ax.set_aspect("equal")
        ax.add_collection(LineCollection(lines, colors=FAINT if points else QUIET, linewidths=0.7))
        if points:
            ax.scatter(*project(np.array(points, float))[0].T, s=12, color=_FAMILIES[0], zorder=3)
        ax.autoscale_view()
    return figure
