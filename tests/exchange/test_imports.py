"""``kop import`` of drawings: units, scales, placements of targets, surfaces, previews, doubts."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from kop_exudyn.analysis.simulation import simulate
from kop_exudyn.cli import main
from kop_exudyn.exchange.curve_files import read_drawing
from kop_exudyn.exchange.drawn_networks import ReadingOptions, drawn_network
from kop_exudyn.exchange.export import export_simulation
from kop_exudyn.exchange.space_nets import surface_through, with_heights_checked
from kop_exudyn.io.designs import load_design
from kop_exudyn.structures import base, nets

RODS = ("--section", "0.03,0.004", "--material", "2.1e9,0.35")
SHELL = (*RODS, "--opening", "30deg")


@pytest.fixture(scope="module")
def corpus(request):
    """The folder of the corpus's files."""
    from pathlib import Path

    return Path(__file__).resolve().parents[1] / "corpus" / "files"


def imported(capsys, *arguments) -> tuple[int, str, str]:
    status = main(["import", *map(str, arguments)])
    told = capsys.readouterr()
    return status, told.out, told.err


def dome(path, scale=1.0, move=(0.0, 0.0, 0.0), turn=None):
    """A mesh over and around the corpus's net."""
    at = np.linspace(-1, 3, 13)
    x, y = (a.ravel() for a in np.meshgrid(at, at, indexing="ij"))
    z = 0.5 - 0.08 * ((x - 1) ** 2 + (y - 1) ** 2)
    points = np.stack([x, y, z], axis=1)
    points = scale * (points if turn is None else points @ np.asarray(turn).T) + move
    k = np.arange(169).reshape(13, 13)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4)
    text = [f"v {a!r} {b!r} {c!r}" for a, b, c in points.tolist()]
    text += ["f " + " ".join(map(str, quad + 1)) for quad in quads]
    path.write_text("\n".join([*text, ""]))
    return path


class TestUnits:
    def test_the_drawings_unit_becomes_the_designs(self, corpus, tmp_path, capsys):
        out = tmp_path / "net.json"
        status, told, _ = imported(capsys, corpus / "unit_m.dxf", "--out", out, *SHELL)
        assert status == 0 and "m, N (the drawing says m)" in told
        assert json.loads(out.read_text())["units"] == {"length": "m", "force": "N"}
        assert load_design(out).units.metres == 1.0

    def test_another_unit_is_converted_to(self, corpus, tmp_path, capsys):
        out = tmp_path / "net.json"
        options = ("--unit", "mm", "--force-unit", "kN", "--section", "30,4", *SHELL[2:])
        assert imported(capsys, corpus / "unit_m.dxf", "--out", out, *options)[0] == 0
        design = load_design(out)
        assert (design.units.length, design.units.force) == ("mm", "kN")
        assert design.network.size == pytest.approx(1000 * np.hypot(2.4, 2.4), rel=1e-9)

    def test_a_section_of_millimetres_in_a_net_of_metres(self, corpus, tmp_path, capsys):
        out = tmp_path / "net.json"
        options = ("--section", "30,4", *SHELL[2:])
        status, _, error = imported(capsys, corpus / "unit_m.dxf", "--out", out, *options)
        assert status == 2 and not out.exists()
        assert "30 x 4 m is thick beside spans of 1 m: is it in the net's unit?" in error

    def test_a_doubtful_section_is_told(self, corpus, tmp_path, capsys):
        out = tmp_path / "net.json"
        options = ("--section", "0.6,0.004", *SHELL[2:])
        status, told, _ = imported(capsys, corpus / "unit_m.dxf", "--out", out, *options)
        assert status == 0 and "look at    the section of 0.6 x 0.004 m is thick" in told


class TestSides:
    def test_the_side_is_written_where_it_is_given(self, corpus, tmp_path, capsys):
        for side, options in ((1, ()), (1, ("--side", "up")), (-1, ("--side", "down"))):
            out = tmp_path / "_".join(("net", *options))
            status, _, error = imported(
                capsys, corpus / "lines.obj", "--out", f"{out}.json", *SHELL, *options
            )
            assert status == 0, error
            assert load_design(f"{out}.json").side == side

    def test_a_grid_has_none(self, corpus, tmp_path, capsys):
        options = ("--as", "grid", "--side", "down", "--out", tmp_path / "net.json")
        status, _, error = imported(capsys, corpus / "lines.obj", *options)
        assert status == 2 and "--side" in error


