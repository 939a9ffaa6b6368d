"""How the two stages proceed, and what exact Hessians are worth.

    python studies/two_stage_history.py [--quick] [--out reports/two_stage_history] [--jobs 2]
    [--resume]

Three C-shells are to share 12 linear and 5 angular parts. Shown are the objective and its terms
after every accepted step, and the designs at the start, between the stages and at the end. The same
kit is then sought twice without reassignments, once with exact Hessians of the energy and
Gauss-Newton Hessians of the fit, once with BFGS updates of them, from the same start, with the same
tolerances and steps enough for both.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from kop_exudyn.analysis.verdict import VerdictSettings
from kop_exudyn.io.datasets import load_designs, select_files
from kop_exudyn.report.designs import DrawnDesign, draw_designs
from kop_exudyn.report.history import draw_history
from kop_exudyn.report.kit_drawings import drawn_stages, histories
from kop_exudyn.report.kit_run import optimize_and_report
from kop_exudyn.search.settings import JobSettings, StageSettings
from lib.stage_history import course, course_rows, draw_courses, input_states
from lib.study import Study
from lib.study_kits import QUICK_STAGES, QUICK_VERDICT

MODELS = Path(__file__).resolve().parents[1] / "models"
PARTS = {"linear": 12, "angular": 5}


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)
    number = 1 if study.quick else 3
    models = MODELS / ("small" if study.quick else "conformals")
    designs, files = load_designs(models, number), select_files(models, number)

    # 1. The method as it is, and twice without reassignments, so that only the Hessian differs.
    method = QUICK_STAGES if study.quick else StageSettings()
    plain = (
        method
        if study.quick
        else replace(method, reassignments=0, relaxed_steps=60, assigned_steps=60)
    )
    results = {
        name: optimize_and_report(
            designs,
            PARTS,
            out=study.out / "runs" / name.replace(" ", "_"),
            inputs=files,
            settings=JobSettings(stages=stages, jobs=study.jobs, baselines=False),
            verdict=QUICK_VERDICT if study.quick else VerdictSettings(),
            resume=study.resume,
            overwrite=True,
        )
        for name, stages in {
            "method": method,
            "exact": plain,
            "bfgs": replace(plain, hessian="bfgs"),
        }.items()
    }

    # 2. What came out.
    result, rows = (
        results["method"],
        [row for name in ("exact", "bfgs") for row in course_rows(name, results[name])],
    )
    worst = {
        name: max(
            found.summary("assigned", n).get("fit", {}).get("max_percent", float("nan"))
            for n in range(number)
        )
        for name, found in results.items()
    }
    totals = {
        name: (
            sum(row["steps"] for row in rows if row["Hessian"] == name),
            results[name].equilibria,
            sum(row["seconds"] for row in rows if row["Hessian"] == name),
        )
        for name in ("exact", "bfgs")
    }
    finding = (
        "Exact Hessians take {} steps, {:,} equilibria and {:.0f} s of SQP; ".format(
            *totals["exact"]
        )
        + "BFGS takes {} steps, {:,} equilibria and {:.0f} s ".format(*totals["bfgs"])
        + (
            f"and ends with the worst joint {worst['bfgs']:.2g} % off instead of "
            f"{worst['exact']:.2g} %. "
        )
        + f"With reassignments and leaps the method reaches {worst['method']:.2g} %."
    )
    report = study.report(finding)

    report.section("The method's course")
    report.figure(
        "history",
        draw_history(histories(result)),
        "The objective and its terms after every accepted step. At a dashed line the weight of the "
        "projection energy rises, or elements get other parts.",
        alt="Objective against steps for both stages",
    )
    drawn = [
        DrawnDesign(design.name, [start, *design.states], design.wanted)
        for design, start in zip(
            drawn_stages(result, ("relaxed", "assigned")), input_states(result, "input")
        )
    ]
    report.figure(
        "designs",
        draw_designs(drawn),
        "At the start, between the stages, and at the end.",
        alt="Designs as given, after the relaxed and after the assigned stage",
    )

    report.section("Exact Hessians against BFGS")
    courses = {
        name: {stage: course(results[name].events, stage) for stage in ("relaxed", "assigned")}
        for name in ("exact", "bfgs")
    }
    report.figure(
        "hessians",
        draw_courses(courses),
        "The objective against points tried and against the SQP's wall "
        "time. A faint line: the weight of the projection energy rises there, and the objective "
        "with it.",
        alt="Objective against points tried and seconds with exact and BFGS Hessians",
    )
    report.table(
        "hessians",
        rows,
        "Without reassignments. Seconds: of the SQP, baselines and paths not counted.",
    )
    report.save(
        {
            "finding": finding,
            "hessians": rows,
            "worst_percent": worst,
            "equilibria": {name: found.equilibria for name, found in results.items()},
        },
        {name: found.settings for name, found in results.items()},
    )


if __name__ == "__main__":
    main()
