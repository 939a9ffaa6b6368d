"""Umbrella meshes with rigid plates against plates of rods: what they save, and how far the
deployed joints move.

    python studies/rigid_plates.py [--quick] [--out reports/rigid_plates]

Every design is deployed twice from its compact state: plates as stars of three rods, ten times
stiffer than the arms (the model of the release), and plates as bodies of six unknowns that carry
the hinges of their edges. Both final states are confirmed by Exudyn. Joints are compared after the
best rigid motion, in % of the bounding-box diagonal of those between plates of rods. Times are
processor times of full deployments, medians after compilation, on one core.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from kop_exudyn.drawing.style import FAINT, PALETTE, style
from kop_exudyn.io.designs import design_files
from kop_exudyn.structures.umbrella.bodies import RIGID, RODS
from lib.study import Study
from lib.study_plates import compared_plates, stiffened_plates
from lib.sweep import Task

ROOT = Path(__file__).resolve().parents[1]
# Released meshes are no part of the repository: compared where they lie beside it.
RELEASED = [
    ROOT.parent / "shared" / "data" / "umbrella" / f"{name}.json.gz"
    for name in ("sphere_cap_0.3", "saddle_5t", "hemisphere_5t", "lilium")
]
STIFFER = (1, 10, 100, 1000)
Rows = Sequence[dict[str, Any]]


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)

    # 1. All designs with both models of the plates; one with ever stiffer rods.
    own = design_files(ROOT / "models" / "umbrellas")
    files = own[:2] if study.quick else [*own, *(path for path in RELEASED if path.exists())]
    tasks = [
        Task(
            path.name.split(".json")[0],
            compared_plates,
            {"file": path, "runs": 1 if study.quick else 5},
        )
        for path in files
    ]
    limit = Task("stiffer plates", stiffened_plates, {"file": own[0], "factors": STIFFER})
    found = study.sweep([*tasks, limit], jobs=1)
    rows = [row for task in tasks for row in found[task.name]["rows"]]
    rods, rigid = ([row for row in rows if row["plates"] == model] for model in (RODS, RIGID))

    # 2. What came out.
    outcome = finding(rods, rigid)
    report = study.report(outcome)
    report.figure(
        "difference",
        drawing(rods, rigid),
        "Left: distance of the joints between rigid plates from those "
        "between plates of rods. Right: time of a full deployment with either.",
        alt="joints moved and seconds for every design",
    )
    report.table(
        "designs",
        [
            {
                "design": a["design"],
                "cells": a["cells"],
                "unknowns": a["unknowns"],
                "if rigid": b["unknowns"],
                "seconds": a["seconds"],
                "rigid": b["seconds"],
                "moved %": b["moved_max_percent"],
                "mean %": b["moved_mean_percent"],
                "energy %": b["energy_percent"],
            }
            for a, b in zip(rods, rigid)
        ],
        "Plates of rods and, where it says so, rigid ones; how far joints move, most and on "
        "average",
    )
    stiffer = found[limit.name]
    report.section(
        "The limit",
        f"One design ({stiffer['design']}) with plates of stiffer and stiffer rods: its joints "
        "approach those between rigid plates.",
    ).table("stiffer", stiffer["rows"])
    report.save({"finding": outcome, "plates": rows, "stiffer": stiffer["rows"]})


def finding(rods: Rows, rigid: Rows) -> str:
    """The outcome in two sentences."""
    saved = [100 * (1 - b["unknowns"] / a["unknowns"]) for a, b in zip(rods, rigid)]
    faster = median(a["seconds"] / b["seconds"] for a, b in zip(rods, rigid))
    moved, energy = ([row[key] for row in rigid] for key in ("moved_max_percent", "energy_percent"))
    return (
        f"Rigid plates leave out {min(saved):.0f} to {max(saved):.0f} % of the unknowns; "
        f"deployments take {1 / faster:.2f} times as long (median). The joint that moves most "
        f"moves by {min(moved):.3f} to {max(moved):.3f} %, and the elastic energy is higher by "
        f"{min(energy):.1f} to {max(energy):.1f} %: what plates of rods give way, the arms have to "
        "bend."
    )


def drawing(rods: Rows, rigid: Rows) -> Figure:
    """Joints moved, and times, design by design."""
    names = [row["design"] for row in rods]
    place = np.arange(len(names))[::-1]
    moved, mean = (
        [row[key] for row in rigid] for key in ("moved_max_percent", "moved_mean_percent")
    )
    before, after = ([row["seconds"] for row in side] for side in (rods, rigid))
    with style():
        figure, (left, right) = plt.subplots(
            1, 2, figsize=(7.4, 0.9 + 0.3 * len(names)), sharey=True, layout="constrained"
        )
        left.hlines(place, 0, moved, color=PALETTE["blue"], linewidth=5, alpha=0.35)
        left.plot(moved, place, "o", color=PALETTE["blue"], label="largest")
        left.plot(mean, place, "|", color=PALETTE["black"], markersize=11, label="mean")
        left.set(
            yticks=place,
            yticklabels=names,
            xlim=(0, None),
            title="Difference",
            xlabel="joints moved, % of the box's diagonal",
        )
        right.hlines(place, after, before, color=FAINT, linewidth=2)
        right.plot(before, place, "s", color=PALETTE["vermillion"], label="rods")
        right.plot(after, place, "o", color=PALETTE["blue"], label="rigid")
        right.set(xlabel="full deployment, s of processor time", xlim=(0, None), title="Time")
        for axes in (left, right):
            axes.legend(loc="best")
            axes.grid(axis="y", visible=False)
    return figure


if __name__ == "__main__":
    main()
