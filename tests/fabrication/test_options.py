"""What a workshop is asked to keep to."""

import numpy as np

from kop_exudyn.fabrication.options import Tolerances


def test_what_a_workshop_keeps_to_is_what_the_designs_were_tried_with():
    """0.5 degrees were printed, five times what nothing was said to snap within."""
    tried = [{"tolerance": {"length": length, "angle": 0.1 * np.pi / 180, "samples": 20}}
             for length in (3e-4, 2e-4)]  # fmt: skip
    found = Tolerances.tried(tried, "m")
    assert (found.length, found.angle) == (0.5, 0.25)
    kept = Tolerances(0.4, 0.5).within(found)
    assert (kept.length, kept.angle) == (0.4, 0.25) and "designs were tried with" in kept.why
    assert Tolerances().within(None) == Tolerances()
    assert Tolerances.tried([{"tolerance": None}], "m") is None
    untried = {"tolerance": {"length": 1e-4, "angle": 1e-3, "samples": 0}}
    assert Tolerances.tried([untried], "m") is None and Tolerances.tried([], "m") is None
