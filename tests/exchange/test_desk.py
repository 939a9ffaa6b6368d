"""The folder for the desk, read back by the programs' own libraries."""

import copy
import csv
from dataclasses import replace

import compas
import meshio
import numpy as np
import pytest
import rhino3dm
import trimesh
from support.settings import ONE_STEP

from kop_exudyn.analysis.simulation import simulate
from kop_exudyn.errors import InputError
from kop_exudyn.exchange.export import (
    DESK_FORMATS,
    all_labels,
    available_formats,
    export_desk,
    export_simulation,
)
from kop_exudyn.exchange.gltf import common_origin, glb_bytes
from kop_exudyn.exchange.states import states_of_kit, states_of_simulation
from kop_exudyn.exchange.vtk import write_vtu
from kop_exudyn.fabrication.pieces import parts_list_of
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings
from kop_exudyn.structures.fitting import Placement
from kop_exudyn.structures.loads import LoadCase
from kop_exudyn.units import Units

MM = Units("mm", "N")


@pytest.fixture(scope="module")
def result(shells):
    """One accepted step a stage: the files don't need more."""
    settings = JobSettings(jobs=1, baselines=False, stages=ONE_STEP)
    return optimize_kit(shells, {"linear": 3, "angular": 2}, settings=settings)


@pytest.fixture(scope="module")
def folder(result, tmp_path_factory):
    folder = tmp_path_factory.mktemp("desk")
    files = export_desk(result, folder)
    assert {path.name for path in files} == {path.name for path in folder.iterdir()}
    return folder


@pytest.fixture(scope="module")
def state(result):
    """The deployed state of the first design."""
    target = result.references[0].target
    outcome = result.stages["assigned"].designs[0]
    return next(iter(states_of_kit(parts_list_of(result), 0, outcome, target)))