class TestTargets:
    def test_the_scale_is_the_targets_too(self, corpus, tmp_path, capsys):
        """A net and its target in millimetres, the design in metres."""
        mesh, out = dome(tmp_path / "dome.obj", 1000.0), tmp_path / "net.json"
        options = (*SHELL, "--scale", "0.001", "--unit", "m", "--target", mesh)
        assert imported(capsys, corpus / "in_millimetres.obj", "--out", out, *options)[0] == 0
        data = json.loads(out.read_text())
        assert data["target"] == {"file": "dome.obj", "scale": 0.001}
        target = load_design(out).target_mesh
        assert np.ptp(target.vertices, axis=0) == pytest.approx([4.0, 4.0, 0.64], rel=1e-6)

    @pytest.mark.parametrize("name", ["plane_xz.dxf", "plane_yz.dxf", "plane_tilted_far_away.dxf"])
    def test_it_is_laid_into_the_drawings_plane(self, name, corpus, tmp_path, capsys):
        """The target stands over the drawing in space; in the design it stands over the net."""
        drawn = drawn_network(read_drawing(corpus / name))
        frame, plan = drawn.frame, np.array([e["points"] for e in drawn.entries]).reshape(-1, 2)
        shift = np.append(plan.min(axis=0) + 0.2, 0.0)  # the net's first joint in plan
        mesh = dome(tmp_path / "dome.obj")
        text = [line for line in mesh.read_text().splitlines() if line.startswith("f")]
        points = np.array(
            [line.split()[1:] for line in mesh.read_text().splitlines() if line[0] == "v"], float
        )
        height = frame(drawn.curves[0].points)[0, 2]
        placed = frame.back(points + shift + [0, 0, height])
        mesh.write_text(
            "\n".join([*(f"v {a!r} {b!r} {c!r}" for a, b, c in placed.tolist()), *text, ""])
        )
        out = tmp_path / "net.json"
        assert imported(capsys, corpus / name, "--out", out, *SHELL, "--target", mesh)[0] == 0
        found = load_design(out).target_mesh.vertices
        np.testing.assert_allclose(found, points + shift + [0, 0, height], atol=1e-7)

    def test_a_missing_mesh_is_named_itself(self, corpus, tmp_path, capsys):
        out = tmp_path / "net.json"
        options = (*SHELL, "--target", tmp_path / "none.obj")
        status, _, error = imported(capsys, corpus / "lines.obj", "--out", out, *options)
        assert status == 2 and error.count("\n") == 1
        assert error.strip().endswith("none.obj: no such file")


