"""Slit parts: beams whose joints may sit anywhere along a slit.

    python studies/slit_parts.py [--quick] [--out DIR] [--jobs N] [--scheduler ADDRESS] [--resume]

The linear elements of conformals 1 to 5 are clustered into 2 to 25 parts, plain ones and ones with
slit ends, which realise an interval of lengths. Slits cost, or one part with slits of any length
would serve all: the dearer, the shorter.

The cost is added to the projection energy (half the mean squared distance of elements to what their
parts realise, relative to the median length) as cost / 2 times the mean squared slit length,
relative as well; both are minimised together, which gives the optimal slit lengths. Then every
design is built of these parts, directly, without optimising anything else, and with its own
corners, so that all deviations come from the linear parts. Deviations are distances of the joints
from the target surfaces, in % of their sizes; every state is an equilibrium that
Exudyn confirmed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kop_exudyn.io.datasets import select_files
from kop_exudyn.io.designs import load_design
from lib.slit_drawing import draw_lengths, draw_slits
from lib.study import Study
from lib.study_tasks import SIZES, slit_task
from lib.sweep import Task

MODELS = Path(__file__).resolve().parents[1] / "models"
SHOWN = 6  # parts of the kits whose intervals are drawn


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)

    # 1. Every number of parts with every cost of slits; None: no slits.
    files = (
        select_files(MODELS / "small", 2) if study.quick else select_files(MODELS / "conformals", 5)
    )
    sizes, costs = ((2, 4), (None, 1e-2)) if study.quick else (SIZES, (None, 1.0, 0.1, 1e-2, 1e-3))
    cases = [(size, cost) for cost in costs for size in sizes]
    tasks = {
        (size, cost): Task(
            f"{size} parts, cost {cost}",
            slit_task,
            {"files": files, "parts": size, "penalty": cost},
        )
        for size, cost in cases
    }
    values = study.sweep(list(tasks.values()))
    found = {case: values[task.name] for case, task in tasks.items()}

    # 2. One row a case.
    rows = []
    for (size, cost), one in found.items():
        fits = [design["fit"] for design in one["designs"] if "failed" not in design]
        whole = len(fits) == len(files)
        rows.append(
            {
                "parts": size,
                "cost": cost,
                "projection energy": one["projection_energy"],
                "rms distance %": one["rms_percent"],
                "mean slit %": float(np.mean(one["slits"])),
                "longest slit %": max(one["slits"]),
                "max %": max(f["max_percent"] for f in fits) if whole else None,
                "mean %": float(np.mean([f["mean_percent"] for f in fits])) if whole else None,
                "failed designs": len(files) - len(fits),
            }
        )
    shown = min(sizes, key=lambda size: abs(size - SHOWN))
    plain, cheap = (
        next(r for r in rows if r["parts"] == shown and r["cost"] == cost)
        for cost in (None, costs[-1])
    )
    finding = (
        f"With {shown} linear parts, slits (cost {costs[-1]:g}) of {cheap['mean slit %']:.0f} % "
        f"of the median "
        f"length on average bring the projection energy from {plain['projection energy']:.2g} to "
        f"{cheap['projection energy']:.2g}, and the largest deviation of {len(files)} designs from "
        f"{percent(plain['max %'])} to {percent(cheap['max %'])} without optimising their shapes."
    )

    # 3. The report.
    report = study.report(finding)
    report.figure(
        "slits",
        draw_slits(rows),
        "Lines: costs of slits. A point is missing where a design could not be built.",
        alt="Projection energy, slit length and deviation over the number of parts",
    )
    lengths = np.concatenate(
        [
            design.parameters[group.indices].ravel()
            for design in map(load_design, files)
            for group in design.groups
            if group.kind == "linear"
        ]
    )
    kits = [
        ("no slits" if cost is None else f"cost {cost:g}", parts_of(found[shown, cost]["kit"]))
        for cost in costs
    ]
    report.figure(
        "intervals",
        draw_lengths(lengths, kits),
        "Above: all lengths of the input elements, two of "
        f"each. Below: what the {shown} parts of each kit realise, a line a part: ticks mark its "
        f"two "
        "lengths, bars the reach of its slits.",
        alt="Lengths of elements, and intervals that parts realise",
    )
    report.table(
        "cases",
        rows,
        "Cost –: no slits. Slits and distances in % of the median length, deviations "
        "(max, mean) in % of the bounding box.",
    )
    report.save({"finding": finding, "cases": rows})


def parts_of(kit: dict) -> np.ndarray:
    """(m, 3): two lengths and the slit's, which is 0 for plain parts."""
    parts = np.array(next(iter(kit.values())))
    return parts if parts.shape[1] == 3 else np.column_stack([parts, np.zeros(len(parts))])


def percent(value: float | None) -> str:
    return "no buildable state" if value is None else f"{value:.2f} %"


if __name__ == "__main__":
    main()
