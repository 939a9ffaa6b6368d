"""Networks from drawings: OBJ and DXF files, written by the test or by ezdxf."""

import json

import ezdxf
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kop_exudyn.cli import main
from kop_exudyn.errors import InputError
from kop_exudyn.exchange.curve_files import read_drawing
from kop_exudyn.exchange.drawing import Drawing, DrawnCurve
from kop_exudyn.exchange.drawn_networks import ReadingOptions, drawn_network, read_network
from kop_exudyn.io.designs import load_design

GRID = """# three lines across two
v -0.2 0 5
v 2.2 0 5
v -0.2 1 5
v 2.2 1 5
v 0 -0.2 5
v 0 1.2 5
v 1 -0.2 5
v 1.1 0.5 5
v 1 1.2 5
v 2 -0.2 5
v 2 1.2 5
l 1 2
l 3 4
l 5 6
l 7/1 8/2 \\
  9/3
l -2 -1
"""
OPTIONS = ("--opening", "30deg", "--section", "0.02,0.01", "--material", "2.1e9,0.35")


@pytest.fixture
def obj(tmp_path):
    path = tmp_path / "net.obj"
    path.write_text(GRID)
    return path


@pytest.fixture
def drawing():
    """A DXF document and its model space."""
    document = ezdxf.new("R2010")
    return document, document.modelspace()


def saved(document, path):
    document.saveas(path)
    return path


def piece(*points) -> DrawnCurve:
    return DrawnCurve(
        np.array([[*point, 0.0] for point in points], float), False, f"from {points[0]}"
    )


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


