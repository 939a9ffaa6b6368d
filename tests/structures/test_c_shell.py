"""C-shells: elements, stress-free assembly, opening through the bifurcation, and every kind of
network."""

import copy
import json
import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kop_exudyn.analysis.simulation import simulate
from kop_exudyn.equilibrium.exudyn_confirm import confirm
from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.errors import InputError
from kop_exudyn.geometry.extent import size_of_points
from kop_exudyn.search.input_fit import fit_input
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.search.weights import Weights
from kop_exudyn.structures.base import design_from_dict

SMALL = 5  # joints a side


def small(data, n=SMALL):
    """The most curved corner of a conformal design, n x n joints, opened well past its
    bifurcation."""
    data = copy.deepcopy(data)
    side = len(data["curves"]) // 2
    keep = [c for c in range(2 * side) if c % side >= side - n]
    data["curves"] = [
        dict(data["curves"][c], points=data["curves"][c]["points"][-4 * (n - 1) - 1 :])
        for c in keep
    ]
    data["opening"]["angle"] = 0.8
    return data


@pytest.fixture(scope="module")
def conformal(repository):
    return json.loads((repository / "models" / "conformals" / "05_sine.json").read_text())


@pytest.fixture(scope="module")
def shell(conformal):
    return design_from_dict(small(conformal))


@pytest.fixture(scope="module")
def states(shell):
    return shell.deploy()


def ring(radius, n=24):
    t = 2 * np.pi * np.arange(n) / n
    return {
        "type": "spline",
        "closed": True,
        "points": (radius * np.stack([np.cos(t), np.sin(t)], axis=1)).tolist(),
    }


def spoke(angle, inner=0.8, outer=2.2, bend=0.5):
    r = np.linspace(inner, outer, 6)
    t = angle + bend * (r - inner)
    return {"type": "spline", "points": np.stack([r * np.cos(t), r * np.sin(t)], axis=1).tolist()}


def wavy(rng, n=4):
    t = np.linspace(-0.3, n - 0.7, 6)
    bump = lambda: 0.12 * rng.normal(size=6)  # noqa: E731
    rows = [np.stack([t, k + bump()], axis=1) for k in range(n)] + [
        np.stack([k + bump(), t], axis=1) for k in range(n)
    ]
    return [{"type": "spline", "points": x.tolist()} for x in rows]


# -- elements ----------------------------------------------------------------------------------
def test_elements_of_a_grid(shell):
    """J joints: J linear elements, two of them with one length, and J - 1 corners."""
    by_size = {(g.kind, g.indices.shape[1]): len(g.indices) for g in shell.groups}
    curves = 2 * SMALL
    assert by_size == {
        ("linear", 2): curves * (SMALL - 2),
        ("linear", 1): 2 * curves,
        ("angular", 1): curves * (SMALL - 1),
    }
    used = np.concatenate([g.indices.ravel() for g in shell.groups])
    np.testing.assert_array_equal(np.sort(used), np.arange(len(shell.parameters)))
    assert np.all(shell.lower <= shell.parameters) and np.all(shell.parameters <= shell.upper)


def test_a_loop_has_no_end_elements():
    curves = [ring(1.0), ring(1.4), ring(1.9)] + [spoke(a) for a in np.arange(8) * np.pi / 4]
    design = design_from_dict({**BARE, "curves": curves})
    sizes = {(g.kind, g.indices.shape[1]): len(g.indices) for g in design.groups}
    assert sizes == {("linear", 2): 3 * 8 + 8, ("linear", 1): 16, ("angular", 1): 3 * 8 + 8 * 2}


def test_free_ends_give_the_end_elements_their_second_length(conformal):
    data = small(conformal)
    lines = [
        {"type": "polyline", "points": p}
        for p in [[[-0.3, y], [2.3, y]] for y in (0, 1, 2)]
        + [[[x, -0.3], [x, 2.3]] for x in (0, 1, 2)]
    ]
    design = design_from_dict({**data, "curves": lines, "free_ends": True})
    assert {(g.kind, g.indices.shape[1]) for g in design.groups} == {("linear", 2), ("angular", 1)}
    full = next(g for g in design.groups if g.kind == "linear")
    values = np.sort(np.unique(np.round(design.parameters[full.indices], 9)))
    np.testing.assert_allclose(values, [0.3, 0.5])


