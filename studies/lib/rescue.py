"""Failures between the stages and what rescues a design: the task that follows one case, and its
figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from kop_exudyn.drawing.style import CYCLE, PALETTE, QUIET, deviation_colours, style
from kop_exudyn.errors import SimulationFailure
from kop_exudyn.io.designs import load_design
from kop_exudyn.report.designs import DrawnState
from kop_exudyn.report.kit_drawings import drawn_state
from kop_exudyn.search.dataset import Dataset
from kop_exudyn.search.events import StageEvent
from kop_exudyn.search.path import to_parts
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.settings import StageSettings
from kop_exudyn.search.stage_results import StageResult
from kop_exudyn.search.stages import Stages
from kop_exudyn.search.weights import Weights
from kop_exudyn.structures.base import Design
from kop_exudyn.wording import counted_parts

from .watched_path import WatchedPath, watch

Case = Mapping[str, Any]


def path_case(
    design: Path,
    parts: Mapping[str, int],
    weight: float,
    relaxed_steps: int,
    path_steps: int,
    seed: int,
) -> dict[str, Any]:
    """One design relaxed at one w_c and followed to its parts, as plain data; where it snaps or
    finds no equilibrium, "rescue" is what the search's own rule makes of it.

    design : its file; parts : kind -> number; weight : w_c; seed : of the clustering
    """
    subject = load_design(design)
    settings = StageSettings(
        schedule=(weight,),
        relaxed_steps=relaxed_steps,
        path_steps=path_steps,
        reassignments=0,  # else the search leaves snaps to its rounds
        seed=seed,
    )
    with DesignPool([subject], 1) as pool:
        pool.prepare()
        dataset = Dataset.of_pool(pool, Weights.suiting([subject]))
        attempts: dict[str, float] = {}

        def observe(event: StageEvent) -> None:
            if event.weight is not None:
                attempts[event.sqp] = event.weight

        stages = Stages(dataset, dict(parts), settings, observer=observe)
        relaxed = stages.relaxed(stages.direct().kit)
        case = _followed(subject, watch(dataset, relaxed, path_steps)[0], relaxed, weight)
        if not fails(case):
            return case
        attempts.clear()
        rescued, _ = to_parts(stages, relaxed)
        path = watch(dataset, rescued, path_steps)[0]
        reached = max(attempts.values(), default=weight)
        return case | {"rescue": _followed(subject, path, rescued, reached)}


def _followed(
    subject: Design, path: WatchedPath | SimulationFailure, relaxed: StageResult, weight: float
) -> dict[str, Any]:
    case: dict[str, Any] = {
        "parts": dict(sorted(relaxed.kit.sizes.items(), reverse=True)),  # linear first
        "weight": weight,
        "relaxed %": relaxed.evaluations[0].fit.max_percent,
    }
    if isinstance(path, SimulationFailure):
        return case | {"no equilibrium": str(path), "snapped": False}
    return case | {
        "at the parts %": path.states[-1].fit.max_percent,
        "snapped": path.jump is not None,
        "snap at": path.jump and path.jump.fraction,
        "snap %": path.jump and 100 * path.jump.distance,
        "largest move %": float(path.moves_percent.max()),
        "moves %": path.moves_percent,
        "energies": path.energies,
        "deviations %": path.deviations_percent,
        "states": {
            "relaxed": _plain(drawn_state(subject, path.start, "")),
            "at the parts": _plain(drawn_state(subject, path.states[-1], "")),
        },
    }


def fails(case: Case) -> bool:
    """Whether a design snaps on its way, or has no equilibrium somewhere on it."""
    return bool(case["snapped"]) or "no equilibrium" in case


def example(cases: Sequence[Case]) -> Case | None:
    """The case to show: of those that snap the one with the largest snap; where none does, that
    with the largest move in one step. None where no case has a whole path."""
    snapped = [case for case in cases if case["snapped"]]
    whole = [case for case in cases if "at the parts %" in case]
    return max(snapped or whole, key=lambda case: case["largest move %"], default=None)


def finding_of(cases: Sequence[Case]) -> str:
    """What came of all cases, in words."""
    failed = [case for case in cases if fails(case)]
    if not failed:
        return (
            f"In none of {len(cases)} cases does the design snap or lose its equilibrium on the "
            "way to its parts: there is nothing to rescue."
        )
    without = sum("no equilibrium" in case for case in failed)
    saved = sum(not fails(case["rescue"]) for case in failed)
    text = (
        f"In {len(failed)} of {len(cases)} cases the design fails on the way to its parts "
        f"({len(failed) - without} snap, {without} find no equilibrium); raising w_c as the search "
        f"does rescues {saved} of them, {_nearer(failed)} of which then end nearer to the target."
    )
    shown = example(cases)
    if shown is None or not shown["snapped"]:
        return text
    text += (
        f" With {_in_words(shown)} a joint jumps {shown['snap %']:.0f} % of the size at "
        f"{shown['snap at']:.0%} of the way, and the design ends {shown['at the parts %']:.1f} % "
        "off"
    )
    rescue = shown["rescue"]
    if fails(rescue):
        return f"{text}; {_in_words(rescue)} don't keep it from that."
    return (
        f"{text}; with {_in_words(rescue)} it stays in its state and ends "
        f"{rescue['at the parts %']:.1f} % off."
    )


def _nearer(failed: Sequence[Case]) -> int:
    """How many of the rescued cases are nearer to the target at their parts than before."""
    return sum(
        not fails(case["rescue"])
        and case["rescue"]["at the parts %"] < case.get("at the parts %", float("inf"))
        for case in failed
    )


def _in_words(case: Case) -> str:
    return f"{counted_parts(case['parts'])} at w_c = {case['weight']:g}"


def drawn(case: Case, state: str, title: str) -> DrawnState:
    """One of a case's states."""
    found = case["states"][state]
    return DrawnState(
        title,
        [np.array(chain) for chain in found["chains"]],
        np.array(found["joints"]),
        np.array(found["deviation_percent"]),
    )


