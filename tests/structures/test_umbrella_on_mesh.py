"""Umbrella designs on surfaces from files, by the function and the command."""

import json

import numpy as np
import pytest
import trimesh

from kop_exudyn.cli import main
from kop_exudyn.errors import InputError
from kop_exudyn.io.designs import load_design
from kop_exudyn.structures.umbrella.generator import height_field
from kop_exudyn.structures.umbrella.on_mesh import umbrella_on_mesh


def dome(n: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """A paraboloid over 0.9 x 0.9, in metres."""
    return height_field(lambda x, y: -(x**2 + y**2) / 0.7, 0.9, n)


@pytest.fixture
def surface(tmp_path):
    path = tmp_path / "dome.ply"
    trimesh.Trimesh(*dome()).export(path)
    return path


def test_the_command_writes_a_design_that_opens_into_the_surface(surface, tmp_path, capsys):
    out = tmp_path / "design.json"
    assert (
        main(
            [
                "import",
                str(surface),
                "--patch",
                "hexagon,1",
                "--out",
                str(out),
                "--scale",
                "1000",
                "--density",
                "9e-10",
            ]
        )
        == 0
    )
    design = load_design(out)
    assert design.name == "dome" and design.mesh.n_cells == 6 and design.arms.density == 9e-10
    assert design.deployed.stable
    x, y, z = design.target.vertices.T
    np.testing.assert_allclose(z, -(x**2 + y**2) / 700, atol=0.01)


def test_compas_meshes_give_the_same_design(surface, write_json_file):
    vertices, faces = dome()
    compas = write_json_file(
        "dome.json",
        {
            "dtype": "compas.datastructures/Mesh",
            "data": {
                "vertex": {str(k): dict(zip("xyz", x)) for k, x in enumerate(vertices.tolist())},
                "face": {str(k): face for k, face in enumerate(faces.tolist())},
            },
        },
    )
    found = [
        umbrella_on_mesh("a", path, ("triangle", [3]), scale=1000.0) for path in (compas, surface)
    ]
    np.testing.assert_allclose(found[0]["lengths"], found[1]["lengths"], rtol=1e-3)


@pytest.mark.parametrize(
    "options, message",
    [
        ((), "an umbrella mesh on a surface needs --patch"),
        (("--patch", "circle,3"), "--patch = 'circle': unknown shape"),
        (("--patch", "hexa,3"), "did you mean 'hexagon'?"),
        (("--patch", "hexagon,2", "--unit", "m"), "umbrella meshes are laid out in mm"),
        (("--patch", "hexagon,2", "--layer", "a"), "--layer: isn't for this import"),
        (("--patch", "hexagon,2", "--elastic-limit", "1,2,3"), "expected one limit, or"),
        (
            ("--patch", "hexagon,3,4"),
            "--patch = [3, 4]: a hexagon needs 1 positive number of cells",
        ),
        (("--patch", "hexagon,500"), "2000 in all at most"),
        # metres taken for millimetres
        (("--patch", "hexagon,2"), "the base mesh reaches beyond the surface"),
        (("--patch", "hexagon"), "expected SHAPE,N or SHAPE,M,N"),
        (
            ("--as", "c_shell"),
            "--as = 'c_shell': can't be made of this file: expected .obj or .dxf",
        ),
    ],
)
def test_mistakes(options, message, surface, tmp_path, capsys):
    try:
        status = main(["import", str(surface), "--out", str(tmp_path / "out.json"), *options])
    except SystemExit as end:
        status = end.code
    error = capsys.readouterr().err
    assert status == 2 and message in error and error.count("\n") == 1
    assert not (tmp_path / "out.json").exists()


def test_closed_surfaces_are_refused(tmp_path):
    path = tmp_path / "ball.ply"
    trimesh.creation.icosphere(2).export(path)
    with pytest.raises(InputError, match="in one piece with exactly one border"):
        umbrella_on_mesh("a", path, ("hexagon", [1]), scale=1000.0)


def test_rigid_plates_and_their_edge(surface, write_json_file):
    data = umbrella_on_mesh(
        "a", surface, ("hexagon", [1]), scale=1000.0, plate_edge=25.0, plate_model="rigid"
    )
    assert data["plate_model"] == "rigid"
    assert load_design(
        write_json_file("a.json", json.loads(json.dumps(data)))
    ).mesh.plate_edge == pytest.approx(25.0)
