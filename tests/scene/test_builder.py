from __future__ import annotations

import numpy as np
import pytest

from kop_exudyn.errors import InputError, SimulationFailure
from kop_exudyn.rods.rotations import exp_so3, log_so3, rotation_z
from kop_exudyn.rods.sections import rectangle
from kop_exudyn.scene.builder import SceneBuilder

K = np.ones(6)


def two_rods() -> SceneBuilder:
    """Two pieces of two elements in a corner of 0.3 rad."""
    builder = SceneBuilder(3)
    bodies = builder.bodies(np.arange(15.0).reshape(5, 3))
    corner = builder.hinges([0.3], parameter=2, prescribed=True)
    nodes = builder.nodes(bodies)
    after = builder.nodes([bodies[2]], corner[0])
    builder.rod(nodes[:3], K, length=1.0, parameter=0, factor=2.0, section=rectangle(1, 1))
    builder.rod([after[0], *nodes[3:]], K, length=[1.0, 3.0])
    builder.pin(bodies[0])
    return builder


def test_numbers_run_on():
    builder = SceneBuilder()
    assert builder.bodies(np.zeros((3, 3))).tolist() == [0, 1, 2]
    assert builder.bodies([[0.0, 0, 0]]).tolist() == [3]
    assert builder.hinges([0.0, 1.0]).tolist() == [0, 1]
    assert builder.hinges(0.5).tolist() == [2]
    assert builder.nodes([0, 1]).tolist() == [0, 1]
    assert builder.nodes(2).tolist() == [2]
    assert builder.rod([0, 1, 2], K, length=1.0).tolist() == [0, 1]
    assert builder.rod([2, 0], K, length=1.0).tolist() == [2]


def test_lengths_are_shared_equally_or_given_one_by_one():
    scene = two_rods().build()
    assert np.allclose(scene.rest_lengths(np.array([0.25, 0, 0])), [0.75, 0.75, 1.0, 3.0])
    assert [chain.elements.tolist() for chain in scene.chains] == [[0, 1], [2, 3]]
    assert scene.chains[0].section.area == 1


@pytest.mark.parametrize("length", [-0.5, -1.0, np.nan])
def test_lengths_that_are_not_positive_are_a_failed_simulation(length):
    with pytest.raises(SimulationFailure, match="rest length of element 0"):
        two_rods().build().rest_lengths(np.array([length, 0, 0]))


def test_node_poses():
    builder = SceneBuilder()
    body = builder.bodies([[1.0, 2, 3]], rotation_z(np.pi / 2)[None])
    other = builder.bodies([[0.0, 0, 0]])
    hinge = builder.hinges([np.pi / 2])
    frame = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    node = builder.nodes(body, hinge, frame, [2.0, 0, 5])
    builder.rod([node[0], builder.nodes(other)[0]], K, length=1.0)
    scene = builder.build()
    x, R = scene.node_poses(scene.initial)
    assert np.allclose(x[0], [1 - 2, 2, 3 + 5])  # turned by pi about z
    assert np.allclose(R[0], rotation_z(np.pi) @ frame)


