"""Repeatability: the same kit again, from inputs that differ by rounding.

    python studies/repeatability.py [--quick] [--out DIR] [--jobs N] [--scheduler ADDRESS]
    [--resume]

Every search is run ten times: once with the designs as they are, nine times with all their
parameters changed by random shares of 1e-9. A search that can be trusted ends in the same quality
every time; the kits may be others.

The spread is by how much the largest of the ten values is above the smallest. Deviations are those
of the designs as they are kept and as they open from their assembly, whichever is larger, in % of
their sizes.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from kop_exudyn.drawing.style import PALETTE, style
from kop_exudyn.io.datasets import select_files
from lib.repeated import repeated_task, spread_percent
from lib.study import Study
from lib.study_tasks import QUICK, changed
from lib.sweep import Task

MODELS = Path(__file__).resolve().parents[1] / "models"
RUNS, QUICK_RUNS = 10, 2
# name, folder, designs, parts
CASES = (
    ("small C-shells", "small", 2, {"linear": 5, "angular": 2}),
    ("grids", "grids", 6, {"linear": 12, "angular": 5}),
    ("umbrella meshes", "umbrellas", 6, {"cell": 8}),
    ("C-shells", "conformals", 5, {"linear": 12, "angular": 5}),
)


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)

    # 1. Every case, again and again.
    cases = CASES[:1] if study.quick else CASES
    jobs = 1 if study.scheduler else study.jobs  # workers of a cluster start no processes
    tasks = {
        (name, seed): Task(
            f"{name} {seed}",
            repeated_task,
            {
                "files": select_files(MODELS / folder, count),
                "parts": parts,
                "stages": changed(QUICK) if study.quick else {},
                "seed": seed,
            },
            {"jobs": jobs},
        )
        for name, folder, count, parts in cases
        for seed in range(QUICK_RUNS if study.quick else RUNS)
    }
    values = study.sweep(list(tasks.values()), jobs=1)
    runs = [
        {"designs": name, "run": seed, **values[task.name]} for (name, seed), task in tasks.items()
    ]

    # 2. How far they are apart.
    rows, told = [], []
    for name, _, _, parts in cases:
        own = [run for run in runs if run["designs"] == name]
        row = {
            "designs": name,
            "parts": " + ".join(f"{count} {kind}" for kind, count in parts.items()),
            "runs": len(own),
            "smallest J": min((r["J"] for r in own if r["J"] is not None), default=None),
            "spread of J %": spread_percent([r["J"] for r in own]),
            "smallest max %": min((r["max %"] for r in own if r["max %"]), default=None),
            "spread of max %": spread_percent([r["max %"] for r in own]),
            "mean seconds": float(np.mean([r["seconds"] for r in own])),
        }
        rows.append(row)
        told.append(
            f"{name}: {percent(row['spread of J %'])} in J, {percent(row['spread of max %'])} in "
            f"the largest deviation"
        )
    finding = (
        f"Spread of {rows[0]['runs']} searches whose inputs differ by 1e-9: {'; '.join(told)}."
    )

    # 3. The report.
    report = study.report(finding)
    report.figure(
        "spread",
        drawn(runs, [case[0] for case in cases]),
        "A point a search, over the smallest of its designs.",
        alt="Objective and largest deviation of repeated searches, over the smallest",
    )
    report.table("cases", rows, "A dash: in one of the runs a design could not be built.")
    report.table("runs", runs, "Run 0: the inputs as they are.")
    report.save({"finding": finding, "cases": rows, "runs": runs})


def percent(value: float | None) -> str:
    return "a failure" if value is None else f"{value:.1f} %"


def drawn(runs: list[dict[str, Any]], names: list[str]) -> Figure:
    """Two panels: J and the largest deviation over their smallest, a column a case."""
    with style():
        figure, axes = plt.subplots(1, 2, figsize=(7.4, 3.2), layout="constrained")
        titles = {"J": "objective", "max %": "largest deviation"}
        for axis, (column, title) in zip(axes, titles.items()):
            for place, name in enumerate(names):
                found = [run[column] for run in runs if run["designs"] == name]
                known = np.array([value for value in found if value is not None])
                if len(known):
                    axis.plot(
                        np.full(len(known), place), known / known.min(), "o", color=PALETTE["blue"]
                    )
            axis.set(title=title, ylabel="over the smallest", xlim=(-0.6, len(names) - 0.4))
            axis.set_xticks(range(len(names)), [name.replace(" ", "\n") for name in names])
    return figure


if __name__ == "__main__":
    main()
