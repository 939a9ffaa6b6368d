"""Run time against error

    python studies/benchmark.py [--quick] [--out reports/benchmark] [--released FOLDER]

How long equilibria, sensitivities and optimisation steps take, for a given error: a cantilever
under its weight, a grid, a C-shell and umbrella meshes with 1 to 8 rod elements a piece, gridshells
of 500 to 100,000 unknowns, and SQP steps with the exact Hessian and with BFGS. Errors are the
largest distance of a joint from the same design with 12 elements a piece (the cantilever: 64), in %
of the bounding box. Times are processor times after compilation, medians of several runs with bars
from the least to the most; all runs in one thread, so on an idle machine they are wall times.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from kop_exudyn.compiled.library import library
from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.equilibrium.system import System
from kop_exudyn.files.json_files import read_json
from kop_exudyn.io.designs import load_design
from kop_exudyn.units import plain_number
from lib import benchmark_goals as goals
from lib.benchmark import deployments, fresh, speedups, three_ways
from lib.benchmark_figures import error_against_time, scaling_figure, steps_figure, ways_compared
from lib.benchmark_scaling import PHASES, scaling
from lib.benchmark_scenes import cantilever, gridshell
from lib.benchmark_steps import sqp_steps
from lib.study import Study

ROOT = Path(__file__).resolve().parents[1]
MODELS = ROOT / "models"
CASES = {
    "C-shell": ("conformals/03_exp.json", "elements_per_piece"),
    "grid": ("grids/05_free_form.json", "elements_per_piece"),
    "umbrella hill": ("umbrellas/hill.json", "arm_elements"),
    "umbrella saddle": ("umbrellas/saddle.json", "arm_elements"),
}
FINE, FINE_STRIP, CHANGE = 12, 64, 1e-6


def main() -> None:
    own = argparse.ArgumentParser(add_help=False)
    own.add_argument("--released", type=Path, default=ROOT.parent / "shared" / "data" / "umbrella")
    released, rest = own.parse_known_args()
    study = Study.from_command_line(__doc__, __file__, rest)
    library()  # compiled now, where it has to be
    quick = study.quick
    refinements, runs = ((1, 2), 1) if quick else ((1, 2, 3, 4, 6, 8), 3)
    of_structures = (1,) if quick else refinements  # Exudyn alone takes its time for these

    # 1. Full deployments.
    cases = (
        {"C-shell": ("small/03_exp.json", "elements_per_piece"), "grid": CASES["grid"]}
        if quick
        else CASES
    )
    rows = [
        row
        for case, (file, field) in cases.items()
        for row in deployments(
            case,
            lambda n, f=file, k=field: fresh(read_json(MODELS / f), {k: n}),
            refinements,
            4 if quick else FINE,
            runs,
        )
    ]

    # 2. One solve three ways: from a straight strip, from a design surface, and from a neighbouring
    # equilibrium.
    ways = three_ways(
        "cantilever",
        lambda n: (*cantilever(n), None),
        lambda n: [n],
        refinements,
        FINE_STRIP,
        1.0,
        runs,
    )
    ways += three_ways(
        "grid",
        grid_from_its_surface,
        lambda n: grid(n).joints,
        of_structures,
        4 if quick else FINE,
        grid(1).target.size,
        runs,
    )
    ways += three_ways(
        "gridshell, warm",
        warm_gridshell,
        lambda n: np.arange(64),
        of_structures,
        4 if quick else FINE,
        float(np.sqrt(2.04)),
        runs,
    )

    # 3. Size, and 4. optimisation.
    sizes = scaling((4, 7) if quick else (5, 8, 12, 17, 24, 34, 45, 59), runs)
    designs = [
        load_design(path) for path in sorted((MODELS / "small").glob("*.json"))[: 1 if quick else 3]
    ]
    steps = sqp_steps(designs, 2 if quick else 15)

    # 5. What was promised.
    faster = speedups(ways)
    table = promised(runs, released.released, sizes[-1], faster, quick)
    report = study.report(finding(table))
    report.section("Goals", "Notes on missed goals say what the time goes into.").table(
        "goals", table
    )
    report.section("Full deployments").figure(
        "deployments",
        error_against_time(rows),
        "Points are numbered by rod elements a piece; bars go from the least to the most time.",
        alt="error over time of full deployments",
    ).table("deployments", rows)
    report.section(
        "The same solve three ways",
        "The warm gridshell starts from an equilibrium before random changes "
        f"of its lengths by {CHANGE:g}. All stop at 1e-9 of the largest force, or don't converge.",
    ).figure(
        "ways",
        ways_compared(ways),
        "Exudyn's elements are the same, so that its solutions have the same errors.",
        alt="error over time for three solvers",
    ).table("ways", ways).table("faster", faster, "Where both converge")
    report.section("Size").figure(
        "scaling",
        scaling_figure(sizes, PHASES),
        "Gridshells with three elements a piece, from their unstressed state "
        "with all lengths shortened by 0.1 %. Every size ran in a process of its own.",
        alt="time and memory by size",
    )
    report.table(
        "scaling", sizes, "Seconds; assembly, factorisation and rest add up to a whole solve"
    )
    report.section("Optimisation").figure(
        "steps",
        steps_figure(steps),
        "Relaxed stage of small C-shells from inputs.",
        alt="objective by SQP steps",
    )
    report.table("steps", [{k: v for k, v in row.items() if k != "values"} for row in steps])
    report.save(
        {"deployments": rows, "ways": ways, "scaling": sizes, "steps": steps, "goals": table},
        {"refinements": refinements, "runs": runs, "fine": FINE, "change": CHANGE},
    )


def finding(goals_: list[dict]) -> str:
    """What misses its goal first, then the largest figures of the others."""

    def told(rows: list[dict]) -> str:
        return "; ".join(
            f"{row['goal']}: {plain_number(row['measured'])} {row['unit']} ({row['asked']})"
            for row in rows
        )

    missed = [row for row in goals_ if row["met"] != "yes"]
    kept = [row for row in goals_ if row["met"] == "yes"]
    sentences = [f"Short of what was asked for: {told(missed)}." if missed else ""]
    sentences += [f"{told(kept[:2])}." if kept else ""]
    return " ".join(filter(None, sentences))


def grid(n: int):
    return fresh(read_json(MODELS / CASES["grid"][0]), {CASES["grid"][1]: n})


def grid_from_its_surface(n: int):
    design = grid(n)
    return design.scene("deployed"), design.parameters, None


def warm_gridshell(n: int):
    scene, q = gridshell(8, n, 1e-3)
    start = solve(System(scene), q).state
    return scene, q * (1 + CHANGE * np.random.default_rng(0).normal(size=len(q))), start


def promised(runs: int, released: Path, largest: dict, faster: list, quick: bool) -> list:
    """The table of goals; the quick one has those that take a moment only."""
    shell = load_design(MODELS / ("small" if quick else "conformals") / "03_exp.json")
    table = [
        goals.newton_iteration(runs, 5 if quick else 17),
        goals.full_sensitivities(shell, runs),
        goals.goal(
            "memory of the largest gridshell",
            2048,
            "MiB",
            largest["peak MiB"],
            f"{largest['unknowns']} unknowns",
        ),
    ]
    frames = [row["times as fast as Exudyn"] for row in faster if row["case"] != "cantilever"]
    if frames:
        table.append(
            goals.goal(
                "ahead of Exudyn's own solver, structures",
                20,
                "times",
                min(frames),
                at_least=True,
                note=f"least of {len(frames)}; the cantilever is no structure",
            )
        )
    if not quick:
        table.append(goals.large_c_shell(read_json(MODELS / "conformals" / "01_sinh.json"), runs))
        table += goals.starting(MODELS / "small" / "03_exp.json", runs)
        five = [load_design(path) for path in sorted((MODELS / "conformals").glob("*.json"))[:5]]
        table.append(goals.kit_problem(five, {"linear": 12, "angular": 5}, 180.0))
        if released.is_dir():
            table += goals.released(
                {n: load_design(released / f"{n}.json.gz") for n in goals.RELEASED}, runs
            )
        else:
            print(f"{released} is not there: goals of released meshes left out", file=sys.stderr)
    return table


if __name__ == "__main__":
    main()