# -- states ------------------------------------------------------------------------------------
def test_the_flat_smooth_network_is_unstressed(shell):
    assert shell.smooth_path[0].elastic_energy < 1e-15 * shell.smooth_path[-1].elastic_energy
    assert shell.smooth_path[0].iterations == 0


def test_it_opens_out_of_the_plane_and_both_designs_agree(shell, states):
    smooth, straight = shell.smooth_path[-1], states["deployed"]
    assert straight.stable and straight.opening == pytest.approx(shell.flat_angle + 0.8)
    heights = np.ptp(straight.state.positions[shell.joints, 2])
    assert heights > 0.05
    x, y = smooth.state.positions[shell.joints], straight.state.positions[shell.joints]
    np.testing.assert_allclose(x, y, atol=0.02 * heights)
    assert straight.elastic_energy == pytest.approx(smooth.elastic_energy, rel=0.02)


def test_costs_count_the_whole_way(shell, states):
    assert states["deployed"].iterations > sum(eq.iterations for eq in shell.smooth_path)


def test_both_sides_are_mirror_images(conformal, shell):
    data = small(conformal)
    data["opening"]["side"] = "down"
    below = design_from_dict(data)
    up, down = (d.smooth_path[-1].state.positions[shell.joints] for d in (shell, below))
    np.testing.assert_allclose(down, up * [1, 1, -1], atol=1e-8)


def test_straight_pieces_assemble_without_stress(states):
    assert states["rest"].elastic_energy < 1e-15 * states["deployed"].elastic_energy


def test_inflected_curves_assemble_without_stress_too():
    design = design_from_dict({**BARE, "curves": wavy(np.random.default_rng(3))})
    found = design.deploy()
    assert found["deployed"].stable
    assert found["rest"].elastic_energy < 1e-12 * found["deployed"].elastic_energy


def test_exudyn_confirms_both_states(shell, states):
    for role, equilibrium in states.items():
        confirmation = confirm(shell.scene(role), equilibrium)
        assert confirmation.newton_steps <= 2 and confirmation.moved < 1e-8


def test_the_target_passes_through_the_smooth_designs_joints(shell):
    from kop_exudyn.geometry.triangles import TriangleSurface

    target = shell.target
    at_joints = TriangleSurface(target.vertices, target.faces).closest(target.positions)
    assert at_joints.squared_distances.max() < 1e-24
    assert target.size == pytest.approx(size_of_points(target.vertices))


def test_an_imperfection_unfolds_the_buckling_of_the_rest_state(conformal):
    """Planar rest states stay in the plane; imperfect ones leave it without ever meeting a
    saddle."""
    planar, imperfect = (
        design_from_dict({**small(conformal), "rest": rest}) for rest in ("planar", "imperfect")
    )
    change = np.where(planar.layout.numbering.is_length, 2e-3, 0.02) * np.random.default_rng(
        1
    ).normal(size=len(planar.parameters))
    flat, bulged = (
        solve(d.systems["rest"], d.parameters + change, None, d.roles[1].opening)
        for d in (planar, imperfect)
    )
    assert np.abs(flat.state.positions[:, 2]).max() == 0
    assert np.abs(bulged.state.positions[:, 2]).max() > 1e-3 and bulged.escapes == 0
    assert bulged.elastic_energy < flat.elastic_energy


def test_rods_beside_each_other_along_the_joint_axis(conformal):
    design = design_from_dict({**small(conformal), "rod_offset": 0.004})
    x = design.smooth.node_poses(design.smooth_path[0].state)[0]
    assert np.ptp(x[:, 2]) == pytest.approx(0.004) and design.smooth_path[0].elastic_energy < 1e-12
    assert design.deploy()["deployed"].stable


def test_the_direction_in_which_curves_are_drawn_does_not_matter(conformal, shell):
    data = small(conformal)
    data["curves"][2]["points"].reverse()
    data["curves"][7]["points"].reverse()
    turned = design_from_dict(data)
    assert turned.flat_angle == pytest.approx(shell.flat_angle)
    order = [int(np.argmin(np.hypot(*(turned.network.joints - x).T))) for x in shell.network.joints]
    assert turned.roles[0].opening == pytest.approx(shell.roles[0].opening)
    x, y = (d.smooth_path[-1].state.positions for d in (turned, shell))
    np.testing.assert_allclose(x[order], y[shell.joints], atol=1e-6)


