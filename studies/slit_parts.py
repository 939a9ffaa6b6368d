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

The second part optimises kits of the small C-shells by both stages, with slit parts and with plain
ones, in the same objective (J, with the cost of slits) and with the same settings. A slit kit is
compared with the plain one of as many parts, and with the plain one of the most similar number of
beams to make.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from kop_exudyn.io.datasets import select_files
from kop_exudyn.io.designs import load_design
from kop_exudyn.search.settings import StageSettings
from lib.slit_drawing import draw_lengths, draw_slits
from lib.study import Study
from lib.study_tasks import QUICK, SIZES, changed, slit_search_task, slit_task
from lib.sweep import Task

MODELS = Path(__file__).resolve().parents[1] / "models"
SHOWN = 6  # parts of the kits whose intervals are drawn
SEARCH = StageSettings(reassignments=2, leaps=1, effort="quick")


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
    searches = search_tasks(study)
    values = study.sweep([*tasks.values(), *searches.values()])
    optimised = optimised_rows({case: values[task.name] for case, task in searches.items()})
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
        f"{percent(plain['max %'])} to {percent(cheap['max %'])} without optimising their shapes. "
        + told(optimised)
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
    report.table(
        "optimised",
        optimised,
        "Small C-shells, both stages. J with the cost of slits; beams to make, so that the designs "
        "can be built one after the other; slits in % of the median length; deviations in % of the "
        "bounding box.",
    )
    report.save({"finding": finding, "cases": rows, "optimised": optimised})


def search_tasks(study: Study) -> dict[tuple[str, int], Task]:
    """By kind and number of parts, the searches of the second part."""
    files = select_files(MODELS / "small", 2 if study.quick else 3)
    sizes = (
        {"slit": (3,), "linear": (3,)}
        if study.quick
        else {"slit": (2, 4, 6), "linear": (2, 4, 6, 8, 12)}
    )
    return {
        (kind, size): Task(
            f"{size} {kind} parts, optimised",
            slit_search_task,
            {
                "files": files,
                "kind": kind,
                "parts": size,
                "corners": 3,
                "stages": changed(replace(QUICK, effort="quick") if study.quick else SEARCH),
            },
            {"jobs": 1 if study.scheduler else study.jobs},
        )
        for kind, own in sizes.items()
        for size in own
    }


def optimised_rows(found: dict[tuple[str, int], dict]) -> list[dict]:
    """A row a search; those of slit kits name the plain kits that they are compared with."""
    rows = []
    for (kind, size), one in found.items():
        row = {
            "kind": kind,
            "parts": size,
            "beams to make": one["pieces"],
            "J": one["objective"],
            "of it slits": one["slit_cost"],
            "mean slit %": float(np.mean(one["slits"])),
            "longest slit %": float(np.max(one["slits"])),
            "max %": one["max_percent"],
            "outside %": one["outside_percent"],
            "search s": one["seconds"],
        }
        rows.append(row)
    plain = [row for row in rows if row["kind"] == "linear"]
    for row in rows:
        slit = row["kind"] == "slit"
        same = [p["J"] for p in plain if slit and p["parts"] == row["parts"]]
        like = min(plain, key=lambda p: abs(p["beams to make"] - row["beams to make"]))
        row["J, plain, as many parts"] = same[0] if same else None
        row["J, plain, like beams"] = like["J"] if slit else None
        row["its parts"] = like["parts"] if slit else None
    return rows


def told(rows: list[dict]) -> str:
    """What optimised slit kits gain, in a sentence."""
    slit = next(r for r in reversed(rows) if r["kind"] == "slit" and r["J"] is not None)
    text = (
        f"Optimised, {slit['parts']} slit parts for the small C-shells end at J = {slit['J']:.3g} "
        f"({slit['beams to make']} beams to make, slits of {slit['mean slit %']:.1f} % on average)"
    )
    if slit["J, plain, as many parts"] is not None:
        text += f", as many plain parts at {slit['J, plain, as many parts']:.3g}"
    if slit["J, plain, like beams"] is not None:
        text += (
            f", the plain kit of the most similar number of beams ({slit['its parts']} parts) at "
            f"{slit['J, plain, like beams']:.3g}"
        )
    return text + "."


def parts_of(kit: dict) -> np.ndarray:
    """(m, 3): two lengths and the slit's, which is 0 for plain parts."""
    parts = np.array(next(iter(kit.values())))
    return parts if parts.shape[1] == 3 else np.column_stack([parts, np.zeros(len(parts))])


def percent(value: float | None) -> str:
    return "no buildable state" if value is None else f"{value:.2f} %"


if __name__ == "__main__":
    main()
