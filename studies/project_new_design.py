"""A new design on a kit that exists: a sixth C-shell built of the parts of five others.

    python studies/project_new_design.py [--quick] [--out DIR] [--jobs N] [--scheduler ADDRESS]
    [--resume]

The kit of the study of kit sizes with 12 linear and 5 angular parts was made for conformals 1 to 5.
Here conformal 6, which it has never seen, is built of the same parts, once for each of several
weights w_c of the projection energy.

Direct: every input element becomes its nearest part. Relaxed: all elements move, drawn to their
nearest parts by w_c and held by the target. Built: each relaxed element becomes its nearest part.
Exchanged: elements then get other parts where the objective gains by that. An element is changed
when its part, or the way in which that is built in, isn't the one of the direct projection.
Deviations are distances of the joints from the target surface; every state is confirmed by Exudyn.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from kop_exudyn.io.designs import load_design
from kop_exudyn.search.settings import StageSettings
from lib.projection_drawing import draw_changes, draw_projection
from lib.size_kits import kits_by_size, sized_cases
from lib.study import Study
from lib.study_tasks import QUICK, changed, project_task
from lib.sweep import Task

MODELS = Path(__file__).resolve().parents[1] / "models"
STATES = ("direct", "relaxed", "built", "reassigned")


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)

    # 1. The kit, from the folder of runs where the study of sizes has left it, and then one
    # projection a weight.
    file = (
        MODELS / "small" / "06_moebius.json"
        if study.quick
        else MODELS / "conformals" / "06_moebius.json"
    )
    size, factors = (
        (3, (0.1, 10.0)) if study.quick else (12, tuple(10.0 ** (k / 2) for k in range(-4, 7)))
    )
    stages = changed(QUICK if study.quick else StageSettings())
    case = sized_cases(MODELS, study.quick)[0]
    kit = next(one for one in kits_by_size(study, case) if one.size == size)
    tasks = [
        Task(
            f"w_c {factor:.3g}",
            project_task,
            {"file": file, "kit": kit.result.kit.to_dict(), "factor": factor, "stages": stages},
        )
        for factor in factors
    ]
    found = study.sweep(tasks)

    # 2. One row a weight; the best one.
    rows = [row_of(factor, found[task.name]) for factor, task in zip(factors, tasks)]
    design = load_design(file)
    direct = rows[0]["direct max %"]
    built = [row for row in rows if row["reassigned max %"] is not None]
    finding = f"{design.name} can't be built of the kit."
    if built:
        best = min(built, key=lambda row: row["reassigned J"])
        finding = (
            f"{design.name} deviates by {shown(direct)} when its elements become their nearest "
            f"parts, by "
            f"{shown(best['built max %'])} when they are relaxed before (w_c = {best['w_c']:.3g} "
            f"times the "
            f"weight of the fit), and by {shown(best['reassigned max %'])} after exchanges; "
            f"{best['reassigned changes']} of its {design.n_elements} elements then have other "
            f"parts than "
            "in the direct projection."
        )

    # 3. The report.
    report = study.report(finding)
    report.figure(
        "sweep",
        draw_projection(rows),
        "The new design against w_c. Dotted: direct projection.",
        alt="Deviation, energy, distance to the parts and changed elements over w_c",
    )
    drawn = [tasks[k] for k in np.unique(np.linspace(0, len(tasks) - 1, 6).round().astype(int))]
    states = [
        (f"w_c = {task.settings['factor']:g}", found[task.name]["reassigned"])
        for task in drawn
        if "failed" not in found[task.name]
    ]
    report.figure(
        "changes",
        draw_changes(design, states),
        "The design built of the kit, after exchanges: elements "
        "with other parts than after direct projection.",
        alt="The design for several w_c, changed elements in colour",
    )
    columns = [f"{state} {what}" for state in STATES[1:] for what in ("max %", "J", "changes")]
    report.table(
        "weights",
        [
            {
                "w_c": row["w_c"],
                **{name.replace("reassigned", "exchanged"): row[name] for name in columns},
            }
            for row in rows
        ],
        f"w_c over the weight of the fit; max %: largest deviation, {shown(direct)} after direct "
        f"projection; "
        "J: the objective; changes: elements with other parts than then. A dash: no equilibrium "
        "was found.",
    )
    report.save({"finding": finding, "weights": rows, "design": design.name})


def row_of(factor: float, found: Mapping[str, Any]) -> dict[str, Any]:
    """Figures of all states for one weight."""
    row: dict[str, Any] = {"w_c": factor}
    for state in STATES:
        one = found.get(state, {})
        row |= {
            f"{state} max %": one.get("fit", {}).get("max_percent"),
            f"{state} J": one.get("objective"),
            f"{state} energy ratio": one.get("energy_ratio"),
        }
        row |= {f"{state} changes": one.get("changes")} if state != "direct" else {}
    tightness = found.get("relaxed", {}).get("tightness", {})
    return row | {f"{kind} distance %": 100 * value for kind, value in tightness.items()}


def shown(percent: float | None) -> str:
    return "– (no equilibrium) –" if percent is None else f"{percent:.2f} %"


if __name__ == "__main__":
    main()
