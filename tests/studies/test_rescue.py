"""What the study of failures says, whatever came of its cases."""

from __future__ import annotations

import numpy as np

from lib.rescue import draw_map, draw_paths, example, fails, finding_of


def case(weight=10.0, snap=None, equilibrium=True, rescue=None, largest=2.0):
    found = {"parts": {"linear": 2, "angular": 1}, "weight": weight, "snapped": snap is not None}
    if not equilibrium:
        return found | {"no equilibrium": "none within 300 iterations", "rescue": rescue}
    found |= {
        "at the parts %": 5.0,
        "snap at": snap and 0.5,
        "snap %": snap,
        "largest move %": snap or largest,
        "moves %": np.array([1.0, snap or largest, 1.0]),
        "energies": np.ones(4),
        "deviations %": np.array([1.0, 2.0, 3.0, 5.0]),
    }
    return found if rescue is None else found | {"rescue": rescue}


def test_nothing_fails():
    cases = [case(), case(1000.0, largest=3.0)]
    assert not any(map(fails, cases))
    assert finding_of(cases).startswith("In none of 2 cases")
    assert example(cases) is cases[1]
    draw_paths([example(cases)])
    (axes,) = draw_map(cases).axes
    order = list(cases[0]["parts"])  # of the numbers that stand at the rows
    assert axes.get_ylabel() == "parts: " + " + ".join(order)
    assert [tick.get_text() for tick in axes.get_yticklabels()] == [
        " + ".join(str(cases[0]["parts"][kind]) for kind in order)
    ]


def test_the_largest_snap_is_shown_and_rescues_are_counted():
    rescued, not_rescued = case(100.0), case(1000.0, snap=4.0)
    cases = [
        case(),
        case(10.0, snap=6.0, rescue=not_rescued),
        case(10.0, snap=9.0, rescue=rescued),
        case(10.0, equilibrium=False, rescue=rescued),
    ]
    text = finding_of(cases)
    assert "In 3 of 4 cases" in text and "(2 snap, 1 find no equilibrium)" in text
    # one had no equilibrium before, the other ends as far off as it did
    assert "rescues 2 of them, 1 of which then end nearer to the target" in text
    assert "jumps 9 % of the size at 50%" in text
    assert "at w_c = 100 it stays in its state and ends 5.0 % off" in text
    assert example(cases) is cases[2]
    cases[2]["rescue"] = not_rescued
    assert "2 linear and 1 angular parts at w_c = 1000 don't keep it from that" in finding_of(cases)


def test_no_case_has_a_whole_path():
    cases = [case(equilibrium=False, rescue=case(equilibrium=False))]
    assert example(cases) is None
    assert "(0 snap, 1 find no equilibrium)" in finding_of(cases)
    draw_map(cases)
