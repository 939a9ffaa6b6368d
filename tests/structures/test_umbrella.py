"""Umbrella meshes of our own layout, without released data."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from kop_exudyn.equilibrium.exudyn_confirm import confirm
from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.equilibrium.sensitivities import Sensitivities
from kop_exudyn.equilibrium.system import System
from kop_exudyn.errors import InputError
from kop_exudyn.exchange.meshes import sweep
from kop_exudyn.fabrication.pieces import DesignPieces
from kop_exudyn.fabrication.placement import PlacedPieces
from kop_exudyn.files.documents import check_schema
from kop_exudyn.geometry.extent import size_of_points
from kop_exudyn.report.viewer_scenes import design_scene
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.fitting import best_placement
from kop_exudyn.structures.umbrella.design import Umbrella
from kop_exudyn.structures.umbrella.layout import BaseMesh, Plates, umbrella_mesh

EDGE = 30 + 3 * np.sqrt(3)


def hexagon() -> dict:
    """A valid design file: six cells around a point."""
    turn = np.arange(6) * np.pi / 3
    corners = EDGE * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return {
        "format": "kop_exudyn/design",
        "version": 1,
        "class": "umbrella",
        "name": "hexagon",
        "base": {
            "vertices": [[0.0, 0.0], *corners.tolist()],
            "faces": [[0, k, k % 6 + 1] for k in range(1, 7)],
            "flipped": False,
        },
        "lengths": [[34.0 + k, 36.0] for k in range(6)],
        "plates": {"arm_position": 10.0, "thickness": 3.0, "width": 5.0, "spacing": 15.0},
        "materials": {
            "arms": {"young": 1400.0, "poisson": 0.35},
            "plates": {"young": 14000.0, "poisson": 0.35},
        },
    }


@pytest.fixture(scope="module", params=["rods", "rigid"])
def design(request) -> Umbrella:
    return design_from_dict(hexagon() | {"plate_model": request.param})


@pytest.fixture(scope="module")
def deployed(design):
    return design.deploy()["deployed"]


def test_the_hexagon_has_six_cells_and_six_inner_edges(design):
    mesh = design.mesh
    assert (mesh.n_cells, len(mesh.crossings), np.count_nonzero(mesh.rods.arms)) == (6, 6, 24)
    assert design.parameters.tolist() == pytest.approx(np.ravel(hexagon()["lengths"]))
    assert mesh.plate_edge == pytest.approx(30)
    assert design.lower.min() == pytest.approx(32)
    assert design.groups[0].kind == "cell" and design.groups[0].indices[2].tolist() == [4, 5]
    assert np.allclose(mesh.positions[mesh.crossings][:, 2], 0)


def test_arms_meet_the_x_joints_upright_and_have_their_length(design):
    mesh = design.mesh
    ends, rods = mesh.rod_ends[mesh.rods.arms], mesh.rods
    span = ends[:, 1] - ends[:, 0]
    assert np.abs(span[:, :2]).max() < 1e-12
    assert np.linalg.norm(span, axis=1) == pytest.approx(
        mesh.lengths[rods.cells[rods.arms], rods.sides[rods.arms]]
    )


@pytest.mark.parametrize("factor", [1.0, 1.2])
def test_the_compact_state_is_unstressed_for_any_lengths(design, factor):
    model, q = design.model, factor * design.parameters
    system = System(model.scene)
    system.set_parameters(q)
    assert system.assemble(model.compact(q, 0.0)).elastic < 1e-20 * model.scene.stiffness.max()


def test_deployed_state_is_stable_and_opens_every_cell(design, deployed):
    assert deployed.stable and deployed.residual < 1e-8
    assert design.spacings(deployed.state) == pytest.approx(15.0, rel=0.05)
    opened = deployed.state.angles
    assert (opened > 0).all() and (opened < np.pi).all()
    assert design.report_positions(deployed.state).shape == design.mesh.positions.shape


def test_plates_are_rigid_bodies_or_nearly_so(design, deployed):
    rods, x = design.mesh.rods, design.report_positions(deployed.state)
    first = rods.joints[~rods.arms]
    before = np.linalg.norm(np.diff(design.mesh.positions[first], axis=1), axis=2)
    after = np.linalg.norm(np.diff(x[first], axis=1), axis=2)
    assert np.abs(after / before - 1).max() < (1e-2 if design.plate_model == "rods" else 1e-12)


def test_rigid_plates_are_the_limit_of_stiff_ones():
    """The distance of the joints from those between rigid plates falls as one over the plates'
    modulus."""
    rigid = design_from_dict(hexagon() | {"plate_model": "rigid"})
    eq = rigid.deploy()["deployed"]
    wanted, apart, less = rigid.report_positions(eq.state), [], []
    for stiffer in (100, 1000):
        data = hexagon()
        data["materials"]["plates"]["young"] *= stiffer
        design = design_from_dict(data)
        found = design.deploy()["deployed"]
        x = design.report_positions(found.state)
        apart.append(
            np.abs(best_placement(x, wanted, np.full(len(x), 1 / len(x))).apply(x) - wanted).max()
        )
        less.append(eq.elastic_energy - found.elastic_energy)
    assert apart[1] < 1e-4 and apart[0] / apart[1] == pytest.approx(10, rel=0.1)
    assert less[0] / less[1] == pytest.approx(10, rel=0.1)


def test_rigid_plates_have_six_unknowns(design):
    mesh = design.mesh
    plates, arms, crossings = (
        mesh.centres.size,
        np.count_nonzero(mesh.rods.arms),
        len(mesh.crossings),
    )
    inner = 2 * arms  # bodies inside arms of three elements
    joints = plates + arms + crossings if design.plate_model == "rods" else plates + crossings
    assert design.systems["deployed"].n_unknowns == 6 * (joints + inner) - 6 + np.count_nonzero(
        mesh.hinged
    )


def test_rigid_plates_are_drawn(design, deployed):
    solid = sweep(design.scene(), deployed.state)
    assert len(solid.faces) > 0 and (np.count_nonzero(solid.elements < 0) > 0) == (
        design.plate_model == "rigid"
    )
    pieces = PlacedPieces(DesignPieces(design, ()), design.scene())
    assert len(pieces.chain_pieces) == len(design.mesh.rods.joints) == len(design.scene().chains)
    rows = {len(chains) for chains in pieces.chains.values()}
    assert rows == {2} and len(pieces.chains) == 12
    page = design_scene(design, {"deployed": deployed})
    assert np.isfinite(page.designs[0].states[0].positions).all()


def test_exudyn_confirms_the_final_state(design, deployed):
    confirmation = confirm(design.scene(), deployed)
    assert confirmation.moved < 1e-8 and confirmation.residual < 1e-8


def test_sensitivities_are_those_of_resolved_states(design, deployed):
    sensitivities = Sensitivities(design.systems["deployed"], deployed)
    direction = np.cos(np.arange(len(design.parameters)))
    rate = sensitivities.positions(design.joints) @ direction
    energy_rate = sensitivities.energy_gradient @ direction
    step = 1e-4
    states = [
        solve(System(design.scene()), deployed.q + s * direction, deployed) for s in (step, -step)
    ]
    moved = (states[0].state.positions - states[1].state.positions)[design.joints].ravel() / (
        2 * step
    )
    assert np.allclose(moved, rate, atol=1e-4 * np.abs(rate).max())
    energy = (states[0].elastic_energy - states[1].elastic_energy) / (2 * step)
    assert energy == pytest.approx(energy_rate, rel=1e-4)


def test_a_mesh_without_a_target_is_compared_with_its_own_deployed_shape(design):
    target = design.target
    assert np.allclose(target.positions, design.deployed.state.positions[design.joints])
    assert len(target.faces) == 6 and len(target.vertices) == 12
    assert target.size == pytest.approx(size_of_points(target.vertices))


def test_swapping_top_and_bottom_turns_the_structure_upside_down(design, deployed):
    """A half turn about the y axis maps the mesh to itself, X axes included: cell k to 2 - k, top
    to bottom."""
    lengths = design.mesh.lengths[(2 - np.arange(6)) % 6, ::-1]
    turned = design_from_dict(
        hexagon() | {"plate_model": design.plate_model, "lengths": lengths.tolist()}
    )
    assert turned.deploy()["deployed"].elastic_energy == pytest.approx(
        deployed.elastic_energy, rel=1e-6
    )


@pytest.mark.parametrize("unit", [0.001, 25.4])
def test_the_deployed_shape_does_not_depend_on_the_unit_of_length(deployed, design, unit):
    data = hexagon() | {"plate_model": design.plate_model}
    data["base"]["vertices"] = (unit * np.array(data["base"]["vertices"])).tolist()
    data["lengths"] = (unit * np.array(data["lengths"])).tolist()
    data["plates"] = {key: unit * value for key, value in data["plates"].items()}
    scaled = design_from_dict(data).deploy()["deployed"]
    assert np.allclose(scaled.state.angles, deployed.state.angles, atol=1e-6)
    assert scaled.elastic_energy == pytest.approx(unit**3 * deployed.elastic_energy, rel=1e-6)


def test_file_meets_its_schema():
    check_schema(hexagon() | {"plate_model": "rigid"}, "umbrella")


@pytest.mark.parametrize(
    "path, value, field",
    [
        (("base", "faces"), [[0, 1, 9], [0, 2, 3]], "base.faces"),
        (("base", "faces"), [[0, 1, 3], [0, 3, 2]], "base.faces"),
        (("base", "faces"), [[0, 1, 2]], "base.faces"),
        (("base", "vertices"), [[0.0, 0.0, 0.0]] * 7, "base.vertices"),
        (("lengths",), [[30.0, 30.0]] * 5, "lengths"),
        (("lengths",), [[30.0, -1.0]] * 6, "lengths"),
        (("plates", "arm_position"), 40.0, "plates.arm_position"),
        (("materials", "arms", "young"), -1.0, "young"),
        (("arm_elements",), 0, "arm_elements"),
        (("plate_model",), "soft", "plate_model"),
        (
            ("target",),
            {
                "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
                "faces": [[0, 1, 2]],
                "crossings": [[0, 0, 0]],
                "plates": [[0, 0, 0]] * 6,
            },
            "target.crossings",
        ),
    ],
)
def test_wrong_files_are_refused_with_the_field(path, value, field):
    data = copy.deepcopy(hexagon())
    inner = data
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    with pytest.raises(InputError, match=field):
        design_from_dict(data, "file.json")


def test_missing_fields_are_named():
    data = hexagon()
    del data["lengths"]
    with pytest.raises(InputError, match="lengths"):
        design_from_dict(data, "file.json")


def test_first_cell_decides_which_ones_carry_the_x_axes():
    data = hexagon()["base"]
    plain, flipped = (BaseMesh(data["vertices"], data["faces"], flag) for flag in (False, True))
    assert np.array_equal(plain.cells, flipped.cells[:, ::-1])
    meshes = [umbrella_mesh(base, np.full((6, 2), 35.0), Plates()) for base in (plain, flipped)]
    shift = meshes[0].positions[meshes[0].crossings] - meshes[1].positions[meshes[1].crossings]
    assert np.linalg.norm(shift, axis=1) == pytest.approx(3.0)
