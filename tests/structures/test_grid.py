"""Orthogonal grids: straightening of lamellas, scenes, equilibria, bad input, the shipped
designs."""

from __future__ import annotations

import copy
import json
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.analysis.simulation import simulate
from kop_exudyn.equilibrium.exudyn_confirm import confirm
from kop_exudyn.equilibrium.newton import NewtonOptions, solve
from kop_exudyn.equilibrium.sensitivities import Sensitivities
from kop_exudyn.errors import InputError, SimulationFailure
from kop_exudyn.geometry.extent import size_of_points
from kop_exudyn.io.datasets import load_designs
from kop_exudyn.io.designs import load_design
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.search.weights import Weights
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.fitting import TargetFitting
from kop_exudyn.structures.grid.c_mesh import c_mesh_residuals
from kop_exudyn.structures.grid.lamellas import corner_height
from kop_exudyn.structures.loads import LoadCase


def grid_data(surface: dict, network: dict, **more) -> dict:
    return {
        "format": "kop_exudyn/design",
        "version": 1,
        "class": "grid",
        "name": "test",
        "material": {"young": 2.1e9, "poisson": 0.35},
        "section": {"type": "rectangle", "width": 0.004, "height": 0.03},
        "surface": {"type": "analytic", **surface},
        "network": network,
        **more,
    }


def lines(half: float, n: int) -> list[float]:
    return np.linspace(-half, half, n).tolist()


def isolines(half: float, n: int) -> dict:
    return {"type": "isolines", "u": lines(half, n), "v": lines(half, n)}


SADDLE = grid_data({"name": "paraboloid", "a": 0.9, "b": -0.7}, isolines(0.4, 4))
ARC = np.linspace(-0.6, 0.6, 4)
CYLINDER = grid_data(
    {"name": "cylinder", "radius": 0.8},
    {"type": "isolines", "u": (0.8 * ARC).tolist(), "v": lines(0.4, 3)},
)


@pytest.fixture(scope="module")
def saddle():
    return design_from_dict(SADDLE)


@pytest.fixture(scope="module")
def deployed(saddle):
    return saddle.deploy()["deployed"]


# -- straightening -----------------------------------------------------------------------------
@given(share=st.floats(0.25, 0.75), turn=st.floats(-1.4, 1.4))
def test_a_corner_over_its_chord_turns_by_its_angle(share, turn):
    h = corner_height(2.0, share, turn)
    assert -np.arctan(h / (2.0 * share)) - np.arctan(h / (2.0 * (1 - share))) == pytest.approx(
        turn, abs=1e-12
    )


def test_arcs_have_their_corners_where_the_tangents_meet():
    grid = design_from_dict(CYLINDER)
    arcs = [
        lamella
        for lamella in grid.straight.lamellas
        if np.ptp(grid.network.joints[lamella.strand.joints, 1]) < 1e-9
    ]
    assert len(arcs) == 3
    for lamella in arcs:
        # the normal points outwards
        np.testing.assert_allclose(lamella.spans.turns, -0.4, rtol=1e-7)
        np.testing.assert_allclose(lamella.spans.before, 0.8 * np.tan(0.2), rtol=1e-7)
        np.testing.assert_allclose(lamella.spans.after, 0.8 * np.tan(0.2), rtol=1e-7)


def test_straight_pieces_of_a_cylinder_are_laid_out_without_stress():
    grid = design_from_dict(CYLINDER)
    system = grid.systems["deployed"]
    system.set_parameters(grid.parameters)
    scene = grid.scene()
    energy = system.assemble(scene.with_driven(scene.initial, grid.parameters)).elastic
    bent = system.assemble(scene.with_driven(scene.initial, 0.99 * grid.parameters)).elastic
    assert energy < 1e-9 * bent


def test_asymptotic_lamellas_are_straight_and_halved():
    grid = design_from_dict(grid_data({"name": "hypar", "c": 0.8}, isolines(0.5, 3)))
    for lamella in grid.straight.lamellas:
        np.testing.assert_allclose(lamella.spans.turns, 0, atol=1e-14)
        np.testing.assert_allclose(lamella.spans.before, 0.5 * lamella.spans.lengths, rtol=1e-12)


