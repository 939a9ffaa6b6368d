"""Networks of curves: crossings, joints, straight pieces, faces, and every mistake a file can
contain."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from kop_exudyn.errors import InputError
from kop_exudyn.geometry.crossings import find_crossings
from kop_exudyn.geometry.curves import Polyline, Spline
from kop_exudyn.geometry.network import middle_joint, network, network_from_dict
from kop_exudyn.geometry.network_faces import faces_of, triangulate
from kop_exudyn.structures.c_shell.straightening import straighten


def line(*points, kind="spline", closed=False):
    return {"type": kind, "points": [list(map(float, p)) for p in points], "closed": closed}


def grid(n=3, over=0.2):
    """n horizontal and n vertical lines, one apart, going on by `over`."""
    low, high = -over, n - 1 + over
    return [line((low, k), (high, k)) for k in range(n)] + [
        line((k, low), (k, high)) for k in range(n)
    ]


def ring(radius=1.0, n=16, centre=(0.0, 0.0)):
    t = 2 * np.pi * np.arange(n) / n
    return line(
        *(np.array(centre) + radius * np.stack([np.cos(t), np.sin(t)], axis=1)), closed=True
    )


def build(curves, **more):
    return network_from_dict({"curves": curves, **more})


# -- joints ------------------------------------------------------------------------------------
def test_a_grid():
    net = build(grid())
    assert net.n_joints == 9 and net.opens.all()
    np.testing.assert_allclose(
        sorted(map(tuple, np.round(net.joints, 12))), [(x, y) for x in range(3) for y in range(3)]
    )
    np.testing.assert_allclose(net.opening_angles, np.pi / 2)
    for strand in net.strands:
        np.testing.assert_allclose(strand.lengths, 1)
        np.testing.assert_allclose(strand.turnings, 0, atol=1e-14)
        assert (strand.head, strand.tail) == (0, 0)


def test_free_ends_are_kept_when_asked_for():
    net = build(grid(over=0.3), free_ends=True)
    for strand in net.strands:
        assert strand.head == pytest.approx(0.3) and strand.tail == pytest.approx(0.3)


def test_opening_angles_do_not_depend_on_how_curves_are_drawn():
    curves = [
        line((-0.5, 0), (3, 0.2)),
        line((-0.5, 1), (3, 1.3)),
        line((0, -0.5), (0.5, 2)),
        line((2, -0.5), (1.5, 2)),
    ]
    net = build(curves)
    for k in range(4):
        turned = [dict(c, points=c["points"][::-1]) if i == k else c for i, c in enumerate(curves)]
        np.testing.assert_allclose(build(turned).opening_angles, net.opening_angles, atol=1e-12)


def test_curves_that_end_on_each_other():
    """Corners and T joints: ends within round-off of the other curve."""
    frame = [
        line((0, 0), (1, 0)),
        line((1 + 1e-9, 0), (1, 1)),
        line((1, 1), (0, 1 - 1e-9)),
        line((0, 1), (0, 1e-9)),
        line((0.4, 0), (0.4, 1 - 1e-9)),
    ]
    net = build(frame)
    assert net.n_joints == 6
    assert {len(s.joints) for s in net.strands} == {2, 3}


def test_a_loop_has_as_many_spans_as_joints():
    net = build([ring(), line((-2, 0.1), (2, 0.2)), line((0.1, -2), (-0.1, 2))])
    loop = net.strands[0]
    assert len(loop.joints) == loop.n_spans == 4
    assert loop.lengths.sum() == pytest.approx(loop.curve.length)
    assert loop.turnings.sum() == pytest.approx(2 * np.pi)
    np.testing.assert_allclose(np.hypot(*net.joints[loop.joints].T), 1, atol=1e-3)


def test_crossings_of_splines_are_exact():
    a = Spline([[0, 0], [1, 0.8], [2, -0.3], [3, 0.9], [4, 0]])
    b = Spline([[0, 0.5], [1.2, -0.2], [2.1, 0.7], [2.9, 0.1], [4, 0.9]])
    found = find_crossings([a, b])
    assert len(found) >= 3
    for c in found:
        gap = a.position(c.stations[0]) - b.position(c.stations[1])
        assert np.abs(gap).max() < 1e-14
    assert [c.stations[0] for c in found] == sorted(c.stations[0] for c in found)


@settings(max_examples=30, deadline=None)
@given(
    st.lists(st.floats(-1, 1), min_size=5, max_size=7),
    st.lists(st.floats(-1, 1), min_size=5, max_size=7),
)
def test_no_crossing_is_missed(heights, widths):
    """A graph over x and a graph over y cross where a fine polyline of both does."""
    n, m = len(heights), len(widths)
    a = Spline(np.stack([np.linspace(-2, 2, n), 0.5 * np.array(heights)], axis=1))
    b = Spline(np.stack([0.5 * np.array(widths), np.linspace(-2, 2, m)], axis=1))
    x = a.position(np.linspace(0, a.length, 4000))
    y = b.position(np.linspace(0, b.length, 4000))
    # how far the points of a lie beside the graph b, by interpolation along y
    beside = x[:, 0] - np.interp(x[:, 1], y[:, 1], y[:, 0])
    assume(np.all(np.diff(y[:, 1]) > 0) and np.abs(np.diff(beside)).min() > 1e-6)
    changes = np.count_nonzero(np.diff(np.sign(beside)))
    try:
        assert len(find_crossings([a, b])) == changes
    except InputError as error:
        assert "touches" in str(error) or "itself" in str(error)


def test_joints_at_the_vertices_of_polylines():
    net = network(
        [
            Polyline([[0, 0], [1, 0.2], [2, 0]]),
            Polyline([[1, -1], [1, 0.2], [1.3, 1]]),
            Polyline([[0, -1], [0.2, 1]]),
            Polyline([[2, -1], [1.8, 1]]),
        ],
        free_ends=True,
    )
    middle = np.argmin(np.hypot(*(net.joints - [1, 0.2]).T))
    np.testing.assert_array_equal(net.joints[middle], [1, 0.2])
    assert net.n_joints == 3


def test_listed_crossings_leave_the_others_unjoined():
    wave = line((0, 0), (1, 1), (2, -1), (3, 1), (4, 0))
    flat = line((-0.5, 0.1), (4.5, 0.1))
    post = line((0.5, -2), (0.5, 2))
    net = build(
        [wave, flat, post],
        crossings=[{"curves": [0, 1], "near": [2.5, 0]}, {"curves": [2, 1]}, {"curves": [0, 2]}],
    )
    assert net.n_joints == 3
    assert np.hypot(*(net.joints[0] - [2.5, 0.1]).T) < 0.2


def test_three_families_leave_joints_of_one_family_out_of_the_opening():
    lines = [line((-1, 0), (3, 0)), line((0.2, -1), (1.8, 3)), line((2.2, -1), (0.1, 3))]
    net = build(lines)
    assert net.n_joints == 3 and net.opens.sum() == 2


@pytest.mark.parametrize(
    "curves, more, message",
    [
        (grid() + [line((5, 5), (6, 6))], {}, r"curves\[6\].points: crosses no other"),
        (
            grid() + [line((10, 10), (11, 11)), line((10, 11), (11, 10))],
            {"free_ends": True},
            r"curves\[6\].points: is not connected",
        ),
        (
            grid() + [line((-0.1, -0.1), (2.1, 2.1))],
            {},
            r"curves\[6\].points: passes through one point \(0, 0\)",
        ),
        (grid() + [line((0.3, 1), (1.5, 1))], {}, r"curves\[1\].points: touches curves\[6\]"),
        (grid() + [grid()[4]], {}, r"curves\[4\].points: touches curves\[6\]"),
        (
            [
                line((0, 0), (1, 1), (2, 0)),
                line((0, 1), (0.9, 1), (1.1, 1), (2, 1)),
                line((0.2, -1), (0.2, 2)),
            ],
            {},
            r"curves\[0\].points: touches curves\[1\]",
        ),
        (
            [line((0, 0), (4, 0)), line((0, -0.0175), (4, 0.0175))],
            {"free_ends": True},
            r"near \(2, 0\) instead of crossing it \(at 0.5°: joints need 1.15°\)",
        ),
        (
            grid() + [line((-0.5, -0.5), (3, 1.5), (1, 2.6), (0.6, -0.7))],
            {},
            r"curves\[6\].points: the curve crosses itself",
        ),
        (
            [ring(), line((-2, 0.1), (2, 0.1))],
            {},
            r"curves\[0\].points: a closed curve needs at least 3 joints",
        ),
        (grid() + [line((0.5, 0.5), (1.5, 0.6))], {}, r"curves\[6\].points: nothing is left"),
        ([line((0, 0), (1, 1))], {}, "curves: a network needs at least two curves"),
        (
            grid(),
            {"crossings": [{"curves": [0, 1]}]},
            r"crossings\[0\] = \[0, 1\]: these two curves don't cross",
        ),
        (
            grid(),
            {"crossings": [{"curves": [0, 3]}] * 2},
            r"crossings\[1\] = \[0, 3\]: the same crossing is listed twice",
        ),
        (grid(), {"crossings": [{"curves": [0, 9]}]}, r"crossings\[0\].curves = 9: no such curve"),
        (
            grid(),
            {"crossings": [{"curves": [3, 3]}]},
            r"crossings\[0\].curves = \[3, 3\]: a curve can't cross itself",
        ),
        (grid(), {"crossings": [{"curves": [0, 3], "near": [0, None]}]}, r"crossings\[0\].near"),
        (grid(), {"crossings": [{"curves": [0, 3]}]}, r"curves\[1\].points: crosses no other"),
    ],
)
def test_mistakes(curves, more, message):
    with pytest.raises(InputError, match=message):
        build(curves, **more)


def test_two_curves_that_cross_twice_need_a_place():
    with pytest.raises(InputError, match=r"crossings\[0\].*cross 2 times"):
        build([ring(), line((-2, 0), (2, 0))], crossings=[{"curves": [0, 1]}])


def test_round_off_does_not_choose_the_middle_joint():
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], float)
    rng = np.random.default_rng(2)
    assert {middle_joint(corners + 1e-13 * rng.normal(size=(4, 2))) for _ in range(20)} == {0}
    assert middle_joint(np.concatenate([corners, [[0.1, 0.0]]])) == 4


# -- straight pieces ---------------------------------------------------------------------------
def straightened(net):
    return [straighten(strand, net.joints) for strand in net.strands]


def walk(straight, joints):
    """The joints that a strand's straight pieces arrive at, laid out from its first joint."""
    x, angle = joints[straight.strand.joints[0]].copy(), straight.angles[0]
    found = [x]
    for (l1, l2), corner in zip(straight.lengths, straight.corners):
        x = x + l1 * np.array([np.cos(angle), np.sin(angle)])
        angle += corner
        x = x + l2 * np.array([np.cos(angle), np.sin(angle)])
        found.append(x)
    return np.array(found)


