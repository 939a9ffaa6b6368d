"""Curves and units that OBJ and DXF files say, written by the test or by ezdxf."""

import ezdxf
import numpy as np
import pytest
from support.drawn import GRID, saved

from kop_exudyn.errors import InputError
from kop_exudyn.exchange.curve_files import read_drawing
from kop_exudyn.exchange.drawn_networks import read_network


class TestObj:
    def test_polylines(self, obj):
        curves = read_drawing(obj).curves
        assert [len(curve.points) for curve in curves] == [2, 2, 2, 3, 2]
        np.testing.assert_array_equal(curves[3].points[1], [1.1, 0.5, 5])
        np.testing.assert_array_equal(curves[4].points, [[2, -0.2, 5], [2, 1.2, 5]])
        assert [curve.label for curve in curves] == [
            "line 13",
            "line 14",
            "line 15",
            "line 16",
            "line 18",
        ]

    def test_a_polyline_that_comes_back_is_closed(self, tmp_path):
        path = tmp_path / "loop.obj"
        path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2 3 1\n")
        (curve,) = read_drawing(path).curves
        assert curve.closed and len(curve.points) == 3

    @pytest.mark.parametrize(
        "text, message",
        [
            ("v 0 0 0\nf 1 1 1\n", "net.obj: contains no curves"),
            ("v 0\n", "line 1 = '0': expected"),
            (
                "v 0 0 1e99\n",
                "line 1 = '0 0 1e99': expected three coordinates of a vertex, within 1e60",
            ),
            ("v 0 0 nan\n", "line 1 = '0 0 nan': expected three coordinates"),
            ("v 0 0 0\nv 1 1 1\n\nl 1 3\n", r"line 4 = 3: no such vertex \(2 are given before\)"),
            ("v 0 0 0\nv 1 1 1\nl 0 1\n", "line 3 = 0: no such vertex"),
            ("v 0 0 0\nv 1 1 1\nl 1 x\n", "line 3 = 'x': expected numbers"),
            ("v 0 0 0\nv 1 1 1\nl 1\n", "line 3 = 'l 1': a polyline needs at least two"),
        ],
    )
    def test_mistakes(self, text, message, tmp_path):
        path = tmp_path / "net.obj"
        path.write_text(text)
        with pytest.raises(InputError, match=message) as caught:
            read_drawing(path)
        assert str(caught.value).startswith(str(path))

    def test_layers_are_of_files_that_have_some(self, obj):
        with pytest.raises(InputError, match="only DXF, 3dm and JSON files have layers"):
            read_drawing(obj, ["0"])


class TestDxf:
    def test_every_kind_of_curve(self, drawing, tmp_path):
        document, space = drawing
        space.add_line((0, 0, 1), (2, 0, 1))
        space.add_lwpolyline([(0, 1), (1, 2), (2, 1)], dxfattribs={"elevation": 1})
        space.add_polyline3d([(0, 3, 1), (1, 3, 1), (2, 4, 1)])
        space.add_spline([(0, 5, 1), (1, 6, 1), (2, 5, 1)])
        space.add_circle((1, 8, 1), 0.5)
        space.add_text("not a rod")
        read = read_drawing(saved(document, tmp_path / "net.dxf"))
        line, lw, poly, spline, circle = read.curves
        assert read.skipped == ["no curves: 1 TEXT"]
        np.testing.assert_allclose(line.points, [[0, 0, 1], [2, 0, 1]])
        np.testing.assert_allclose(lw.points, [[0, 1, 1], [1, 2, 1], [2, 1, 1]])
        np.testing.assert_allclose(poly.points, [[0, 3, 1], [1, 3, 1], [2, 4, 1]])
        np.testing.assert_allclose(spline.points[[0, -1]], [[0, 5, 1], [2, 5, 1]], atol=1e-12)
        assert len(spline.points) > 8 and np.abs(spline.points - [1, 6, 1]).sum(axis=1).min() < 0.05
        assert circle.closed and len(circle.points) > 8
        np.testing.assert_allclose(
            np.linalg.norm(circle.points - [1, 8, 1], axis=1), 0.5, atol=1e-3
        )
        assert line.label.startswith("LINE ") and spline.label.startswith("SPLINE ")

    def test_bulges_are_arcs(self, drawing, tmp_path):
        document, space = drawing
        space.add_lwpolyline([(0, 0, 0, 0, 1), (2, 0)])  # a half circle below
        (curve,) = read_drawing(saved(document, tmp_path / "net.dxf")).curves
        np.testing.assert_allclose(np.linalg.norm(curve.points - [1, 0, 0], axis=1), 1, atol=1e-3)

    def test_layers(self, drawing, tmp_path):
        document, space = drawing
        for name in ("rods", "frame"):
            document.layers.add(name)
            space.add_line((0, 0), (1, 0), dxfattribs={"layer": name})
        path = saved(document, tmp_path / "net.dxf")
        assert len(read_drawing(path).curves) == 2 and len(read_drawing(path, ["rods"]).curves) == 1
        with pytest.raises(
            InputError, match=r"layer = 'rod': no such layer \(there are frame, rods\)"
        ):
            read_drawing(path, ["rod"])

    def test_entities_of_other_programs_are_left_out(self, drawing, tmp_path):
        document, space = drawing
        space.add_line((0, 0), (1, 0))
        path = saved(document, tmp_path / "net.dxf")
        content = path.read_bytes().replace(
            b"ENTITIES\n", b"ENTITIES\n  0\nODD_THING\n  5\nFEFE\n", 1
        )
        path.write_bytes(content)
        assert b"ODD_THING" in content and len(read_drawing(path).curves) == 1

    @pytest.mark.parametrize(
        "content, message",
        [
            (b"", "can't be read as DXF|contains no curves"),
            (b"\x00\x01\x02" * 50, "can't be read as DXF|contains no curves"),
            (b"not a drawing at all\n", "can't be read as DXF|contains no curves"),
        ],
    )
    def test_something_else(self, content, message, tmp_path):
        path = tmp_path / "net.dxf"
        path.write_bytes(content)
        with pytest.raises(InputError, match=message) as caught:
            read_drawing(path)
        assert str(caught.value).startswith(str(path)) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("comments", "unit", "doubt"),
    [
        ("# unit: cm\n", "cm", None),
        ("# unit: cm\n# File units = centimeters\n", "cm", None),
        ("# unit: cm\n# unit: mm\n", None, "different units (cm, mm)"),
        ("# unit: bananas\n", None, "called bananas"),
    ],
)
def test_units_that_comments_say(comments, unit, doubt, tmp_path):
    """The first of two was taken, and an unknown one passed over, without a word."""
    (tmp_path / "net.obj").write_text(comments + GRID)
    drawing = read_drawing(tmp_path / "net.obj")
    assert drawing.unit == unit
    assert [doubt in text for text in drawing.doubts] == ([True] if doubt else [])


def test_a_dxf_file_in_utf_16(tmp_path):
    document = ezdxf.new("R2010")
    for k in range(3):
        document.modelspace().add_line((-0.5, k), (2.5, k))
        document.modelspace().add_line((k, -0.5), (k, 2.5))
    document.saveas(tmp_path / "a.dxf")
    text = (tmp_path / "a.dxf").read_text(encoding="utf-8")
    (tmp_path / "b.dxf").write_bytes(text.encode("utf-16"))
    found = [read_network(tmp_path / name).network.n_joints for name in ("a.dxf", "b.dxf")]
    assert found == [9, 9]