def test_it_travels_to_other_processes(shell, states):
    copied = pickle.loads(pickle.dumps(shell))
    again = solve(
        copied.systems["rest"], copied.parameters, states["rest"], copied.roles[1].opening
    )
    assert again.iterations == 0


# -- mistakes ----------------------------------------------------------------------------------
BARE = {
    "format": "kop_exudyn/design",
    "version": 1,
    "class": "c_shell",
    "name": "test",
    "material": {"young": 2.1e9, "poisson": 0.35},
    "section": {"type": "rectangle", "width": 0.03, "height": 0.004},
    "opening": {"angle": 0.3},
}


@pytest.mark.parametrize(
    "curves, field",
    [
        (
            [[[0, 0], [2, 0]], [[0, 1], [2, 1]], [[0.5, -1], [0.5, 2]], [[5, 5], [6, 6]]],
            r"curves\[3\].points: crosses no other",
        ),
        (
            [[[0, 0], [2, 0]], [[0, 1], [2, float("nan")]]],
            r"curves\[1\].points\[1\]\[1\] = nan: must be finite",
        ),
        ([[[0, 0], [2, 0]], [[0.5, -1], [0.5, 1]]], r"curves\[0\].points: nothing is left"),
        (
            [[[0, 0], [2, 0]], [[0, 1], [2, 1]], [[0.5, -1], [0.5, 2]]],
            r"curves\[2\]|nothing is left",
        ),
    ],
)
def test_mistakes_name_file_and_field(curves, field):
    data = {**BARE, "curves": [{"type": "polyline", "points": p} for p in curves]}
    with pytest.raises(InputError, match=field) as caught:
        design_from_dict(data, "bad.json")
    assert str(caught.value).startswith("bad.json: ")


def test_crossings_listed_without_a_place(c_shell_data):
    """Straight lines cross once: "near" may be left out."""
    pairs = [{"curves": [a, b]} for a in range(3) for b in range(3, 6)]
    assert len(design_from_dict({**c_shell_data, "crossings": pairs}).joints) == 9


# -- a mesh as target --------------------------------------------------------------------------
def write_mesh(path, vertices, faces):
    path.write_text(
        "".join(f"v {x:.12g} {y:.12g} {z:.12g}\n" for x, y, z in vertices)
        + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces)
    )


class TestMeshTargets:
    def test_its_own_target_elsewhere_is_the_same_target(self, conformal, shell, tmp_path):
        turn = Rotation.from_rotvec([0.05, -0.1, 0.2])
        own = shell.target
        write_mesh(tmp_path / "moved.obj", turn.apply(own.vertices) + 0.1 * own.size, own.faces)
        design = design_from_dict(
            small(conformal) | {"target": {"file": "moved.obj"}}, str(tmp_path / "shell.json")
        )
        places = turn.apply(own.positions) + 0.1 * own.size
        # slid along the surface a little
        assert np.abs(design.target.positions - places).max() < 0.02 * own.size
        mine, meshs = simulate(shell), simulate(design)
        assert meshs.fit.max_percent < mine.fit.max_percent + 0.1

    def test_the_fit_to_another_surface(self, conformal, shell, tmp_path):
        """A shell keeps to a mesh that is somewhat flatter than what it opens into."""
        own = shell.target
        flatter = own.vertices * [1.0, 1.0, 0.9]
        write_mesh(tmp_path / "flatter.obj", flatter, own.faces)
        design = design_from_dict(
            small(conformal) | {"target": {"file": "flatter.obj"}}, str(tmp_path / "shell.json")
        )
        before = DesignObjective(design, Weights(energy=0.0)).evaluate(design.parameters)
        after = fit_input(design, Weights(energy=0.0), max_steps=8)
        assert after.fit.value < 0.3 * before.fit.value and after.confirmations

    @pytest.mark.parametrize(
        "content, message",
        [
            (None, "target.file = .*: no such file"),
            ("v 0 0 0\n", "target.file = .*no.obj.: "),
            ("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "target.file"),
        ],
    )
    def test_unusable_meshes(self, content, message, conformal, tmp_path):
        if content is not None:
            (tmp_path / "no.obj").write_text(content)
        with pytest.raises(InputError, match=message):
            design_from_dict(
                small(conformal) | {"target": {"file": "no.obj"}}, str(tmp_path / "shell.json")
            ).target
