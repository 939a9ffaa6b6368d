"""What fabrication errors do to designs that were built from a kit.

    python studies/robustness.py [--quick] [--out reports/robustness] [--jobs 2] [--resume]

Every beam of a real structure is a little too long or too short, every corner a little off its
angle. Here each length errs by 0.1 % of the design's median length (standard deviation) and each
angle by 0.1 degrees, independently of each other, and so do multiples of that. How far the joints
then move, after the best rigid placement, is computed twice: to first order from the sensitivities
of the equilibrium, which costs one linear solve, and by solving the equilibria of random samples.
The designs are those that the kits of the study of direct and relaxed kits end with.

A sample snaps when it doesn't come back to the planned state after its errors have been taken away.
Snapped samples are counted apart: where a design stands at the edge of a snap, small errors are
enough, and no derivative tells how far it goes.
"""

from __future__ import annotations

from math import radians
from pathlib import Path

import numpy as np

from kop_exudyn.report.designs import draw_designs
from lib.study import Study
from lib.study_kits import kits, run_folder, three_classes
from lib.sweep import Task
from lib.tolerance_drawing import draw_agreement, drawn_spreads, robustness_of_run, table_rows

MODELS = Path(__file__).resolve().parents[1] / "models"
SHARE, ANGLE = 1e-3, radians(0.1)
LIMIT = 1.0  # displacement of the darkest colour, % of the size
AT_TOLERANCE = 100  # samples of each design at the tolerance itself: what a builder asks


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)
    factors = [0.1, 1.0] if study.quick else [1e-3, 0.01, 0.1, 0.3, 1.0, 3.0, 10.0]
    few, many = (2, 2) if study.quick else (12, AT_TOLERANCE)
    samples = [many if factor == 1.0 else few for factor in factors]

    # 1. The kits, and the sensitivities and samples of all designs of each.
    kits(study, MODELS)
    cases = three_classes(MODELS, study.quick)
    tasks = [
        Task(
            case.name,
            robustness_of_run,
            {
                "run": run_folder(case.name, study) / "result.json",
                "files": list(case.files),
                "share": SHARE,
                "angle": ANGLE,
                "factors": factors,
                "samples": samples,
            },
        )
        for case in cases
    ]
    classes = {name: value["designs"] for name, value in study.sweep(tasks).items()}

    # 2. What came out: at the tolerance itself, and where prediction and sampling part.
    rows, every = table_rows(classes), [found for designs in classes.values() for found in designs]
    missed = {
        factor: [
            size["linear_error"]
            for found in every
            for size in found["sizes"]
            if size["factor"] == factor and "linear_error" in size
        ]
        for factor in factors
    }
    at_edge = [f"{row['design']} ({row['snapped']})" for row in rows if row["snapped"]]
    soft = [
        f"{found['design']} (predicted {size['predicted_rms_percent']:.2g} %, sampled "
        f"{size['sampled_rms_percent']:.2g} %)"
        for found in every
        for size in found["sizes"]
        if size["factor"] == 1.0 and size.get("linear_error", 0.0) > 1.0
    ]
    ends = f"At the tolerance {', '.join(at_edge)} snap" if at_edge else "None snaps"
    finding = (
        f"Errors of 0.1 % and 0.1° move the joints of {len(every)} designs by "
        f"{rows_median(rows):.2g} % of the size (rms, median of the designs). {ends} in {many} "
        "samples a design. The prediction misses "
        f"{100 * np.median(missed[factors[0]]):.2g} % of the displacement at {factors[0]:g} times "
        f"the tolerance, {100 * np.median(missed[1.0]):.2g} % at the tolerance and "
        f"{100 * np.median(missed[factors[-1]]):.2g} % at {factors[-1]:g} times (medians)."
        + (
            f" It tells nothing of designs that hardly resist one of their motions: "
            f"{', '.join(soft)}."
            if soft
            else ""
        )
    )
    report = study.report(finding)
    report.figure(
        "agreement",
        draw_agreement(classes),
        f"Above: lines are the prediction, markers re-solved samples, {many} at the tolerance and "
        f"{few} at each other size. Below: the part of the displacements that their own prediction "
        "misses, of the samples that didn't snap; it grows in proportion to the errors as long as "
        "the second order governs it. Hollow: some samples snapped.",
        alt="Predicted and sampled displacements against the errors' size",
    )
    report.table(
        "designs",
        rows,
        "At the tolerance itself. By lengths: their share of the mean square displacement, the "
        "rest is by angles. Planned max: largest deviation from the target without errors; 95 % of "
        "the samples stay below the next figure. Snapped, failed (no equilibrium): of the samples.",
    )
    report.figure(
        "joints",
        draw_designs(drawn_spreads(classes), LIMIT, "displacement"),
        "Where the errors show: rms displacement of each joint at the tolerance itself, by "
        "sensitivities, for the three designs of each class that move most.",
        alt="Designs with joints coloured by their displacement",
    )
    report.save(
        {"finding": finding, "designs": rows, "missed": {f"{k:g}": v for k, v in missed.items()}}
    )


def rows_median(rows: list[dict]) -> float:
    return float(np.median([row["predicted rms %"] for row in rows]))


if __name__ == "__main__":
    main()