def wavy_net(rng, n=4):
    """A grid of curves with inflections."""
    t = np.linspace(-0.3, n - 0.7, 6)
    bump = lambda: 0.12 * rng.normal(size=6)  # noqa: E731
    return build(
        [line(*np.stack([t, k + bump()], axis=1)) for k in range(n)]
        + [line(*np.stack([k + bump(), t], axis=1)) for k in range(n)]
    )


@pytest.mark.parametrize("seed", range(6))
def test_pieces_assemble_at_the_joints_whatever_the_curves_do(seed):
    net = wavy_net(np.random.default_rng(seed))
    for straight in straightened(net):
        assert straight.exact.all()
        np.testing.assert_allclose(
            walk(straight, net.joints), net.joints[straight.strand.joints], atol=1e-12
        )
        ratio = straight.lengths.min(axis=1) / straight.lengths.max(axis=1)
        assert ratio.min() > 0.08
        np.testing.assert_allclose(straight.angles, straight.strand.angles, atol=0.61)


def test_corners_are_tangent_intersections_where_these_lie_ahead():
    net = build([ring(), line((-2, 0.1), (2, 0.2)), line((0.1, -2), (-0.1, 2))])
    loop = straighten(net.strands[0], net.joints)
    np.testing.assert_array_equal(loop.angles, net.strands[0].angles)
    assert loop.corners.sum() == pytest.approx(2 * np.pi)
    np.testing.assert_allclose(loop.lengths[:, 0], loop.lengths[:, 1], rtol=1e-2)
    np.testing.assert_allclose(
        walk(loop, net.joints)[-1], net.joints[loop.strand.joints[0]], atol=1e-12
    )