class TestGrids:
    def test_plan_and_surface_share_the_scale(self, corpus, tmp_path, capsys):
        mesh, out = dome(tmp_path / "dome.obj", 1000.0), tmp_path / "grid.json"
        options = ("--as", "grid", "--surface", mesh, "--section", "0.004,0.05", *RODS[2:])
        options += ("--scale", "0.001", "--unit", "m", "--held", "corners")
        assert imported(capsys, corpus / "in_millimetres.obj", "--out", out, *options)[0] == 0
        design = load_design(out)
        x, y, z = design.target.positions.T
        np.testing.assert_allclose(z, 0.5 - 0.08 * ((x - 1) ** 2 + (y - 1) ** 2), atol=5e-3)
        assert design.network.n_joints == 9 and design.units.length == "m"

    def test_another_unit_than_the_surfaces_is_suspected(self, corpus, tmp_path, capsys):
        mesh, out = dome(tmp_path / "dome.obj", 0.001), tmp_path / "grid.json"
        options = ("--as", "grid", "--surface", mesh, *RODS)
        status, _, error = imported(capsys, corpus / "lines.obj", "--out", out, *options)
        assert status == 2 and "is it drawn in the surface's unit, and above it?" in error

    def test_a_net_in_space_is_a_grid_on_its_own_surface(self, corpus, tmp_path, capsys):
        out = tmp_path / "saddle.json"
        options = ("--as", "grid", "--section", "0.004,0.05", *RODS[2:], "--held", "corners")
        status, told, _ = imported(capsys, corpus / "saddle_in_space.obj", "--out", out, *options)
        assert status == 0 and told.startswith(str(out))
        assert json.loads(out.read_text())["surface"]["file"] == "saddle_surface.obj"
        x, y, z = load_design(out).target.positions.T
        np.testing.assert_allclose(z, 0.2 * (x - 1) * (y - 1), atol=2e-3)

    @pytest.mark.parametrize("axes", [[0, 1, 2], [1, 2, 0], [2, 0, 1]])
    def test_the_surface_through_a_net_that_lies_anyhow(self, axes, corpus):
        drawing = read_drawing(corpus / "saddle_in_space.obj")
        for curve in drawing.curves:
            curve.points[:] = curve.points[:, axes]
        drawn = with_heights_checked(drawn_network(drawing, ReadingOptions(scale=2.0), space=True))
        vertices, faces, up = surface_through(drawn)
        height = axes.index(2)
        assert up == "xyz"[height]
        local = vertices[:, np.argsort(axes)] / 2.0
        inside = (np.abs(local[:, :2] - 1) <= 1.0).all(axis=1)
        wanted = 0.2 * (local[:, 0] - 1) * (local[:, 1] - 1)
        np.testing.assert_allclose(local[inside, 2], wanted[inside], atol=3e-3)

    def test_laths_that_pass_each_other(self, corpus, tmp_path, capsys):
        out = tmp_path / "grid.json"
        options = ("--as", "grid", *RODS, "--out", out)
        status, _, error = imported(capsys, corpus / "passing_in_space.obj", *options)
        assert status == 2 and "at a distance of 0.5 where they cross in plan" in error

    def test_a_flat_net_has_no_surface(self, corpus, tmp_path, capsys):
        options = ("--as", "grid", *RODS, "--out", tmp_path / "grid.json")
        status, _, error = imported(capsys, corpus / "lines.obj", *options)
        assert status == 2 and "a grid needs --surface: the net is drawn flat" in error

    def test_curves_in_space_on_a_surface_that_overhangs(self, tmp_path, capsys):
        """Half a tube, which no plan shows: its flat parameters are its angle and its length."""
        t, y = np.linspace(-1.9, 1.9, 25), np.linspace(0, 3, 16)
        tube = [(np.sin(a), b, np.cos(a)) for b in y for a in t]
        k = np.arange(len(tube)).reshape(16, 25)
        quads = np.stack([k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]], axis=-1).reshape(-1, 4)
        text = [f"v {a} {b} {c}" for a, b, c in tube]
        text += ["f " + " ".join(map(str, quad + 1)) for quad in quads]
        mesh, net = tmp_path / "tube.obj", tmp_path / "net.obj"
        mesh.write_text("\n".join([*text, ""]))
        lines = []
        for height in (0.8, 2.2):
            lines.append([(np.sin(a), height, np.cos(a)) for a in np.linspace(-1.2, 1.2, 21)])
        for angle in (-0.9, 0.0, 0.9):
            lines.append([(np.sin(angle), b, np.cos(angle)) for b in (0.4, 1.5, 2.6)])
        text, first = [], 1
        for line in lines:
            text += [f"v {a} {b} {c}" for a, b, c in line]
            text.append("l " + " ".join(str(first + n) for n in range(len(line))))
            first += len(line)
        net.write_text("\n".join([*text, ""]))
        out = tmp_path / "grid.json"
        options = ("--as", "grid", "--surface", mesh, *RODS, "--out", out)
        status, _, error = imported(capsys, net, *options)
        assert status == 2 and "--chart conformal with the curves drawn in space" in error
        assert imported(capsys, net, *options, "--chart", "conformal")[0] == 0
        x = load_design(out).target.positions
        assert len(x) == 6
        np.testing.assert_allclose(np.hypot(x[:, 0], x[:, 2]), 1.0, atol=0.01)
        np.testing.assert_allclose(np.sort(x[:, 1]), [0.8] * 3 + [2.2] * 3, atol=0.01)


