"""The page of all reports.

    python studies/index.py

Writes reports/index.html from what the reports in that folder say.
"""

from __future__ import annotations

from pathlib import Path

from lib.index_page import write_index

REPORTS = Path(__file__).resolve().parents[1] / "reports"

write_index(
    REPORTS,
    "What kop_exudyn was tried on, and what came of it",
    "Each report says what was tried, on what and with what result, with its settings, versions "
    "and times. The "
    "program of the same name in the folder studies makes it anew.",
)
