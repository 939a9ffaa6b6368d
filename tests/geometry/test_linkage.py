"""Parts of a net that move without the rest: found by what pins and rigid laths allow."""

import numpy as np
import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.geometry.linkage import free_turns, refuse_loose_parts
from kop_exudyn.geometry.network import network_from_dict


def line(*points, kind="polyline"):
    return {"type": kind, "points": [list(map(float, p)) for p in points]}


def grid(m=4, n=4):
    lines = [line((-0.2, k), (n - 0.8, k)) for k in range(m)]
    return lines + [line((k, -0.2), (k, m - 0.8)) for k in range(n)]


def built(curves, free_ends=True):
    return network_from_dict({"curves": curves, "free_ends": free_ends})


def test_a_straight_grid_opens_in_one_motion():
    """All parallelograms shear alike."""
    (turns,) = free_turns(built(grid())).T
    np.testing.assert_allclose(turns / turns[0], 1.0, rtol=1e-9)
    refuse_loose_parts(built(grid()))


def test_a_braced_square_does_not_move():
    turns = free_turns(built([*grid(2, 2), line((-0.1, 0.2), (0.9, 1.2))]))
    assert turns.shape[1] == 0


def test_two_crossing_laths_are_one_scissor():
    refuse_loose_parts(built([line((-1, 0), (1, 0)), line((0, -1), (0.2, 1))]))


@pytest.mark.parametrize(
    "extra, named",
    [
        ([line((2.5, 2.5), (2.6, 3.4))], r"curves\[8\]: turns about \(2.55\d*, 3\)"),
        ([line((3.1, 2.5), (2.5, 2.6))], r"curves\[8\]: turns about \(3, 2.5"),
        (
            [line((0.5, -1), (0.5, 0.1)), line((0.4, -0.9), (2, -0.9))],
            r"curves\[8\], curves\[9\]: move about",
        ),
    ],
)
def test_loose_parts_are_named(extra, named):
    with pytest.raises(InputError, match=named) as caught:
        refuse_loose_parts(built(grid() + extra))
    assert "without the rest of the net" in str(caught.value)


def test_a_comb_of_laths_that_dangle_from_one():
    with pytest.raises(InputError, match=r"curves\[1\]: turns about \(0, 0\)"):
        refuse_loose_parts(
            built([line((-1, 0), (4, 0))] + [line((k, -1), (k, 1)) for k in range(4)])
        )