class TestPreviews:
    def test_a_page_without_a_design(self, corpus, tmp_path, capsys):
        page = tmp_path / "net.html"
        name = "scissor_edges_with_tips.obj"
        status, told, _ = imported(capsys, corpus / name, "--preview", page)
        assert status == 0 and told.startswith(str(page))
        html = page.read_text()
        assert "What was read of scissor_edges_with_tips.obj" in html and "<script" not in html
        assert "hinged tip: 4" not in html  # the figure's text is drawn, the table's is written
        assert "4 tips hinged" in html and "16 seams joined" in html

    def test_a_refused_drawing_is_shown(self, corpus, tmp_path, capsys):
        page, out = tmp_path / "net.html", tmp_path / "net.json"
        options = (*SHELL, "--out", out, "--preview", page)
        status, _, error = imported(capsys, corpus / "lonely.dxf", *options)
        assert status == 2 and "crosses no other curve" in error and not out.exists()
        assert "No design comes of this drawing" in page.read_text()

    def test_an_umbrella_mesh(self, tmp_path, capsys):
        mesh = dome(tmp_path / "dome.obj", 300.0)
        page = tmp_path / "dome.html"
        options = ("--patch", "hexagon,1", "--preview", page)
        status, told, _ = imported(capsys, mesh, *options)
        assert status == 0 and "cells      6" in told and " mm" in told
        assert "An umbrella mesh of 6 cells" in page.read_text()

    def test_nothing_is_overwritten(self, corpus, tmp_path, capsys):
        page = tmp_path / "net.html"
        page.write_text("mine")
        status, _, error = imported(capsys, corpus / "lines.obj", "--preview", page)
        assert status == 2 and "exists already" in error and page.read_text() == "mine"

    def test_without_either_the_summary_alone_is_given(self, corpus, capsys):
        status, told, _ = imported(capsys, corpus / "lines.obj")
        assert status == 0 and "6 of 6 drawn pieces" in told


def test_nets_far_away_are_designs_near_the_origin_and_files_give_the_place_back(tmp_path):
    """A vault in millimetres, 50 km away: the same design, file for file, as at the origin."""

    far = np.array([30e6, 40e6, 250e3])
    grid, lines = np.linspace(-6e3, 6e3, 13), np.linspace(-4e3, 4e3, 4)
    n = len(grid)
    results = {}
    for name, at in (("near", np.zeros(3)), ("far", far)):
        mesh = [(x, y, -5e-5 * x * x - 2e-5 * y * y) + at for y in grid for x in grid]
        faces = [
            (a, a + 1, a + n + 1, a + n)
            for a in (j * n + i for j in range(n - 1) for i in range(n - 1))
        ]
        text = ["v {:.4f} {:.4f} {:.4f}".format(*p) for p in mesh]
        text += ["f " + " ".join(str(k + 1) for k in face) for face in faces]
        (tmp_path / f"{name}_surface.obj").write_text("\n".join(text))
        ends = [((-4e3, c), (4e3, c)) for c in lines] + [((c, -4e3), (c, 4e3)) for c in lines]
        points = [(x + at[0], y + at[1], at[2]) for line in ends for x, y in line]
        text = ["v {:.4f} {:.4f} {:.4f}".format(*p) for p in points]
        text += [f"l {2 * k + 1} {2 * k + 2}" for k in range(len(ends))]
        (tmp_path / f"{name}.obj").write_text("\n".join(text))
        design = tmp_path / f"{name}.json"
        command = ["import", str(tmp_path / f"{name}.obj"), "--as", "grid", "--out", str(design)]
        command += ["--surface", str(tmp_path / f"{name}_surface.obj"), "--unit", "mm"]
        assert main([*command, "--section", "15,120", "--material", "11000,0.3"]) == 0
        result = simulate(load_design(design))
        export_simulation(result, tmp_path / name, formats=["obj", "vtu"])
        results[name] = result
    np.testing.assert_array_equal(results["near"].design.origin, 0)
    np.testing.assert_array_equal(results["far"].design.origin, far.round())
    joints = {name: np.array(result.to_dict()["joints"]) for name, result in results.items()}
    np.testing.assert_allclose(joints["far"] - far, joints["near"], atol=1e-3)
    for file in ("deployed.obj", "target.obj"):
        near, there = (
            np.array(
                [
                    line.split()[1:]
                    for line in (tmp_path / name / f"{name}_{file}").read_text().splitlines()
                    if line.startswith("v ")
                ],
                float,
            )
            for name in ("near", "far")
        )
        np.testing.assert_allclose(there - far, near, atol=1e-3)


