"""Curves against circles, lines and numerical integrals."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.errors import InputError
from kop_exudyn.geometry.curves import Polyline, Spline, curve_from_dict


def circle_points(n, turn=2 * np.pi, radius=2.0):
    t = turn * np.arange(n) / n
    return radius * np.stack([np.cos(t), np.sin(t)], axis=1)


def test_a_periodic_spline_follows_a_circle_with_order_four():
    errors = []
    for n in (16, 32, 64):
        circle = Spline(circle_points(n), closed=True)
        errors.append(abs(circle.length - 4 * np.pi))
    slopes = np.diff(np.log2(errors))
    np.testing.assert_allclose(slopes, -4, atol=0.3)
    s = np.linspace(0, circle.length, 200)
    np.testing.assert_allclose(np.hypot(*circle.position(s).T), 2, atol=1e-6)
    np.testing.assert_allclose(circle.curvature(s), 0.5, rtol=2e-3)


@pytest.mark.parametrize("laps", [0, 1, -1, 3])
def test_a_loop_gains_a_whole_turn_each_lap(laps):
    circle = Spline(circle_points(24), closed=True)
    s = np.array([0.1, 3.0, 9.0])
    np.testing.assert_allclose(
        circle.angle(s + laps * circle.length), circle.angle(s) + 2 * np.pi * laps, atol=1e-12
    )
    np.testing.assert_allclose(
        circle.position(s + laps * circle.length), circle.position(s), atol=1e-12
    )


def test_turning_of_a_spiral_is_not_wrapped():
    t = np.linspace(0, 6 * np.pi, 200)
    spiral = Spline(np.stack([(1 + t) * np.cos(t), (1 + t) * np.sin(t)], axis=1))
    direction = t + np.arctan2(1 + t, 1)
    # natural ends are a little too straight
    assert spiral.turning(0, spiral.length) == pytest.approx(direction[-1] - direction[0], abs=0.1)


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(st.floats(0.4, 1.6), st.floats(-0.5, 0.5)), min_size=2, max_size=9),
    st.booleans(),
)
def test_stations_are_arc_lengths(steps, smooth):
    points = np.cumsum([[0, 0], *steps], axis=0)
    curve = (Spline if smooth else Polyline)(points)
    s = np.linspace(0, curve.length, 41)
    h = 1e-6 * curve.length
    middle = 0.5 * (s[1:] + s[:-1])
    speed = (curve.position(middle + h) - curve.position(middle - h)) / (2 * h)
    near_vertex = np.abs(middle[:, None] - curve.stations).min(axis=1) < 2 * h
    np.testing.assert_allclose(speed[~near_vertex], curve.tangent(middle)[~near_vertex], atol=1e-6)
    np.testing.assert_allclose(curve.position(curve.stations[[0, -1]]), points[[0, -1]], atol=1e-12)


def test_turning_is_the_integral_of_the_curvature():
    curve = Spline([[0, 0], [1, 0.7], [2.2, 0.1], [3, 0.9], [4, 0.4]])
    s, w = np.polynomial.legendre.leggauss(40)
    edges = curve.stations
    half = 0.5 * np.diff(edges)
    at = 0.5 * (edges[1:] + edges[:-1])[:, None] + half[:, None] * s
    assert np.sum(half * (curve.curvature(at) @ w)) == pytest.approx(
        curve.turning(0, curve.length), abs=1e-10
    )


def test_natural_splines_end_straight_and_go_on_straight():
    curve = Spline([[0, 0], [1, 1], [2, 0.5]])
    np.testing.assert_allclose(curve.curvature([0, curve.length]), 0, atol=1e-12)
    beyond = curve.position([curve.length, curve.length + 0.5])
    np.testing.assert_allclose(beyond[1] - beyond[0], 0.5 * curve.tangent(curve.length), atol=1e-14)


def test_two_points_make_a_line():
    line = Spline([[1, 1], [4, 5]])
    assert line.length == pytest.approx(5)
    np.testing.assert_allclose(line.position(2.5), [2.5, 3])
    np.testing.assert_allclose(line.tangent(1.0), [0.6, 0.8])


def test_a_polyline_turns_at_its_vertices_half_before_and_half_after():
    path = Polyline([[0, 0], [1, 0], [1, 1], [2, 1]])
    np.testing.assert_allclose(
        path.angle([0, 0.5, 1, 1.5, 2, 2.5, 3]), np.array([0, 0, 0.5, 1, 0.5, 0, 0]) * np.pi / 2
    )
    assert path.turning(0.2, 1.7) == pytest.approx(np.pi / 2)
    square = Polyline([[0, 0], [1, 0], [1, 1], [0, 1]], closed=True)
    assert square.length == 4 and square.lap_turning == pytest.approx(2 * np.pi)
    np.testing.assert_allclose(
        square.angle([0, 4, 4.5]), [-np.pi / 4, 1.75 * np.pi, 2 * np.pi], atol=1e-12
    )


def test_sags_bound_the_distance_to_the_chords():
    curve = Spline([[0, 0], [1, 0.9], [1.3, 0.1], [3, 0.9], [4, 0.4]])
    a, b = curve.stations[:-1], curve.stations[1:]
    start, end = curve.position(a), curve.position(b)
    normal = (
        np.stack([-(end - start)[:, 1], (end - start)[:, 0]], axis=1)
        / np.hypot(*(end - start).T)[:, None]
    )
    for f in np.linspace(0.1, 0.9, 9):
        off = np.sum((curve.position(a + f * (b - a)) - start) * normal, axis=1)
        assert np.all(np.abs(off) <= curve.sags + 1e-12)


@pytest.mark.parametrize(
    "points, closed, message",
    [
        ([[0, 0], [1, float("nan")]], False, "not finite"),
        ([[0, 0, 0], [1, 0, 0]], False, r"shape \(n, 2\)"),
        ([[0, 0], [1]], False, "list of points"),
        ("abc", False, "list of points"),
        ([[0, 0]], False, "at least 2 points"),
        ([[0, 0], [1, 1], [0, 0]], True, "at least 3 points"),
        ([[0, 0], [1, 1], [1, 1]], False, "same"),
    ],
)
@pytest.mark.parametrize("kind", ["spline", "polyline"])
def test_unusable_points(kind, points, closed, message):
    with pytest.raises(InputError, match=message) as caught:
        curve_from_dict({"type": kind, "points": points, "closed": closed}, "curves[3]")
    assert caught.value.field.startswith("curves[3].points")


def test_a_polyline_that_folds_back():
    with pytest.raises(InputError, match="folds back"):
        Polyline([[0, 0], [2, 0], [1, 0]])


def test_unknown_kinds():
    with pytest.raises(InputError, match="unknown type"):
        curve_from_dict({"type": "nurbs", "points": [[0, 0], [1, 1]]}, "curves[0]")


def test_points_that_nearly_are_the_same_would_make_a_hook():
    """7 micrometres apart in 3 metres, in another direction than the curve's."""
    x = np.linspace(0, 3, 15)
    points = np.stack([x, 0.05 * np.sin(x)], axis=1)
    hooked = np.insert(points, 8, points[7] + [-4e-6, 6e-6], axis=0)
    with pytest.raises(InputError, match=r"points\[8\]: is only 7.21e-06 away .* leave one of"):
        Spline(hooked)
    along = np.insert(points, 8, points[7] + 1e-5 * (points[8] - points[7]), axis=0)
    assert Spline(along).length == pytest.approx(Spline(points).length, rel=1e-6)
