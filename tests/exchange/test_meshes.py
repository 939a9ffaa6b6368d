"""Solids, lines and fields read back by trimesh and meshio, and measured."""

import meshio
import numpy as np
import pytest
import trimesh

from kop_exudyn.errors import InputError
from kop_exudyn.exchange.curve_files import read_drawing
from kop_exudyn.exchange.meshes import sweep, tube
from kop_exudyn.exchange.polygons import write_obj, write_ply
from kop_exudyn.rods.rotations import rotation_z
from kop_exudyn.rods.sections import circle, general, rectangle
from kop_exudyn.scene.builder import SceneBuilder


def rod(section, points, frames=None):
    builder = SceneBuilder()
    bodies = builder.bodies(points, frames)
    builder.rod(builder.nodes(bodies), np.ones(6), length=1.0, section=section)
    return builder.build()


@pytest.fixture(scope="module")
def deployed(shells):
    return shells[0].deploy()


@pytest.mark.parametrize(
    "section",
    [
        rectangle(0.3, 0.1),
        circle(0.2),
        general(
            1, 1, 1, 1, outline=[[0, 0], [0.4, 0], [0.4, 0.1], [0.1, 0.1], [0.1, 0.4], [0, 0.4]]
        ),
    ],
)
def test_straight_rods_are_closed_and_have_their_volume(section):
    scene = rod(section, [[0, 0, 0], [1, 0, 0], [2.5, 0, 0]])
    mesh = sweep(scene, scene.initial)
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    y, z = section.outline.T
    area = 0.5 * np.sum(y * np.roll(z, -1) - np.roll(y, -1) * z)
    assert solid.is_watertight and solid.is_winding_consistent
    assert solid.volume == pytest.approx(2.5 * area)
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [2.5, np.ptp(y), np.ptp(z)])


def test_refined_rods_follow_the_arc_between_nodes():
    """Two nodes whose poses are a quarter turn apart on a circle: rings in between are on it
    too."""
    scene = rod(rectangle(0.1, 0.1), [[0, 0, 0], [1, 1, 0]], rotation_z(np.array([0, np.pi / 2])))
    mesh = sweep(scene, scene.initial, refinement=8)
    middles = mesh.vertices.reshape(-1, 4, 3).mean(axis=1)
    np.testing.assert_allclose(np.linalg.norm(middles - [0, 1, 0], axis=1), 1.0, atol=1e-12)
    assert len(middles) == 9
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert solid.volume == pytest.approx(0.01 * np.pi / 2, rel=0.01)


def test_coarse_and_refined_rods_agree_at_nodes(shells, deployed):
    scene = shells[0].scene("deployed")
    coarse, fine = (sweep(scene, deployed["deployed"].state, refinement=n) for n in (1, 3))
    at_nodes = fine.vertices.reshape(-1, 4, 3)[::3]
    elements = sum(len(chain.elements) for chain in scene.chains)
    assert len(fine.vertices) == 4 * (3 * elements + len(scene.chains))
    np.testing.assert_allclose(at_nodes[:3], coarse.vertices.reshape(-1, 4, 3)[:3], atol=1e-12)


def test_tubes_have_no_holes():
    faces = tube(3, rectangle(1, 1).outline)
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_rods_without_section_are_refused():
    scene = rod(None, [[0, 0, 0], [1, 0, 0]])
    with pytest.raises(InputError, match="section"):
        sweep(scene, scene.initial)
    assert len(sweep(scene, scene.initial, outline=rectangle(1, 1).outline).vertices) == 8


def test_ply_read_by_trimesh_and_meshio(shells, deployed, tmp_path):
    mesh = sweep(shells[0].scene("rest"), deployed["rest"].state)
    colours = np.tile([1.0, 0.0, 0.2], (len(mesh.vertices), 1))
    path = write_ply(tmp_path / "rest.ply", mesh, colours)
    found = trimesh.load(path, process=False)
    np.testing.assert_array_equal(found.vertices, mesh.vertices)
    np.testing.assert_array_equal(
        found.visual.vertex_colors[:, :3], np.tile([255, 0, 51], (len(mesh.vertices), 1))
    )
    again = meshio.read(path)
    np.testing.assert_array_equal(again.cells_dict["triangle"], mesh.faces)
    np.testing.assert_array_equal(again.point_data["rod"], mesh.chains)


def test_obj_lines(shells, deployed, tmp_path):
    lines = shells[0].scene("deployed").polylines(deployed["deployed"].state)
    path = write_obj(tmp_path / "lines.obj", lines)
    text = path.read_text().splitlines()
    vertices = np.array([line.split()[1:] for line in text if line.startswith("v ")], float)
    found = [
        vertices[np.array(line.split()[1:], int) - 1] for line in text if line.startswith("l ")
    ]
    assert len(found) == len(lines)
    for a, b in zip(found, lines):
        np.testing.assert_array_equal(a, b)
    named = write_obj(tmp_path / "named.obj", lines[:2], ["rod 1", "rod 2"]).read_text()
    assert "g rod_1\n" in named
    path = write_obj(tmp_path / "inches.obj", lines, unit="in")
    assert path.read_text().startswith("# unit: in\nv ")
    assert (read_drawing(path).unit, read_drawing(path).metres) == ("in", 0.0254)


@pytest.mark.parametrize(
    "head, unit",
    [
        ("# Rhino\n\n# File units = millimeters\n", "mm"),
        ("# Units: m\n", "m"),
        ("# unit: parsec\n", None),
        ("# united we stand\n", None),
        ("v 0 0 0\n# unit: m\n", None),  # a comment among the elements may be about anything
        ("", None),
    ],
)
def test_units_that_obj_files_say_in_comments(head, unit, tmp_path):
    path = tmp_path / "a.obj"
    path.write_text(f"{head}v 0 0 0\nv 1 0 0\nl -2 -1\n")
    assert read_drawing(path).unit == unit
