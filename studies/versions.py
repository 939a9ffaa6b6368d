"""This version beside another one

    python studies/versions.py --other COMMIT_OR_FOLDER [--quick] [--out reports/versions]

How long both take for the same work, on the same machine, in turns: a first and a later
`kop simulate`, deployments, Newton iterations, sensitivities, and the memory of a large solve.

Both are copied into a folder for the time of the study, so that nothing is compiled before. Times
are processor times of processes of their own, medians over rounds in which one version follows the
other; the least and the most ratio of a round say how far the machine can be trusted. Both read
the other version's models; whether they end in the same state is said.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from statistics import geometric_mean

from tqdm import tqdm

from lib.study import Study
from lib.versions import Case, compared, copied

ROOT = Path(__file__).resolve().parents[1]
SHELL, GRID, UMBRELLA = "conformals/01_sinh.json", "grids/01_dome.json", "umbrellas/saddle.json"
QUICK = [
    Case("later kop simulate", "warm", "small/01_sinh.json", rounds=1),
    Case("Newton iteration, 324 unknowns", "iteration", "4", rounds=1),
    Case("sensitivities of a small C-shell", "sensitivities", "small/01_sinh.json", rounds=1),
]
CASES = [
    Case("first kop simulate of a C-shell", "cold", SHELL, rounds=1),
    *(
        Case(f"later kop simulate of {what}", "warm", model)
        for what, model in (("a C-shell", SHELL), ("a grid", GRID), ("an umbrella mesh", UMBRELLA))
    ),
    Case("C-shell opened, 73 joints", "deployment", SHELL, 3),
    Case("C-shell opened, Moebius", "deployment", "conformals/06_moebius.json", 3),
    Case("umbrella mesh opened, saddle", "deployment", UMBRELLA, 3),
    Case("umbrella mesh opened, monkey saddle", "deployment", "umbrellas/monkey.json", 3),
    Case("Newton iteration, 7,878 unknowns", "iteration", "17", 5),
    Case("Newton iteration, 33,072 unknowns", "iteration", "34", 3),
    Case("sensitivities and Hessian of a C-shell", "sensitivities", SHELL, 5),
    Case("memory of a solve, 101,022 unknowns", "memory", "59", rounds=1),
]


def main() -> None:
    own = argparse.ArgumentParser(add_help=False)
    own.add_argument("--other", required=True)
    chosen, rest = own.parse_known_args()
    study = Study.from_command_line(__doc__, __file__, rest)
    cases = QUICK if study.quick else CASES
    with tempfile.TemporaryDirectory() as folder:
        other = copied(chosen.other, "other", ROOT, Path(folder))
        this = copied(str(ROOT), "this", ROOT, Path(folder), other.models)
        rows = list(tqdm(compared(cases, this, other), total=len(cases), disable=None))
    ratios = [row["ratio"] for row in rows if row["ratio"] is not None]
    outcome = f"This version takes {geometric_mean(ratios):.2f} of the other's, as a geometric mean"
    report = study.report(
        f"{outcome} over {len(ratios)} cases." if ratios else "Nothing could run."
    )
    report.section("Both versions").table("versions", rows, "Ratios below 1: this one needs less.")
    report.save(
        {"versions": rows},
        {"other": Path(chosen.other).name, "rounds": max(case.rounds for case in cases)},
    )


if __name__ == "__main__":
    main()