class TestLaidFlat:
    """C-shells are made of flat nets; what is drawn on a developable surface can be unrolled."""

    @staticmethod
    def net(path, shape, n=4):
        """n by n lines of parameters (u, v), one apart, on a surface."""
        t, text = np.linspace(-0.15, n - 0.85, 25), []
        for k in range(n):
            for u, v in ((t, np.full(25, float(k))), (np.full(25, float(k)), t)):
                text += [f"v {x!r} {y!r} {z!r}" for x, y, z in np.stack(shape(u, v), 1).tolist()]
                text.append("l " + " ".join(str(m) for m in range(-25, 0)))
        path.write_text("\n".join([*text, ""]))
        return path

    @pytest.mark.parametrize("radius", [2.5, 10.0])
    def test_a_cylinder(self, radius, tmp_path, capsys):
        path = self.net(
            tmp_path / "net.obj",
            lambda u, v: (radius * np.sin(u / radius), v, radius * np.cos(u / radius)),
        )
        out = tmp_path / "net.json"
        status, told, _ = imported(capsys, path, "--out", out, *SHELL)
        assert status == 0 and "drawn in space and laid flat" in told
        design = load_design(out)
        assert design.network.n_joints == 16
        spans = np.concatenate([strand.lengths for strand in design.network.strands])
        np.testing.assert_allclose(spans, 1.0, rtol=5e-3)
        np.testing.assert_allclose(design.network.opening_angles, np.pi / 2, atol=0.01)

    def test_a_dome_cannot_be(self, tmp_path, capsys):
        path = self.net(
            tmp_path / "net.obj", lambda u, v: (u, v, -0.1 * ((u - 1.5) ** 2 + (v - 1.5) ** 2))
        )
        out = tmp_path / "net.json"
        status, _, error = imported(capsys, path, "--out", out, *SHELL)
        assert status == 2 and "can't be laid flat: lengths would change by up to" in error
        assert not out.exists()


class TestAClassFromOutside:
    """What a class registers is all that `kop import` needs to make designs of drawings."""

    @pytest.fixture(autouse=True)
    def toy(self, monkeypatch):
        base.class_names()  # those that there are, before what is registered meanwhile is lost
        nets.net_classes()
        for registry in (base.CLASSES, nets.NETS):
            monkeypatch.setattr(registry, "items", dict(registry.items))
        toy = SimpleNamespace(middle=np.zeros(3), doubts=[])
        base.register_class("toy")(lambda data, source: toy)
        nets.register_net(
            "toy",
            nets.NetClass(
                "a toy",
                "toys",
                lambda curves, options: {"strings": len(curves), "angle": options["opening"]},
                options=("opening",),
                needed=("opening",),
            ),
        )

    def test_its_fields_are_written(self, corpus, tmp_path, capsys):
        out = tmp_path / "toy.json"
        options = ("--as", "toy", "--out", out, *SHELL)
        assert imported(capsys, corpus / "unit_m.dxf", *options)[0] == 0
        data = json.loads(out.read_text())
        assert (data["class"], data["name"]) == ("toy", "unit_m") and data["strings"] >= 4
        assert data["angle"] == pytest.approx(np.pi / 6)
        assert data["section"]["height"] == 0.004 and data["units"]["length"] == "m"

    def test_its_options_are_its_own(self, corpus, tmp_path, capsys):
        net, out = corpus / "unit_m.dxf", ("--out", tmp_path / "toy.json")
        status, _, told = imported(capsys, net, "--as", "toy", *out, *RODS)
        assert status == 2 and "a toy needs --opening" in told
        status, _, told = imported(capsys, net, "--as", "toy", *out, *SHELL, "--held", "corners")
        assert status == 2 and "--held" in told and "it is for drawings of grids" in told
        status, _, told = imported(capsys, net, "--as", "grid", *out, *SHELL)
        assert status == 2 and "--opening" in told
        assert "it is for drawings of C-shells and drawings of toys" in told

    def test_classes_that_are_not_drawn_are_named(self, corpus, tmp_path, capsys):
        del nets.NETS.items["toy"]
        out = ("--out", tmp_path / "toy.json")
        status, _, told = imported(capsys, corpus / "unit_m.dxf", "--as", "toy", *out, *SHELL)
        assert status == 2 and "aren't made of drawings (known: c_shell, grid)" in told


