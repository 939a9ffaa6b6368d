"""Kits for as many designs as were published, and harder ones.

    python studies/data_sets.py [--quick] [--out reports/data_sets] [--jobs 2]

Ten C-shells, conformal images of a square, share 8 linear and 5 angular parts, as the ten of Becker
et al. (2024) do. So do ten of which only five are such images: the others are a fan, a hexagon, a
ring, a skew net and a triangle. Five umbrella meshes of 84 to 150 cells, one of them on supports,
share 8 cells. Nine grids, among them one of strongly varying curvature, one of asymptotic lines
held at its boundary and one of geodesics, share 8 + 5 parts. Four released umbrella meshes share 8
cells (read from beside the repository, left out where they aren't). Every table has the inputs and
the baselines beside the kit: see the study `direct_vs_relaxed`. Deviations are distances of the
joints from the target surface, in % of its size.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from kop_exudyn.search.result import KitResult
from lib.comparison import Row, comparison_rows, finding
from lib.comparison_page import begin, realised, show
from lib.study import Study
from lib.study_kits import data_sets, kits_of

ROOT = Path(__file__).resolve().parents[1]
SHOWN = 4  # designs of each set in the pictures
COLUMNS = ("direct", "assigned")


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)
    cases = data_sets(ROOT / "models", ROOT.parent / "shared" / "data" / "umbrella", study.quick)
    results: dict[str, KitResult] = {}
    rows: list[Row] = []
    for case in cases:  # the kits are kept in the folder of runs, the report after every set
        results |= kits_of(study, [case])
        rows += comparison_rows(case.name, results[case.name])
        write(study, results, rows, [case.name for case in cases if case.name not in results])


def write(
    study: Study, results: Mapping[str, KitResult], rows: Sequence[Row], missing: Sequence[str]
) -> None:
    """The report on the sets that have been done; missing : names of the others."""
    # 1. What came out, design by design and in a few sentences.
    outcome = finding(rows)
    if missing:
        outcome += f" Not run yet: {', '.join(missing)}."
    report = begin(study, rows, outcome)

    # 2. The designs, set by set.
    for name, result in results.items():
        joints = sorted({len(design.joints) for design in result.designs})
        sizes = " to ".join(map(str, dict.fromkeys((joints[0], joints[-1]))))
        report.section(
            name,
            f"{realised(result)} of {sizes} joints; the search took "
            f"{result.wall_s / 60:.0f} min. {' '.join(result.verdict)}",
        )
        alt = f"The {name} after direct projection and with the kit found here"
        show(report, name, result, COLUMNS, SHOWN, alt)
    report.save({"finding": outcome, "designs": rows})


if __name__ == "__main__":
    main()
