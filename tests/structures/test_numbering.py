"""Numbers of straightened curves' lengths and corners, and the elements made of them."""

import numpy as np
import pytest

from kop_exudyn.geometry.curves import Polyline
from kop_exudyn.geometry.network import network
from kop_exudyn.structures.numbering import number_pieces


def numbered(curves, free_ends=False):
    net = network(curves, free_ends=free_ends)
    halves = [np.stack([0.4 * s.lengths, 0.6 * s.lengths], axis=1) for s in net.strands]
    return number_pieces(net.strands, halves, [s.turnings for s in net.strands]), net


def ladder(free):
    return [Polyline([[-free, y], [3 + 2 * free, y]]) for y in (0.0, 1.0)] + [
        Polyline([[x, -free], [x, 1 + 2 * free]]) for x in (0.0, 1.0, 3.0)
    ]


def test_pieces_of_a_rail_without_free_ends():
    numbering, _ = numbered(ladder(0.0))
    rail = numbering.strands[0]
    assert (
        rail.before.tolist() == [0, 2]
        and rail.after.tolist() == [1, 3]
        and rail.corners.tolist() == [4, 5]
    )
    assert rail.tips == (None, None)
    np.testing.assert_allclose(numbering.parameters[:6], [0.4, 0.6, 0.8, 1.2, 0, 0], atol=1e-14)
    np.testing.assert_array_equal(np.flatnonzero(~numbering.is_length[:6]), [4, 5])
    whole, single, corners = numbering.groups
    assert whole.indices[0].tolist() == [1, 2] and single.indices[:2].tolist() == [[0], [3]]
    assert corners.indices[:2].tolist() == [[4], [5]]


def test_free_ends_stand_in_the_direction_of_the_curve():
    """Head before the first joint, tail behind the last one; every piece arrives at its joint
    first, then leaves it."""
    numbering, _ = numbered(ladder(0.2), free_ends=True)
    rail = numbering.strands[0]
    assert rail.tips == (4, 5) and rail.corners.tolist() == [6, 7]
    np.testing.assert_allclose(numbering.parameters[[4, 5]], [0.2, 0.4], rtol=1e-12)
    assert [group.indices.shape[1] for group in numbering.groups] == [2, 1]
    assert numbering.groups[0].indices[:3].tolist() == [[4, 0], [1, 2], [3, 5]]


def test_every_parameter_is_in_one_element_around_loops_too():
    t = np.arange(8) * np.pi / 4
    rim = np.stack([np.cos(t), np.sin(t)], axis=1)
    loops = [Polyline(r * rim, closed=True) for r in (1.0, 2.0)]
    spokes = [
        Polyline([0.9 * x, 2.1 * x]) for x in np.stack([np.cos(t + 0.2), np.sin(t + 0.2)], axis=1)
    ]
    for free_ends in (False, True):
        numbering, net = numbered(loops + spokes, free_ends)
        used = np.concatenate([group.indices.ravel() for group in numbering.groups])
        np.testing.assert_array_equal(np.sort(used), np.arange(len(numbering.parameters)))
        ring = numbering.strands[0]
        assert numbering.groups[0].indices[7].tolist() == [ring.after[-1], ring.before[0]]


def test_bounds_hold_the_design_itself_however_short_its_shortest_piece():
    curves = [Polyline([[0, y], [3, y]]) for y in (0.0, 1.0)] + [
        Polyline([[x, 0], [x, 1]]) for x in (0.0, 0.02, 1.5, 3.0)
    ]
    numbering, _ = numbered(curves)
    lower, upper = numbering.bounds(1.5)
    assert (lower <= numbering.parameters).all() and (numbering.parameters <= upper).all()
    lengths = numbering.parameters[numbering.is_length]
    assert lower[numbering.is_length].min() == pytest.approx(0.008)
    assert lower[numbering.is_length].max() == pytest.approx(0.1 * np.median(lengths))
    assert (lower[~numbering.is_length] == -1.5).all() and np.isinf(
        upper[numbering.is_length]
    ).all()
