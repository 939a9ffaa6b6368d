"""Which ends go on in each other: seams within laths, tips between them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.errors import InputError
from kop_exudyn.exchange.drawing import DrawnCurve
from kop_exudyn.exchange.joins import Families, join_ends


def piece(*points) -> DrawnCurve:
    return DrawnCurve(
        np.array([[*point, 0.0][:3] for point in points], float), False, f"from {points[0]}"
    )


def joined(pieces, rule="auto", crossing=(), tolerance=1e-6):
    return join_ends(pieces, crossing, tolerance, rule)


def rhombus(half_angle: float, n: int):
    """Every edge of a closed scissor net of n + 1 laths in either direction, with its four tips."""
    u, v = (np.array([np.cos(a), np.sin(a), 0.0]) for a in (half_angle, -half_angle))
    at = [[i * u + j * v for j in range(n + 1)] for i in range(n + 1)]
    edges = [(at[i][j], at[i + 1][j]) for i in range(n) for j in range(n + 1)]
    return edges + [(at[i][j], at[i][j + 1]) for i in range(n + 1) for j in range(n)]


class TestTopology:
    @settings(deadline=None, max_examples=40)
    @given(
        half=st.floats(0.03, 1.54),
        n=st.integers(1, 4),
        seed=st.integers(0, 1000),
        turn=st.floats(0, 6.28),
    )
    def test_the_tips_of_a_scissor_stay_hinged(self, half, n, seed, turn):
        """However near to closed or to fully open it is: at one pair of tips its laths turn by less
        than 45 degrees then."""
        rng = np.random.default_rng(seed)
        edges = rhombus(half, n)
        edges = [edges[k][:: rng.choice([1, -1])] for k in rng.permutation(len(edges))]
        c, s = np.cos(turn), np.sin(turn)
        spin = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        found = joined([piece(*(spin @ x for x in edge)) for edge in edges])
        if n == 1:  # four laths: nothing but the turn of the acute tips tells
            assert len(found.curves) >= 2
            return
        assert len(found.curves) == 2 * (n + 1) and len(found.tips) == 4 and found.families
        for curve in found.curves:
            steps = np.diff(curve.points, axis=0)
            np.testing.assert_allclose(steps, np.broadcast_to(steps[0], steps.shape), atol=1e-9)

    def test_whole_laths_with_hinged_tips(self):
        """As drawn lath by lath; they cross on the way."""
        u, v = np.array([3, 0.8]), np.array([3, -0.8])
        laths = [piece(k * v / 3, k * v / 3 + u) for k in range(4)]
        laths += [piece(k * u / 3, k * u / 3 + v) for k in range(4)]
        crossing = [(a, b) for a in range(4) for b in range(4, 8)]
        found = joined(laths, crossing=crossing)
        assert len(found.curves) == 8 and len(found.tips) == 4 and not len(found.seams)
        assert len(joined(laths, "always", crossing).curves) < 8
        assert len(joined(laths, "never", crossing).curves) == 8

    def test_a_lath_drawn_in_pieces_between_its_joints(self):
        """Seams where nothing crosses: both pieces cross the same family."""
        rods = [piece((0, y), (1.5, y + 0.4)) for y in (0, 1)]
        rods += [piece((1.5, y + 0.4), (3, y)) for y in (0, 1)]
        across = [piece((x, -1), (x, 2)) for x in (0.5, 1.0, 2.0, 2.5)]
        crossing = [(0, 4), (0, 5), (1, 4), (1, 5), (2, 6), (2, 7), (3, 6), (3, 7)]
        found = joined([*rods, *across], crossing=[*crossing])
        assert len(found.curves) == 6 and len(found.seams) == 2

    def test_triangles_leave_only_the_turn(self):
        a, b, c = (0, 0), (1, 0), (0.5, 0.9)
        bars = [piece(a, b), piece(b, c), piece(c, a), piece(b, (2, 0.1))]
        found = joined(bars, crossing=[(0, 1), (1, 2), (2, 0)])
        assert not found.families
        assert sorted(len(curve.points) for curve in found.curves) == [2, 2, 3]

    def test_a_lath_is_not_hinged_with_itself(self):
        loop = piece((0, 0), (1, 0), (1, 1), (0, 0))
        with pytest.raises(InputError, match=r"its ends meet at a corner at \(0, 0, 0\)"):
            joined([loop])


class TestPieces:
    def test_edges_become_curves(self):
        """Every edge of a net drawn for itself, in any order and direction."""
        xs, ys = [0.0, 1.0, 2.1], [0.0, 0.9, 2.0]
        edges = [piece((a, y), (b, y)) for y in ys for a, b in zip(xs, xs[1:])]
        edges += [piece((x, b), (x, a)) for x in xs for a, b in zip(ys, ys[1:])]
        edges = [edges[k] for k in np.random.default_rng(3).permutation(len(edges))]
        found = joined(edges).curves
        assert len(found) == 6 and {len(curve.points) for curve in found} == {3}
        assert all(np.ptp(curve.points[:, :2], axis=0).min() == 0 for curve in found)
        assert not any(curve.closed for curve in found)

    def test_sharp_corners_stay_joints(self):
        assert len(joined([piece((0, 0), (1, 0)), piece((1, 0), (1, 1))]).curves) == 2

    def test_a_ring_of_pieces_is_closed(self):
        corners = [(np.cos(t), np.sin(t)) for t in np.linspace(0, 2 * np.pi, 13)[:-1]]
        (ring,) = joined([piece(a, b) for a, b in zip(corners, corners[1:] + corners[:1])]).curves
        assert ring.closed and len(ring.points) == 12

    @pytest.mark.parametrize("rule", ["auto", "always"])
    def test_the_straightest_continuation(self, rule):
        fan = [piece((0, 0), (1, 0)), piece((1, 0), (2, 0.1)), piece((1, 0), (2, 0.6))]
        assert sorted(len(curve.points) for curve in joined(fan, rule).curves) == [2, 3]


@settings(deadline=None, max_examples=60)
@given(seed=st.integers(0, 10**6), n=st.integers(2, 30))
def test_families_know_what_follows_from_what_they_were_told(seed, n):
    """Against a colouring: relations told in any order, and all that follow from them."""
    rng = np.random.default_rng(seed)
    colour = rng.integers(0, 2, n)
    families, told = Families(n), []
    for _ in range(2 * n):
        a, b = rng.integers(0, n, 2)
        if a != b:
            families.relate(int(a), int(b), bool(colour[a] != colour[b]))
            told.append((a, b))
    part = np.arange(n)
    for a, b in told:
        part[part == part[a]] = part[b]
    assert not families.mixed
    for a in range(n):
        for b in range(n):
            known = families.differ(a, b)
            assert known == (bool(colour[a] != colour[b]) if part[a] == part[b] else None)


def test_a_contradiction_makes_all_that_hangs_on_it_unknown():
    families = Families(4)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        families.relate(a, b, True)
    assert families.mixed and families.differ(0, 1) is None and families.differ(3, 3) is False
