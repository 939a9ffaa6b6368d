"""Soak: random designs, anywhere and in any units, are the same structures

    python studies/soak.py [--quick] [--out reports/soak] [--jobs 2] [--resume]

Three thousand random tiny designs of all classes are each read and deployed twice: as they are, and
turned, perhaps mirrored, up to 3e7 of their sizes away, in units of length from 1e-6 to 1e6. Both
must have the same outcome, the same state, percentages and energies; the state must be found again
from beside it; commands must end with the right status. What lies beyond 1e7 sizes must be refused.

States may differ by 1e-9 of the size, and by 4e-15 for every size that they are away from the
origin: coordinates there are rounded before we see them. A line is reproduced by its seed:
soak_case(238), from lib.stress.soak.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from kop_exudyn.drawing.style import PALETTE, style
from lib.stress.random_designs import CLASSES
from lib.stress.soak import ROUNDED, SAME, soak_cases
from lib.study import Study
from lib.sweep import Task

CASES, QUICK_CASES, AT_ONCE = 3000, 20, 10
NAMES = {"c_shell": "C-shells", "grid": "grids", "umbrella": "umbrella meshes"}


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)
    count = QUICK_CASES if study.quick else CASES
    tasks = [
        Task(f"cases from {first}", soak_cases, {"first": first, "count": AT_ONCE})
        for first in range(0, count, AT_ONCE)
    ]
    cases = [case for found in study.sweep(tasks).values() for case in found["cases"]]
    wrong = [case for case in cases if case["wrong"]]
    outcomes = Counter((case["class"], case["outcome"]) for case in cases)
    rows = [
        {"class": NAMES[name], "outcome": outcome, "cases": number}
        for (name, outcome), number in sorted(outcomes.items())
    ]
    near = [c["apart"] for c in cases if c["apart"] is not None and c["sizes away"] <= 1e5]
    far = [c["apart"] for c in cases if c["apart"] is not None and c["sizes away"] > 1e5]
    finding = (
        f"Of {len(cases):,} designs {len(wrong)} are wrong somewhere. Up to 1e5 sizes away states "
        f"differ by at most {max(near, default=0.0):.1e} of the size, beyond by at most "
        f"{max(far, default=0.0):.1e}."
    )
    report = study.report(finding)
    report.figure(
        "apart",
        drawn(cases),
        "A point a design: how far its states in both places are apart. Line: what is allowed.",
        alt="Differences of states over the distance from the origin",
    )
    report.table("outcomes", rows, "Failed: no equilibrium is found in either place.")
    if wrong:
        report.table("wrong", wrong, "What was found wrong; the seed makes it again.")
    report.save({"finding": finding, "outcomes": rows, "wrong": wrong, "cases": cases})


def drawn(cases: list[dict[str, Any]]) -> Figure:
    """Differences over distances, a colour a class."""
    with style():
        figure, axis = plt.subplots(figsize=(7.4, 3.4), layout="constrained")
        for name, colour in zip(CLASSES, ("blue", "orange", "green")):
            own = [c for c in cases if c["class"] == name and c["apart"] is not None]
            axis.loglog(
                [max(c["sizes away"], 0.3) for c in own],
                [max(c["apart"], 1e-17) for c in own],
                ".",
                color=PALETTE[colour],
                label=NAMES[name],
            )
        distances = np.geomspace(0.3, 1e7, 100)
        axis.loglog(distances, SAME + ROUNDED * distances, color=PALETTE["black"], label="allowed")
        axis.set(xlabel="distance from the origin, sizes", ylabel="states apart, of the size")
        axis.legend()
    return figure


if __name__ == "__main__":
    main()
