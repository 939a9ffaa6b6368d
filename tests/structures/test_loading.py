"""Designs under loads: statics that must hold whatever the design, supports, and what the command
line says."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from support.grids import coarse_grid

from kop_exudyn.analysis.simulation import simulate
from kop_exudyn.cli import main
from kop_exudyn.errors import InputError
from kop_exudyn.io.designs import load_design
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.links import joint_links
from kop_exudyn.structures.loading import loaded_state, supports_of
from kop_exudyn.structures.loads import LoadCase, tributary_areas
from kop_exudyn.structures.strength import materials_of

GRAVITY = np.array([0.0, 0.0, -9.81])


@pytest.fixture(scope="module")
def dome(repository):
    return load_design(repository / "models" / "grids" / "01_dome.json")


@pytest.fixture(scope="module")
def opened(dome):
    return dome.deploy()["deployed"]


def test_weight_is_that_of_the_rods(dome, opened):
    found = loaded_state(dome, opened, LoadCase(GRAVITY))
    length = dome.scene().rest_lengths(dome.parameters).sum()
    assert found.total_force == pytest.approx(900 * 0.004 * 0.03 * length * GRAVITY)
    assert 0 < found.deflections.mean() < found.deflections.max() < 0.01 * found.size
    held = found.equilibrium.state.positions[dome.joints[found.supports]]
    np.testing.assert_allclose(
        held, opened.state.positions[dome.joints[found.supports]], atol=1e-10
    )
    assert found.confirmation.moved < 1e-8 and found.equilibrium.stable


def test_the_dome_stands_on_its_lowest_boundary(dome, opened):
    supports = supports_of(dome, opened, LoadCase(GRAVITY))
    x = opened.state.positions[dome.joints]
    corners = {0, 8, 72, 80}
    assert corners <= set(supports.tolist()) and x[supports, 2].max() < x[:, 2].mean()
    own = LoadCase(GRAVITY, supports=np.array([8, 0, 72]))
    np.testing.assert_array_equal(supports_of(dome, opened, own), [0, 8, 72])


def test_forces_and_displacements_are_reciprocal(dome, opened):
    """Maxwell and Betti: what a small force at i does at j is what the same at j does at i."""

    def moved(at: int, along: int, seen: int, across: int) -> float:
        cases = [
            LoadCase(
                joints=np.array([at]),
                forces=size * np.eye(3)[[along]],
                supports=np.array([0, 8, 72, 80]),
            )
            for size in (0.01, -0.01)
        ]
        there, back = (
            loaded_state(dome, opened, case).equilibrium.state.positions for case in cases
        )
        return (there - back)[dome.joints[seen], across]

    there, back = moved(40, 2, 13, 0), moved(13, 0, 40, 2)
    assert abs(there) > 1e-6
    assert there == pytest.approx(back, rel=1e-4)


@pytest.mark.parametrize(
    "case",
    [
        LoadCase(GRAVITY),
        LoadCase(joints=[40, 30], forces=[[0, 0, -0.5], [0.2, 0, 0]]),
        LoadCase(line=[0, 0, -0.05], plan=[0, 0.1, -0.3]),
        LoadCase(area=[0.05, 0, -0.2]),
    ],
    ids=lambda case: case.name,
)
def test_reactions_balance_the_loads(dome, opened, case):
    """Forces and moments: those of the supports and those of the loads add up to nothing."""
    found = loaded_state(dome, opened, case)
    assert found.reactions.shape == (len(found.supports), 3)
    scale = np.linalg.norm(found.reactions, axis=1).sum()
    np.testing.assert_allclose(
        found.reactions.sum(axis=0) + found.total_force, 0, atol=1e-7 * scale
    )
    if len(case.joints):
        x = found.equilibrium.state.positions[dome.joints]
        moment = np.cross(x[found.supports], found.reactions).sum(axis=0)
        moment += np.cross(x[case.joints], case.forces).sum(axis=0)
        np.testing.assert_allclose(moment, 0, atol=1e-6 * scale)


def test_what_is_spread_adds_up(dome, opened):
    """A line load is the rods' length times it, loads per area are the target's areas times
    them."""
    length = dome.scene().rest_lengths(dome.parameters).sum()
    line = loaded_state(dome, opened, LoadCase(line=[0, 0, -0.02])).total_force
    assert line == pytest.approx([0, 0, -0.02 * length])
    surface, plan = tributary_areas(dome.target.positions)
    for case, areas in (
        (LoadCase(area=[0, 0, -0.1]), surface),
        (LoadCase(plan=[0, 0, -0.1]), plan),
    ):
        total = loaded_state(dome, opened, case).total_force
        assert total == pytest.approx([0, 0, -0.1 * areas.sum()])
    assert plan.sum() < surface.sum() < 1.5 * plan.sum()


def test_areas_of_joints():
    """On a tilted grid of squares: corners a quarter, edges a half, middles one, by whatever
    diagonals they were told apart; nothing over a gap."""
    x, y = np.meshgrid(np.arange(6.0), np.arange(5.0))
    slope = np.radians(30)
    points = np.stack([x * np.cos(slope), y, x * np.sin(slope)], axis=-1).reshape(-1, 3)
    surface, plan = tributary_areas(points)
    rim = ((x == 0) | (x == 5)) * 1 + ((y == 0) | (y == 4))
    np.testing.assert_allclose(surface, 0.5 ** rim.ravel(), rtol=1e-12)
    np.testing.assert_allclose(plan, np.cos(slope) * surface)
    apart = np.concatenate([points, points + [0, 40, 0]])
    assert tributary_areas(apart)[0].sum() == pytest.approx(40)
    with pytest.raises(InputError, match="on a line"):
        tributary_areas(np.arange(12.0)[:, None] * [1.0, 0, 0])


@pytest.mark.parametrize("model", ["grids/01_dome", "conformals/01_sinh", "umbrellas/hill"])
def test_areas_do_not_depend_on_where_and_in_which_unit(repository, model):
    """By which diagonal Delaunay's triangles tell a square's corners apart is chance."""
    design = load_design(repository / "models" / f"{model}.json")
    x, links = (
        design.target.positions,
        joint_links(design.scene(design.fitted_role.name), design.joints),
    )
    assert len(links) == {"grids": 144, "conformals": 144, "umbrellas": 12}[model.split("/")[0]]
    surface, plan = design.joint_areas
    turn = Rotation.from_rotvec([0, 0, 0.7]).as_matrix()
    mirrored = x * [-1, 1, 1]
    for moved, scale in (
        (1e3 * x, 1e6),
        (x @ turn.T + [3, 4, 5], 1),
        (mirrored, 1),
        (x / 3, 1 / 9),
    ):
        own = tributary_areas(moved, links)
        np.testing.assert_allclose(own[0], scale * surface, rtol=1e-7)
        np.testing.assert_allclose(own[1], scale * plan, rtol=1e-7)
    order = np.random.default_rng(0).permutation(len(x))
    place = np.argsort(order)
    again = tributary_areas(x[order], place[links])
    np.testing.assert_allclose(again[0], surface[order], rtol=1e-7)


@pytest.mark.parametrize("scale", [1.0, 1e-3, 1 / 25.4, 1 / 304.8])
def test_areas_along_a_straight_rim(scale):
    """Of a vault: rounding left triangles along the rim, which stood upright there."""
    x, y = np.meshgrid(np.linspace(-2000, 2000, 5), np.linspace(-2000, 2000, 5))
    vault = np.stack([x, y, -5.5e-5 * x**2 - 2e-5 * y**2], axis=-1).reshape(-1, 3)
    surface, plan = tributary_areas(scale * vault)
    rim = ((x == x.min()) | (x == x.max())) * 1 + ((y == y.min()) | (y == y.max()))
    np.testing.assert_allclose(plan, (1000 * scale) ** 2 * 0.5 ** rim.ravel(), rtol=1e-9)
    assert (surface < 1.03 * plan).all()


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 10_000), st.floats(0.0, 0.6))
def test_areas_of_skewed_nets_are_those_of_their_cells(seed, skew):
    """Inner joints have about a quarter of each of the four around them, and no third of one."""
    rng = np.random.default_rng(seed)
    i, j = np.meshgrid(np.arange(5), np.arange(6), indexing="ij")
    number = np.arange(30).reshape(5, 6)
    links = np.concatenate(
        [
            np.stack([number[:-1].ravel(), number[1:].ravel()], 1),
            np.stack([number[:, :-1].ravel(), number[:, 1:].ravel()], 1),
        ]
    )
    points = np.stack([i + skew * j, j, 0 * i], axis=-1).reshape(-1, 3).astype(float)
    points[:, :2] += 0.02 * rng.normal(size=(30, 2))
    surface, plan = tributary_areas(points, links)
    np.testing.assert_allclose(surface, plan)
    for a, b in zip(*(k.ravel() for k in np.meshgrid([1, 2, 3], [1, 2, 3, 4], indexing="ij"))):
        around = [(a - 1, b - 1), (a - 1, b), (a, b - 1), (a, b)]
        quads = [
            points[[number[p, q], number[p + 1, q], number[p + 1, q + 1], number[p, q + 1]]]
            for p, q in around
        ]
        least = sum(0.2 * _area(q) for q in quads)
        most = sum(0.3 * _area(q) for q in quads)
        assert least < surface[number[a, b]] < most


def _area(quad):
    x, y = quad[:, 0], quad[:, 1]
    return 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))


@pytest.mark.parametrize(
    "fields, message",
    [
        ({"gravity": 9.81}, "loads.gravity = 9.81: expected three"),
        ({"line": [0, np.nan, 1]}, "loads.line.*expected three finite"),
        ({"joints": [1, 2], "forces": [[0, 0, 1]]}, "loads.forces.*each of 2 joints"),
        ({"joints": [1], "forces": [0, 0, np.inf]}, "loads.forces.*finite"),
        ({"forces": [[0, 0, 1.0]]}, "loads.forces.*each of 0 joints"),
        ({"joints": "one"}, "loads.joints: expected numbers"),
    ],
)
def test_load_cases_say_what_is_wrong_with_them(fields, message):
    with pytest.raises(InputError, match=message):
        LoadCase(**fields)


def test_combinations(c_shell_data):
    """Factored sums of other cases; unknown names and supports that differ are refused."""
    cases = [
        {"name": "snow", "plan": [0, 0, -2.0]},
        {"name": "lamp", "points": [{"joint": 1, "force": [0, 0, -3.0]}]},
    ]
    both = {"name": "both", "factors": {"snow": 1.5, "lamp": 2}, "factor": 1.1}
    design = design_from_dict(c_shell_data | {"load_cases": cases, "combinations": [both]})
    found = {case.name: case for case in design.load_cases}["both"]
    assert found.plan.tolist() == [0, 0, -3] and found.forces.tolist() == [[0, 0, -6]]
    assert found.factor == 1.1 and not found.empty
    wrong = {"name": "wrong", "factors": {"wind": 1}}
    with pytest.raises(InputError, match=r"combinations\[0\].factors = 'wind': is no load case"):
        design_from_dict(c_shell_data | {"load_cases": cases, "combinations": [wrong]})
    held = [case | {"supports": list(range(k, k + 3))} for k, case in enumerate(cases)]
    with pytest.raises(InputError, match="held at different joints"):
        design_from_dict(c_shell_data | {"load_cases": held, "combinations": [both]})


def test_a_force_on_a_support_changes_nothing(dome, opened):
    case = LoadCase(
        joints=np.array([8]), forces=np.array([[3.0, -2.0, 5.0]]), supports=np.array([0, 8, 72, 80])
    )
    assert loaded_state(dome, opened, case).deflections.max() < 1e-9


def test_a_c_shell_under_the_loads_of_its_file(c_shell_data):
    c_shell_data["material"]["density"] = 0.01
    design = design_from_dict(
        c_shell_data
        | {
            "loads": {"gravity": [0, 0, -9.81], "points": [{"joint": 4, "force": [0, 0, -1e-3]}]},
            "supports": [0, 2, 6, 8],
        }
    )
    found = simulate(design)
    assert found.loaded.supports.tolist() == [0, 2, 6, 8]
    weight = (
        0.01 * 9.81 * 0.02 * 0.01 * design.scene("deployed").rest_lengths(design.parameters).sum()
    )
    assert found.loaded.total_force[2] == pytest.approx(-weight - 1e-3)
    down = found.loaded.equilibrium.state.positions[4, 2] - found.deployed.state.positions[4, 2]
    assert down < 0
    assert found.to_dict()["loaded"]["deflection"]["max"] >= -down
    assert simulate(design, LoadCase()).loaded is None


@pytest.mark.parametrize("pins, supports", [(None, (3, 4, 5)), ({"joints": "corners"}, (3,))])
def test_umbrella_meshes_stand_on_their_pins_or_corners(repository, pins, supports):
    """Rigid plates have no elements, but weigh as much as bending ones."""
    data = json.loads((repository / "models" / "umbrellas" / "hill.json").read_text())
    found = []
    for model in ("rods", "rigid"):
        design = design_from_dict(data | {"plate_model": model} | ({"pins": pins} if pins else {}))
        unloaded = design.deploy()["deployed"]
        found.append(loaded_state(design, unloaded, LoadCase(1000 * GRAVITY)))
        held = design.joints[found[-1].supports]
        assert len(held) in supports
        moved = found[-1].equilibrium.state.positions[held] - unloaded.state.positions[held]
        assert np.abs(moved).max() < 1e-8 * found[-1].size
        assert found[-1].deflections.max() > 1e-5 * found[-1].size
    assert found[0].total_force == pytest.approx(found[1].total_force, rel=1e-9)
    design.loads = found[-1].case
    assert design.with_plates("rods").loads is design.loads
    assert found[0].deflections.max() == pytest.approx(found[1].deflections.max(), rel=0.3)


def test_unusable_loads(dome, opened, c_shell_data):
    def loads(**changes):
        return loaded_state(dome, opened, replace(LoadCase(GRAVITY), **changes))

    with pytest.raises(InputError, match="supports.*one line"):
        loads(supports=np.array([0, 1, 2]) * 0)
    with pytest.raises(InputError, match="loads.points = 81: names a joint"):
        loads(joints=np.array([81]), forces=np.ones((1, 3)))
    with pytest.raises(InputError, match="supports = 99: names a joint"):
        design_from_dict(c_shell_data | {"supports": [0, 1, 99]}, "file")
    light = design_from_dict(c_shell_data)
    assert materials_of(light)[0].density is None
    with pytest.raises(InputError, match="material.density: self-weight needs"):
        simulate(light, LoadCase(GRAVITY))


@pytest.mark.parametrize(
    "change, message",
    [
        ({"loads": {"gravity": [0, 0]}}, "loads.gravity.*must have at least 3"),
        ({"loads": {"wind": 1}}, "loads.wind: unknown field"),
        # the unknown one is named, not one that is known
        ({"loads": {"gravity": [0, 0, -9.81], "suports": [1]}}, "suports: .*mean 'supports'"),
        ({"loads": {"points": [{"joint": 1}]}}, r"loads.points\[0\].force: is missing"),
        ({"supports": [1, 2]}, "supports.*at least 3"),
    ],
)
def test_fields_of_the_design_file(c_shell_data, write_json_file, change, message):
    with pytest.raises(InputError, match=message):
        load_design(write_json_file("design.json", c_shell_data | change))


def test_supports_may_stand_beside_the_loads_or_among_them(c_shell_data):
    held = {"supports": [0, 1, 2]}
    loads = {"gravity": [0, 0, -9.81]}
    (beside,) = design_from_dict(c_shell_data | {"loads": loads} | held).load_cases
    (among,) = design_from_dict(c_shell_data | {"loads": loads | held}).load_cases
    np.testing.assert_array_equal(among.supports, beside.supports)


def test_command_line(repository, capsys):
    path = str(repository / "models" / "grids" / "01_dome.json")
    assert main(["simulate", path, "--gravity", "20", "--json"]) == 0
    loaded = json.loads(capsys.readouterr().out)["loaded"]
    assert loaded["gravity"] == [0, 0, -20] and loaded["deflection"]["max_percent"] > 0
    assert loaded["strength"]["utilisation"] == pytest.approx(
        loaded["strength"]["equivalent_stress"] / 4e7
    )
    assert main(["simulate", path, "--gravity=0,0,-9.81", "--json"]) == 0
    deflection = json.loads(capsys.readouterr().out)["loaded"]["deflection"]["max"]
    assert main(["simulate", path, "--gravity=0,0,-9.81"]) == 0
    text = capsys.readouterr().out
    assert f"deflection       max {deflection:.3g} m" in text and "of the elastic limit" in text
    with pytest.raises(SystemExit):
        main(["simulate", path, "--gravity", "1,2"])
    assert "expected a number or X,Y,Z" in capsys.readouterr().err


CASES = [
    {"name": "snow", "plan": [0, 0, -2.0], "supports": [0, 4, 20, 24]},
    {"name": "weight", "gravity": [0, 0, -9.81], "supports": [0, 4, 20, 24]},
]


def simulated(tmp_path, repository, capsys, arguments=(), **fields):
    """What `kop simulate` says of a coarse dome with more fields, as data and as text."""
    path = tmp_path / "dome.json"
    path.write_text(json.dumps({**coarse_grid(repository, "01_dome", 0), **fields}))
    assert main(["simulate", str(path), *arguments, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert main(["simulate", str(path), *arguments]) == 0
    return found, capsys.readouterr().out


def test_loads_of_the_command_line_replace_the_load_cases(tmp_path, repository, capsys):
    """Whichever of them is the first, which was added to them once."""
    forces = [
        simulated(tmp_path, repository, capsys, ["--line", "3"], load_cases=cases)[0]["loaded"]
        for cases in (CASES, CASES[::-1])
    ]
    alone = simulated(tmp_path, repository, capsys, ["--line", "3"], supports=[0, 4, 20, 24])[0]
    for loaded in forces:
        assert loaded["total_force"] == pytest.approx(alone["loaded"]["total_force"])
        assert loaded["supports"] == [0, 4, 20, 24]


@pytest.mark.parametrize("inside", [True, False])
def test_every_load_case_has_its_reactions(tmp_path, repository, capsys, inside):
    """With supports of its own, or those of the design."""
    cases, fields = CASES, {}
    if not inside:
        cases = [{k: v for k, v in case.items() if k != "supports"} for case in CASES]
        fields = {"supports": [0, 4, 20, 24]}
    found, text = simulated(tmp_path, repository, capsys, load_cases=cases, **fields)
    assert found["loaded"]["case"] == "snow" and "load, snow" in text
    for name in ("snow", "weight"):
        check = found["load_cases"][name]
        total = np.add(np.sum(check["reactions"], axis=0), check["total_force"])
        assert np.abs(total).max() < 1e-6 * np.abs(check["reactions"]).max()
    assert text.count("reactions up to") == 2


def test_a_state_behind_a_jump_is_not_stable(tmp_path, repository, capsys):
    loads = {"points": [{"joint": 12, "force": [0, 0, -1e5]}], "supports": [0, 4, 20, 24]}
    found, text = simulated(tmp_path, repository, capsys, loads=loads)
    critical = found["load_cases"]["loads"]["critical_factor"]
    assert 0 < critical < 1 and found["load_cases"]["loads"]["stable"] is False
    if "loaded" in found:
        assert found["loaded"]["stable"] is False and found["loaded"]["reached"] is False
        assert f"no: it buckles at {critical:.3g} of the load" in text


def test_what_is_missing_or_nothing_is_named(tmp_path, repository, capsys):
    data = coarse_grid(repository, "01_dome", 0)
    path = tmp_path / "dome.json"

    def refused(*arguments, **fields):
        path.write_text(json.dumps({**data, **fields}))
        assert main(["simulate", str(path), *arguments]) == 2
        return capsys.readouterr().err

    bare = {k: v for k, v in data["material"].items() if k != "density"}
    assert f"{path}: material.density" in refused("--gravity", material=bare)
    assert "--gravity: nothing acts" in refused("--gravity", "0")
    assert "nothing acts" in refused(loads={"gravity": [0, 0, 0]})
    cases = [{"name": "a", "plan": [0, 0, -1]}]
    nothing = [{"name": "none", "factors": {"a": 0}}]
    assert "none: nothing acts" in refused(load_cases=cases, combinations=nothing)
    assert "names something twice" in refused(supports=[0, 0, 4])


def test_negative_values_need_no_sign_of_equality(tmp_path, repository, capsys):
    down = simulated(tmp_path, repository, capsys, ["--gravity", "-1,0,-9.81"])[0]
    assert down["loaded"]["gravity"] == [-1, 0, -9.81]
    up = simulated(tmp_path, repository, capsys, ["--plan", "-5e-1"])[0]
    assert up["loaded"]["total_force"][2] > 0


def test_rods_that_sag_between_joints(repository):
    """By beam theory; and so few elements that it tells are said."""
    told = {}
    for pieces in (2, 16):
        data = {**coarse_grid(repository, "01_dome", 0), "elements_per_piece": pieces}
        design = design_from_dict(data)
        joints = list(range(len(design.joints)))
        result = simulate(design, LoadCase(line=[0, 0, -200.0], supports=joints), warn=False)
        told[pieces] = result.loaded.deflections.max(), any("sag" in w for w in result.warnings)
    assert told[2][1] and not told[16][1]
    assert 0.88 * told[16][0] < told[2][0] < 0.95 * told[16][0]
    shell = load_design(repository / "models" / "small" / "01_sinh.json")
    held = LoadCase(line=[0, 0, -1.0], supports=list(range(len(shell.joints))))
    assert any("sag" in warning for warning in simulate(shell, held, warn=False).warnings)
