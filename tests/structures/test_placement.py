"""Designs away from the origin, turned: the same structure, in the user's coordinates."""

from __future__ import annotations

import copy
import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from support.placements import placed
from support.settings import FEW_ERRORS

from kop_exudyn.analysis.simulation import simulate
from kop_exudyn.equilibrium.newton import refine, solve
from kop_exudyn.equilibrium.system import System
from kop_exudyn.exchange.objects import to_meshio, to_pandas
from kop_exudyn.exchange.polygons import write_mesh_obj
from kop_exudyn.exchange.states import states_of_simulation
from kop_exudyn.geometry.centring import TooFarError
from kop_exudyn.geometry.extent import size_of_points
from kop_exudyn.geometry.surfaces import PLAN_AXES
from kop_exudyn.io.designs import load_design
from kop_exudyn.rods.rotations import exp_so3
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings, StageSettings
from kop_exudyn.structures.base import Target, design_from_dict
from kop_exudyn.structures.fitting import Placement, TargetFitting
from kop_exudyn.structures.umbrella.release import centred_release

MODELS = ["small/01_sinh.json", "small/03_exp.json", "umbrellas/hill.json"]


@pytest.fixture(scope="module", params=MODELS)
def model(request, repository):
    data = json.loads((repository / "models" / request.param).read_text())
    design = design_from_dict(data)
    return data, design, design.deploy()[design.fitted_role.name]


@pytest.mark.parametrize("sizes, allowed", [(0.0, 1e-9), (1e5, 1e-9), (1e6, 4e-9)])
def test_a_design_that_is_moved_and_turned_is_the_same(model, sizes, allowed):
    """To 1e-9 of its size a hundred thousand sizes away; at a million, where coordinates are
    rounded to 1e-10, to a few times that; in its file's coordinates to what these can tell."""
    data, design, state = model
    for seed in (0, 1):
        moved, motion, size = placed(data, sizes, seed)
        other = design_from_dict(moved)
        found = other.deploy()[other.fitted_role.name]
        x, y = design.report_positions(state.state), other.report_positions(found.state)
        wanted = motion.rotation @ (x - x.mean(axis=0)).T
        if design.class_name == "umbrella":  # turned about its own middle by the pose of its target
            fit = Rotation.align_vectors(y - y.mean(axis=0), x - x.mean(axis=0))[0]
            wanted = fit.as_matrix() @ (x - x.mean(axis=0)).T
        here = found.state.positions if design.class_name != "umbrella" else y - other.middle
        near = y - y.mean(axis=0) if sizes == 0 else None
        inside = here[other.joints] if design.class_name != "umbrella" else here
        apart = inside - inside.mean(axis=0) - wanted.T
        assert np.abs(apart).max() < allowed * size
        if near is not None:
            assert np.abs(near - wanted.T).max() < allowed * size
        goal = motion.apply(x) if design.class_name != "umbrella" else y
        assert np.abs(y - goal).max() < (allowed + 4e-16 * sizes) * size
        assert found.elastic_energy == pytest.approx(state.elastic_energy, rel=1e-6)
        lengths = np.abs(other.parameters - design.parameters)
        assert lengths.max() < 1e-12 * size + 1e-13 * sizes * size


@pytest.fixture(scope="module", params=["conformals/04_cubic.json", "patches/ring.json"])
def saddle(request, repository):
    data = json.loads((repository / "models" / request.param).read_text())
    return data, risen(data)


def risen(data):
    """Joints (n, 3) of a smooth C-shell when it is open, around their middle."""
    design = design_from_dict(data)
    x = design.smooth_path[-1].state.positions[design.joints]
    return x - x.mean(axis=0)


@pytest.mark.parametrize("seed", [0, 2, "mirrored"])
def test_saddles_rise_to_the_same_side_however_they_are_turned(saddle, seed):
    """Their two sides are alike but for the mirror image: nothing but the choice tells them
    apart."""
    data, here = saddle
    if seed == "mirrored":
        turned, motion = copy.deepcopy(data), Placement(np.diag([-1.0, 1.0, 1.0]), np.zeros(3))
        for curve in turned["curves"]:
            curve["points"] = [[-x, y] for x, y in curve["points"]]
        turned["opening"]["angle"] *= -1
    else:
        turned, motion, _ = placed(data, 0.0, seed)
    there = risen(turned)
    assert np.abs(here[:, 2]).max() > 0.02  # where the other side would be twice that away
    # the mean angle of all hinges holds the shape, but not its turn in the plane
    turn, off = Rotation.align_vectors(there, here @ motion.rotation.T)
    assert off < 1e-8 and abs(turn.as_matrix()[2, 2] - 1) < 1e-12


