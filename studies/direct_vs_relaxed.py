"""What the two stages gain over the baselines.

    python studies/direct_vs_relaxed.py [--quick] [--out reports/direct_vs_relaxed] [--jobs 2]

A kit can be had at once: cluster the elements of all input designs, and replace each element by its
nearest part (direct). The parts can then be tuned (unrelaxed). The method of Becker et al. (2024)
lets all elements move before they become parts, with BFGS, and keeps the assignment (published;
opened: the state that its designs open into). Ours relaxes too (relaxed), and tunes parts and
assignment at the end, for designs that open by themselves and keep below their limits (assigned).
All are computed for kits of three classes of structures with as many parts, beside what the inputs
themselves deviate, and every state shown is an equilibrium that Exudyn confirmed. Deviations are
distances of the joints from the target surface, in % of its size.
"""

from __future__ import annotations

from pathlib import Path

from kop_exudyn.search.result import STAGES
from lib.comparison import comparison_rows, finding
from lib.comparison_page import begin, realised, show
from lib.study import Study
from lib.study_kits import kits

ROOT = Path(__file__).resolve().parents[1]
SHOWN = 3  # designs of each class in the pictures: those that gain most


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)

    # 1. One kit a class: all four stages, kept in the folder of runs.
    results = kits(study, ROOT / "models")

    # 2. What came out, design by design and in a sentence.
    rows = [row for name, result in results.items() for row in comparison_rows(name, result)]
    outcome = finding(rows)
    report = begin(study, rows, outcome)
    report.table(
        "energies",
        [
            {key: row[key] for key in row if key in ("class", "design") or key.endswith("energy")}
            for row in rows
        ],
        "Elastic energy of the deployed state, relative to the input's.",
    )

    # 3. The designs themselves, class by class.
    for name, result in results.items():
        report.section(name, f"{realised(result)}.")
        alt = f"The {name} after direct projection, unrelaxed, relaxed and assigned"
        show(report, name, result, STAGES, SHOWN, alt)
    report.save({"finding": outcome, "designs": rows})


if __name__ == "__main__":
    main()