def label(case: Case) -> str:
    """The case's kit and weight, as a legend has them."""
    sizes = " + ".join(str(count) for count in case["parts"].values())
    return f"{sizes} parts, $w_c$ = $10^{{{round(np.log10(case['weight']))}}}$"


def draw_paths(cases: Sequence[Case]) -> Figure:
    """Movement in each step, deviation and energy along the path, one line a case."""
    fields = {
        "moves %": "largest move of a joint\nin one step, % of the size",
        "deviations %": "largest deviation from\nthe target, % of the size",
        "energies": "elastic energy, relative\nto the input design's",
    }
    with style():
        figure = Figure(figsize=(9.6, 3.6), layout="constrained")
        panels = figure.subplots(1, len(fields))
        for ax, (key, text) in zip(panels, fields.items()):
            for k, case in enumerate(cases):
                values = np.asarray(case[key])
                n = len(np.asarray(case["moves %"]))
                ax.plot(
                    100 * np.arange(n + 1 - len(values), n + 1) / n,
                    values,
                    color=CYCLE[k],
                    marker="os^D"[k % 4],
                    markersize=3.5,
                    linewidth=1.3,
                    label=label(case),
                )
            ax.set(xlabel="way to the parts, %", ylabel=text)
        panels[0].set_yscale("log")
        panels[0].axhline(1.0, color=QUIET, linewidth=0.8, linestyle=(0, (4, 3)))
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure


def draw_map(cases: Sequence[Case]) -> Figure:
    """Deviation at the parts for every kit (rows) and w_c (columns); snaps are framed, failures
    crossed out."""
    kits = list(dict.fromkeys(tuple(case["parts"].items()) for case in cases))
    weights = sorted({case["weight"] for case in cases})
    values = [case["at the parts %"] for case in cases if "at the parts %" in case]
    norm = LogNorm(min(values, default=1.0), max([*values, 1.01 * min(values, default=1.0)]))
    with style():
        figure = Figure(
            figsize=(1.6 + 1.35 * len(weights), 1.5 + 0.62 * len(kits)), layout="constrained"
        )
        ax = figure.subplots()
        ax.grid(False)
        for case in cases:
            _draw_cell(
                ax,
                weights.index(case["weight"]),
                kits.index(tuple(case["parts"].items())),
                case,
                norm,
            )
        ax.set(
            xlim=(-0.5, len(weights) - 0.5),
            ylim=(len(kits) - 0.5, -0.5),
            xlabel="weight $w_c$ of the projection",
            ylabel="parts: " + " + ".join(kind for kind, _ in kits[0]),
        )
        ax.set_xticks(
            range(len(weights)), [f"$10^{{{round(np.log10(weight))}}}$" for weight in weights]
        )
        ax.set_yticks(
            range(len(kits)), [" + ".join(str(count) for _, count in kit) for kit in kits]
        )
        ax.tick_params(length=0)
        ax.spines[:].set_visible(False)
    return figure


def _draw_cell(ax: Axes, x: int, y: int, case: Case, norm: LogNorm) -> None:
    value = case.get("at the parts %")
    colour = "#f2f2f2" if value is None else deviation_colours()(norm(value))
    ax.add_patch(Rectangle((x - 0.46, y - 0.44), 0.92, 0.88, facecolor=colour, linewidth=0))
    if value is None:
        ax.text(x, y, "no equilibrium", ha="center", va="center", color=QUIET, size=8)
        return
    ink = "white" if norm(value) > 0.5 else "#222222"
    if not case["snapped"]:
        ax.text(x, y, f"{value:.2g} %", ha="center", va="center", color=ink)
        return
    ax.text(x, y - 0.14, f"{value:.2g} %", ha="center", va="center", color=ink)
    ax.text(
        x,
        y + 0.2,
        f"snaps {case['snap %']:.0f} %",
        ha="center",
        va="center",
        color=ink,
        size=7.5,
        weight="bold",
    )
    ax.add_patch(
        Rectangle(
            (x - 0.46, y - 0.44), 0.92, 0.88, fill=False, edgecolor=PALETTE["blue"], linewidth=2.4
        )
    )


def _plain(state: DrawnState) -> dict[str, Any]:
    return {
        "chains": [np.round(chain, 5) for chain in state.chains],
        "joints": np.round(state.joints, 5),
        "deviation_percent": np.round(state.deviation_percent, 5),
    }
