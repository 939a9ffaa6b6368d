"""Cases of the soak (its first ones run in its quick mode), and that it sees what is wrong."""

import numpy as np
import pytest

from lib.stress.random_designs import HERE, Place, random_design
from lib.stress.soak import compared, soak_case


@pytest.mark.parametrize("seed", (238, 239, 240))
def test_designs_are_the_same_anywhere(seed):
    row = soak_case(seed)
    assert row["wrong"] == "" and row["outcome"] in ("stable", "failed", "refused as too far away")
    assert (row["apart"] is not None) == (row["outcome"] == "stable")


@pytest.mark.parametrize("class_name, far", [("c_shell", 2.0), ("grid", 3.0), ("umbrella", 1e3)])
def test_a_place_that_is_another_one_is_seen(class_name, far, tmp_path):
    """The design stands elsewhere than the soak is told: turned in its plane, or larger."""
    rng = np.random.default_rng(3)
    data = random_design(rng, class_name)

    class Wrong(Place):
        def points(self, x, size):
            return 1.001 * super().points(x, size)

    there = Wrong(np.eye(3), far * np.array([1.0, 0.0, 0.0]))
    found = compared(rng, data, there, far, tmp_path)
    assert found["wrong"] and found["outcome"] in ("stable", "refused", "failed in one place")
    (tmp_path / "again").mkdir()
    assert compared(rng, data, HERE, 0.0, tmp_path / "again")["wrong"] == ""
