"""A design that buckles between the stages, and what rescues it.

    python studies/failure_and_rescue.py [--quick] [--out reports/failure_and_rescue] [--jobs 2]
    [--resume]

After the relaxed stage every element is only near its part. On the way there a design can snap into
another stable state, the more easily the farther elements are from their parts: with few parts, or
a small weight w_c of the projection energy. The way is therefore followed in small steps, and a
joint that moves far more in one of them than in the others is taken for a snap. Here one C-shell is
given kits of its own, of several sizes, at several weights (clustered with seed 0); each way has
40 steps, so that a snap stands out. Where a case fails, the search's own rule is applied: the
relaxed stage goes on with w_c raised tenfold, twice at most. Shown is the case with the largest
snap.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from kop_exudyn.report.designs import DrawnDesign, draw_designs
from lib.rescue import draw_map, draw_paths, drawn, example, fails, finding_of, label, path_case
from lib.study import Study
from lib.sweep import Task

MODELS = Path(__file__).resolve().parents[1] / "models"
DESIGN, SMALL = MODELS / "conformals" / "02_tanh.json", MODELS / "small" / "03_exp.json"
FIELDS = ("relaxed %", "at the parts %", "snap at", "snap %")


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)
    sizes = [(1, 1), (2, 1)] if study.quick else [(2, 1), (3, 2), (4, 2), (6, 3), (8, 4), (12, 5)]
    weights = [1e1, 1e3] if study.quick else [1e2, 1e3, 1e4, 1e5]
    steps = {"relaxed_steps": 6 if study.quick else 15, "path_steps": 40, "seed": 0}
    tasks = [
        Task(
            f"{linear}+{angular}_{weight:g}",
            path_case,
            {
                "design": SMALL if study.quick else DESIGN,
                "parts": {"linear": linear, "angular": angular},
                "weight": weight,
                **steps,
            },
        )
        for linear, angular in sizes
        for weight in weights
    ]
    cases = list(study.sweep(tasks).values())
    finding = finding_of(cases)
    report = study.report(finding)
    shown = example(cases)
    if shown is not None:
        rescue = shown.get("rescue")
        ways = [shown, *([rescue] if rescue is not None and "moves %" in rescue else [])]
        report.figure(
            "paths",
            draw_paths(ways),
            "The largest snap of all cases and what its rescue made of it, on the way to the "
            "parts. A snap shows as one step in which a joint moves far more than in those around "
            "it; moves below the dashed line are never taken for one."
            if fails(shown)
            else "The case with the largest move of a joint in one step: no snap.",
            alt="Moves, deviation and energy along the way to the parts",
        )
        states = [drawn(shown, "relaxed", f"relaxed: {label(shown)}")]
        states += [drawn(case, "at the parts", f"at the parts: {label(case)}") for case in ways]
        report.figure(
            "states",
            draw_designs([DrawnDesign((SMALL if study.quick else DESIGN).stem[3:], states)], 10.0),
            "Before the way to the parts (left), at its end"
            + (", and rescued." if len(ways) > 1 else "."),
            alt="The design relaxed and at its parts",
        )
    report.section("All cases")
    report.figure(
        "map",
        draw_map(cases),
        "Largest deviation of the joints at the parts, % of the size, before these are tuned. "
        "Framed: a snap, and how far the joint jumped. Far off without a frame: the design got "
        "there in several steps, none of which stands out, so the watch on the path alone doesn't "
        "tell.",
        alt="Deviation for all kits and weights",
    )
    report.table(
        "cases",
        [_row(case) for case in cases],
        "Snap at: share of the way. Rescued: the weight at which the search's rule ends, and what "
        "comes of it. A dash: none.",
    )
    report.save({"finding": finding, "cases": [_summary(case) for case in cases]})


def _row(case: dict[str, Any]) -> dict[str, Any]:
    rescue = case.get("rescue")
    return {
        "linear": case["parts"]["linear"],
        "angular": case["parts"]["angular"],
        "w_c": case["weight"],
        **{field: case.get(field) for field in FIELDS},
        "rescued at w_c": rescue and rescue["weight"],
        "rescued": rescue and ("no" if fails(rescue) else "yes"),
        "rescued, at the parts %": rescue and rescue.get("at the parts %"),
    }


def _summary(case: dict[str, Any]) -> dict[str, Any]:
    kept = {key: case.get(key) for key in ("parts", "weight", "snapped", "no equilibrium", *FIELDS)}
    rescue = case.get("rescue")
    return kept | {"rescue": None if rescue is None else _summary(rescue)}


if __name__ == "__main__":
    main()