def test_straight_spans_get_their_corner_in_the_middle():
    for straight in straightened(build(grid())):
        np.testing.assert_allclose(straight.lengths, 0.5, atol=1e-14)
        np.testing.assert_allclose(straight.corners, 0, atol=1e-14)


def test_an_inflection_changes_directions_as_little_as_possible():
    s_shape = line((0, 0), (0.5, 0.12), (1, 0), (1.5, -0.12), (2, 0))
    net = build(
        [s_shape, line((0.5, -1), (0.5, 1)), line((1.5, -1), (1.5, 1)), line((0, 0.6), (2, 0.6))]
    )
    straight = straighten(net.strands[0], net.joints)
    shift = straight.angles - straight.strand.angles
    assert straight.exact.all() and 0 < np.abs(shift).max() < 0.3
    np.testing.assert_allclose(
        walk(straight, net.joints), net.joints[straight.strand.joints], atol=1e-12
    )


def test_a_span_that_turns_too_far():
    hook = line((-1, 0), (0, 0), (1, 0), (1.6, 0.5), (1, 1), (0, 1), (-1, 1))
    net = build([hook, line((0, -1), (0.0, 2)), line((-0.5, -1), (-0.5, 2))])
    with pytest.raises(InputError, match=r"curves\[0\].points: .*one corner can't follow that"):
        straighten(net.strands[0], net.joints)