def read(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_everything_is_there(folder):
    assert available_formats() == DESK_FORMATS
    names = {path.name for path in folder.iterdir()}
    for name in ("first", "second"):
        for role in ("deployed", "rest"):
            for suffix in ("obj", "ply", "glb", "vtu", "compas.json"):
                assert f"{name}_assigned_{role}.{suffix}" in names
        assert {f"{name}_assigned.3dm", f"{name}_assigned_target.obj"} <= names
    assert {f"{table}.csv" for table in ("designs", "elements", "joints", "rods", "parts")} <= names


def test_states_lie_where_their_joints_fit_the_target(result, state):
    fit = result.summary("assigned", 0)["fit"]
    assert np.nanmax(state.deviations) == pytest.approx(fit["pieces_max"])
    joints = state.placement.apply(state.equilibrium.state.positions[state.design.joints])
    rows = [r for r in read_joints(result) if r["design"] == "first" and r["stage"] == "assigned"]
    np.testing.assert_allclose(joints, [[r["x"], r["y"], r["z"]] for r in rows])


def read_joints(result):
    from kop_exudyn.exchange.result_tables import result_tables

    return result_tables(result)["joints"]


def test_glb_is_in_metres_with_y_up_and_knows_every_rod(folder, state):
    scene = trimesh.load(folder / "first_assigned_deployed.glb")
    rods = {name: mesh for name, mesh in scene.geometry.items() if not mesh.metadata.get("target")}
    assert len(rods) == len(state.scene.chains) and len(scene.geometry) == len(rods) + 1
    for mesh in rods.values():
        assert {"design", "state", "part", "element", "utilisation"} <= set(mesh.metadata)
    assert {mesh.metadata["part"] for mesh in rods.values()} <= {"L1", "L2", "L3"}
    solids = scene.to_mesh() if hasattr(scene, "to_mesh") else scene.to_geometry()
    extent = np.ptp(state.points, axis=0)[[0, 2, 1]]
    np.testing.assert_allclose(np.ptp(solids.vertices, axis=0), extent, atol=0.05)
    volume = sum(mesh.volume for mesh in rods.values())
    q = state.equilibrium.q
    assert volume == pytest.approx(state.scene.rest_lengths(q).sum() * 0.03 * 0.004, rel=0.01)


def test_states_of_a_design_far_away_are_moved_alike(state, tmp_path):
    """Each was moved by its own middle: beside each other they were centimetres apart."""
    fields = {"name": "far", "units": MM, "beside_target": True, "joints": state.design.joints}
    there = type("Named", (), fields | {"origin": np.array([5e7, 5e7, 0.0])})()
    states = [replace(state, design=there, target=None, name=name) for name in ("one", "other")]
    turned = Placement(np.diag([1.0, -1.0, -1.0]), np.zeros(3))
    states[1] = replace(states[1], placement=turned)
    origin = common_origin(states)
    assert np.abs(origin - [5e7, 5e7, 0.0]).max() < 1e4 and (common_origin([state]) == 0).all()
    for one in states:
        data = glb_bytes([one], origin=origin)
        scene = trimesh.load(trimesh.util.wrap_as_stream(data), file_type="glb")
        edge = scene.graph.transforms.edge_data[(scene.graph.base_frame, "origin")]
        np.testing.assert_allclose(edge["metadata"]["origin_metres"], origin / 1000)


def test_glb_of_millimetres_far_away_keeps_its_digits(state):
    """A vault in millimetres, 50 km from the origin: single precision would keep 4 mm."""
    far = np.array([3.0e7, 4.0e7, 100.0])
    fields = {"name": "far", "units": MM, "beside_target": True, "joints": state.design.joints}
    there, here = (type("Named", (), fields | {"origin": at})() for at in (far, np.zeros(3)))
    moved = replace(state, design=there, target=None)
    scene = trimesh.load(trimesh.util.wrap_as_stream(glb_bytes([moved])), file_type="glb")
    points = np.concatenate([mesh.vertices for mesh in scene.geometry.values()])
    assert np.abs(points).max() < 10.0
    near = replace(moved, design=here)
    scene_near = trimesh.load(trimesh.util.wrap_as_stream(glb_bytes([near])), file_type="glb")
    other = np.concatenate([mesh.vertices for mesh in scene_near.geometry.values()])
    np.testing.assert_allclose(np.ptp(points, axis=0), np.ptp(other, axis=0), atol=1e-5)
    root = scene.graph.get("origin")[0]
    np.testing.assert_allclose(np.linalg.norm(root[:3, :3], axis=0), 1e-3)  # millimetres
    data = scene.graph.transforms.edge_data[(scene.graph.base_frame, "origin")]
    np.testing.assert_allclose(data["metadata"]["origin_metres"], far / 1000, atol=2e-3)


def test_vtu_read_by_meshio(folder, state, result):
    found = meshio.read(folder / "first_assigned_deployed.vtu")
    eq = state.equilibrium
    np.testing.assert_allclose(found.points, state.points)
    np.testing.assert_array_equal(found.cells_dict["line"], state.scene.elements)
    fields = {name: values[0] for name, values in found.cell_data.items()}
    np.testing.assert_array_equal(fields["My"], eq.stress[:, 4])
    np.testing.assert_array_equal(fields["utilisation"], state.strength.utilisation)
    strains = ("stretch", "shear_y", "shear_z", "twist", "curvature_y", "curvature_z")
    resultants = ("N", "Qy", "Qz", "Mt", "My", "Mz")
    work = sum(fields[s] * fields[r] for s, r in zip(strains, resultants))
    energy = 0.5 * np.sum(fields["rest_length"] * work)
    assert energy == pytest.approx(eq.elastic_energy, rel=1e-9)
    np.testing.assert_allclose(np.linalg.norm(found.point_data["tangent"], axis=1), 1)
    np.testing.assert_array_equal(found.point_data["deviation"], state.deviations)
    labels = all_labels(parts_list_of(result))
    numbers = {row["number"]: row["part"] for row in read(folder / "parts.csv")}
    for rod, part in zip(fields["rod"], fields["part"]):
        assert numbers[str(part)] == labels[part - 1] == state.parts[rod]


def test_a_vtu_file_says_its_units(state, tmp_path):
    """Kilonewtons and millimetres; none where the design names none."""
    for units, deviation, moment in (
        (Units("mm", "kN"), "deviation [mm]", "My [kN mm]"),
        (Units("ft", "kip"), "deviation [ft]", "My [kip ft]"),
        (None, "deviation", "My"),
    ):
        other = copy.copy(state.design)
        other.units = units
        path = write_vtu(tmp_path / "a.vtu", replace(state, design=other), overwrite=True)
        found = meshio.read(path)
        assert deviation in found.point_data and moment in found.cell_data
        assert "stretch" in found.cell_data  # has no unit
        said = {} if units is None else {f"metres_per_{units.length}": units.metres}
        assert said.items() <= found.field_data.items()
        assert bool(found.field_data) == (units is not None)
        # in squares as plain letters: colour bars of other programs lack raised ones
        assert all(name.isascii() for name in found.cell_data)


def test_obj_has_a_group_for_every_rod_and_the_target_a_file(folder, state):
    text = (folder / "first_assigned_deployed.obj").read_text().splitlines()
    groups = [line[2:] for line in text if line.startswith("g ")]
    assert groups == ["_".join(name.split()) for name in state.names]
    assert len(set(groups)) == len(groups) and groups[0].startswith("L")
    target = trimesh.load(folder / "first_assigned_target.obj", process=False)
    assert len(target.faces) == len(state.target.faces)
    unit = state.design.units and state.design.units.length
    said = [line for line in text if line.startswith("#")]
    assert said == ([] if unit is None else [f"# unit: {unit}"])


def test_rhino_file_has_layers_by_part_and_user_text(folder, state):
    model = rhino3dm.File3dm.Read(str(folder / "first_assigned.3dm"))
    layers = [layer.FullPath for layer in model.Layers]
    for part in set(state.parts):
        assert f"first deployed::{part}" in layers
    assert "first deployed::target" in layers and "first rest::joints" in layers
    names = [layer.FullPath for layer in model.Layers]
    axes = [o for o in model.Objects if isinstance(o.Geometry, rhino3dm.PolylineCurve)
            and names[o.Attributes.LayerIndex].startswith("first deployed")]  # fmt: skip
    assert len(axes) == len(state.lines)
    for line, found, part in zip(state.lines, axes, state.parts):
        own = found.Geometry
        points = [own.Point(k) for k in range(own.PointCount)]
        np.testing.assert_allclose([[p.X, p.Y, p.Z] for p in points], line, atol=1e-12)
        assert names[found.Attributes.LayerIndex] == f"first deployed::{part}"
        assert found.Attributes.GetUserString("part") == part
        assert float(found.Attributes.GetUserString("utilisation")) > 0
    meshes = [o for o in model.Objects if isinstance(o.Geometry, rhino3dm.Mesh)]
    assert len(meshes) == 2 * len(axes) + 1


def test_compas_reads_graph_and_mesh(folder, state):
    data = compas.json_load(folder / "first_assigned_deployed.compas.json")
    graph, mesh = data["graph"], data["mesh"]
    assert graph.number_of_edges() == len(state.scene.chains)
    joints = {graph.node_attribute(n, "joint") for n in graph.nodes()} - {None}
    assert joints == set(range(1, len(state.design.joints) + 1))
    lengths = sorted(graph.edge_length(edge) for edge in graph.edges())
    straight = [np.linalg.norm(line[-1] - line[0]) for line in state.lines]
    np.testing.assert_allclose(lengths, sorted(straight), rtol=1e-9)
    parts = {graph.edge_attribute(edge, "part") for edge in graph.edges()}
    assert parts == set(state.parts)
    assert mesh.number_of_faces() > 4 * len(state.scene.elements)
    assert data["target"].number_of_faces() == len(state.target.faces)


def test_a_design_alone_with_its_loaded_state(shells, tmp_path):
    """No kit: elements have numbers, no parts; the state under loads is there as well."""
    design = shells[0]
    loads = LoadCase(joints=[1], forces=[[0.0, 0.0, -0.5]])
    result = simulate(design, loads)
    files = {p.name for p in export_simulation(result, tmp_path, formats=["vtu", "csv", "3dm"])}
    assert files == {f"first_{state}.vtu" for state in ("deployed", "rest", "loaded")} | {
        "first.3dm",
        "first_rods.csv",
        "READ_ME.txt",
    }
    rows = read(tmp_path / "first_rods.csv")
    assert {row["state"] for row in rows} == {"deployed", "rest", "loaded"}
    assert all(row["part"] == "" and int(row["element"]) > 0 for row in rows)
    loaded, free = (
        np.array([[float(r["My"]), float(r["Mz"])] for r in rows if r["state"] == state])
        for state in ("loaded", "deployed")
    )
    assert np.abs(loaded - free).max() > 1e-3
    names = [state.name for state in states_of_simulation(result)]
    assert names == ["deployed", "rest", "loaded"]


def test_unknown_formats_and_stages_are_refused(result, folder):
    with pytest.raises(InputError, match="formats"):
        export_desk(result, folder, formats=["stl"], overwrite=True)
    with pytest.raises(InputError, match="stage"):
        export_desk(result, folder, stage="final", overwrite=True)
    with pytest.raises(InputError, match="exists already"):
        export_desk(result, folder, formats=["obj"])
