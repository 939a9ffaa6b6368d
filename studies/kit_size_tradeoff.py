"""Kit size against fidelity: five C-shells built from 2 to 25 linear parts.

    python studies/kit_size_tradeoff.py [--quick] [--out DIR] [--jobs N] [--scheduler ADDRESS]
    [--resume]

How many parts are enough? Kits for conformals 1 to 5 are found with 5 angular and 25, 20, 16, 12,
10, 8, 6, 4, 3 and 2 linear parts. The largest kit is found from scratch, in both stages; every
other one starts from the next larger kit: the elements which that one realises are clustered into
fewer parts, and the assigned stage optimises these and which part serves which element, in two
rounds and without leaps, which keeps the sweep within half an hour. A kit that is worse than a
smaller one is then sought again from that one.

Deviations are distances of the joints from the target surfaces, in % of their
sizes; every state is an equilibrium that Exudyn confirmed. Kit size counts pieces to make, as
many of each part as the design that needs most of it, in % of the elements of all designs: 20 % at
best for five designs. The knee is the point farthest below the straight line from the first to the
last point, both axes scaled to [0, 1] (the rule of Satopaa et al., 2011), on the curve of the
smallest largest deviation that at most so many parts give.
"""

from __future__ import annotations

from pathlib import Path

from kop_exudyn.analysis.tradeoff import knee, tradeoff_row
from kop_exudyn.report.tradeoff_drawing import draw_tradeoff
from lib.study import Study
from lib.study_tasks import shared_kits

MODELS = Path(__file__).resolve().parents[1] / "models"


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)

    # 1. Chains of kits, down from the largest and up from the smallest; each task runs its designs
    # in parallel.
    _, best = shared_kits(study, MODELS)
    tasks = list(best.values())
    kits = {task.name: study.results[task.name].value for task in tasks}

    # 2. One row a kit, smallest first. A kit that couldn't be found at all has no row.
    rows = [
        tradeoff_row(task.settings["parts"], kits[task.name], study.results[task.name].seconds)
        for task in tasks
        if "failed" not in kits[task.name]
    ]
    sizes = [row["linear"] for row in rows]
    at = knee(sizes, [row["max %"] for row in rows])

    # 3. The report.
    files = tasks[0].settings["files"]
    first, last = rows[0], rows[-1]
    finding = (
        f"From {first['linear']} to {last['linear']} linear parts the largest deviation of "
        f"{len(files)} designs "
        f"goes from {shown(first['max %'])} to {shown(last['max %'])}, the kit from "
        f"{first['kit size %']:.0f} "
        f"to {last['kit size %']:.0f} % of the elements"
    )
    finding += (
        "."
        if at is None
        else (
            f"; the knee is at {sizes[at]} linear parts, with {shown(rows[at]['max %'])} "
            f"and {rows[at]['kit size %']:.0f} %."
        )
    )
    report = study.report(finding)
    report.figure(
        "tradeoff",
        draw_tradeoff(rows, "linear", at),
        "Figures of every kit against its number of linear "
        "parts; the dotted line marks the knee. Kits are optimised for all terms of the "
        "objective, so one of "
        "more parts may deviate more: grey is what at most so many parts give.",
        alt="deviation, kit size, energy, time over linear parts",
    )
    report.table(
        "kits",
        rows,
        "max and mean: of the joints' deviations; energy ratio: mean over the designs; J: the "
        "objective; seconds: of the search that gave the kit; a dash: not all designs could be "
        "built.",
    )
    designs = [
        {
            "linear": task.settings["parts"]["linear"],
            "design": design["name"],
            "failed": design.get("failed"),
            **design.get("fit", {}),
            "energy ratio": design.get("energy_ratio"),
        }
        for task in tasks
        for design in kits[task.name].get("designs", ())
    ]
    report.save(
        {
            "finding": finding,
            "kits": rows,
            "designs": designs,
            "knee": None if at is None else sizes[at],
        }
    )


def shown(percent: float | None) -> str:
    return "no buildable design" if percent is None else f"{percent:.2f} %"


if __name__ == "__main__":
    main()
