"""What studies say first: the figures of their tables, the worse ones too."""

from __future__ import annotations

from buildable import finding as of_requirements
from buildable import level_rows
from engines import finding as of_engines

from lib.index_page import first_sentence


def _row(of: str, level: str, opens: bool, opened: float | None, snapped: int) -> dict:
    return {
        "class": of,
        "required": level,
        "opens": opens,
        "opened max %": opened,
        "utilisation": 0.5,
        "samples": 20,
        "snapped": snapped,
        "snow": 0.9 if level == "+ load" else 3.0,
    }


def test_requirements_are_told_by_what_they_cost_each_class():
    """The page of all reports shows the first sentence only. In a median over all classes, one that
    pays dearly for its loads wasn't seen."""
    rows = [
        *(_row("grids", "nothing", opens, 2.0, 3) for opens in (True, False)),
        _row("shells", "nothing", True, 1.0, 0),
        *(_row(of, "opening", True, 0.2, 0) for of in ("grids", "grids", "shells")),
        *(_row(of, "+ load", True, 3.0, 1) for of in ("grids", "grids")),
        _row("shells", "+ load", True, 0.25, 0),
    ]
    told = of_requirements(rows)
    assert first_sentence(told) == (
        "With opening required, 3 of 3 designs open into the state shown instead of 2 and 0 of "
        "60 samples snap instead of 6 of 60; the median of the designs' largest deviations, as "
        "they open, is 0.2 % instead of 2 %."
    )
    assert told.endswith(
        "That all carry snow as well, which 3 instead of 0 then do, changes this median from 0.2 % "
        "to 3 % of grids, 0.2 % to 0.25 % of shells."
    )
    assert of_requirements(rows[:6]) == "Not all has been required yet, only: nothing, opening."
    nowhere = [{**row, "opened max %": None} for row in rows]
    assert "is nowhere instead of nowhere" in of_requirements(nowhere)
    table = level_rows(rows)
    assert [row["class"] for row in table] == ["grids"] * 3 + ["shells"] * 3 + ["all"] * 3
    first, last = table[0], table[-1]
    assert (first["open as shown"], first["samples that snap"]) == ("1 of 2", "6 of 40")
    assert (last["median max %"], last["largest max %"]) == (3.0, 3.0)
    assert (last["carry the snow"], first["carry the snow"]) == ("3 of 3", "0 of 2")


def test_engines_are_told_by_the_distance_that_was_measured():
    rows = [
        {"apart": 3e-9, "exudyn s": 5.0, "fast s": 0.5},
        {"apart": 2e-3, "exudyn s": 1.0, "fast s": 1.0},
    ]
    loaded = [{"apart": 4e-11}, {"failure": "no equilibrium"}]
    way = {"design": "a", "way": "Exudyn as it comes", "seconds": 2.0, "error %": None}
    told = of_engines(
        rows, loaded, [{"design": "a", "way": "fast", "seconds": 1.0, "error %": 0.1}, way]
    )
    assert "deploys 1 of 2 designs to this package's states in 10 to 10 times the time" in told
    assert "1 of 2 under forces; these states are at most 3e-09 of the size apart" in told
    assert "solves 0 of 1 near ones" in told