class TestCommand:
    def test_obj_to_design(self, obj, tmp_path, capsys):
        out = tmp_path / "design.json"
        assert (
            main(
                [
                    "import",
                    str(obj),
                    "--out",
                    str(out),
                    *OPTIONS,
                    "--elastic-limit",
                    "4e7",
                    "--free-ends",
                ]
            )
            == 0
        )
        told = capsys.readouterr().out.splitlines()
        assert told[0] == str(out) and told[1].endswith("5 of 5 drawn pieces")
        design = load_design(out)
        assert design.name == "net" and design.network.n_joints == 6
        assert design.opening == pytest.approx(np.pi / 6)
        assert {strand.head for strand in design.network.strands} != {0.0}
        assert json.loads(out.read_text())["material"]["elastic_limit"] == 4e7

    def test_it_is_told_without_any_file_to_write(self, obj, capsys):
        assert main(["import", str(obj)]) == 0
        assert "joints     6" in capsys.readouterr().out

    def test_a_surface_is_no_drawing(self, tmp_path, capsys):
        """An OBJ file of faces alone: what it needs is said, not what a C-shell would need."""
        mesh = tmp_path / "hill.obj"
        mesh.write_text("v -5 -5 0\nv 5 -5 0\nv 0 5 0\nf 1 2 3\n")
        assert main(["import", str(mesh), "--out", str(tmp_path / "a.json")]) == 2
        assert "needs --patch" in capsys.readouterr().err

    def test_a_mesh_to_keep_to(self, obj, tmp_path, repository, capsys):
        (tmp_path / "designs").mkdir()
        mesh, out = tmp_path / "meshes" / "hill.obj", tmp_path / "designs" / "net.json"
        options = ("import", str(obj), "--out", str(out), *OPTIONS, "--target", str(mesh))
        assert main(list(options)) == 2
        assert capsys.readouterr().err == f"kop: {mesh}: no such file\n" and not out.exists()
        mesh.parent.mkdir()
        mesh.write_text("v -5 -5 0\nv 5 -5 0\nv 0 5 0\nv 0 0 1\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
        assert main(list(options)) == 0
        assert json.loads(out.read_text())["target"] == {"file": "../meshes/hill.obj"}
        design = load_design(out)
        assert (
            len(design.target.faces) == 3
            and len(design.target.positions) == design.network.n_joints
        )

    def test_dxf_to_design_with_json(self, drawing, tmp_path, capsys):
        document, space = drawing
        document.units = ezdxf.units.MM
        for y in (0, 1000):
            space.add_line((-200, y), (2200, y))
        for x in (0, 1000, 2000):
            space.add_spline([(x, -200), (x + 50, 500), (x, 1200)])
        path, out = saved(document, tmp_path / "net.dxf"), tmp_path / "design.json"
        assert (
            main(["import", str(path), "--out", str(out), *OPTIONS, "--scale", "0.001", "--json"])
            == 0
        )
        told = json.loads(capsys.readouterr().out)
        assert told["design"] == str(out) and told["class"] == "c_shell" and told["name"] == "net"
        assert told["summary"]["joints"] == 6 and told["summary"]["curves"] == 5
        assert told["summary"]["units"] == {
            "length": "m",
            "force": "N",
        }  # drawn in mm, ezdxf's unit
        design = load_design(out)
        assert design.network.n_joints == 6 and design.network.size < 3

    @pytest.mark.parametrize(
        "options, message",
        [
            ((), "a C-shell needs --opening"),
            (OPTIONS[:2], "a C-shell needs --section"),
            ((*OPTIONS, "--as", "umbrella"), "an umbrella mesh on a surface needs --patch"),
            ((*OPTIONS, "--material", "1,0.7"), "--material = 0.7: "),
            ((*OPTIONS, "--opening", "9"), "--opening = 9.0: must be smaller than 3.14159"),
            ((*OPTIONS, "--opening", "35"), "35 degrees are 35deg"),
            ((*OPTIONS[2:], "--as", "grid", "--held", "edge"), "a grid needs --surface"),
            (
                (*OPTIONS, "--opening", "wide"),
                "expected an angle in radians, or as 35deg, got 'wide'",
            ),
            ((*OPTIONS, "--scale", "0"), "expected a positive number"),
            ((*OPTIONS, "--section", "3"), "expected two numbers"),
        ],
    )
    def test_mistakes(self, options, message, obj, tmp_path, capsys):
        try:
            status = main(["import", str(obj), "--out", str(tmp_path / "out.json"), *options])
        except SystemExit as end:
            status = end.code
        error = capsys.readouterr().err
        assert status == 2 and message in error and error.count("\n") == 1
        assert not (tmp_path / "out.json").exists()


class TestGrids:
    @pytest.fixture
    def plan(self, tmp_path):
        """A drawing above the vault of the repository's models, in plan."""
        path = tmp_path / "plan.obj"
        lines = [[(-0.9, y), (0.9, y)] for y in (-0.5, 0.0, 0.5)] + [
            [(x, -0.7), (x, 0.7)] for x in (-0.6, 0.0, 0.6)
        ]
        text = "".join(f"v {x} {y} 0\n" for line in lines for x, y in line)
        path.write_text(text + "".join(f"l {2 * k + 1} {2 * k + 2}\n" for k in range(len(lines))))
        return path

    def test_curves_in_plan_on_a_mesh(self, plan, tmp_path, repository, capsys):
        (tmp_path / "designs").mkdir()
        out = tmp_path / "designs" / "vault.json"
        surface = repository / "models" / "grids" / "vault.obj"
        options = (
            "--as",
            "grid",
            "--surface",
            str(surface),
            "--section",
            "0.004,0.05",
            "--material",
            "1.1e10,0.3",
        )
        assert main(["import", str(plan), "--out", str(out), *options]) == 0
        design = load_design(out)
        assert design.class_name == "grid" and design.network.n_joints == 9 and design.held is None
        for words, numbers in (("corners", [0, 2, 6, 8]), ("0,2,8", [0, 2, 8])):
            assert (
                main(
                    [
                        "import",
                        str(plan),
                        "--out",
                        str(out),
                        *options,
                        "--held",
                        words,
                        "--overwrite",
                    ]
                )
                == 0
            )
            assert load_design(out).held.tolist() == numbers
        capsys.readouterr()
        assert (
            main(
                ["import", str(plan), "--out", str(out), *options, "--held", "0,1,9", "--overwrite"]
            )
            == 2
        )
        assert "held = 9: names a joint that doesn't exist" in capsys.readouterr().err
        found = {tuple(x) for x in design.target.positions[:, :2].round(6).tolist()}
        assert found == {(x, y) for x in (-0.6, 0.0, 0.6) for y in (-0.5, 0.0, 0.5)}

    @pytest.mark.parametrize(
        "options, message",
        [
            ((), "a grid needs --section"),
            (OPTIONS[2:], "a grid needs --surface"),
            (("--surface", "no.obj", *OPTIONS[2:]), "no such file"),
            (("--surface", "no.ply", *OPTIONS[2:], "--scale", "2"), "no such file"),
        ],
    )
    def test_mistakes(self, options, message, plan, tmp_path, capsys):
        assert (
            main(
                ["import", str(plan), "--as", "grid", "--out", str(tmp_path / "out.json"), *options]
            )
            == 2
        )
        error = capsys.readouterr().err
        assert message in error and error.count("\n") == 1 and not (tmp_path / "out.json").exists()


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