@given(tilt=st.floats(-0.5, 0.5), cubic=st.floats(-3, 3))
@settings(max_examples=30, deadline=None)
def test_corners_stay_between_joints_and_move_continuously(tilt, cubic):
    """Through inflections too, and with the angle always the integral of the normal curvature."""

    def spans(c):
        surface = {"name": "polynomial", "coefficients": [[0, 0, 0.2], [0], [tilt], [c]]}
        grid = design_from_dict(grid_data(surface, isolines(0.4, 3)))
        return np.concatenate(
            [[s.shares, s.turns] for s in (lamella.spans for lamella in grid.straight.lamellas)],
            axis=1,
        )

    (shares, turns), (nearby, _) = spans(cubic), spans(cubic + 1e-6)
    assert (shares >= 0.25).all() and (shares <= 0.75).all()
    assert np.abs(shares - nearby).max() < 1e-4
    x = np.array([-0.4, 0.0, 0.4])
    # on v = 0 the curve u lies in a plane of symmetry: slope angles differ
    slope = 2 * tilt * x + 3 * cubic * x**2
    np.testing.assert_allclose(turns[6 + 2 : 6 + 4], np.diff(np.arctan(slope)), atol=1e-6)


def test_elements_cover_the_parameters_once(saddle):
    by_kind = {(group.kind, group.indices.shape[1]): group.indices for group in saddle.groups}
    assert {key: len(value) for key, value in by_kind.items()} == {
        ("linear", 2): 16,
        ("linear", 1): 16,
        ("angular", 1): 24,
    }
    used = np.concatenate([indices.ravel() for indices in by_kind.values()])
    np.testing.assert_array_equal(np.sort(used), np.arange(len(saddle.parameters)))
    assert not saddle.straight.numbering.is_length[by_kind["angular", 1]].any()
    assert (saddle.lower < saddle.parameters).all() and (saddle.parameters < saddle.upper).all()
    shares = np.concatenate([lamella.spans.shares for lamella in saddle.straight.lamellas])
    assert shares.min() > 0.4 and shares.max() < 0.6


def test_turns_too_large_for_one_corner_are_refused():
    with pytest.raises(InputError, match="more curves across"):
        design_from_dict(grid_data({"name": "cylinder", "radius": 0.3}, isolines(0.45, 2)))


# -- scenes ------------------------------------------------------------------------------------
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


# -- equilibria --------------------------------------------------------------------------------
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


# -- C-meshes ----------------------------------------------------------------------------------
PSEUDOSPHERE = grid_data(
    {"name": "pseudosphere", "scale": 1.0},
    {
        "type": "asymptotic",
        "domain": [[0.4, -0.6], [1.6, 0.6]],
        "points": [[1.0, s] for s in lines(0.3, 4)],
    },
)


def c_mesh(data):
    grid = design_from_dict(data)
    return c_mesh_residuals(grid.surface, grid.network.joints, grid.straight.lamellas)


def test_asymptotic_lines_of_the_pseudosphere_collapse_to_a_straight_strip():
    residuals = c_mesh(PSEUDOSPHERE)
    assert residuals.collapses and residuals.chebyshev < 1e-6 and residuals.gauss < 1e-6


def test_spheres_and_free_forms_do_not():
    sphere = c_mesh(grid_data({"name": "sphere", "radius": 1.0}, isolines(0.4, 4)))
    assert sphere.gauss < 1e-12 and not sphere.collapses  # the curvature is constant, sides differ
    bumps = {"name": "gaussians", "bumps": [[0.2, 0.0, 0.1, 0.4]]}
    free = c_mesh(grid_data(bumps, isolines(0.5, 4)))
    assert free.gauss > 0.1 and not free.collapses


def test_users_are_told_what_may_collapse_unless_joints_are_held():
    (told,) = design_from_dict(CYLINDER).cautions
    assert "collapse to a flat strip" in told and '"held"' in told
    assert design_from_dict(CYLINDER | {"held": "corners"}).cautions == []
    assert design_from_dict(SADDLE).cautions == []


