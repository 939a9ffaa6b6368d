"""Umbrella meshes that stand on pins."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest

from kop_exudyn.equilibrium.exudyn_confirm import confirm
from kop_exudyn.equilibrium.newton import NewtonOptions, solve
from kop_exudyn.equilibrium.system import System
from kop_exudyn.errors import InputError, SimulationFailure
from kop_exudyn.files.documents import check_schema
from kop_exudyn.geometry.extent import size_of_points
from kop_exudyn.scene.actuators import LinearActuators
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.search.weights import Weights
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.umbrella.generator import (
    design_on_surface,
    height_field,
    hexagon_patch,
    parallelogram_patch,
    triangle_patch,
)
from kop_exudyn.structures.umbrella.layout import BaseMesh
from kop_exudyn.structures.umbrella.pins import corner_joints

EDGE = 30 + 3 * np.sqrt(3)


def bowl() -> dict:
    """Six cells around a point, over a paraboloid, on three pins."""
    vertices, faces = height_field(lambda x, y: -(x**2 + 0.6 * y**2) / 500, 600.0, 16)
    data = design_on_surface("bowl", BaseMesh(*hexagon_patch(1, EDGE)), vertices, faces)
    return data | {"pins": {"joints": [0, 2, 4]}}


@pytest.fixture(scope="module", params=["rods", "rigid"])
def design(request):
    return design_from_dict(bowl() | {"plate_model": request.param})


@pytest.fixture(scope="module")
def deployed(design):
    return design.deploy()["deployed"]


def test_pin_places_are_parameters_of_no_element(design):
    assert len(design.parameters) == 12 + 9
    assert design.free.tolist() == list(range(12, 21))
    places = design.mesh.target.crossings[[0, 2, 4]]
    assert np.array_equal(design.parameters[12:].reshape(3, 3), places)
    reach = 0.1 * size_of_points(places)
    assert np.allclose(design.upper[12:] - design.parameters[12:], reach)
    assert np.allclose(design.parameters[12:] - design.lower[12:], reach)
    assert design.free_scale == pytest.approx(np.median(design.mesh.lengths))


def test_pinned_joints_are_where_they_should_be(design, deployed):
    assert deployed.stable
    assert np.allclose(
        deployed.state.positions[design.joints[[0, 2, 4]]], design.mesh.target.crossings[[0, 2, 4]]
    )
    assert design.systems["deployed"].scene.pinned.sum() == 0


def test_exudyn_refuses_other_pins_plates_and_heights(design, deployed):
    """The right state of this mesh, offered as that of another one."""
    scene = design.scene()
    assert confirm(scene, deployed).gaps["pin"] < 1e-12
    q = design.parameters.copy()
    q[12] += 1e-3
    with pytest.raises(SimulationFailure, match="pin is off by"):
        confirm(scene, deployed, q=q)
    away = deployed.state.transformed(np.eye(3), np.array([0.0, scene.size, 0.0]))
    with pytest.raises(SimulationFailure, match="pin is off by"):
        confirm(scene, replace(deployed, state=away))
    actuators = scene.terms[0]
    higher = LinearActuators(
        actuators.top,
        actuators.bottom,
        1.001 * actuators.spacing,
        actuators.weight,
        extension=actuators.extension,
        shear=actuators.shear,
    )
    with pytest.raises(SimulationFailure, match="moved the state"):
        confirm(scene.with_terms(higher), deployed)
    if design.plate_model == "rods":
        stiffness = scene.stiffness.copy()
        plates = scene.length_parameter < 0
        stiffness[plates] *= 1.001
        with pytest.raises(SimulationFailure, match="moved the state"):
            confirm(replace(scene, stiffness=stiffness), deployed)
    else:
        offset = scene.node_offset.copy()
        offset[scene.node_hinge < 0] *= 1.0001  # where the plates' middles are
        centre = scene.hinge_centre * 1.0001
        with pytest.raises(SimulationFailure, match="moved the state"):
            confirm(replace(scene, node_offset=offset, hinge_centre=centre), deployed)


@pytest.mark.parametrize("plate_model", ["rods", "rigid"])
def test_a_mesh_without_pins_is_held_at_places_of_its_target(plate_model):
    """Six coordinates of three X joints, which carry no force: without them, nothing changes."""
    content = {key: value for key, value in bowl().items() if key != "pins"}
    design = design_from_dict(content | {"plate_model": plate_model})
    deployed = design.deploy()["deployed"]
    scene, anchor = design.scene(), design.anchor
    x = deployed.state.positions[design.joints]
    assert scene.pinned.sum() == 6 and len(set(anchor.joints.tolist())) == 3
    assert np.allclose(x[anchor.joints, anchor.axes], anchor.values, rtol=0, atol=1e-9 * scene.size)
    target = design.mesh.target.crossings[anchor.joints, anchor.axes]
    assert np.array_equal(anchor.values, target)
    gradient = np.zeros(scene.n_dofs)
    system = System(scene.with_pins(np.zeros(scene.n_dofs, bool)))
    system.set_parameters(design.parameters)
    system.assemble(deployed.state)
    gradient[system.sparsity.free] = system.gradient[: system.n_unknowns]
    assert np.abs(gradient).max() < 1e-7 * system.force_scale()[0] * scene.length_scale
    confirm(scene, deployed)
    away = deployed.state.transformed(np.eye(3), np.array([0.0, 0.0, scene.size]))
    with pytest.raises(SimulationFailure, match="pin is off by"):
        confirm(scene, replace(deployed, state=away))


def test_the_mesh_is_laid_on_its_pins_wherever_they_are(design, deployed):
    q = design.parameters.copy()
    turn = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
    q[12:] = (q[12:].reshape(3, 3) @ turn.T + [100, 200, 300]).ravel()
    moved = design.deploy(q)["deployed"]
    assert moved.elastic_energy == pytest.approx(deployed.elastic_energy, rel=1e-8)
    assert np.allclose(
        moved.state.positions, deployed.state.positions @ turn.T + [100, 200, 300], atol=1e-5
    )


def test_exudyn_confirms_the_pinned_state(design, deployed):
    confirmation = confirm(design.scene(), deployed)
    assert confirmation.moved < 1e-8 and confirmation.residual < 1e-7


def test_gradient_of_the_objective_in_lengths_and_pins(design):
    """By central differences of states solved anew, at a point where the fit matters as much as the
    energy."""
    objective = DesignObjective(design, Weights(fit=1e3, energy=0.5))
    q = design.parameters + 0.3 * np.sin(np.arange(len(design.parameters)))
    derivatives = objective.derivatives(objective.evaluate(q))
    at = derivatives.evaluation
    for part in (slice(0, 12), slice(12, 21)):
        direction = np.zeros(len(q))
        direction[part] = np.cos(np.arange(len(q)))[part]
        values = []
        for step in (1e-3, -1e-3):
            state = solve(
                System(design.scene()),
                q + step * direction,
                at.equilibria["deployed"],
                options=NewtonOptions(tolerance=1e-12),
            )
            values.append(objective.judge(q + step * direction, {"deployed": state}).value)
        assert (values[0] - values[1]) / 2e-3 == pytest.approx(
            derivatives.gradient @ direction, rel=1e-5
        )
    assert np.allclose(derivatives.hessian, derivatives.hessian.T)


def test_other_plates_keep_the_pins(design):
    other = design.with_plates("rods" if design.plate_model == "rigid" else "rigid")
    assert other.pins is design.pins and np.array_equal(
        other.parameters[12:], design.parameters[12:]
    )
    assert other.least_length == design.least_length


@pytest.mark.parametrize(
    "patch, pins",
    [
        (hexagon_patch(2, EDGE), 6),
        (triangle_patch(4, EDGE), 3),
        (parallelogram_patch(3, 4, EDGE), 4),
    ],
)
def test_corners_are_the_outlines_convex_ones(patch, pins):
    base = BaseMesh(*patch)
    found = corner_joints(base)
    assert len(found) == pins
    middle, all_joints = (
        base.vertices.mean(axis=0),
        np.linalg.norm(base.midpoints - base.vertices.mean(axis=0), axis=1),
    )
    assert np.linalg.norm(base.midpoints[found] - middle, axis=1).min() > np.median(all_joints)


def test_places_may_be_given():
    data = bowl()
    places = (np.array(data["target"]["crossings"])[[0, 2, 4]] + 1.0).tolist()
    data["pins"] = {"joints": [0, 2, 4], "positions": places}
    check_schema(data, "umbrella")
    assert np.array_equal(design_from_dict(data).parameters[12:], np.ravel(places))


@pytest.mark.parametrize(
    "pins, field",
    [
        ({"joints": [0, 1]}, "pins.joints"),
        ({"joints": [0, 1, 1]}, "pins.joints"),
        ({"joints": [0, 1, 6]}, "pins.joints"),
        ({"joints": [0, 1, 2], "positions": [[0, 0, 0], [1, 0, 0]]}, "pins.positions"),
        ({"joints": [0, 1, 2], "positions": [[0, 0, 0], [1, 0, 0], [3, 0, 0]]}, "pins.positions"),
    ],
)
def test_wrong_pins_are_refused_with_the_field(pins, field):
    with pytest.raises(InputError, match=field):
        design_from_dict(bowl() | {"pins": pins}, "file.json")


def test_pins_without_target_need_places():
    data = copy.deepcopy(bowl())
    del data["target"]
    with pytest.raises(InputError, match="pins.positions"):
        design_from_dict(data, "file.json")