@settings(max_examples=3, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1.0, 1e3]))
def test_percentages_neither_turn_nor_move(model, seed, sizes):
    """To 1e-9 %: the size, the places on the target, and with them the fit."""
    data, design, state = model
    other = design_from_dict(placed(data, sizes, seed)[0])
    assert other.target.size == pytest.approx(design.target.size, rel=1e-11)
    assert percentages(other) == pytest.approx(percentages(design, state), abs=1e-9)


# The turns that take the three axes to each other: a plane chart has no others.
TURNS = [t.as_matrix().round() for t in Rotation.create_group("O")]


@pytest.fixture(scope="module")
def grid_on_mesh(tmp_path_factory):
    folder = tmp_path_factory.mktemp("grids")
    return folder, percentages(turned_grid(folder, np.eye(3), np.zeros(3)))


@settings(max_examples=6, deadline=None, derandomize=True)
@given(st.sampled_from(TURNS), st.tuples(*[st.integers(-50, 50)] * 3))
def test_percentages_of_grids_neither_turn_nor_move(grid_on_mesh, turn, shift):
    folder, wanted = grid_on_mesh
    other = turned_grid(folder, turn, np.array(shift, float))
    assert percentages(other) == pytest.approx(wanted, abs=1e-9)


@pytest.fixture(
    scope="module", params=["small/01_sinh.json", "grids/02_saddle.json", "umbrellas/oval.json"]
)
def target(request, repository):
    return load_design(repository / "models" / request.param).target


