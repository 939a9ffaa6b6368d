"""Networks from drawings: what is joined, mended, told and refused."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.drawn import GRID, piece

from kop_exudyn.errors import InputError
from kop_exudyn.exchange.drawing import Drawing, DrawnCurve
from kop_exudyn.exchange.drawn_networks import ReadingOptions, drawn_network, read_network


class TestNetworks:
    def test_scale_plane_and_kind(self):
        curves = [
            DrawnCurve(np.array([[0, 7, 0], [1, 7, 1], [2, 7, 0]], float), False, "a"),
            DrawnCurve(np.array([[0, 7, 0.5], [2, 7, 0.5]], float), False, "b"),
        ]
        read = drawn_network(Drawing(curves), ReadingOptions(kind="polyline", scale=1000.0))
        assert read.entries[0] == {
            "type": "polyline",
            "points": [[0, 0], [1000, 1000], [2000, 0]],
        }
        assert read.labels == ["a", "b"]
        kinds = [entry["type"] for entry in drawn_network(Drawing(curves)).entries]
        assert kinds == ["spline", "polyline"]

    def test_c_shells_in_space_are_refused(self):
        lines = np.array([[[0, 0, 0], [1, 1, 1]], [[0, 1, 0], [1, 0.2, 0.5]]], float)
        curves = [DrawnCurve(line, False, "a") for line in lines]
        with pytest.raises(InputError, match="must lie in a plane; they extend by 1, 1, 1"):
            drawn_network(Drawing(curves))

    def test_a_tilted_drawing_is_laid_flat(self):
        """Lengths and angles are those of the drawing."""
        turn = Rotation.from_rotvec([0.4, -0.8, 0.3])
        square = [piece((-0.2, k), (2.2, k)) for k in range(3)]
        square += [piece((k, -0.2), (k, 2.2)) for k in range(3)]
        tilted = [
            DrawnCurve(turn.apply(c.points) + [10.0, -4.0, 7.0], False, c.label) for c in square
        ]
        read = drawn_network(Drawing(tilted))
        net, plain = read.network, drawn_network(Drawing(square)).network
        assert net.n_joints == 9 and read.findings[0].text.startswith("the drawing's plane, turned")
        for a, b in zip(net.strands, plain.strands):
            np.testing.assert_allclose(a.lengths, b.lengths, rtol=1e-7)
        np.testing.assert_allclose(net.opening_angles, np.pi / 2, atol=1e-7)
        np.testing.assert_allclose(
            read.frame.back(read.frame(tilted[2].points)), tilted[2].points, atol=1e-12
        )

    def test_a_curve_without_joints_is_named_as_in_the_drawing(self, obj):
        obj.write_text(GRID + "v 8 8 5\nv 9 9 5\nl -2 -1\n")
        with pytest.raises(InputError, match=r"line 21: crosses no other curve"):
            read_network(obj).network

    def test_points_twice_are_dropped(self):
        doubled = DrawnCurve(np.array([[0, 0, 0], [0, 0, 0], [1, 0, 0]], float), False, "a")
        read = drawn_network(Drawing([doubled, piece((0.5, -1), (0.5, 1))]))
        assert read.entries[0]["points"] == [[0, 0], [1, 0]]
        assert [f.text for f in read.findings] == ["1 repeated point left out of a"]


class TestLargeDrawings:
    """Searches among all pairs of points, or of pieces, would take minutes and gigabytes here."""

    def test_curves_of_thousands_of_points(self):
        t = np.linspace(-0.1, 3.1, 3000)
        curves = []
        for k in range(4):
            wave = k + 0.02 * np.sin(2 * t + k)
            for x, y in ((t, wave), (wave, t)):
                curves.append(DrawnCurve(np.stack([x, y, 0 * t], 1), False, f"lath {len(curves)}"))
        read = drawn_network(Drawing(curves))
        assert read.network.n_joints == 16 and len(read.entries) == 8

    def test_a_net_of_edges(self):
        stops = np.arange(26.0)
        edges = [piece((a, k), (a + 1, k)) for k in stops for a in stops[:-1]]
        edges += [piece((k, a), (k, a + 1)) for k in stops for a in stops[:-1]]
        read = drawn_network(Drawing(edges))
        assert len(read.entries) == 52 and read.network.n_joints == 26**2


def test_a_gap_between_ends_is_told_once():
    """Two pairs of finely drawn arcs whose ends stop short of each other: one doubt a place, as
    many as there are places to look at."""
    size, gap, t = 2000.0, 4.0, np.linspace(0, 1, 60)
    curves = []
    for c in (0.0, 500.0, 1000.0):
        curves.append(np.stack([size * t, c + 60 * np.sin(3 * t), 0 * t], axis=1))
        curves.append(np.stack([800 + c + 40 * np.sin(3 * t), -300 + 1600 * t, 0 * t], axis=1))
    corner = curves[0][-1] + [0.7 * gap, 0.7 * gap, 0]
    curves.append(np.stack([corner[0] + 100 * t, corner[1] + 900 * t, 0 * t], axis=1))
    drawn = [DrawnCurve(points, False, f"arc {n}") for n, points in enumerate(curves)]
    net = drawn_network(Drawing(drawn), ReadingOptions())
    doubts = [finding.text for finding in net.findings if "a joint may be meant" in finding.text]
    assert len(doubts) == 1 and "arc 0" in doubts[0] and "arc 6" in doubts[0]


def test_why_there_is_no_network_is_found_once(monkeypatch):
    """It was searched for again by the preview, by the summary and by the error."""
    from kop_exudyn.exchange import drawn_networks

    calls = []

    def counting(*args, **options):
        calls.append(args)
        raise InputError("crosses no other curve", field="curves[0]")

    monkeypatch.setattr(drawn_networks, "network", counting)
    lines = [DrawnCurve(np.array([[0.0, y, 0.0], [3.0, y, 0.0]]), False, f"l{y}") for y in (0, 1)]
    drawn = drawn_networks.drawn_network(Drawing(lines))
    for _ in range(3):
        with pytest.raises(InputError, match="crosses no other curve"):
            drawn.network  # noqa: B018
    assert len(calls) == 1