# -- files -------------------------------------------------------------------------------------
def test_shipped_designs_keep_to_their_surfaces(repository):
    designs = [
        *load_designs(repository / "models" / "grids"),
        *load_designs(repository / "models" / "grids_hard"),
    ]
    assert len(designs) >= 9
    for design in designs:
        state = design.deploy()["deployed"]
        fit = TargetFitting(design.target)(state.state.positions[design.joints])
        assert state.stable and fit.max_percent < 0.01, design.name


@pytest.mark.parametrize(
    "change, field",
    [
        ({"surface": {"type": "analytic", "name": "dodecahedron"}}, "surface.name"),
        ({"surface": {"type": "analytic", "name": "sphere", "radius": 0}}, "surface.radius"),
        ({"surface": {"type": "analytic"}}, "surface"),
        ({"surface": {"type": "analytic", "name": "sphere", "radius": "1"}}, "surface"),
        ({"surface": {"type": "mesh", "file": "missing.obj"}}, "surface.file"),
        ({"surface": {"type": "mesh", "file": "x.obj", "expression": "x*y"}}, "surface"),
        ({"network": {"type": "isolines", "u": [0, 0.2], "v": [0.2, 0.1]}}, "network.v"),
        ({"network": {"type": "isolines", "u": [0, 0.2]}}, "network"),
        ({"network": {"type": "hexagons"}}, "network.type"),
        (
            {
                "network": {
                    "type": "geodesics",
                    "domain": [[-1, -1], [1, 1]],
                    "through": [[0, 2, 0.0], [0, 0, 1.0]],
                }
            },
            "network.through[0]",
        ),
        (
            {"network": {"type": "asymptotic", "domain": [[1, -1], [-1, 1]], "points": [[0, 0]]}},
            "network.domain",
        ),
        (
            {
                "network": {
                    "type": "curves",
                    "curves": [{"points": [[0, 0], [1, 0]]}, {"points": [[0, 1], [1, 1]]}],
                }
            },
            "network.curves[0].points: crosses no other",
        ),
        (
            {
                "network": {
                    "type": "curves",
                    "curves": [{"points": [[0, 0], [1, y]]} for y in (0, 1, 2)],
                }
            },
            "network.curves[2].points: passes through one point (0, 0) with "
            "network.curves[0].points, network.curves[1].points",
        ),
        ({"elements_per_piece": 0}, "elements_per_piece"),
        ({"sections": 3}, "sections"),
    ],
)
def test_bad_design_files_are_named_with_their_field(write_json_file, change, field):
    with pytest.raises(InputError) as caught:
        load_design(write_json_file("bad.json", {**SADDLE, **change}))
    assert "bad.json" in str(caught.value) and field in str(caught.value)
    assert "\n" not in str(caught.value)


def test_mesh_files_lie_beside_the_design(write_json_file, tmp_path):
    side = np.linspace(-0.6, 0.6, 13)
    x, y = (a.ravel() for a in np.meshgrid(side, side, indexing="ij"))
    k = np.arange(169).reshape(13, 13)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4) + 1
    rows = [f"v {a} {b} {0.45 * a * a - 0.35 * b * b}" for a, b in zip(x, y)]
    rows += [f"f {a} {b} {c}\nf {a} {c} {d}" for a, b, c, d in quads]
    (tmp_path / "patch.obj").write_text("\n".join(rows))
    path = write_json_file(
        "meshed.json", {**SADDLE, "surface": {"type": "mesh", "file": "patch.obj"}}
    )
    grid, exact = load_design(path), design_from_dict(SADDLE)
    lengths = exact.straight.numbering.is_length
    np.testing.assert_allclose(grid.parameters[lengths], exact.parameters[lengths], rtol=1e-3)
    np.testing.assert_allclose(grid.parameters[~lengths], exact.parameters[~lengths], atol=2e-3)
    beyond = json.loads(path.read_text())
    beyond["network"]["u"] = [-0.9, 0.0, 0.4]
    with pytest.raises(InputError, match="leaves the surface"):
        load_design(write_json_file("beyond.json", beyond))


# -- held joints -------------------------------------------------------------------------------
DOME = grid_data({"name": "paraboloid", "a": -0.2, "b": -0.2}, isolines(0.8, 5))


def test_a_dome_that_nothing_holds_closes_like_scissors_and_says_so(caplog):
    """Equal lines on a surface of equal curvatures shear without stretching."""
    result = simulate(design_from_dict(DOME))
    assert result.fit.max_percent < 1 and result.displaced_percent > 20
    assert "joints end up to" in caplog.text and "hardly resists that motion" in caplog.text


