"""Places and stretches of drawings: said in the drawing's own coordinates, the same wherever it
lies."""

import numpy as np
import pytest
from support.drawn import piece

from kop_exudyn.errors import InputError, shown_place
from kop_exudyn.exchange.drawing import Drawing, DrawnCurve
from kop_exudyn.exchange.drawn_networks import ReadingOptions, drawn_network
from kop_exudyn.exchange.json_curves import json_drawing

FRONT = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # rows: where x, y and z go


def net(to=lambda x: x):
    lines = [((-0.2, k), (3.2, k)) for k in range(4)] + [((k, -0.2), (k, 3.2)) for k in range(4)]
    return [moved(piece(*line), to) for line in lines]


def moved(curve, to):
    return DrawnCurve(np.array([to(x) for x in curve.points]), False, curve.label)


@pytest.mark.parametrize(
    "to, scale, said",
    [
        (lambda x: x, 1.0, r"\(1, 1, 0\)"),
        (lambda x: x + (200, 100, 0), 1.0, r"\(201, 101, 0\)"),
        (lambda x: 1000 * x + (8000, 0, 0), 1e-3, r"\(9000, 1000, 0\)"),
        (lambda x: x + (2.6e6, 5.2e6, 0), 1.0, r"\(2600001, 5200001, 0\)"),
        (lambda x: x @ FRONT + (0, 7, 0), 1.0, r"\(1, 7, 1\)"),
    ],
)
def test_three_curves_through_a_point_are_named_where_they_are_drawn(to, scale, said):
    curves = [*net(to), moved(piece((0.7, 1.3), (1.4, 0.6)), to)]
    with pytest.raises(InputError, match=f"passes through one point {said} with"):
        drawn_network(Drawing(curves), ReadingOptions(scale=scale)).network


@pytest.mark.parametrize("share", [1e-6, 0.1, 0.5])
def test_points_within_the_tolerance_are_one(share):
    options = ReadingOptions(tolerance=1e-3)
    off = share * options.tolerance
    curves = [*net(), piece((0.7 + off, 1.3), (1.4 + off, 0.6))]
    with pytest.raises(InputError, match="passes through one point"):
        drawn_network(Drawing(curves), options).network


def test_far_places_keep_the_digits_that_tell_them_apart():
    assert shown_place((1 / 3, 2.0)) == "(0.333333, 2)"
    assert shown_place((2600003.2, 5200001.0), 3.0) == "(2600003.2, 5200001)"
    assert shown_place((-1.23456789e9, 0.0), 1e3) == "(-1234567890, 0)"
    a, b = (shown_place((2.6e6 + x, 5.2e6), 3.0) for x in (0.0, 0.003))
    assert a != b


@pytest.mark.parametrize("off", [0.0, 1e-6, 1e-4, 9e-4])
@pytest.mark.parametrize(
    "to", [lambda x: x, lambda x: x @ FRONT + (0, 3, 0), lambda x: x + (50, -70, 2)]
)
def test_pieces_that_overlap_are_one_lath(to, off):
    """Whatever plane they are drawn in, exactly or within the tolerance, in either direction."""
    lines = []
    for k in range(4):
        lines += [piece((-0.2, k), (1.6, k)), piece((1.4, k + off), (3.2, k + off))]
        lines[-1] = DrawnCurve(lines[-1].points[:: -1 if k % 2 else 1], False, "b")
        lines.append(piece((k, -0.2), (k, 3.2)))
    found = drawn_network(Drawing([moved(line, to) for line in lines])).network
    assert (len(found.strands), found.n_joints) == (8, 16)
    spans = np.concatenate([strand.lengths for strand in found.strands])
    np.testing.assert_allclose(spans, 1.0, atol=1e-5)


def test_arcs_of_one_circle_that_overlap_are_one_lath():
    def arc(radius, a, b):
        t = np.radians(np.linspace(a, b, 25))
        x = radius * np.column_stack([np.cos(t), np.sin(t), 0 * t])
        return DrawnCurve(x, False, f"arc {a}")

    arcs = [arc(r, *at) for r in (1.0, 1.5, 2.0) for at in ((70, 95), (85, 110))]
    ends = [np.array([np.cos(t), np.sin(t)]) for t in np.radians([75, 90, 105])]
    spokes = [piece(0.9 * x, 2.1 * x) for x in ends]
    found = drawn_network(Drawing(arcs + spokes)).network
    assert (len(found.strands), found.n_joints) == (6, 9)


def test_curves_that_part_are_not_trimmed():
    """One begins on another and goes along with it for a while, tangentially: a fork."""
    t = np.linspace(0, 1, 60)
    fork = np.column_stack([0.5 + 2.5 * t, 1.0 + 0.8 * t**2, 0 * t])
    curves = [*net()[:2], piece((0.0, -0.2), (0.0, 3.2)), DrawnCurve(fork, False, "fork")]
    with pytest.raises(InputError, match="touches|crosses no other|not connected"):
        drawn_network(Drawing(curves)).network


class TestListsOfPoints:
    curves = [[[-0.2, k], [3.2, k]] for k in range(4)] + [[[k, -0.2], [k, 3.2]] for k in range(4)]

    @pytest.mark.parametrize(
        "wrong, named",
        [
            ([[1.0, -0.2], [1.0, 3.2, 0.0]], r"\[8\] = "),
            ([[None, -0.2], [1.0, 3.2]], r"\[8\]\[0\] = \[None, -0.2\]"),
            ([[1.0, -0.2], ["1.0", 3.2]], r"\[8\]\[1\] = \['1.0', 3.2\]"),
            ([], r"\[8\] = \[\]"),
            ([[0.0, 1.0]], r"\[8\] = "),
            (True, r"\[8\] = True"),
            ({"a": 1}, r"\[8\] = "),
            ("layer", r"\[8\] = 'layer'"),
        ],
    )
    def test_what_is_no_curve_among_others_is_named(self, wrong, named):
        import json

        with pytest.raises(InputError, match=named + ".*is no curve"):
            json_drawing(json.dumps([*self.curves, wrong]).encode(), ())
        nested = [self.curves, [*self.curves[:3], self.curves[3:5]]]  # lists of lists are layers
        for whole, number in ((self.curves, 8), (nested, 13)):
            assert len(json_drawing(json.dumps(whole).encode(), ()).curves) == number