def test_hinges_turn_about_their_own_axis_and_centre():
    builder = SceneBuilder()
    body = builder.bodies([[1.0, 2, 3]])
    hinge = builder.hinges([np.pi / 2], axis=[3, 0, 0], centre=[0, 1, 0])
    node = builder.nodes(body, hinge, offset=[2.0, 5, 0])
    builder.rod([node[0], builder.nodes(builder.bodies([[0.0, 0, 0]]))[0]], K, length=1.0)
    scene = builder.build()
    x, R = scene.node_poses(scene.initial)
    assert np.allclose(scene.hinge_axis, [[1, 0, 0]])
    assert np.allclose(x[0], [1 + 2, 2 + 1, 3 + 5])
    assert np.allclose(R[0], [[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    arms, rates = scene.node_arms(scene.initial)
    assert (
        np.allclose(arms[0], [2, 1, 5]) and np.allclose(rates[0], [0, -5, 0]) and not rates[1].any()
    )


def test_prescriptions_follow_the_parameters():
    builder = two_rods()
    builder.prescribe(3, 1, parameter=1, factor=2.0, constant=0.5)
    scene = builder.build()
    state = scene.with_driven(scene.initial, np.array([0.0, 10.0, 0.1]))
    assert state.positions[3].tolist() == [9.0, 20.5, 11.0]
    assert state.angles[0] == pytest.approx(0.4)
    assert scene.initial.angles[0] == 0.3


@pytest.mark.parametrize("free", [(), (0,), (1,), (2,), (0, 1, 2)])
def test_states_brought_to_the_pins(free):
    """Held places, turns and angles are the scene's, what is free stays as it is."""
    builder = two_rods()
    builder.hinges([0.2], prescribed=True)
    builder.pin(3, (1, *(3 + k for k in range(3) if k not in free)))
    scene = builder.build()
    q = np.array([0.0, 10.0, 0.1])
    there = scene.initial.moved(np.random.default_rng(1).normal(size=scene.n_dofs))
    state = scene.held(there, q)
    assert np.array_equal(state.positions[0], scene.initial.positions[0])
    assert state.positions[3, 1] == scene.initial.positions[3, 1]
    assert np.array_equal(state.positions[3, ::2], there.positions[3, ::2])
    assert state.angles.tolist() == pytest.approx([0.4, 0.2])
    turn = log_so3(scene.initial.rotations[3].T @ state.rotations[3])
    assert np.abs(np.delete(turn, free)).max(initial=0.0) < 1e-14
    if len(free) != 1:
        assert np.array_equal(
            there.rotations[3] if free else scene.initial.rotations[3], state.rotations[3]
        )
    else:  # the nearest of the turns that are left
        near = [
            np.trace(there.rotations[3].T @ scene.initial.rotations[3] @ exp_so3(a * turn))
            for a in (0.99, 1.0, 1.01)
        ]
        assert np.argmax(near) == 1
    again = scene.held(state, q)
    assert np.array_equal(again.rotations, state.rotations)


def test_pins_hold_bodies_and_constant_hinges():
    builder = two_rods()
    builder.hinges([0.2], prescribed=True)
    builder.pin(1, (2,))
    scene = builder.build()
    assert np.flatnonzero(scene.pinned).tolist() == [0, 1, 2, 3, 4, 5, 8, 31]


def test_variants_leave_the_scene_alone():
    scene = two_rods().build()
    assert scene.with_weight(np.ones((4, 3))).weight.shape == (4, 3) and scene.weight is None
    assert scene.with_pins(np.zeros(31)).pinned.dtype == bool and scene.pinned.any()
    assert scene.with_terms("load").terms == ("load",) and scene.terms == ()


def test_size_and_length_scale_come_from_the_nodes():
    scene = two_rods().build()
    assert scene.length_scale == pytest.approx(np.sqrt(27))
    assert scene.size == pytest.approx(4 * np.sqrt(27))
    assert np.allclose(scene.polylines(scene.initial)[0], np.arange(9.0).reshape(3, 3))


@pytest.mark.parametrize(
    "spoil",
    [
        lambda b: b.rod([0], K, length=1.0),
        lambda b: b.rod([0, 0], K, length=1.0),  # one body at both ends
        lambda b: b.rod([0, 1], K, parameter=3),
        lambda b: b.hinges([0.0], parameter=7, prescribed=True),
        lambda b: b.hinges([0.0, 0.0], axis=[[0, 0, 1], [0, 0, 0]]),
        lambda b: b.hinges([0.0], axis=[0, np.nan, 1]),
        lambda b: b.prescribe(1, 0, parameter=3),
    ],
)
def test_pieces_that_do_not_fit(spoil):
    builder = two_rods()
    with pytest.raises(InputError):
        spoil(builder)
        builder.build()


def test_a_scene_needs_a_rod():
    with pytest.raises(InputError):
        SceneBuilder().build()