@pytest.mark.parametrize(
    "held, numbers", [("corners", [0, 4, 20, 24]), ([24, 0, 20], [0, 20, 24]), ("boundary", None)]
)
def test_held_joints_keep_a_dome_in_shape(held, numbers, caplog):
    design = design_from_dict(DOME | {"held": held})
    if numbers is None:
        outer = np.abs(design.network.joints).max(axis=1) > 0.79
        numbers = np.flatnonzero(outer)
        assert len(numbers) == 16
    np.testing.assert_array_equal(design.held, numbers)
    result = simulate(design)
    assert result.fit.max_percent < 0.01 and result.displaced_percent < 0.01 and not caplog.text
    places = result.deployed.state.positions[design.joints[design.held]]
    np.testing.assert_allclose(places, design.target.positions[design.held], rtol=0, atol=1e-12)
    sagging = simulate(design, LoadCase(joints=[12], forces=[[0, 0, -5.0]])).loaded
    np.testing.assert_array_equal(sagging.supports, numbers)


def test_sensitivities_of_a_held_grid():
    design = design_from_dict(DOME | {"held": "corners"})
    objective = DesignObjective(design, Weights(share=1.0))  # smooth, unlike facets
    rng = np.random.default_rng(2)
    q = design.parameters * (1 + 3e-3 * rng.uniform(-1, 1, len(design.parameters)))
    direction = design.parameters * rng.uniform(-1, 1, len(q))
    tight = NewtonOptions(max_iterations=100, tolerance=1e-13)
    at = objective.evaluate(q, options=tight)
    gradient = objective.derivatives(at).gradient
    h = 1e-6  # between held joints lengths act stiffly
    ahead, back = (objective.evaluate(q + s * h * direction, at, tight).value for s in (1, -1))
    assert (ahead - back) / (2 * h) == pytest.approx(gradient @ direction, rel=1e-5)


@pytest.mark.parametrize(
    "held, message",
    [
        ("edge", 'held = .edge.: expected numbers of joints, "corners" or "boundary"'),
        ([0, 1, 25], "held = 25: names a joint that doesn't exist .joints 0 to 24"),
        ([0, 4], "held = .0, 4.: joints on one line"),
        ([-1, 4, 20], "held = -1: names a joint"),
    ],
)
def test_joints_that_cant_be_held(held, message):
    with pytest.raises(InputError, match=message):
        design_from_dict(DOME | {"held": held})


def test_a_grid_that_finds_no_shape_is_told_of_held_joints():
    flat = grid_data({"name": "paraboloid", "a": -0.05, "b": -0.05}, isolines(0.8, 5))
    with pytest.raises(SimulationFailure, match='see the field "held"'):
        design_from_dict(flat).deploy()


def test_lengths_and_angles_of_a_fitted_grid_replace_those_of_its_curves(repository):
    file = repository / "models" / "grids" / "05_free_form.json"
    data = json.loads(file.read_text(encoding="utf-8"))
    values = data["straightened"]
    fitted = design_from_dict(data, str(file))
    drawn = design_from_dict({k: v for k, v in data.items() if k != "straightened"}, str(file))
    numbering = fitted.straight.numbering
    assert numbering.split(fitted.parameters, digits=7) == values
    lengths = fitted.parameters[numbering.is_length]
    assert not np.array_equal(lengths, drawn.parameters[numbering.is_length])
    off = [
        TargetFitting(grid.target, 0.1)(
            grid.deploy()["deployed"].state.positions[grid.joints]
        ).max_percent
        for grid in (fitted, drawn)
    ]
    assert off[0] < 0.01 < 0.2 < off[1]

    def refused(match, **changes):
        with pytest.raises(InputError, match=match):
            design_from_dict(data | {"straightened": values | changes}, str(file))

    refused(r"straightened.lengths.*have \d+ lengths", lengths=values["lengths"][1:])
    refused(r"straightened.angles.*have \d+ angles", angles=[*values["angles"], 0.0])
    refused(r"must be positive", lengths=[-0.1, *values["lengths"][1:]])
