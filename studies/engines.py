"""Who solves: this package's solver, Exudyn with steps controlled, Exudyn as it comes

    python studies/engines.py [--quick] [--out reports/engines] [--redraw]

Every design of the models (and of the released umbrella meshes, where they lie beside the
repository) is deployed twice from the same start: by this package's solver, and by Exudyn's
residuals and steps (`kop simulate --engine exudyn`). How far the two states are apart is the
largest difference of a body's coordinate, relative to the scene's size, and of a hinge's angle.
Both states are then confirmed by Exudyn. Every design is also put under random forces by both.

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
    study = Study.from_command_line(__doc__, __file__, can_redraw=True)
    if study.stored is not None:
        show(study, **{name: study.stored[name] for name in ("deployments", "loaded", "ways")})
        return
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

    show(study, rows, loaded, solves, {"runs": runs, "fine": fine})


def show(
    study: Study,
    deployments: Rows,
    loaded: Rows,
    ways: Rows,
    settings: dict[str, int] | None = None,
) -> None:
    """What came out: the page and its data."""
    report = study.report(finding(deployments, loaded, ways))
    report.section("Deployments").figure(
        "deployments",
        drawing(deployments),
        "Processor seconds of a full deployment by this package's solver and by Exudyn's residuals "
        "and steps, and of a confirmation by Exudyn's static solver.",
        alt="seconds by design of both engines",
    ).table(
        "deployments",
        deployments,
        "Fast: this package's solver; exudyn: Exudyn's residuals and steps; s: processor seconds. "
        "Apart: the two states, relative to the scene's size; angles: of hinges. Confirmation: "
        "Exudyn's static solver, from the state that is confirmed.",
    )
    report.section("Under forces").table(
        "loaded",
        loaded,
        "Forces: how many joints have one. Deflection: the largest, in % of the size. Apart: the "
        "two states under them, relative to the size.",
    )
    report.section("One solve three ways").table(
        "ways",
        ways,
        "Seconds: median of the runs, least and most beside it. Error: largest distance of a joint "
        "from the same design with more elements, in % of the size; Exudyn's is that of its own "
        "positions, and without one it found no equilibrium.",
    )
    report.save({"deployments": deployments, "loaded": loaded, "ways": ways}, settings)


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
    apart = max((row["apart"] for row in (*same, *held)), default=0.0)
    return (
        f"Exudyn deploys {len(same)} of {len(rows)} designs to this package's states{times}, and "
        f"{len(held)} of {len(loaded)} under forces; these states are at most {apart:.1g} of the "
        "size apart. "
        f"Exudyn's static solver as it comes, with the best of its settings, solves {len(there)} "
        f"of {len(alone)} near ones; it is quicker than this package's solver for "
        f"{', '.join(quicker) if quicker else 'none'}."
    )


def drawing(rows: Rows) -> Figure:
    """Seconds by design, on a logarithmic axis."""
    with style():
        figure, axes = plt.subplots(figsize=(7, 0.24 * len(rows) + 1.2), layout="constrained")
        for place, row in enumerate(rows):
            shown = (
                ("fast s", "this package's solver"),
                ("exudyn s", "Exudyn's residuals and steps"),
                ("confirmation s", "confirmation by Exudyn"),
            )
            for colour, (key, name) in enumerate(shown):
                if key in row:
                    label = name if place == 0 else None
                    axes.plot(row[key], place, "o", color=CYCLE[colour], label=label)
        axes.set_yticks(range(len(rows)), [row["design"] for row in rows])
        axes.invert_yaxis()
        axes.set_xscale("log")
        axes.set_xlabel("processor seconds")
        axes.grid(axis="x", color=FAINT)
        figure.legend(loc="outside upper left", ncols=3)
    return figure


if __name__ == "__main__":
    main()
