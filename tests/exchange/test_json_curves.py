"""Curves in JSON files: of COMPAS, and bare lists of points."""

import json

import numpy as np
import pytest

from kop_exudyn.cli import main
from kop_exudyn.errors import InputError
from kop_exudyn.exchange.curve_files import is_drawing, read_drawing

NET = [[[-0.2, k, 0.0], [2.2, k, 0.0]] for k in range(3)]
NET += [[[k, -0.2, 0.0], [k, 2.2, 0.0]] for k in range(3)]
FRAME = {"point": [1.0, 2.0, 3.0], "xaxis": [0.0, 2.0, 0.0], "yaxis": [0.5, 1.0, 0.0]}
SCISSORS = {"vertices": [[0, 0], [1, 0]], "edges": [[0, 1], [1, 2]]}  # lists, but not of points


def compas(kind, content, key="data"):
    return {"dtype": f"compas.geometry/{kind}", key: content}


def line(ends):
    return compas("Line", {"start": ends[0], "end": ends[1]})


def drawn(tmp_path, data, layers=()):
    path = tmp_path / "net.json"
    path.write_text(json.dumps(data))
    assert is_drawing(path)
    return read_drawing(path, layers)


def names_of_types(ends):
    """As version 1 wrote lines."""
    points = [compas("Point", point) for point in ends]
    return compas("Line", {"start": points[0], "end": points[1]}, "value")


@pytest.mark.parametrize(
    "data",
    [
        [line(ends) for ends in NET],
        {"laths": {"u": [line(x) for x in NET[:3]], "v": [line(x) for x in NET[3:]]}},
        [compas("Polyline", {"points": ends}) for ends in NET],
        [names_of_types(ends) for ends in NET],
        NET,
        [NET[:3], NET[3:]],
        [[point[:2] for point in ends] for ends in NET],
    ],
)
def test_a_net_is_read(data, tmp_path, capsys):
    (tmp_path / "net.json").write_text(json.dumps(data))
    assert main(["import", str(tmp_path / "net.json"), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)["summary"]
    assert (summary["curves"], summary["joints"], summary["spans"]) == (6, 9, 12)
    assert summary["median_span"] == pytest.approx(1.0)


def test_keys_are_layers_and_what_is_no_curve_is_named(tmp_path):
    data = {"frame": [line([[5, 0, 0], [6, 0, 0]])], "laths": [line(x) for x in NET]}
    data["more"] = compas("Plane", {})
    drawing = drawn(tmp_path, data)
    assert [c.layer for c in drawing.curves] == ["frame"] + ["laths"] * 6
    assert drawing.skipped == ["no curves: 1 Plane"]
    assert len(drawn(tmp_path, data, ["laths"]).curves) == 6
    with pytest.raises(InputError, match="no such key .there are frame, laths, more"):
        drawn(tmp_path, data, ["Laths "])


def test_round_curves_lie_in_their_frames(tmp_path):
    """Radii, and places at the parameters; a frame's axes are made perpendicular."""
    middle, x, y = np.array([1.0, 2.0, 3.0]), np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])
    arc = {"radius": 2.0, "start_angle": 0.5, "end_angle": 2.0, "frame": FRAME}
    ellipse = {"major": 2.0, "minor": 1.0, "frame": {"dtype": "any/Frame", "data": FRAME}}
    plane = {"point": FRAME["point"], "normal": [0, 0, -3.0]}
    data = [compas("Arc", arc), compas("Ellipse", ellipse)]
    data.append(compas("Circle", {"radius": 2.0, "plane": plane}, "value"))
    arc_, ellipse_, circle = drawn(tmp_path, data).curves
    for t, end in ((0.5, 0), (2.0, -1)):
        assert np.allclose(arc_.points[end], middle + 2 * (np.cos(t) * x + np.sin(t) * y))
    assert [arc_.closed, ellipse_.closed, circle.closed] == [False, True, True]
    for curve in (arc_, circle):
        radii = np.linalg.norm(curve.points - middle, axis=1)
        assert np.allclose(radii, 2) and np.allclose(curve.points[:, 2], 3)
        path = curve.path
        assert np.linalg.norm(0.5 * (path[1:] + path[:-1]) - middle, axis=1).min() > 2 - 1e-3
    off = ellipse_.points - middle
    assert np.allclose((off @ x / 2) ** 2 + (off @ y) ** 2, 1)


def test_splines(tmp_path):
    """A Bezier curve of degree two is a parabola; a NURBS curve is a circle's quarter, with all
    knots, or without the first and the last one, as Rhino has them."""
    corner = [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
    quarter = {"points": corner, "weights": [1.0, 0.5**0.5, 1.0], "knots": [0.0, 1.0], "degree": 2}
    data = [compas("NurbsCurve", quarter | {"multiplicities": m}) for m in ([3, 3], [2, 2])]
    data.append(compas("Bezier", {"points": corner}))
    full, rhino, parabola = drawn(tmp_path, data).curves
    for curve in (full, rhino):
        assert np.allclose(np.linalg.norm(curve.points, axis=1), 1) and len(curve.points) > 8
    u, v = parabola.points[:, 0], parabola.points[:, 1]
    assert np.allclose(np.sqrt(1 - u) + np.sqrt(1 - v), 1, atol=1e-6)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ([compas("Line", {"start": [0, 0, 0]})], "Line 1: can't be read as a curve: 'end'"),
        ([compas("Line", None)], "Line 1: can't be read as a curve"),
        ([compas("Polyline", {"points": [[0, 0, 1e90], [0, 0, 0]]})], "points within 1e60"),
        ([compas("Circle", {"radius": -1, "frame": FRAME})], "Circle 1: is no curve: expected pos"),
        ([compas("Circle", {"radius": 1})], "Circle 1: can't be read as a curve: 'plane'"),
        ([NET[0], [[0, 1], [1, 2]]], "lists of points of two and of three numbers"),
        (
            [compas("NurbsCurve", {"points": [[0, 0, 0]] * 2, "knots": [0], "degree": 3})],
            "NurbsCurve 1: can't be read as a curve: 'multiplicities'",
        ),
    ],
)
def test_what_is_refused_by_name(data, words, tmp_path, capsys):
    path = tmp_path / "net.json"
    path.write_text(json.dumps(data))
    assert main(["import", str(path)]) == 2
    error = capsys.readouterr().err
    assert words in error and str(path) in error and len(error.splitlines()) == 1


def test_other_json_files_are_no_drawings(tmp_path, capsys):
    """Lists of numbers in dictionaries may be anything; meshes and graphs are read by --edges."""
    path = tmp_path / "any.json"
    for data in (SCISSORS, [], [1, 2], [[0, 1]], {"dtype": "compas.datastructures/Mesh"}, "[0"):
        path.write_text(data if isinstance(data, str) else json.dumps(data))
        assert not is_drawing(path)
    path.write_text(json.dumps(SCISSORS))
    assert main(["import", str(path)]) == 2
    error = capsys.readouterr().err
    for words in ("nor has curves (lists of points stand", "of a surface, give --patch", "--edges"):
        assert words in error
    path.write_text(json.dumps({"vertices": [[0, 0], [1, 0]]}))
    assert main(["import", str(path)]) == 2
    assert "--edges" not in capsys.readouterr().err
    node = {str(k): {"x": k, "y": 0, "z": 0} for k in range(2)}
    path.write_text(json.dumps({"node": node, "edge": {"0": {"1": {}}}}))
    assert main(["import", str(path)]) == 2
    assert "--edges reads the edges as laths" in capsys.readouterr().err
