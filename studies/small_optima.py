"""How far from the best: random kits so small that the best one is known.

    python studies/small_optima.py [--quick] [--out DIR] [--jobs N] [--scheduler ADDRESS] [--resume]

Fifty random strips of four pieces, pinned so that they bulge, are built of two parts each. Every
assignment of parts to pieces that differs by more than names is tried, 36 of them, with the parts
brought to the objective's minimum from two starts; the least is the optimum. The search, which sees
none of this, is compared with it, at normal and at thorough effort.

Parts are optimised locally inside each assignment, so the optimum is proven over the assignments
only. A search counts as having found it within 0.1 % of J. Nothing follows for kits of hundreds of
elements, where there are far more assignments than can be tried.
"""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from kop_exudyn.drawing.style import PALETTE, style
from lib.small_kits import compared
from lib.study import Study
from lib.sweep import Task

INSTANCES, QUICK_INSTANCES = 50, 2
EFFORTS = ("normal", "thorough")


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)

    # 1. Every instance by itself.
    efforts = EFFORTS[:1] if study.quick else EFFORTS
    seeds = range(QUICK_INSTANCES if study.quick else INSTANCES)
    tasks = [Task(f"strip {seed}", compared, {"seed": seed, "efforts": efforts}) for seed in seeds]
    values = study.sweep(tasks)
    rows = [row for task in tasks for row in values[task.name]["rows"]]

    # 2. What came out.
    told = []
    for effort in efforts:
        own = [row for row in rows if row["effort"] == effort]
        ratios = [row["ratio"] for row in own]
        told.append(
            f"at {effort} effort the search finds the optimum in {sum(r['found'] for r in own)} of "
            f"{len(own)} instances and is within 10 % of it in {sum(r <= 1.1 for r in ratios)}, "
            f"at worst {max(ratios):.2f} times above"
        )
    finding = "; ".join(told) + "."
    finding = finding[0].upper() + finding[1:]

    # 3. The report.
    report = study.report(finding)
    report.figure(
        "ratios",
        drawn(rows),
        "J of the search over that of the best assignment, instances in the order of that.",
        alt="sorted ratios of the search's objective to the optimum",
    )
    report.table(
        "instances",
        rows,
        "Second best: of the assignments, over the best one; direct: of the direct projection.",
    )
    report.save({"finding": finding, "instances": rows})


def drawn(rows: list[dict]) -> Figure:
    """Sorted ratios, a line an effort."""
    with style():
        figure, axis = plt.subplots(figsize=(6.4, 3.4), layout="constrained")
        for effort, colour in zip(EFFORTS, ("blue", "vermillion")):
            ratios = np.sort([row["ratio"] for row in rows if row["effort"] == effort])
            if len(ratios):
                axis.plot(
                    np.arange(1, len(ratios) + 1), ratios, "o-", color=PALETTE[colour], label=effort
                )
        axis.set(xlabel="instances", ylabel="J over the optimum's")
        axis.legend()
    return figure


if __name__ == "__main__":
    main()
