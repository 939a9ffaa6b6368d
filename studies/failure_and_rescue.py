"""A design that buckles between the stages, and what rescues it.

    python studies/failure_and_rescue.py [--quick] [--out reports/failure_and_rescue] [--jobs 2]
    [--resume]

After the relaxed stage every element is only near its part. On the way there a design can snap into
another stable state, the more easily the farther elements are from their parts: with few parts, or
a small weight w_c of the projection energy. The way is therefore followed in small steps, and a
joint that moves far more in one of them than in the others is taken for a snap. Here one C-shell is
given kits of its own, of several sizes, at several weights.
"""

from __future__ import annotations

from pathlib import Path

from kop_exudyn.report.designs import DrawnDesign, draw_designs
from lib.rescue import draw_map, draw_paths, drawn, label, path_case
from lib.study import Study
from lib.sweep import Task

DESIGN = Path(__file__).resolve().parents[1] / "models" / "conformals" / "02_tanh.json"


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)
    sizes = [(3, 2), (8, 4)] if study.quick else [(2, 1), (3, 2), (4, 2), (6, 3), (8, 4), (12, 5)]
    weights = [1e2, 1e4] if study.quick else [1e2, 1e3, 1e4, 1e5]
    steps = (
        {"relaxed_steps": 6, "path_steps": 10}
        if study.quick
        else {"relaxed_steps": 15, "path_steps": 10}
    )

    # 1. Every size of kit at every weight: relaxed, then followed to the parts.
    tasks = [
        Task(
            f"{linear}+{angular}_{weight:g}",
            path_case,
            {
                "design": DESIGN,
                "parts": {"linear": linear, "angular": angular},
                "weight": weight,
                **steps,
            },
        )
        for linear, angular in sizes
        for weight in weights
    ]
    cases = list(study.sweep(tasks).values())

    # 2. The worst of the snaps that most ways rescue from, and the ways.
    snapped = [case for case in cases if case["snapped"]]
    failed = max(snapped, key=lambda case: (len(rescues(case, cases)), case["snap %"]))
    rescued = rescues(failed, cases)
    shown = [failed, *rescued]
    finding = (
        f"{len(snapped)} of {len(cases)} cases snap on the way to their parts. With "
        f"{label_text(failed)} a "
        f"joint jumps {failed['snap %']:.0f} % of the box at {failed['snap at']:.0%} of the way, "
        f"and the design "
        f"ends {failed['at the parts %']:.1f} % off"
        + ("; " if rescued else "")
        + " and ".join(
            f"with {label_text(case)} it stays in its state and ends "
            f"{case['at the parts %']:.1f} % off"
            for case in rescued
        )
        + "."
    )
    report = study.report(finding)
    report.figure(
        "paths",
        draw_paths(shown),
        "The failure and its rescues on their way to the parts. A snap shows as one step in which "
        "a joint "
        "moves far more than in those around it; moves below the dashed line are never taken for "
        "one.",
        alt="Moves, deviation and energy along the path for a snapping and for rescued cases",
    )
    states = [drawn(failed, "relaxed", f"relaxed: {label(failed)}")]
    states += [drawn(case, "at the parts", f"at the parts: {label(case)}") for case in shown]
    report.figure(
        "states",
        draw_designs([DrawnDesign("tanh", states)], 10.0),
        "Before the way to the parts (left), after the snap, and rescued.",
        alt="The design relaxed, after its snap, and rescued",
    )
    report.section("All cases")
    report.figure(
        "map",
        draw_map(cases),
        "Largest deviation of the joints at the parts, % of the box, before these "
        "are tuned. Framed: a snap, and how far the joint jumped. Far off without a frame: the "
        "design got "
        "there in several steps, none of which stands out, so the watch on the path alone doesn't "
        "tell.",
        alt="Deviation for all kits and weights",
    )
    fields = ("relaxed %", "at the parts %", "snap at", "snap %")
    rows = [
        {
            "linear": case["parts"]["linear"],
            "angular": case["parts"]["angular"],
            "w_c": case["weight"],
            **{field: case.get(field) for field in fields},
        }
        for case in cases
    ]
    report.table("cases", rows, "Snap at: share of the way. A dash: none.")
    report.save(
        {
            "finding": finding,
            "cases": [
                {key: case.get(key) for key in ("parts", "weight", "snapped", *fields)}
                for case in cases
            ],
        }
    )


def label_text(case: dict) -> str:
    sizes = " and ".join(f"{count} {kind}" for kind, count in case["parts"].items())
    return f"{sizes} parts at w_c = {case['weight']:g}"


def rescues(failed: dict, cases: list[dict]) -> list[dict]:
    """What serves best without a snap, of higher weights for that kit, and of larger kits at that
    weight."""
    safe = [case for case in cases if "at the parts %" in case and not case["snapped"]]
    heavier = [
        case
        for case in safe
        if case["parts"] == failed["parts"] and case["weight"] > failed["weight"]
    ]
    larger = [
        case
        for case in safe
        if case["weight"] == failed["weight"]
        and case["parts"]["linear"] > failed["parts"]["linear"]
    ]
    return [
        min(group, key=lambda case: case["at the parts %"]) for group in (heavier, larger) if group
    ]


if __name__ == "__main__":
    main()
