"""The opening angle: its sense does not depend on how the curves are listed, and it has limits."""

import copy
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.analysis.simulation import simulate
from kop_exudyn.errors import InputError, SimulationFailure
from kop_exudyn.geometry.network import network_from_dict
from kop_exudyn.io.designs import load_design
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.structures.base import design_from_dict


def scissor(half_angle: float, n: int = 4, turn: float = 0.0) -> list[np.ndarray]:
    """A rhombic net of 2 n straight laths at plus and minus half an angle to the line at `turn`."""
    u, v = (np.array([np.cos(turn + a), np.sin(turn + a)]) for a in (half_angle, -half_angle))
    laths = [np.array([k * v - 0.2 * u, k * v + (n - 0.8) * u]) for k in range(n)]
    return laths + [np.array([k * u - 0.2 * v, k * u + (n - 0.8) * v]) for k in range(n)]


def design(laths, opening: float, version: int = 2) -> dict:
    return {
        "format": "kop_exudyn/design",
        "version": version,
        "class": "c_shell",
        "name": "scissor",
        "material": {"young": 2.1e9, "poisson": 0.35},
        "section": {"type": "rectangle", "width": 0.02, "height": 0.004},
        "curves": [{"type": "polyline", "points": lath.tolist()} for lath in laths],
        "opening": {"angle": opening},
    }


@settings(deadline=None, max_examples=60)
@given(
    half=st.floats(0.1, 0.77),
    turn=st.floats(0, 2 * np.pi),
    seed=st.integers(0, 1000),
)
def test_the_acute_angle_opens_however_the_curves_are_drawn(half, turn, seed):
    rng = np.random.default_rng(seed)
    laths = scissor(half, turn=turn)
    laths = [laths[k][:: rng.choice([1, -1])] for k in rng.permutation(len(laths))]
    net = network_from_dict(design(laths, 0.1))
    np.testing.assert_allclose(net.opening_angles, 2 * half, atol=1e-9)


@pytest.mark.parametrize("turn", [0.0, 0.3, -0.7, 2.0])
def test_at_right_angles_the_family_along_x_comes_first(turn):
    laths = scissor(np.pi / 4, turn=turn + np.pi / 4)  # families at `turn` and upright to it
    found = set()
    for order in (laths, laths[::-1]):
        net = network_from_dict(design(order, 0.1))
        first = net.directions[0, 0]
        found.add(round(float(abs(np.cos(first))), 9))
        assert net.opening_angles == pytest.approx(np.pi / 2)
    assert len(found) == 1
    (along,) = found
    assert along >= np.sqrt(0.5) - 1e-9


def test_files_of_version_1_open_from_the_first_curve():
    laths = scissor(0.3)
    for order, angle in ((laths, np.pi - 0.6), (laths[::-1], 0.6)):
        net = network_from_dict(design(order, 0.1, version=1))
        assert net.opening_angles == pytest.approx(angle)


def test_both_orders_open_into_the_same_shape(repository):
    data = json.loads((repository / "models" / "small" / "03_exp.json").read_text())
    data["version"] = 2
    found = [
        simulate(design_from_dict(data | {"curves": curves}))
        for curves in (data["curves"], data["curves"][::-1])
    ]
    sizes = [np.sort(np.linalg.norm(s.joints - s.joints.mean(axis=0), axis=1)) for s in found]
    np.testing.assert_allclose(sizes[0], sizes[1], rtol=1e-5)
    energies = [state.deployed.elastic_energy for state in found]
    assert energies[1] == pytest.approx(energies[0], rel=1e-5)
    opening = data["opening"]["angle"]
    for state in found:
        told = state.to_dict()
        assert told["opening_angle"] - np.pi / 2 == pytest.approx(opening, abs=0.01)
        assert told["assembly_angle"] == pytest.approx(np.pi / 2, abs=0.01)


@pytest.mark.parametrize("opening", [-1.1, 2.2])
def test_a_scissor_stops_where_it_is_closed(opening):
    with pytest.raises(InputError, match="opening.angle = .* from 57.3° to") as caught:
        design_from_dict(design(scissor(0.5), opening))
    assert "an opening between -57.3 and 122.7° is possible" in str(caught.value)


def test_a_braced_net_is_not_opened_by_spinning_a_hinge(triaxial):
    """Three families of laths: their triangles keep all angles, so only a hinge that passes
    through the closed position could meet the mean."""
    with pytest.raises(SimulationFailure, match="takes the two through each other"):
        simulate(design_from_dict(triaxial))


@pytest.fixture
def triaxial() -> dict:
    """Three families, each lath crossing those of the other two away from their crossings."""
    laths = [np.array([[-0.2, y], [4.2, y]]) for y in (0.5, 1.4, 2.3)]
    for sign in (1, -1):
        along = np.array([0.5, sign * np.sqrt(0.75)])
        for k in range(4):
            start = np.array(
                [0.2 + 1.04 * k + (0 if sign > 0 else -0.9), -0.2 if sign > 0 else 3.0]
            )
            laths.append(np.array([start, start + 3.6 * along]))
    return design(laths, 0.5) | {"free_ends": True}


def test_a_dangling_lath_is_named():
    laths = [np.array([[-0.2, k], [3.2, k]]) for k in range(4)]
    laths += [np.array([[k, -0.2], [k, 3.2]]) for k in range(4)]
    laths.append(np.array([[2.5, 2.5], [2.6, 3.4]]))
    data = design(laths, 0.3) | {"free_ends": True}
    with pytest.raises(
        InputError, match=r"curves\[8\]: turns about .* without the rest of the net"
    ):
        design_from_dict(copy.deepcopy(data))


def test_searches_do_not_pass_through_states_with_laths_through_each_other(repository):
    """Elements far from the input's have an equilibrium in which a hinge has turned beyond closed:
    a failed trial, which names the hinge."""
    design = load_design(repository / "models" / "small" / "03_exp.json")
    rng = np.random.default_rng(9)
    q = design.parameters * (1 + 0.1 * rng.normal(size=len(design.parameters)))
    objective = DesignObjective(design)
    with pytest.raises(SimulationFailure, match=r"deployed state: the hinge of curves\[0\] and"):
        objective.evaluate(q)
    design.check_state = lambda role, state: None  # as if none of its states were checked
    state = objective.evaluate(q).equilibria[design.fitted_role.name].state
    angles = state.angles[: design.network.n_joints]
    assert angles.min() < 0 or angles.max() > np.pi
    near = design.parameters * (1 + 1e-3 * rng.normal(size=len(design.parameters)))
    assert objective.evaluate(near).fit.max_percent < 1