@settings(max_examples=5, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_fits_to_a_turned_target_are_the_same(target, seed):
    """Of joints scattered about it: the surface, the places and the joints turned alike.

    Fits end with steps of 1e-10 of the size, and converge linearly where residuals are large:
    4e-8 % is seen between the two.
    """
    rng = np.random.default_rng(seed)
    motion = Placement(Rotation.random(rng=rng).as_matrix(), 10 * target.size * rng.normal(size=3))
    vertices, joints = motion.apply(target.vertices), motion.apply(target.positions)
    there = Target(
        vertices, target.faces, joints, size_of_points(vertices[np.unique(target.faces)])
    )
    here = replace(target, size=size_of_points(target.vertices[np.unique(target.faces)]))
    x = target.positions + 0.01 * target.size * rng.normal(size=target.positions.shape)
    found = [TargetFitting(t)(y) for t, y in ((here, x), (there, motion.apply(x)))]
    assert found[1].max_percent == pytest.approx(found[0].max_percent, abs=1e-6)
    assert found[1].mean_percent == pytest.approx(found[0].mean_percent, abs=1e-6)


def test_kits_of_turned_designs_are_the_same(repository):
    """Two tiny C-shells, as they are and each turned and moved for itself."""
    kits = []
    for seed in (None, 5):
        designs = []
        for name in ("01_sinh", "03_exp"):
            data = json.loads((repository / "models" / "small" / f"{name}.json").read_text())
            designs.append(
                design_from_dict(
                    data if seed is None else placed(data, 3.0, seed + len(designs))[0]
                )
            )
        stages = StageSettings(
            schedule=(1e4,),
            relaxed_steps=2,
            assigned_steps=2,
            reassignments=0,
            path_steps=2,
            effort="quick",
            requirements=FEW_ERRORS,
            levelling=0.0,  # it ends by the gain of its steps: at the same parts to 1e-4 only
        )
        settings = JobSettings(jobs=1, baselines=False, stages=stages)
        kits.append(optimize_kit(designs, {"linear": 6, "angular": 3}, settings=settings))
    near, turned = (kit.kit.parts for kit in kits)
    assert near.keys() == turned.keys() == {"linear", "angular"}
    for kind in near:
        assert turned[kind] == pytest.approx(near[kind], rel=1e-6)
    for number in range(2):
        a, b = (kit.summary("assigned", number)["fit"] for kit in kits)
        assert b["max_percent"] == pytest.approx(a["max_percent"], abs=1e-5)


def percentages(design, state=None):
    """Size of the target; largest and mean deviation of the joints, %."""
    state = state or refine(
        design.systems[design.fitted_role.name], design.deploy()[design.fitted_role.name]
    )
    fit = TargetFitting(design.target)(state.state.positions[design.joints])
    return [design.target.size, fit.max_percent, fit.mean_percent]


def turned_grid(folder, turn, shift):
    """A grid on the mesh of a paraboloid, turned by one of TURNS and moved."""
    x, y = (c.ravel() for c in np.meshgrid(*[np.linspace(-1.2, 1.2, 25)] * 2, indexing="ij"))
    k = np.arange(24)
    corner = (k[:, None] * 25 + k).ravel()
    faces = np.concatenate(
        [
            np.stack(t, axis=1)
            for t in ((corner, corner + 25, corner + 26), (corner, corner + 26, corner + 1))
        ]
    )
    points = np.stack([x, y, 0.3 * x**2 - 0.2 * y**2 + 0.05 * x * y], axis=1) @ turn.T + shift
    write_mesh_obj(folder / "mesh.obj", points, faces, overwrite=True)
    up = int(np.argmax(np.abs(turn[:, 2])))
    lines = []
    for axis, along in zip(PLAN_AXES["xyz"[up]], "uv"):
        own = int(np.argmax(np.abs(turn[axis])))
        values = np.linspace(-0.8, 0.8, 4) if own == 0 else np.linspace(-0.7, 0.7, 4)
        lines.append((along, (values + shift[axis]).tolist()))
    data = {
        "format": "kop_exudyn/design",
        "version": 1,
        "class": "grid",
        "name": "turned",
        "material": {"young": 2.1e9, "poisson": 0.35},
        "section": {"type": "rectangle", "width": 0.004, "height": 0.03},
        "surface": {"type": "mesh", "file": "mesh.obj", "up": "xyz"[up]},
        "network": {"type": "isolines", **dict(lines)},
        "held": "corners",
    }
    return design_from_dict(data, str(folder / "turned.json"))


@pytest.mark.parametrize("name", ["small/01_sinh.json", "umbrellas/dome.json"])
@pytest.mark.parametrize("sizes", [0.0, 5.0, 40.0])
@pytest.mark.parametrize("origin", [None, (7.0, -3.0, 11.0)])
def test_every_output_has_the_same_joints(repository, name, sizes, origin):
    """The design's place was added twice to those of JSON and of tables."""
    data, _, size = placed(json.loads((repository / "models" / name).read_text()), sizes, 3)
    more = {} if origin is None else {"origin": (size * np.array(origin)).tolist()}
    design = design_from_dict(data | more)
    assert np.any(design.middle) == (sizes > 2)
    result = simulate(design, warn=False)
    shift = np.zeros(3) if origin is None else size * np.array(origin)
    wanted = result.joints + shift
    np.testing.assert_allclose(result.to_dict()["joints"], wanted, atol=1e-9 * size)
    table = to_pandas(result)["joints"]
    fitted = result.deployed.state.positions[design.joints] + design.middle + shift
    np.testing.assert_allclose(table[["x", "y", "z"]].to_numpy(), fitted, atol=1e-9 * size)
    np.testing.assert_allclose(table["distance"], result.fit.distances)
    away = np.linalg.norm(fitted[:, None] - wanted[None], axis=2).min(axis=1)
    assert away.max() < 1e-9 * size  # they are among all joints
    points = to_meshio(result).points  # as exported: placed onto the target
    far = np.linalg.norm(points[:, None] - wanted[None], axis=2).min(axis=0)
    assert far.max() < 0.05 * size


def test_simulations_and_files_have_the_users_coordinates(repository):
    """Joints, rods in exported files, and Exudyn confirms what lies 50 sizes away."""
    data = json.loads((repository / "models" / "small" / "03_exp.json").read_text())
    design = design_from_dict(data)
    moved, motion, size = placed(data, 50.0, 3)
    other = design_from_dict(moved)
    a, b = simulate(design), simulate(other)
    assert np.abs(motion.apply(a.joints) - b.joints).max() < 1e-9 * size
    assert b.fit.max_percent == pytest.approx(a.fit.max_percent, abs=1e-9)
    for near, far in zip(states_of_simulation(a), states_of_simulation(b)):
        assert np.abs(motion.apply(near.points) - far.points).max() < 1e-7 * size
        if near.target is not None:
            assert np.nanmax(np.abs(near.deviations - far.deviations)) < 1e-9 * size


@pytest.mark.parametrize("name", ["small/01_sinh.json", "umbrellas/dome.json"])
def test_what_double_precision_cannot_tell_is_refused(repository, name):
    data = json.loads((repository / "models" / name).read_text())
    moved, _, _ = placed(data, 2e8, 0)
    with pytest.raises(TooFarError, match="times its own size from the origin"):
        design_from_dict(moved, "far.json")


def test_grids_on_meshes_lie_where_their_mesh_does(tmp_path):
    """A paraboloid's mesh at a kilometre: curves in the plane move with it."""
    x, y = (c.ravel() for c in np.meshgrid(*[np.linspace(-1.2, 1.2, 25)] * 2, indexing="ij"))
    k = np.arange(24)
    corner = (k[:, None] * 25 + k).ravel()
    faces = [[c, c + 25, c + 26] for c in corner] + [[c, c + 26, c + 1] for c in corner]
    joints = []
    for shift in (np.zeros(3), np.array([1024.0, -2048.0, 512.0])):
        points = np.stack([x, y, 0.3 * x**2 - 0.2 * y**2], axis=1) + shift
        lines = [f"v {p[0]!r} {p[1]!r} {p[2]!r}" for p in points.tolist()]
        lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
        (tmp_path / "mesh.obj").write_text("\n".join(lines))
        data = {
            "format": "kop_exudyn/design",
            "version": 1,
            "class": "grid",
            "name": "far",
            "material": {"young": 2.1e9, "poisson": 0.35},
            "section": {"type": "rectangle", "width": 0.004, "height": 0.03},
            "surface": {"type": "mesh", "file": "mesh.obj"},
            "network": {
                "type": "isolines",
                "u": (np.linspace(-0.8, 0.8, 4) + shift[0]).tolist(),
                "v": (np.linspace(-0.7, 0.7, 4) + shift[1]).tolist(),
            },
            "held": "corners",
        }
        design = design_from_dict(data, str(tmp_path / "far.json"))
        state = refine(design.systems["deployed"], design.deploy()["deployed"]).state
        joints.append(design.report_positions(state) - shift)
    assert np.abs(joints[0] - joints[1]).max() < 1e-9


def test_released_meshes_are_centred_by_field():
    vertices = [[1e6, 0.0, 0.0], [1e6 + 1, 1.0, 2.0]]
    data = {
        "vertices": vertices,
        "target_v": [[0.0, 0.0, 5e6], [1.0, 1.0, 5e6 + 1]],
        "correspondence": [None, [0.0, 0.5, 5e6]],
    }
    near, origin = centred_release(data)
    assert origin.tolist() == [0.5, 0.5, 5e6 + 0.5]
    assert near["vertices"] == [[-0.5, -0.5, -1.0], [0.5, 0.5, 1.0]]
    assert near["correspondence"] == [None, [-0.5, 0.0, -0.5]]
    assert centred_release({"vertices": "x"})[1].tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("sizes", [0.0, 1e3, 1e5])
def test_scenes_of_python_programs_converge_as_far_as_they_can(sizes):
    """A bent cantilever away from the origin: its forces are resolved to eps times its distance."""
    build = SceneBuilder()
    n, turn = 8, exp_so3(np.array([[0.3, -0.5, 0.2]]))[0]
    line = np.linspace([0, 0, 0], [1, 0, 0], n + 1) @ turn.T + sizes * np.array([0.6, 0.64, 0.48])
    bodies = build.bodies(line, turn)
    build.rod(
        build.nodes(bodies), [2e5, 1e5, 1e5, 0.8, 1.0, 2.0], length=1.0, curvature=[0, 0.5, 0]
    )
    build.pin(0)
    eq = solve(System(build.build()), np.zeros(0))
    tip = turn.T @ (eq.state.positions[-1] - eq.state.positions[0])
    assert tip[0] == pytest.approx(np.sin(0.5) / 0.5, abs=1e-9 + 1e-14 * sizes * 1e2)
    assert abs(tip[2]) == pytest.approx((1 - np.cos(0.5)) / 0.5, abs=1e-9 + 1e-14 * sizes * 1e2)
