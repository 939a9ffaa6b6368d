"""Where the time of a kit optimisation goes.

    python studies/where_time_goes.py [--quick] [--out reports/where_time_goes]

Both stages of finding a kit of 12 linear and 5 angular parts for three C-shells are run in one
process on one core, with a clock around the functions that do the work; each moment counts for the
innermost of them. Shown is what every accepted step of the sequential quadratic programs cost. The
first step of each program is left out, since clustering, paths and trials of reassignments come
before it.
"""

from __future__ import annotations

from pathlib import Path

from kop_exudyn.compiled.library import library
from kop_exudyn.io.datasets import load_designs
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings, StageSettings
from lib.phases import PhaseClock, StepCosts, medians
from lib.profile_drawing import draw_costs
from lib.study import Study

MODELS = Path(__file__).resolve().parents[1] / "models"
PARTS = {"linear": 12, "angular": 5}
TITLES = {"relaxed": "relaxed: all elements", "assigned": "assigned: parts only"}


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)
    designs = load_designs(MODELS / "conformals", 1 if study.quick else 3)
    stages = (
        StageSettings(
            schedule=(1e4,),
            relaxed_steps=2,
            assigned_steps=2,
            reassignments=0,
            path_steps=2,
            restarts=2,
        )
        if study.quick
        else StageSettings()
    )

    # 1. Compiled before the clock starts; one job, so that all work is done in this process.
    library()  # compiled now, where it has to be
    clock = PhaseClock()
    with clock.running():
        costs = StepCosts(clock)
        outcome = optimize_kit(
            designs,
            PARTS,
            settings=JobSettings(stages=stages, jobs=1, baselines=False),
            observer=costs,
        )
    steps = [step for step in costs.steps if step.stage in TITLES]
    whole = dict(clock.seconds)

    # 2. Of a typical step of each stage, and of the whole run.
    typical = medians(steps)
    total = sum(whole.values())
    rows = [
        {
            "phase": phase,
            "run, s": seconds,
            "run, %": 100 * seconds / total,
            **{f"{stage} step, s": typical[stage].get(phase) for stage in typical},
        }
        for phase, seconds in sorted(whole.items(), key=lambda item: -item[1])
    ]
    rows.append(
        {
            "phase": "all",
            "run, s": total,
            "run, %": 100.0,
            **{f"{stage} step, s": typical[stage]["all"] for stage in typical},
        }
    )
    mechanics = (
        sum(whole.get(phase, 0.0) for phase in ("assembly", "factorisation", "Newton, rest"))
        / total
    )
    finding = (
        f"Of {total:.0f} s on one core, {mechanics:.0%} is the search for {outcome.equilibria:,} "
        f"equilibria, "
        f"{whole.get('sensitivities', 0.0) / total:.0%} their sensitivities, "
        f"{whole.get('QP', 0.0) / total:.0%} "
        f"quadratic programs, {whole.get('target fitting', 0.0) / total:.0%} distances to targets, "
        f"{whole.get('Exudyn', 0.0) / total:.0%} Exudyn, and {whole.get('rest', 0.0) / total:.0%} "
        f"all the rest; a step takes "
        + " and ".join(
            f"{m['all']:.1f} s and {m['equilibria']:.0f} equilibria in the {stage} stage"
            for stage, m in typical.items()
        )
        + " (medians)."
    )

    report = study.report(finding)
    report.figure(
        "steps",
        draw_costs(steps, TITLES),
        "Below: wall seconds of every accepted step by phase. Above: equilibria solved for it, "
        f"{sum(len(design.roles) for design in designs)} for every point tried. A dashed line: "
        f"the weight of "
        "the projection energy was raised, or elements got other parts.",
        alt="Seconds by phase of every accepted step in both stages",
    )
    report.table(
        "phases",
        rows,
        "The whole run, and the median of an accepted step. Equilibria are assembly, "
        "factorisation and the rest of Newton's method. Rest: everything that none of these "
        "clocks is around.",
    )
    report.save(
        {"finding": finding, "phases": rows, "medians": typical, "equilibria": outcome.equilibria},
        {"designs": [design.name for design in designs], "parts": PARTS},
    )


if __name__ == "__main__":
    main()
