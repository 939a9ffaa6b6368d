"""Kit size against fidelity: how many parts are enough.

    python studies/kit_size_tradeoff.py [--quick] [--out DIR] [--jobs N] [--scheduler ADDRESS]
    [--resume]

Kits of several sizes are found by what kop tradeoff calls, for conformals 1 to 5 (2 to 25 linear
and 5 angular parts), six umbrella meshes (1 to 12 cells) and six grids (1 to 12 linear and 5
angular parts). Each is sought from scratch, in both stages, with two rounds of exchanges and
without leaps; the next larger kit, with parts of it merged, is one of its starts. A kit that is
worse than a smaller one is sought again from that one, with parts of it split. At some sizes the
direct projection and the published method make what they can of as many parts.

Deviations are distances of the joints from the target surfaces, in % of their sizes, the larger of
the state that is shown and of the one that the design opens into from its assembly; every state is
an equilibrium that Exudyn confirmed. Kit size counts pieces to make, as many of each part as the
design that needs most of it, in % of the elements of all designs: 20 % at best for five designs.
The knee is the point farthest below the straight line from the first to the last point, both axes
scaled to [0, 1] (the rule of Satopaa et al., 2011), on the curve of the smallest largest deviation
that at most so many parts give.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from kop_exudyn.analysis.tradeoff import knee
from kop_exudyn.drawing.style import PALETTE, style
from kop_exudyn.report.tradeoff_drawing import draw_tradeoff, plain_log
from lib.size_kits import KeptKit, SizedCase, compared_tasks, kits_by_size, sized_cases
from lib.study import Study

MODELS = Path(__file__).resolve().parents[1] / "models"
OTHERS = {"direct": "direct projection", "published": "published method"}
COLUMNS = (
    "pieces",
    "kit size %",
    "max %",
    "mean %",
    "open as shown",
    "direct max %",
    "published max %",
    "energy ratio",
    "J",
    "from",
    "seconds",
)
MARKS = {"direct": ("x", "orange"), "published": ("+", "black")}


@dataclass(frozen=True)
class Found:
    """What came out for one set of designs.

    kits : the smallest first; rows : of the tables; at : number of the row at the knee, or None
    """

    case: SizedCase
    kits: Sequence[KeptKit]
    rows: Sequence[Mapping[str, Any]]
    at: int | None


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)
    cases = sized_cases(MODELS, study.quick)
    found: list[Found] = []
    for case in cases:  # the kits are kept in the folder of runs, the report after every set
        kits = kits_by_size(study, case)
        tasks = compared_tasks(study, case)
        values = study.sweep(list(tasks.values()), jobs=1)
        others = {size: values[task.name] for size, task in tasks.items()}
        rows = [row_of(kit, others.get(kit.size, {})) for kit in kits]
        at = knee([kit.size for kit in kits], [row["max %"] for row in rows])
        found.append(Found(case, kits, rows, at))
        write(study, found, [case.name for case in cases[len(found) :]])


def row_of(kit: KeptKit, others: Mapping[str, Any]) -> dict[str, Any]:
    """Figures of one kit; of the other methods None where they weren't run or a design can't be
    built."""
    told = {name: value for name, value in kit.row.items() if name not in ("parts", "cost")}
    result = kit.result
    opens = [bool(result.redeployment(n).get("same_state")) for n in range(len(result.designs))]
    return {
        **told,
        "open as shown": f"{sum(opens)} of {len(opens)}",
        **{f"{name} max %": others.get(name) for name in OTHERS},
    }


def write(study: Study, found: Sequence[Found], missing: Sequence[str]) -> None:
    """The report on the sets that have been done; missing : names of the others."""
    outcome = " ".join(sentence(one) for one in found)
    if missing:
        outcome += f" Not run yet: {', '.join(missing)}."
    report, several = study.report(outcome), len(found) + len(missing) > 1
    for one in found:
        kind, suffix = one.case.kind, f"_{one.case.name.replace(' ', '_')}" if several else ""
        fixed = "".join(f" and {n} {other}" for other, n in one.case.others.items())
        report.section(
            one.case.name[0].upper() + one.case.name[1:],
            f"{len(one.case.files)} designs of {one.case.sizes[0]} to {one.case.sizes[-1]} "
            f"{kind}{fixed} parts.",
        )
        report.figure(
            f"tradeoff{suffix}",
            drawn(one),
            f"Figures of every kit against its number of {kind} parts"
            + ("; the dotted line marks the knee." if one.at is not None else ".")
            + " Kits are optimised for all terms of the objective, so one of more parts may "
            "deviate more: grey is what at most so many parts give.",
            alt=f"deviation, kit size, energy, time over {kind} parts",
        )
        report.table(
            f"kits{suffix}",
            [{name: row[name] for name in (kind, *COLUMNS)} for row in one.rows],
            "max and mean: of the joints' deviations; energy ratio: mean over the designs; J: the "
            "objective; from: the kit whose parts were split or merged; seconds: of the search "
            "that gave the kit; direct and published: largest deviation of the designs as they "
            "open; a dash: not run, or not all designs could be built.",
        )
    designs = [
        {
            "of": one.case.name,
            one.case.kind: kit.size,
            "design": design.name,
            **kit.result.summary("assigned", n).get("fit", {}),
        }
        for one in found
        for kit in one.kits
        for n, design in enumerate(kit.result.designs)
    ]
    sets = {one.case.name: {"kits": one.rows, "knee": one.at} for one in found}
    first = found[0]
    at = None if first.at is None else first.kits[first.at].size
    report.save(
        {
            "finding": outcome,
            "kits": first.rows,
            "designs": designs,
            "knee": at,
            "sets": sets,
        },
        settings={one.case.name: dict(one.kits[-1].result.settings) for one in found},
    )


def sentence(one: Found) -> str:
    """What the rows of one set say, beside the other methods at the same sizes."""
    first, last, kind = one.rows[0], one.rows[-1], one.case.kind
    text = (
        f"{one.case.name[0].upper()}{one.case.name[1:]}: from {first[kind]} to {last[kind]} {kind} "
        f"parts the largest deviation of {len(one.case.files)} designs goes from "
        f"{shown(first['max %'])} to {shown(last['max %'])}, the kit from "
        f"{first['kit size %']:.0f} to {last['kit size %']:.0f} % of the elements"
    )
    if one.at is not None:
        row = one.rows[one.at]
        text += f"; the knee is at {row[kind]}, with {shown(row['max %'])}"
    for name, told in OTHERS.items():
        both = [row for row in one.rows if row[kind] in one.case.compared]
        values = ", ".join(f"{shown(row[f'{name} max %'])} of {row[kind]}" for row in both)
        text += f"; the {told} ends at {values}"
    return f"{text}."


def drawn(one: Found) -> Figure:
    """The four panels, with what the other methods make of as many parts in the first."""
    figure = draw_tradeoff(one.rows, one.case.kind, one.at)
    panel = figure.axes[0]
    with style():
        for name, told in OTHERS.items():
            mark, colour = MARKS[name]
            points = [(row[one.case.kind], row[f"{name} max %"]) for row in one.rows]
            known = [point for point in points if point[1] is not None]
            if known:
                panel.plot(*zip(*known), mark, color=PALETTE[colour], label=told, markersize=7)
        plain_log(panel)
        for legend in figure.legends:  # one for all, outside of the panels
            legend.remove()
        labels = panel.get_legend_handles_labels()
        figure.legend(*labels, loc="outside lower center", ncols=3)
    return figure


def shown(percent: float | None) -> str:
    return "no buildable design" if percent is None else f"{percent:.2f} %"


if __name__ == "__main__":
    main()
