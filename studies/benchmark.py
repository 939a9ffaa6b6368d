"""Run time against error: one C-shell, one grid and one umbrella mesh for 1 to 8 rod elements a piece.

    python studies/benchmark.py [--quick] [--out reports/benchmark]

Error: largest distance of a joint from the same design with 12 elements a piece, in % of the target's bounding box. Time:
median of several full deployments from the design's own start, after compilation. The grid, which needs no actuation,
is also solved by plain Newton with line search and by Exudyn's static solver alone, from the same start.
"""
from __future__ import annotations

import argparse
import json
from pathlib import Path
from statistics import median
from time import perf_counter

import matplotlib.pyplot as plt
import numpy as np

from kop_exudyn.equilibrium.exudyn_model import solve_alone
from kop_exudyn.equilibrium.newton import NewtonOptions, solve
from kop_exudyn.equilibrium.warm_up import warm_up
from kop_exudyn.errors import SimulationFailure
from kop_exudyn.io.json_files import read_json, write_json
from kop_exudyn.report.environment import environment
from kop_exudyn.report.page import Page
from kop_exudyn.report.style import style
from kop_exudyn.structures.base import design_from_dict

ROOT = Path(__file__).resolve().parents[1]
CASES = {"C-shell": ("conformals/03_exp.json", "elements_per_piece"), "grid": ("grids/05_free_form.json", "elements_per_piece"),
         "umbrella mesh": ("umbrellas/hill.json", "arm_elements")}
FINE = 12

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--quick", action="store_true", help="three refinements, one run each")
parser.add_argument("--out", type=Path, default=ROOT / "reports" / "benchmark")
arguments = parser.parse_args()
refinements, runs = ((1, 2, 3), 1) if arguments.quick else ((1, 2, 3, 4, 6, 8), 5)
warm_up()


def designs(file: str, field: str, elements: int, count: int):
    """Fresh copies of a design: nothing is kept from an earlier deployment."""
    path = ROOT / "models" / file
    return [design_from_dict(read_json(path) | {field: elements}, str(path)) for _ in range(count)]


def deployed(design) -> tuple[np.ndarray, float, int]:
    """Joints, seconds and Newton iterations of a full deployment (its workspaces are made before)."""
    design.systems
    begin = perf_counter()
    equilibrium = design.deploy()[design.fitted_role.name]
    return equilibrium.state.positions[design.joints], perf_counter() - begin, equilibrium.iterations


rows = []
for case, (file, field) in CASES.items():
    fine = designs(file, field, FINE, 1)[0]
    exact, _, _ = deployed(fine)
    for n in refinements:
        results = [deployed(design) for design in designs(file, field, n, runs)]
        joints, _, iterations = results[0]
        error = 100 * np.linalg.norm(joints - exact, axis=1).max() / fine.target.diagonal
        unknowns = designs(file, field, n, 1)[0].systems[fine.fitted_role.name].n_unknowns
        rows.append({"case": case, "elements a piece": n, "unknowns": unknowns, "iterations": iterations,
                     "seconds": median(r[1] for r in results), "error %": error})

# The same solve, from the same start, three ways: mixed-stress Newton, plain Newton, Exudyn alone.
file, field = CASES["grid"]
ways = []
for n in refinements:
    design = designs(file, field, n, 1)[0]
    system, scene, q = design.systems["deployed"], design.scene("deployed"), design.parameters
    for name, options in (("mixed-stress Newton", NewtonOptions()), ("plain Newton", NewtonOptions(mixed=False))):
        times = []
        for _ in range(runs):
            begin = perf_counter()
            try:
                iterations = solve(system, q, options=options).iterations
            except SimulationFailure as failure:
                iterations = str(failure)
            times.append(perf_counter() - begin)
        ways.append({"elements a piece": n, "way": name, "iterations": iterations, "seconds": median(times)})
    ways.append({"elements a piece": n, "way": "Exudyn's static solver"} | solve_alone(scene, q))

with style():
    figure, axes = plt.subplots(figsize=(6.4, 4.2))
    for case in CASES:
        own = [r for r in rows if r["case"] == case]
        axes.loglog([r["seconds"] for r in own], [max(r["error %"], 1e-9) for r in own], "o-", label=case)
        for r in own:
            axes.annotate(str(r["elements a piece"]), (r["seconds"], max(r["error %"], 1e-9)), xytext=(4, 4),
                          textcoords="offset points", fontsize=8)
    axes.set(xlabel="time of a full deployment, s", ylabel="largest joint error, % of bounding box")
    axes.legend()

page = Page("Run time against error", __doc__.split("\n\n")[2].replace("\n", " "))
page.figure(figure, "Points are numbered by rod elements a piece.", alt="error over time for three designs")
page.table(list(rows[0]), [list(r.values()) for r in rows], "Full deployments")
page.table(list(ways[0]), [[w.get(k) for k in ways[0]] for w in ways], "One grid from its design surface, three ways")
page.details("Environment", environment())
arguments.out.mkdir(parents=True, exist_ok=True)
page.save(arguments.out / "index.html", overwrite=True)
write_json(arguments.out / "benchmark.json", {"deployments": rows, "ways": ways, "environment": environment()}, overwrite=True)
print(json.dumps(rows[-1]), json.dumps(ways[-1], default=str))