# -- faces -------------------------------------------------------------------------------------
def test_faces_of_a_grid():
    net = build(grid(4), free_ends=True)
    faces = faces_of(net)
    assert sorted(map(len, faces)) == [4] * 9
    triangles = triangulate(net)
    assert len(triangles) == 18
    a, b, c = (net.joints[triangles[:, k]] for k in range(3))
    areas = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    np.testing.assert_allclose(areas, 0.5)


def test_the_outer_face_is_left_out_even_of_a_ring():
    spokes = [
        line(0.5 * np.array([np.cos(a), np.sin(a)]), 2.5 * np.array([np.cos(a), np.sin(a)]))
        for a in np.arange(12) * np.pi / 6 + 0.1
    ]
    net = build([ring(1), ring(2)] + spokes)
    faces = faces_of(net)
    assert sorted(map(len, faces)) == [4] * 12 + [12]
    assert len(triangulate(net)) == 24  # the hole in the middle stays open


def test_larger_faces_are_cut_into_ears():
    net = build(
        grid(3)[:2]
        + grid(3)[3:5]
        + [line((-0.2, 0.5), (0.5, 1.4)), line((0.9, 0.05 - 1), (1.8, 0.9))],
        free_ends=True,
    )
    faces = faces_of(net)
    assert sum(len(f) - 2 for f in faces if len(f) > 2) == len(triangulate(net))


def test_a_tree_has_no_surface():
    net = build(
        [line((0, 0), (2, 0)), line((0.5, -1), (0.5, 1)), line((1.5, -1), (1.5, 1))], free_ends=True
    )
    with pytest.raises(InputError, match="enclose no face"):
        triangulate(net)


class TestLargeDrawings:
    """Searches that look at every pair of pieces would need gigabytes and minutes for these."""

    def test_laths_of_thousands_of_points(self):
        t = np.linspace(-0.1, 3.1, 4000)
        across = [Spline(np.stack([t, k + 0.05 * np.sin(t)], axis=1)) for k in range(3)]
        upwards = [Spline(np.stack([np.full(4000, float(k)), t], axis=1)) for k in range(3)]
        net = network([*across, *upwards])
        wanted = [[x, k + 0.05 * np.sin(x)] for k in range(3) for x in range(3)]
        np.testing.assert_allclose(net.joints, wanted, atol=1e-9)

    def test_a_net_of_sixty_by_sixty(self):
        lines = [Polyline([[-1, k], [60, k + 0.3]]) for k in range(60)]
        lines += [Polyline([[k, -1], [k + 0.2, 61]]) for k in range(60)]
        net = network(lines)
        assert net.n_joints == 3600 and net.opens.all()
        assert {len(strand.joints) for strand in net.strands} == {60}

    def test_more_points_than_can_be_searched(self, monkeypatch):
        monkeypatch.setattr("kop_exudyn.geometry.crossings._MOST_PIECES", 100)
        waves = [[x, 0.1 * np.sin(x)] for x in np.linspace(0, 9, 200)]
        with pytest.raises(InputError, match="curves: have 200 pieces .* at most 100 can be"):
            network([Polyline(waves), Polyline([[1, -1], [1, 1]])])
