"""Orthogonal grids: what is simulated, and the equilibria that they find."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from support.grids import SADDLE, grid_data, isolines, lines

from kop_exudyn.equilibrium.exudyn_confirm import confirm
from kop_exudyn.equilibrium.newton import NewtonOptions, solve
from kop_exudyn.equilibrium.sensitivities import Sensitivities
from kop_exudyn.geometry.extent import size_of_points
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.fitting import TargetFitting


@pytest.fixture(scope="module")
def saddle():
    return design_from_dict(SADDLE)


@pytest.fixture(scope="module")
def deployed(saddle):
    return saddle.deploy()["deployed"]


def test_strong_axes_stand_along_the_surface_normal(saddle):
    scene = saddle.scene()
    state = scene.with_driven(scene.initial, saddle.parameters)
    R = scene.node_poses(state)[1]
    normals = saddle.surface.at(saddle.network.joints).normals
    np.testing.assert_allclose(scene.initial.rotations[saddle.joints][:, :, 2], normals, atol=1e-12)
    stations = np.isin(scene.node_body, saddle.joints)
    body = np.searchsorted(saddle.joints, scene.node_body[stations])
    np.testing.assert_allclose(R[stations][:, :, 2], normals[body], atol=1e-12)
    # bending about y, in the lamella's plane, is the stiff one
    assert scene.stiffness[0, 4] > 50 * scene.stiffness[0, 5]


def test_corners_turn_about_the_lamellas_thin_direction(saddle):
    """Positive angles turn the leaving piece towards the normal."""
    scene = saddle.scene()
    for lamella in saddle.straight.lamellas:
        for number in lamella.numbers.corners:
            hinge = int(np.flatnonzero(scene.driven.parameters == number)[0])
            hinge = int(scene.driven.dofs[hinge]) - 6 * scene.n_bodies
            leave = int(np.flatnonzero(scene.node_hinge == hinge)[0])
            q = saddle.parameters.copy()
            poses = []
            for angle in (0.0, 0.3):
                q[number] = angle
                poses.append(scene.node_poses(scene.with_driven(scene.initial, q))[1][leave])
            before, after = poses
            np.testing.assert_allclose(after[:, 1], before[:, 1], atol=1e-14)
            np.testing.assert_allclose(
                after[:, 0], np.cos(0.3) * before[:, 0] + np.sin(0.3) * before[:, 2], atol=1e-14
            )


def test_the_grid_keeps_to_its_surface_and_exudyn_agrees(saddle, deployed):
    assert deployed.stable and deployed.elastic_energy > 0
    fit = TargetFitting(saddle.target)(deployed.state.positions[saddle.joints])
    assert fit.max_percent < 0.2
    confirmation = confirm(saddle.scene(), deployed)
    assert confirmation.moved < 1e-9


def test_sensitivities_follow_taylor_in_lengths_and_angles(saddle, deployed):
    system = saddle.systems["deployed"]
    options = NewtonOptions(tolerance=1e-12)
    tight = solve(system, saddle.parameters, deployed, options=options)
    sensitivities = Sensitivities(system, tight)
    direction = np.random.default_rng(5).normal(size=len(saddle.parameters)) * 0.02
    slope = float(sensitivities.energy_gradient @ direction)
    curvature = float(direction @ sensitivities.energy_hessian @ direction)
    motion = sensitivities.positions(saddle.joints) @ direction
    x = tight.state.positions[saddle.joints].ravel()
    errors = []
    for h in (0.1, 0.05):
        moved = solve(system, saddle.parameters + h * direction, tight, options=options)
        errors.append(
            (
                abs(
                    moved.elastic_energy
                    - tight.elastic_energy
                    - h * slope
                    - 0.5 * h * h * curvature
                ),
                np.abs(moved.state.positions[saddle.joints].ravel() - x - h * motion).max(),
            )
        )
    assert errors[0][0] / errors[1][0] > 6 and errors[0][1] / errors[1][1] > 3


def test_more_elements_a_piece_change_little(saddle, deployed):
    fine = design_from_dict({**SADDLE, "elements_per_piece": 4})
    energy = fine.deploy()["deployed"].elastic_energy
    assert energy == pytest.approx(deployed.elastic_energy, rel=0.02)
    assert len(fine.scene().elements) == 2 * len(saddle.scene().elements)


def test_units_do_not_matter(saddle, deployed):
    """In millimetres: lengths 1000 times, the modulus in N/mm^2."""
    data = copy.deepcopy(SADDLE)
    data["material"]["young"] *= 1e-6
    data["section"].update(width=4.0, height=30.0)
    data["surface"].update(a=0.9e-3, b=-0.7e-3)
    data["network"] = isolines(400.0, 4)
    grid = design_from_dict(data)
    state = grid.deploy()["deployed"]
    assert state.elastic_energy * 1e-3 == pytest.approx(deployed.elastic_energy, rel=1e-6)
    np.testing.assert_allclose(
        state.state.positions[grid.joints],
        1000 * deployed.state.positions[saddle.joints],
        atol=1e-5,
    )


def test_geodesic_lamellas_bend_in_their_own_planes_only():
    """So they need much less energy than iso-lines of the same surface, which bend sideways too."""
    through = [[0.0, s, 0.0] for s in lines(0.4, 4)] + [[s, 0.0, np.pi / 2] for s in lines(0.4, 4)]
    network = {"type": "geodesics", "domain": [[-0.6, -0.6], [0.6, 0.6]], "through": through}
    surface = {"name": "paraboloid", "a": -1.2, "b": -0.9}
    traced, iso = (
        design_from_dict(grid_data(surface, n)).deploy()["deployed"]
        for n in (network, isolines(0.4, 4))
    )
    assert traced.elastic_energy < 0.2 * iso.elastic_energy


def test_curvature_lines_of_a_minimal_surface_give_the_grid_of_its_isolines():
    network = {
        "type": "curvature",
        "domain": [[-0.45, -0.45], [0.45, 0.45]],
        "points": [[x, x + 0.01] for x in lines(0.4, 4)],
    }
    grids = [
        design_from_dict(grid_data({"name": "enneper", "scale": 1.0}, n))
        for n in (
            network,
            {"type": "isolines", "u": lines(0.4, 4), "v": [x + 0.01 for x in lines(0.4, 4)]},
        )
    ]
    corners = [np.sort(grid.parameters[~grid.straight.numbering.is_length]) for grid in grids]
    np.testing.assert_allclose(*corners, atol=1e-6)


def test_closed_lamellas_have_no_ends():
    turns = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    rings = [
        {"points": (r * np.stack([np.cos(turns), np.sin(turns)], axis=1)).tolist(), "closed": True}
        for r in (0.4, 0.6)
    ]
    spokes = [
        {"type": "polyline", "points": [[0.4 * c, 0.4 * s], [0.6 * c, 0.6 * s]]}
        for c, s in np.stack([np.cos(turns[::2]), np.sin(turns[::2])], axis=1)
    ]
    grid = design_from_dict(
        grid_data(
            {"name": "paraboloid", "a": -0.8, "b": -0.8},
            {"type": "curves", "curves": rings + spokes},
        )
    )
    shapes = [(group.kind, group.indices.shape) for group in grid.groups]
    assert shapes == [("linear", (24, 2)), ("linear", (24, 1)), ("angular", (36, 1))]
    assert grid.deploy()["deployed"].stable


def test_the_target_is_the_design_surface_around_the_grid(saddle):
    target = saddle.target
    np.testing.assert_allclose(
        target.vertices[:, 2],
        0.45 * target.vertices[:, 0] ** 2 - 0.35 * target.vertices[:, 1] ** 2,
        atol=1e-14,
    )
    fit = TargetFitting(target)(target.positions)
    assert fit.max_percent < 1e-2
    assert (target.vertices[:, :2].min(axis=0) < -0.5).all() and (
        target.vertices[:, :2].max(axis=0) > 0.5
    ).all()
    assert target.size == pytest.approx(size_of_points(target.positions))


def test_designs_travel_to_other_processes(saddle, deployed):
    copied = pickle.loads(pickle.dumps(saddle))
    np.testing.assert_array_equal(
        copied.deploy()["deployed"].state.positions, deployed.state.positions
    )
