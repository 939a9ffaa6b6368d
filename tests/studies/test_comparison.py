"""What the pages that compare kits with baselines say first."""

from lib.comparison import finding


def row(design, assigned, built, direct=2.0):
    return {
        "design": design,
        "input max %": 0.1,
        "direct max %": direct,
        "assigned max %": assigned,
        "buildable": "can be built" if built else "can't be built",
        "buckled": "–",
        "failed": "–",
    }


def test_the_first_sentence_says_how_many_can_be_built():
    """The page of all reports shows it alone."""
    rows = [row("a", 0.5, True), row("b", 0.6, False), row("c", 3.0, True)]
    first, *others = finding(rows).split(". ")
    assert first.startswith("Over 3 designs, 2 of which can be built, the median")
    assert others[-1] == "Not to be built as they are: b."
    assert "Worse than a baseline: c (direct: 2 %, here 3 %)" in others


def test_where_all_can_be_built_that_is_said_last():
    told = finding([row("a", 0.5, True)])
    assert "which can be built" not in told and told.endswith("can be built.")


def test_a_nearer_baseline_that_would_yield_is_told_so():
    worse = row("c", 3.0, True) | {"direct utilisation": 2.4}
    assert "Worse than a baseline: c (direct: 2 %, stressed to 240 % of its limit, here 3 %)." in (
        finding([worse])
    )
    fine = row("c", 3.0, True) | {"direct utilisation": 0.4}
    assert "c (direct: 2 %, here 3 %)" in finding([fine])
