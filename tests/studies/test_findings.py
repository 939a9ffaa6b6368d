"""What studies say first: the figures of their tables, the worse ones too."""

from __future__ import annotations

from buildable import finding as of_requirements
from engines import finding as of_engines

from lib.index_page import first_sentence


def _row(level: str, opens: bool, opened: float | None, snapped: int) -> dict:
    return {
        "required": level,
        "opens": opens,
        "opened max %": opened,
        "utilisation": 0.5,
        "samples": 20,
        "snapped": snapped,
        "snow": None,
    }


def test_requirements_are_told_by_what_all_of_them_cost():
    """The page of all reports shows the first sentence only: it said once what comes of none."""
    rows = [
        *(_row("nothing", opens, 2.0, 3) for opens in (True, False)),
        _row("opening", True, 1.0, 1),
        *(_row("+ load", True, opened, 0) for opened in (0.5, 0.7)),
    ]
    told = of_requirements(rows)
    assert first_sentence(told) == (
        "Where all is required, 2 of 2 designs open into the state shown instead of 1, and the "
        "median of their largest deviation, as they open, is 0.6 % of the target instead of 2 %; "
        "0 of 40 samples snap instead of 6 of 40."
    )
    assert "Required nothing: 1 of 2 designs" in told and "Required opening: 1 of 1" in told
    dearer = [_row("nothing", True, None, 0), _row("+ load", False, 3.0, 9)]
    assert "0 of 1 designs open into the state shown instead of 1" in of_requirements(dearer)
    assert "is 3 % of the target instead of nowhere" in of_requirements(dearer)
    assert of_requirements(rows[:2]).startswith("Required nothing")  # nothing to compare


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
