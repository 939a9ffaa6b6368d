"""What it costs that designs can be built: that they open by themselves, forgive the workshop, keep
below their elastic limit, and carry their load.

    python studies/buildable.py [--quick] [--out reports/buildable] [--jobs 2]

A kit can be sought for states that a computer leads the designs through, whatever a builder would
find; that is how kits of parts have been sought so far. Here the same kits are sought five times,
each time with one requirement more: nothing; the designs have to open from their assembly into the
states that are shown; errors of the workshop must not make them snap; the equivalent stress has to
keep below the elastic limit, in the assembly, deployed and on the way; and every design has to
carry snow without deflecting by more than a 200th of its span, and 1.5 times that without yielding
or giving way. The snow is that under which the input would deflect by as much, if deflections grew
as they do with small loads. C-shells weigh a little stress in all five. One start each, two leaps:
what other starts find is not the question here. Deviations are distances of the joints from the
target surface in % of its size, of the states that the designs open into: what a builder gets.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from kop_exudyn.drawing.style import PALETTE, style
from kop_exudyn.io.datasets import select_files
from kop_exudyn.report.designs import DrawnDesign, draw_designs
from kop_exudyn.report.kit_drawings import drawn_state
from kop_exudyn.search.evaluation import Evaluation
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.result import KitResult
from kop_exudyn.structures.base import Design
from kop_exudyn.structures.load_bound import LoadBound
from kop_exudyn.structures.strength import design_strength, materials_of, rod_strength
from lib.loaded_designs import with_snow
from lib.study import Study
from lib.study_kits import KitCase, kit_of, run_folder, three_classes

MODELS = Path(__file__).resolve().parents[1] / "models"
LEVELS = {
    "nothing": Requirements.none(),
    "opening": Requirements(stress=False, loads=False, samples=0),
    "+ margin": Requirements(stress=False, loads=False),
    "+ stress": Requirements(loads=False),
    "+ load": Requirements(),
}
LAST = "+ load"
QUICK = ("nothing", "opening", LAST)
CARRIED = 1.001  # of what is allowed: bounds are kept to as well as the search converges
COLOURS = tuple(PALETTE[name] for name in ("vermillion", "orange", "green", "sky", "blue"))


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)

    # 1. The kits: every class (quick: the first) under every requirement. They are kept in the
    # folder of runs; the report is written after every class.
    found: dict[str, dict[str, KitResult]] = {}
    cases = three_classes(MODELS, study.quick)[: 1 if study.quick else None]
    levels = QUICK if study.quick else tuple(LEVELS)
    for case in cases:
        kits: dict[str, KitResult] = {}
        folder = run_folder(f"{case.name} with snow", study)
        loaded = replace(case, files=select_files(with_snow(list(case.files), folder)))
        for level in levels:
            result = kit_of(*required(loaded, level, LEVELS[level], study), study.jobs)
            study.kits_s[f"{case.name}, {level}"] = result.wall_s
            kits[level] = result
        found[case.name] = kits
        write(study, found, [case.name for case in cases if case.name not in found])


def write(
    study: Study, found: Mapping[str, Mapping[str, KitResult]], missing: Sequence[str]
) -> None:
    """The report on the classes that have been done; missing : names of the others."""
    # 2. What came out.
    rows = [
        row
        for name, results in found.items()
        for level, result in results.items()
        for row in design_rows(name, level, result)
    ]
    outcome = finding(rows)
    if missing:
        outcome += f" Not run yet: {', '.join(missing)}."
    report = study.report(outcome)
    report.figure(
        "costs",
        draw_costs(rows),
        "Largest deviation of every design in the state that it opens into, by what is required; "
        "every class has its own scale.",
        alt="Deviations of opened designs by what is required",
    )
    report.table(
        "levels",
        level_rows(rows),
        "Median and largest: of the designs' largest deviations in the states that they open into. "
        "Utilisation: of the elastic limit. Of samples that snap there are more where one of a few "
        "does.",
    )
    report.table(
        "designs",
        rows,
        "Shown max: of the state that the search ended with. Opened max: of the state that the "
        "design opens into, moved by so much. Utilisation: the largest of all states that are "
        "known, of the elastic limit. Snow: largest share of the deflection and the stress that "
        "are allowed under it; 10: gives way.",
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
    samples = min(requirements.samples, case.stages.requirements.samples)  # quick: few
    stages = replace(
        case.stages,
        requirements=replace(requirements, samples=samples),
        effort="quick",
        leaps=min(case.stages.leaps, 2),
    )
    name = f"{case.name} {level.removeprefix('+ ')} required"
    named = replace(case, name=name, stages=stages, baselines=False, published=False)
    return named, run_folder(named.name, study)


def design_rows(name: str, level: str, result: KitResult) -> list[dict[str, Any]]:
    """One row a design."""
    rows = []
    for n, design in enumerate(result.designs):
        shown, opened = result.stages["assigned"].designs[n], result.redeployed[n]
        moved = result.redeployment(n)
        known = [*design_strength(design, shown.equilibria).values()] if is_found(shown) else []
        on_the_way = stresses_on_the_way(design, opened) if is_found(opened) else []
        stressed = [s.largest for s in known if s.largest is not None] + on_the_way
        errors = result.buildable[n]["tolerance"] if result.buildable else None
        rows.append(
            {
                "class": name,
                "required": level,
                "design": design.name,
                "shown max %": shown.fit.max_percent if is_found(shown) else None,
                "opened max %": opened.fit.max_percent if is_found(opened) else None,
                "moved %": _felt(moved.get("moved_percent")),
                "opens": bool(moved.get("same_state")),
                "utilisation": max(stressed) if stressed else None,
                "snapped": None if errors is None else errors["snapped"],
                "samples": None if errors is None else errors["samples"],
                "snow": under_snow(design, result, n) if is_found(opened) else None,
            }
        )
    return rows


def stresses_on_the_way(design: Design, opened: Evaluation) -> list[float]:
    """Utilisation at the stations that a design is opened through."""
    if design.way is None:
        return []
    materials = materials_of(design)
    used = [
        rod_strength(design.scene(station.scene), state, materials).largest
        for station, state in zip(design.way.stations, opened.way)
    ]
    return [value for value in used if value is not None]


def under_snow(design: Design, result: KitResult, number: int) -> float | None:
    """The largest share of what is allowed under the load case, in the state that a design opens
    into; None without one."""
    role = design.fitted_role.name
    given = result.references[number].equilibria[role]
    opened = result.redeployed[number].equilibria[role]
    found = [0.0]
    for case in design.load_cases:
        bound = LoadBound(design, case, given)
        found += bound.utilisation(opened, bound.loaded(opened)).values()
    return max(found) if design.load_cases else None


def _felt(percent: float | None) -> float | None:
    """Without what solvers' tolerances leave."""
    return None if percent is None else round(percent, 6)


