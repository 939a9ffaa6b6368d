"""The pages on which inputs, baselines and both stages are compared: what they begin with, and the
designs that gain most."""

from __future__ import annotations

from collections.abc import Sequence

from kop_exudyn.report.designs import draw_designs
from kop_exudyn.report.kit_drawings import drawn_stages
from kop_exudyn.search.result import KitResult
from kop_exudyn.wording import counted_parts

from .comparison import Row, draw_comparison, most_changed
from .study import Study, StudyReport

_INPUT = "Largest deviation of every design, logarithmic. Input: before any kit."
_PUBLISHED = " Published, opened: the state that the designs of the published method open into."
_STAGES = (
    " Assigned: the kit found here. A cross at the right: no equilibrium was found, or Exudyn "
    "didn't confirm it. A ring: it buckled into another state: led back to the elements of the "
    "input, it doesn't come back to the input's shape."
)
_DEVIATIONS = (
    "Deviations of the joints in % of the size. Utilisation: the largest of all states, of the "
    "elastic limit. Snapped: of the samples with the workshop's errors, those that end in another "
    "state. Failed: no equilibrium was found."
)


def begin(study: Study, rows: Sequence[Row], finding: str) -> StudyReport:
    """A report that begins with its finding, and with all designs in a figure and a table.

    rows : see `comparison_rows`
    """
    report = study.report(finding)
    report.figure(
        "deviations",
        draw_comparison(rows),
        _INPUT + (_PUBLISHED if any(map(_published, rows)) else "") + _STAGES,
        alt="Deviation of all designs: inputs, baselines and both stages",
    )
    report.table(
        "designs",
        [
            {key: row[key] for key in row if not key.endswith(("energy", " utilisation"))}
            for row in rows
        ],
        _DEVIATIONS,
    )
    return report


def _published(row: Row) -> bool:
    """Whether a row has the published method beside the others."""
    return any(name.startswith("published") and value is not None for name, value in row.items())


def realised(result: KitResult) -> str:
    """Which parts realise how many elements, without a full stop."""
    elements = sum(design.n_elements for design in result.designs)
    parts = counted_parts(result.kit.sizes)
    return f"{parts} realise {elements} elements of {len(result.designs)} designs"


def show(
    report: StudyReport,
    name: str,
    result: KitResult,
    stages: Sequence[str],
    shown: int,
    alt: str,
) -> None:
    """Pictures of the designs of a kit that direct projection leaves farthest off.

    stages : a column each; shown : how many designs, a row each
    """
    report.figure(
        name.replace(" ", "_"),
        draw_designs(most_changed(drawn_stages(result, stages), shown)),
        "Equilibria, placed where their largest deviation is least; grey: the input design. "
        "Joints are coloured by their deviation. "
        f"Of {len(result.designs)} designs those that direct projection leaves farthest off are "
        "shown.",
        alt=alt,
    )
