"""Released umbrella meshes against the reference simulator's states; skipped where the released
files are absent."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from scipy.spatial import cKDTree

from kop_exudyn.equilibrium.exudyn_confirm import confirm
from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.equilibrium.sensitivities import Sensitivities
from kop_exudyn.errors import InputError
from kop_exudyn.files.json_files import read_json
from kop_exudyn.structures.fitting import TargetFitting, best_placement
from kop_exudyn.structures.umbrella.design import Umbrella
from kop_exudyn.structures.umbrella.layout import BaseMesh, Plates, umbrella_mesh
from kop_exudyn.structures.umbrella.release import is_release, release_mesh

# largest joint distance from the reference, % of the bounding-box diagonal
REFERENCES = {"sphere_cap_0.3": 0.02, "hemisphere_5t": 0.02, "saddle_5t": 0.2}


@pytest.fixture(scope="module")
def content(shared_data):
    """Function (name): the content of a released file, read once."""
    cache = {}

    def read(name: str):
        if name not in cache:
            cache[name] = read_json(shared_data / "umbrella" / f"{name}.json.gz")
        return cache[name]

    return read


def percent_apart(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Distances (n,) after a rigid alignment, % of the bounding-box diagonal."""
    placed = best_placement(x, y, np.full(len(x), 1 / len(x))).apply(x)
    return 100 * np.linalg.norm(placed - y, axis=1) / np.linalg.norm(np.ptp(y, axis=0))


@pytest.mark.parametrize("name", REFERENCES)
def test_final_states_agree_with_the_reference_simulator(content, name):
    """Those of rods and actuators alone: the reference states are without limits of the joints."""
    design = Umbrella.from_release(content(name), name, joint_limits=0.0)
    state = design.deploy()["deployed"]
    reference = content("reference_states")[name]
    unit = content(name)["bbox_diagonal"]  # mm; the reference's lengths are in it
    apart = percent_apart(
        design.report_positions(state.state), unit * np.array(reference["joint_positions"])
    )
    assert apart.max() <= REFERENCES[name]
    assert state.elastic_energy == pytest.approx(unit**3 * reference["elastic_energy"], rel=0.015)
    assert state.potential == pytest.approx(unit**3 * reference["total_energy"], rel=1e-4)
    assert design.spacings(state.state) == pytest.approx(
        unit * np.array(reference["plate_spacing"]), rel=1e-3
    )


def test_with_limits_the_published_equilibrium_is_met(content):
    """The published state of the input design has its joints' limits; without them T joints open
    to 105 degrees and the state is 0.37 % away."""
    published = content("hemisphere_5t_published_equilibria")["input"]["deformed_physical_joints"]
    design = Umbrella.from_release(content("hemisphere_5t"), "hemisphere_5t")
    eq = design.deploy()["deployed"]
    unit = content("hemisphere_5t")["bbox_diagonal"]
    apart = percent_apart(design.report_positions(eq.state), unit * np.array(published))
    assert apart.max() < 0.02 and eq.escapes == 0
    turning = ~np.isin(np.flatnonzero(design.mesh.hinged), design.mesh.crossings)
    assert np.degrees(eq.state.angles[turning].max()) < 92


def test_rigid_plates_are_cheaper_and_nearly_the_same(content):
    rods = Umbrella.from_release(content("hemisphere_5t"), "hemisphere_5t")
    rigid = rods.with_plates("rigid")
    states = [design.deploy()["deployed"] for design in (rods, rigid)]
    joints = [design.report_positions(eq.state) for design, eq in zip((rods, rigid), states)]
    assert percent_apart(*joints).max() < 0.1
    assert states[1].elastic_energy == pytest.approx(states[0].elastic_energy, rel=0.03)
    unknowns = [design.systems["deployed"].n_unknowns for design in (rods, rigid)]
    assert unknowns[1] < 0.75 * unknowns[0]
    confirmation = confirm(rigid.scene(), states[1])
    assert confirmation.moved < 1e-8 and confirmation.newton_steps <= 2


def test_lilium_deploys_ends_stable_and_is_confirmed_by_exudyn(content):
    """Of all models it has the softest mode, so round-off moves it most."""
    design = Umbrella.from_release(content("lilium"), "lilium")
    state = design.deploy()["deployed"]
    assert state.stable and state.residual < 1e-8
    confirmation = confirm(design.scene(), state)
    assert confirmation.residual < 1e-7 and confirmation.moved < 1e-7
    assert design.spacings(state.state) == pytest.approx(design.mesh.spacing, rel=1e-2)