class TestMixedUnits:
    """A surface in millimetres beside a plan in metres gave a nearly flat grid, without a word."""

    @pytest.mark.parametrize("option", ["--surface", "--target"])
    def test_a_mesh_that_says_another_unit_is_converted(self, option, corpus, tmp_path, capsys):
        said = {}
        for unit, scale in (("m", 1.0), ("mm", 1000.0), ("in", 1 / 0.0254)):
            mesh = dome(tmp_path / f"{unit}.obj", scale, turn=np.eye(3))
            mesh.write_text(f"# unit: {unit}\n{mesh.read_text()}")
            out = tmp_path / f"{unit}.json"
            own = ("--as", "grid", *RODS) if option == "--surface" else SHELL
            status, told, _ = imported(
                capsys, corpus / "unit_m.dxf", "--out", out, *own, option, mesh
            )
            assert status == 0 and ("says that it is in" in told) == (unit != "m")
            design = load_design(out)
            said[unit] = (
                design.target.vertices if option == "--surface" else design.target_mesh.vertices
            )
        for unit in ("mm", "in"):
            np.testing.assert_allclose(said[unit], said["m"], rtol=1e-9, atol=1e-9)

    def test_a_surface_far_larger_than_its_net_is_questioned(self, corpus, tmp_path, capsys):
        mesh = dome(tmp_path / "mm.obj", 1000.0)  # and doesn't say so
        out = tmp_path / "grid.json"
        options = ("--as", "grid", *RODS, "--surface", mesh)
        status, told, _ = imported(capsys, corpus / "unit_m.dxf", "--out", out, *options)
        assert status == 0 and "times as large as the net: is it in the drawing's unit?" in told


def test_a_target_of_several_pieces_is_pointed_out(tmp_path, capsys):
    """Joints went to whichever of two sheets was nearest, without a word."""
    net = [f"v {a} {k} 0\nv {b} {k} 0" for k in range(3) for a, b in ((-0.2, 2.2),)]
    net += [f"v {k} {a} 0\nv {k} {b} 0" for k in range(3) for a, b in ((-0.2, 2.2),)]
    lines = "\n".join([*net, *(f"l {2 * k + 1} {2 * k + 2}" for k in range(6))])
    (tmp_path / "net.obj").write_text(lines + "\n")
    sheet = "v -1 -1 {0}\nv 3 -1 {0}\nv 3 3 {0}\nv -1 3 {0}\n"
    for name, sheets in (("one.obj", [0.0]), ("two.obj", [0.0, 0.1])):
        faces = [f"f {4 * k + 1} {4 * k + 2} {4 * k + 3} {4 * k + 4}\n" for k in range(len(sheets))]
        (tmp_path / name).write_text("".join([*map(sheet.format, sheets), *faces]))
        out = tmp_path / f"{name}.json"
        options = ("--target", tmp_path / name, "--opening", "35deg", *RODS, "--out", out)
        status, told, _ = imported(capsys, tmp_path / "net.obj", *options)
        assert status == 0 and ("two.obj is in 2 pieces" in told) == (name == "two.obj")
