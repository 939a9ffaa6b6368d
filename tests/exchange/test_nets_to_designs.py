"""`kop import` of drawn nets: designs of C-shells and grids."""

import json

import ezdxf
import numpy as np
import pytest
from support.drawn import OPTIONS, saved

from kop_exudyn.cli import main
from kop_exudyn.io.designs import load_design


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
            ((*OPTIONS, "--opening", "35"), "if degrees are meant, write 35deg"),
            ((*OPTIONS[2:], "--as", "grid", "--held", "edge"), "a grid needs --surface"),
            (
                (*OPTIONS, "--opening", "wide"),
                "expected an angle in radians, or as 35deg, got 'wide'",
            ),
            ((*OPTIONS, "--scale", "0"), "expected a positive number"),
            ((*OPTIONS, "--edges", "--layer", "laths"), "--layer = 'laths': edges are read of all"),
            (("--preview", "p.pdf"), "--preview = 'p.pdf': expected a name that ends in .html"),
            (("--out", "net.txt"), "expected a name that ends in .json or .json.gz"),
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