def test_published_optimised_shape_is_reached_by_its_arm_lengths(content):
    """The file gives the deployed joints; the arm lengths that lead there are found from them, then
    deployed anew."""
    published = content("hemisphere_5t_published_equilibria")
    unit = content("hemisphere_5t")["bbox_diagonal"]  # mm
    wanted = unit * np.array(published["tsf+energy"]["deformed_physical_joints"])
    design = Umbrella.from_release(content("hemisphere_5t"), "hemisphere_5t")
    rods = design.mesh.rods
    slots = 2 * rods.cells[rods.arms] + rods.sides[rods.arms]

    def chords(x: np.ndarray) -> np.ndarray:
        x = x[rods.joints[rods.arms]]
        return np.bincount(slots, np.linalg.norm(x[:, 0] - x[:, 1], axis=1)) / np.bincount(slots)

    q = (
        design.parameters
        * chords(wanted)
        / chords(unit * np.array(published["input"]["deformed_physical_joints"]))
    )
    state = design.deploy(q)["deployed"]
    joints = np.arange(len(wanted))
    for _ in range(3):
        x = state.state.positions[joints]
        place = best_placement(wanted, x, np.full(len(joints), 1 / len(joints)))
        rows = Sensitivities(design.systems["deployed"], state).positions(joints)
        turns = np.stack([np.cross(axis, x / unit) for axis in np.eye(3)], axis=2).reshape(-1, 3)
        motions = np.hstack([np.tile(np.eye(3), (len(x), 1)), turns])
        step = np.linalg.lstsq(
            np.hstack([rows, motions]), (place.apply(wanted) - x).ravel(), rcond=1e-4
        )[0]
        q = q + step[: len(q)]
        state = solve(design.systems["deployed"], q, state)
    state = design.deploy(q)["deployed"]
    assert percent_apart(state.state.positions[joints], wanted).max() < 0.2
    fit = TargetFitting(design.target, 1e-9)(state.state.positions[design.joints])
    assert fit.max_percent <= 0.4


@pytest.mark.parametrize("name", ["sphere_cap_0.3", "saddle_5t", "hemisphere_5t", "lilium"])
def test_our_layout_of_the_base_mesh_is_the_released_one(content, name):
    data = content(name)
    released = release_mesh(data)
    base = BaseMesh(np.array(data["base_mesh_v"])[:, :2], data["base_mesh_f"], data["flip_bits"][0])
    ours = umbrella_mesh(
        base,
        released.lengths,
        Plates(data["arm_joint_offset"], released.thickness, released.width, released.spacing),
    )
    assert released.plate_edge == pytest.approx(ours.plate_edge)
    theirs, mine = arm_table(released), arm_table(ours)
    distance, where = cKDTree(theirs).query(mine)
    assert distance.max() < 1e-6 and len(set(where)) == len(theirs) == len(mine)


def arm_table(mesh) -> np.ndarray:
    """One row an arm: its joints, ends, the axes that it turns about with their sense, cell and
    side."""
    rods, arms = mesh.rods, mesh.rods.arms
    order = np.argsort(np.isin(rods.joints, mesh.crossings), axis=1)[arms]
    pick = np.arange(len(order))[:, None], order
    axes = np.where(rods.behind, 1, -1)[:, :, None] * mesh.frames[rods.joints][:, :, :, 2]
    return np.concatenate(
        [
            mesh.positions[rods.joints[arms][pick]].reshape(-1, 6),
            mesh.rod_ends[arms][pick].reshape(-1, 6),
            axes[arms][pick].reshape(-1, 6),
            rods.cells[arms][:, None],
            rods.sides[arms][:, None],
        ],
        axis=1,
    )


@pytest.mark.parametrize(
    "change, field",
    [
        (lambda d: d.update(bbox_diagonal=-1), "bbox_diagonal"),
        (lambda d: d["vertices"].pop(), "v_labels"),
        (lambda d: d["vertices"].__setitem__(3, [0.0, float("nan"), 0.0]), "vertices"),
        (lambda d: d["v_labels"].__setitem__(0, "QQ"), "v_labels"),
        (lambda d: d["uid"].__setitem__(1, [99999, 0]), "uid"),
        (lambda d: d["edges"].__setitem__(0, [0, 10**7]), "edges"),
        (lambda d: d["A_segments"].__setitem__(0, [5, 6, 7]), "A_segments"),
        (lambda d: d["midpoint_offsets_A"].__setitem__(0, []), "midpoint_offsets_A"),
        (lambda d: d["ghost_normals"].__setitem__(0, [0.0, 1.0, 1.0]), "ghost_normals"),
        (lambda d: d["segment_normals"].__setitem__(0, [0.0, 0.0, 2.0]), "segment_normals"),
        (lambda d: d["target_f"].__setitem__(0, [0, 1, -1]), "target_f"),
        (lambda d: d.pop("edges"), "edges"),
    ],
)
def test_damaged_files_are_refused_with_the_field(content, change, field):
    data = copy.deepcopy(content("saddle_5t"))
    change(data)
    with pytest.raises(InputError, match=field):
        release_mesh(data, "damaged.json")


def test_released_files_are_told_from_others(content):
    assert is_release(content("saddle_5t"))
    assert (
        not is_release(content("reference_states"))
        and not is_release([1])
        and not is_release({"class": "umbrella"})
    )
