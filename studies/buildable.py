"""What it costs that designs open by themselves, and keep below their elastic limit.

    python studies/buildable.py [--quick] [--out reports/buildable] [--jobs 2]

A kit can be sought for states that a computer leads the designs through, whatever a builder would
find; that is how kits of parts have been sought so far. Here the same kits are sought three times:
nothing is required; the designs have to open from their assembly into the states that are shown;
and the equivalent stress has to keep below the elastic limit as well, in the assembly, deployed and
on the way. C-shells weigh a little stress in all three. Deviations are distances of the joints from
the target surface in % of its size, of the states that the designs open into: what
a builder gets.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from kop_exudyn.drawing.style import PALETTE, style
from kop_exudyn.report.designs import DrawnDesign, draw_designs
from kop_exudyn.report.kit_drawings import drawn_state
from kop_exudyn.search.objective import Evaluation
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.result import KitResult
from kop_exudyn.structures.strength import design_strength
from lib.study import Study
from lib.study_kits import KitCase, kit_of, run_folder, three_classes

MODELS = Path(__file__).resolve().parents[1] / "models"
LEVELS = {
    "nothing": Requirements.none(),
    "opening": Requirements(stress=False),
    "opening, stress": Requirements(),
}
COLOURS = (PALETTE["vermillion"], PALETTE["orange"], PALETTE["blue"])


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)

    # 1. The kits: every class (quick: the first) under every requirement.
    found: dict[str, dict[str, KitResult]] = {}
    cases = three_classes(MODELS, study.quick)
    for case in cases[:1] if study.quick else cases:
        found[case.name] = {}
        for level, requirements in LEVELS.items():
            result = kit_of(*required(case, level, requirements, study), study.jobs)
            study.kits_s[f"{case.name}, {level}"] = result.wall_s
            found[case.name][level] = result

    # 2. What came out.
    rows = [
        row
        for name, results in found.items()
        for level, result in results.items()
        for row in design_rows(name, level, result)
    ]
    outcome = finding(rows)
    report = study.report(outcome)
    report.figure(
        "costs",
        draw_costs(rows),
        "Largest deviation of every design in the state that it opens into, by what is required.",
        alt="Deviations of opened designs under three requirements",
    )
    report.table(
        "designs",
        rows,
        "Shown max: of the state that the search ended with. Opened max: of the state that the "
        "design opens into, moved by so much. Utilisation: the largest of all states that are "
        "known, of the elastic limit.",
    )
    name, results = next(iter(found.items()))
    report.figure(
        "before_and_after",
        draw_designs(drawn_levels(results)),
        f"The {name} as they open, without any requirement and with all of them; grey: the input.",
        alt="Opened designs of a kit before and after",
    )
    report.save({"finding": outcome, "designs": rows})


def required(
    case: KitCase, level: str, requirements: Requirements, study: Study
) -> tuple[KitCase, Path]:
    """A case under a requirement, and the folder of its run."""
    stages = replace(case.stages, requirements=requirements)
    named = replace(case, name=f"{case.name}, {level}".replace(",", ""), stages=stages)
    return named, run_folder(named, study)


def design_rows(name: str, level: str, result: KitResult) -> list[dict[str, Any]]:
    """One row a design."""
    rows = []
    for n, design in enumerate(result.designs):
        shown, opened = result.stages["assigned"].designs[n], result.redeployed[n]
        moved = result.redeployment(n)
        known = [*design_strength(design, shown.equilibria).values()] if is_found(shown) else []
        on_the_way = opened.utilisation.values() if is_found(opened) else ()
        stressed = [s.largest for s in known if s.largest is not None] + list(on_the_way)
        rows.append(
            {
                "class": name,
                "required": level,
                "design": design.name,
                "shown max %": shown.fit.max_percent if is_found(shown) else None,
                "opened max %": opened.fit.max_percent if is_found(opened) else None,
                "moved %": moved.get("moved_percent"),
                "opens": bool(moved.get("same_state")),
                "utilisation": max(stressed) if stressed else None,
            }
        )
    return rows


def is_found(outcome: Any) -> bool:
    """Whether a design has a state there."""
    return isinstance(outcome, Evaluation)


def finding(rows: list[dict[str, Any]]) -> str:
    """What the rows say, in a sentence a level."""
    sentences = []
    for level in LEVELS:
        own = [row for row in rows if row["required"] == level]
        opened = [row["opened max %"] for row in own if row["opened max %"] is not None]
        opens = sum(row["opens"] for row in own)
        used = [row["utilisation"] for row in own if row["utilisation"] is not None]
        stress = f", utilisation up to {max(used):.2g}" if used else ""
        sentences.append(
            f"Required {level}: {opens} of {len(own)} designs open into the state shown, and they "
            f"open to {np.median(opened):.2g} % of the target in the median, {max(opened):.2g} % "
            f"at most{stress}."
        )
    return " ".join(sentences)


def draw_costs(rows: list[dict[str, Any]]) -> Figure:
    """Opened deviations of all designs, one bar a requirement."""
    designs = list(dict.fromkeys((row["class"], row["design"]) for row in rows))
    with style():
        figure = Figure(figsize=(max(5.0, 0.6 * len(designs) + 2.0), 3.6), layout="constrained")
        axes = figure.add_subplot()
        for k, (level, colour) in enumerate(zip(LEVELS, COLOURS)):
            own = {(row["class"], row["design"]): row for row in rows if row["required"] == level}
            heights = [own[key]["opened max %"] or 0.0 for key in designs]
            places = np.arange(len(designs)) + 0.27 * (k - 1)
            axes.bar(places, heights, 0.25, color=colour, label=level)
        axes.set_xticks(np.arange(len(designs)), [name for _, name in designs], rotation=60)
        axes.set_ylabel("opened, largest deviation in %")
        axes.legend(title="required")
    return figure


def drawn_levels(results: dict[str, KitResult]) -> list[DrawnDesign]:
    """Every design as it opens, without any requirement and with all of them."""
    levels = ("nothing", "opening, stress")
    first = results[levels[0]]
    drawn = []
    for n, (design, reference) in enumerate(zip(first.designs, first.references)):
        role = design.fitted_role.name
        wanted = design.scene(role).polylines(reference.equilibria[role].state)
        states = [
            drawn_state(design, results[level].redeployed[n], f"required: {level}")
            for level in levels
        ]
        drawn.append(DrawnDesign(design.name, states, wanted))
    return drawn


if __name__ == "__main__":
    main()
