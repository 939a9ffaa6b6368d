"""The page of all reports.

    python studies/index.py

Writes reports/index.html from what the reports in that folder say.
"""

from __future__ import annotations

from pathlib import Path

from lib.index_page import Chapter, write_index

REPORTS = Path(__file__).resolve().parents[1] / "reports"

# What a user gains, figure by figure: designs, kit, how good, how small, how sure.
STORY = (
    Chapter("pavilion", "Large structures from few different parts"),
    Chapter("two_stage", "One kit builds several designs"),
    Chapter("direct_vs_relaxed", "Searching beats rounding to the nearest part"),
    Chapter("data_sets", "Ten designs from thirteen parts, and meshes of 150 cells"),
    Chapter("buildable", "What it costs that a kit can be built"),
    Chapter("kit_size_tradeoff", "How many parts are enough"),
    Chapter("part_reuse", "The same parts serve many designs"),
    Chapter("project_new_design", "A new design from a kit that exists"),
    Chapter("slit_parts", "Adjustable parts bring kits down to a handful"),
    Chapter("robustness", "What the workshop's errors do"),
    Chapter("engines", "Every state that is kept is confirmed by Exudyn"),
    Chapter("stress", "It holds under conditions worse than any user's"),
)

write_index(
    REPORTS,
    "A dozen parts, many structures: what kop_exudyn can do",
    "Each figure leads to its report: what was tried, on what and with what result, with settings, "
    "versions and times. The program of the same name in the folder studies makes it anew.",
    STORY,
)
