"""Ends of laths beyond their last joints: what is cut off is told, and what keeps it."""

import json

import numpy as np
import pytest

from kop_exudyn.cli import main
from kop_exudyn.errors import InputError
from kop_exudyn.exchange.drawing import Drawing, DrawnCurve
from kop_exudyn.exchange.drawn_networks import ReadingOptions, drawn_network
from kop_exudyn.exchange.free_ends import cut_ends, free_end_doubts
from kop_exudyn.geometry.curves import Polyline
from kop_exudyn.geometry.network import network, network_from_dict
from kop_exudyn.units import Units


def net(overhangs):
    """Three laths along x and three along y, one apart; these go on by so much at one end."""
    laths = [((-0.2, k), (2.2, k)) for k in range(3)]
    laths += [((k, 0), (k, 2 + over)) for k, over in enumerate(overhangs)]
    points = [np.column_stack([np.array(lath, float), [0, 0]]) for lath in laths]
    return Drawing([DrawnCurve(x, False, f"line {k}") for k, x in enumerate(points)])


def write(path, overhangs):
    text = []
    for curve in net(overhangs).curves:
        text += [f"v {x} {y} {z}" for x, y, z in curve.points.tolist()] + ["l -2 -1"]
    path.write_text("\n".join(text) + "\n")
    return path


def test_lengths_and_tips_of_what_is_cut_off():
    drawn = drawn_network(net((0, 0.3, 0.9)), ReadingOptions(scale=10.0))
    lengths, tips = cut_ends(drawn.network)
    assert sorted(np.round(lengths, 9)) == [2.0] * 6 + [3.0, 9.0]
    assert np.round(tips, 9).tolist().count([20.0, 29.0]) == 1
    kept = drawn_network(net((0, 0.3, 0.9)), ReadingOptions(free_ends=True))
    assert not len(cut_ends(kept.network)[0])


def test_ends_as_long_as_spans_are_doubted_where_they_are():
    options = ReadingOptions(scale=10.0, ends_kept_by="--keep")
    (doubt,) = free_end_doubts(drawn_network(net((0, 0.3, 0.9)), options), Units("cm"))
    assert doubt.kind == "suspicious" and doubt.places.tolist() == [[2.0, 2.9, 0.0]]
    assert "1 free end that is cut off is longer" in doubt.text and "up to 9 cm" in doubt.text
    assert "--keep keeps ends" in doubt.text
    assert not free_end_doubts(drawn_network(net((0, 0.3, 0.4)), options), None)


def test_the_import_tells_and_names_the_option(tmp_path, capsys):
    path = write(tmp_path / "net.obj", (0, 0, 1))
    assert main(["import", str(path), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)["summary"]
    assert (summary["cut_ends"], summary["longest_cut_end"]) == (7, pytest.approx(1.0))
    assert main(["import", str(path)]) == 0
    told = capsys.readouterr().out
    assert "7 ends beyond the last joints, of up to 1 units" in told
    assert "(--free-ends keeps them)" in told and "longer than half a span" in told
    assert main(["import", str(path), "--free-ends"]) == 0
    assert "free end" not in capsys.readouterr().out
    assert main(["import", str(path), "--as", "grid"]) == 0
    told = capsys.readouterr().out
    assert "7 ends beyond the last joints" in told and "--free-ends" not in told


def test_grids_have_no_free_ends_to_keep(tmp_path, capsys):
    path = write(tmp_path / "net.obj", (0, 0, 0))
    assert main(["import", str(path), "--as", "grid", "--free-ends"]) == 2
    assert "--free-ends: isn't for this import: it is for drawings of C-shells" in (
        capsys.readouterr().err
    )


def test_what_keeps_a_lath_of_one_joint(tmp_path, capsys):
    """Of drawings the option, of design files the field, of grids nothing."""
    path = tmp_path / "cross.obj"
    path.write_text("v 0 1 0\nv 2 1 0\nv 1 0 0\nv 1 2 0\nl 1 2\nl 3 4\n")
    assert main(["import", str(path)]) == 2
    assert "cut off (--free-ends keeps them)" in capsys.readouterr().err
    assert main(["import", str(path), "--as", "grid"]) == 2
    assert "free_ends" not in capsys.readouterr().err
    cross = [[[0, 1], [2, 1]], [[1, 0], [1, 2]]]
    data = {"curves": [{"type": "polyline", "points": points} for points in cross]}
    with pytest.raises(InputError, match=r"cut off \(free_ends keeps them\)"):
        network_from_dict(data)
    with pytest.raises(InputError, match="cut off$"):
        network([Polyline(points) for points in cross])