def is_found(outcome: Any) -> bool:
    """Whether a design has a state there."""
    return isinstance(outcome, Evaluation)


def level_rows(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """One row a class and requirement; the last ones of all classes together."""
    found = []
    classes = list(dict.fromkeys(row["class"] for row in rows))
    for name in classes + (["all"] if len(classes) > 1 else []):
        for level in dict.fromkeys(row["required"] for row in rows):
            own = [r for r in rows if r["required"] == level and name in (r["class"], "all")]
            opened = _opened(own)
            used = [row["utilisation"] for row in own if row["utilisation"] is not None]
            snow = [row["snow"] for row in own if row["snow"] is not None]
            found.append(
                {
                    "class": name,
                    "required": level,
                    "open as shown": f"{sum(row['opens'] for row in own)} of {len(own)}",
                    "median max %": float(np.median(opened)) if opened else None,
                    "largest max %": max(opened, default=None),
                    "utilisation": max(used, default=None),
                    "samples that snap": _snapped(own) or None,
                    "carry the snow": _carry(snow) if snow else None,
                }
            )
    return found


def finding(rows: list[dict[str, Any]]) -> str:
    """What the rows say in two sentences: what it costs and gains that designs open, forgive and
    keep below their limit; and what it costs by class that they carry their load as well."""
    levels = list(dict.fromkeys(row["required"] for row in rows))
    of = {level: [row for row in rows if row["required"] == level] for level in levels}
    without, last = of[levels[0]], levels[-1]
    if last != LAST or len(levels) < 3:
        return f"Not all has been required yet, only: {', '.join(levels)}."
    built, loaded = of[levels[-2]], of[last]
    names = [level.removeprefix("+ ") for level in levels[1:-1]]
    before, now = _snapped(without), _snapped(built)
    text = (
        f"With {' and '.join(filter(None, (', '.join(names[:-1]), names[-1])))} required, "
        f"{sum(row['opens'] for row in built)} of {len(built)} designs open into the state shown "
        f"instead of {sum(row['opens'] for row in without)}"
    )
    if now:
        text += f" and {now} samples snap instead of {before or 'none'}"
    text += (
        f"; the median of the designs' largest deviations, as they open, is {_median(built)} "
        f"instead of {_median(without)}."
    )
    classes = dict.fromkeys(row["class"] for row in rows)
    costs = [f"{_median(built, name)} to {_median(loaded, name)} of {name}" for name in classes]
    carried = [
        sum(r["snow"] is not None and r["snow"] <= CARRIED for r in own) for own in (loaded, built)
    ]
    return (
        f"{text} That all carry snow as well, which {carried[0]} instead of {carried[1]} then do, "
        f"changes this median from {', '.join(costs)}."
    )


def _median(rows: list[dict[str, Any]], name: str | None = None) -> str:
    """Median of the opened designs' largest deviations, of one class or all."""
    opened = _opened([row for row in rows if name in (row["class"], None)])
    return f"{np.median(opened):.2g} %" if opened else "nowhere"


def _carry(snow: list[float]) -> str:
    return f"{sum(value <= CARRIED for value in snow)} of {len(snow)}"


def _opened(rows: list[dict[str, Any]]) -> list[float]:
    """Largest deviations of the designs that open."""
    return [row["opened max %"] for row in rows if row["opened max %"] is not None]


def _snapped(rows: list[dict[str, Any]]) -> str:
    """Of how many samples so many snap, which differs: where one of a few does, more are tried; ""
    where none was tried."""
    tried = sum(row["samples"] or 0 for row in rows)
    return f"{sum(row['snapped'] or 0 for row in rows)} of {tried}" if tried else ""


def draw_costs(rows: list[dict[str, Any]]) -> Figure:
    """Opened deviations of all designs, one bar a requirement, one panel a class."""
    classes = list(dict.fromkeys(row["class"] for row in rows))
    names = {
        of: list(dict.fromkeys(r["design"] for r in rows if r["class"] == of)) for of in classes
    }
    counts = [len(names[of]) for of in classes]
    with style():
        figure = Figure(figsize=(max(5.0, 0.62 * sum(counts) + 2.0), 3.8), layout="constrained")
        panels = figure.subplots(1, len(classes), squeeze=False, width_ratios=counts)[0]
        for axes, of in zip(panels, classes):
            for k, (level, colour) in enumerate(zip(LEVELS, COLOURS)):
                own = {
                    row["design"]: row["opened max %"] or 0.0
                    for row in rows
                    if row["class"] == of and row["required"] == level
                }
                if own:  # a quick run looks at some of the levels
                    places = np.arange(len(own)) + 0.17 * (k - 2)
                    heights = [own[name] for name in names[of]]
                    axes.bar(places, heights, 0.16, color=colour, label=level)
            axes.set_xticks(np.arange(len(names[of])), names[of], rotation=60)
            axes.set_title(of)
        panels[0].set_ylabel("opened, largest deviation in %")
        labels = panels[0].get_legend_handles_labels()
        figure.legend(*labels, loc="outside lower center", ncols=5, title="required")
    return figure


def drawn_levels(results: Mapping[str, KitResult]) -> list[DrawnDesign]:
    """Every design as it opens, without any requirement and with all of them."""
    levels = ("nothing", LAST)
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
