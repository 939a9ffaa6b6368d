"""Who solves: this package's solver, Exudyn with steps controlled, Exudyn as it comes

    python studies/engines.py [--quick] [--out reports/engines]

Every design of the models (and of the released umbrella meshes, where they lie beside the
repository) is deployed twice from the same start: by this package's solver, and by Exudyn's
residuals and steps (`kop simulate --engine exudyn`). How far the two states are apart is the
largest difference of a body's coordinate, relative to the scene's size, and of a hinge's angle.
Both states are then confirmed by Exudyn. A design of each class is also put under random forces by
both.

Then one solve, from the same near start to the final state, by both and by Exudyn's static solver
as it comes, with the quickest of the settings that a user of it would try (load steps, over which
the opening and the actuators' forces grow; stabilisation; modified Newton). The start is a C-shell
opened by 0.9 of its way, a grid on its surface, a mesh whose actuators aim at 0.9 of their spacing.
Each one's error is that of its own joints against the same design with more elements. Times are
processor times after compilation, on one core, medians where there are several runs.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from kop_exudyn.drawing.style import CYCLE, FAINT, style
from kop_exudyn.io.designs import design_files
from lib.engines import as_it_comes, both_engines
from lib.study import Study
from lib.sweep import Task

ROOT = Path(__file__).resolve().parents[1]
MODELS = ROOT / "models"
# Released meshes are no part of the repository: compared where they lie beside it.
RELEASED = [
    ROOT.parent / "shared" / "data" / "umbrella" / f"{name}.json.gz"
    for name in ("saddle_5t", "hemisphere_5t", "lilium")
]
# One solve three ways: structures of three classes.
COMPARED = (
    "conformals/03_exp",
    "conformals/06_moebius",
    "grids/01_dome",
    "grids/05_free_form",
    "umbrellas/dome",
    "umbrellas/hill",
)
SAME, FINE = 1e-6, 8
Rows = list[dict[str, Any]]


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)
    folders = ("small",) if study.quick else ("conformals", "grids", "umbrellas", "small")
    files = [path for folder in folders for path in design_files(MODELS / folder)]
    files = files[:1] if study.quick else [*files, *(path for path in RELEASED if path.exists())]
    compared = ("small/03_exp",) if study.quick else COMPARED
    runs, fine = (1, 3) if study.quick else (3, FINE)

    # 1. All designs by both engines, and one solve three ways.
    tasks = [
        Task(f"{path.parent.name}/{path.name}", both_engines, {"file": path, "runs": runs})
        for path in files
    ]
    ways = [
        Task(
            f"three ways: {name}",
            as_it_comes,
            {"file": MODELS / f"{name}.json", "fine": fine, "runs": runs},
        )
        for name in compared
    ]
    found = study.sweep([*tasks, *ways], jobs=1)
    rows = [found[task.name]["row"] for task in tasks]
    loaded = [found[task.name]["loaded"] for task in tasks if "loaded" in found[task.name]]
    solves = [row for task in ways for row in found[task.name]["rows"]]

    # 2. What came out.
    report = study.report(finding(rows, loaded, solves))
    report.section("Deployments").figure(
        "deployments",
        drawing(rows),
        "Processor seconds of a full deployment by either engine, and of a confirmation.",
        alt="seconds by design of both engines",
    ).table("deployments", rows, "apart: relative to the scene's size")
    report.section("Under forces").table("loaded", loaded, "apart: relative to the size")
    report.section("One solve three ways").table(
        "ways", solves, "Exudyn's error is that of its own positions; without one, it failed"
    )
    report.save(
        {"deployments": rows, "loaded": loaded, "ways": solves}, {"runs": runs, "fine": fine}
    )


def finding(rows: Rows, loaded: Rows, solves: Rows) -> str:
    """What came out, in three sentences."""
    same = [row for row in rows if "failure" not in row and row["apart"] <= SAME]
    ratios = sorted(row["exudyn s"] / row["fast s"] for row in same)
    held = [row for row in loaded if "failure" not in row and row["apart"] <= SAME]
    alone = [row for row in solves if row["way"] == "Exudyn as it comes"]
    there = [row for row in alone if row["error %"] is not None]
    quicker = [
        row["design"]
        for row in there
        if row["seconds"]
        < next(other["seconds"] for other in solves if other["design"] == row["design"])
    ]
    times = f" in {ratios[0]:.0f} to {ratios[-1]:.0f} times the time" if ratios else ""
    return (
        f"Exudyn deploys {len(same)} of {len(rows)} designs to this package's states, at most "
        f"{SAME:g} of their size apart{times}, and {len(held)} of {len(loaded)} under forces. "
        f"Exudyn's static solver as it comes, with the best of its settings, solves {len(there)} "
        f"of {len(alone)} near ones; it is quicker than this package's solver for "
        f"{', '.join(quicker) if quicker else 'none'}."
    )


def drawing(rows: Rows) -> Figure:
    """Seconds by design, on a logarithmic axis."""
    with style():
        figure, axes = plt.subplots(figsize=(7, 0.24 * len(rows) + 1.2))
        for place, row in enumerate(rows):
            shown = (("fast s", 0), ("exudyn s", 1), ("confirmation s", 2))
            for key, colour in shown:
                if key in row:
                    label = key.removesuffix(" s") if place == 0 else None
                    axes.plot(row[key], place, "o", color=CYCLE[colour], label=label)
        axes.set_yticks(range(len(rows)), [row["design"] for row in rows])
        axes.invert_yaxis()
        axes.set_xscale("log")
        axes.set_xlabel("processor seconds")
        axes.grid(axis="x", color=FAINT)
        axes.legend()
    return figure


if __name__ == "__main__":
    main()
