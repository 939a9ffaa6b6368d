"""A random scene that uses every feature, away from equilibrium."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from kop_exudyn.rods.rotations import exp_so3
from kop_exudyn.scene.attraction import Attraction
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.scene.loads import DeadForces, HingeTorques
from kop_exudyn.scene.scene import Scene
from kop_exudyn.scene.state import State


@dataclass(frozen=True)
class Case:
    scene: Scene
    q: np.ndarray
    state: State


def make_case(seed: int) -> Case:
    """8 bodies, 5 hinges (2 prescribed), nodes with frames and offsets, 9 pieces of 1 to 3
    elements, all loads."""
    rng = np.random.default_rng(seed)
    n_bodies, n_parameters = 8, 6
    builder = SceneBuilder(n_parameters)
    builder.bodies(rng.normal(size=(n_bodies, 3)), exp_so3(0.4 * rng.normal(size=(n_bodies, 3))))
    free = builder.hinges(
        0.5 * rng.normal(size=3),
        axis=[[0, 0, 1], *rng.normal(size=(2, 3))],
        centre=[[0, 0, 0], [0, 0, 0], 0.2 * rng.normal(size=3)],
    )
    driven = builder.hinges(
        [0.2],
        parameter=4,
        factor=-1.5,
        prescribed=True,
        axis=rng.normal(size=3),
        centre=0.2 * rng.normal(size=3),
    )
    fixed = builder.hinges([0.7], prescribed=True)
    hinge_of_body = {0: free[0], 1: free[1], 2: free[2], 3: driven[0], 4: fixed[0]}

    def node(body: int) -> int:
        hinge = hinge_of_body.get(body, -1) if rng.random() < 0.6 else -1
        frame = exp_so3(0.4 * rng.normal(size=3)) if rng.random() < 0.7 else None
        offset = 0.3 * rng.normal(size=3) if rng.random() < 0.7 else 0.0
        return builder.nodes([body], hinge, frame, offset)[0]

    for piece in range(9):
        between = rng.permutation(n_bodies)[: rng.integers(2, 5)]
        builder.rod(
            [node(b) for b in between],
            10 ** rng.uniform(-1, 1, 6),
            length=rng.uniform(1, 3),
            parameter=piece % 4 if piece < 6 else -1,
            factor=0.7,
            curvature=0.3 * rng.normal(size=3),
            weight=0.4 * rng.normal(size=3) if piece % 2 else None,
        )
    builder.prescribe(5, 1, parameter=5, factor=2.0, constant=0.1)
    builder.pin(6, (0, 2, 3, 5))
    builder.pin(7)
    builder.term(DeadForces([1, 5], rng.normal(size=(2, 3)), rng.normal(size=(2, 3))))
    builder.term(HingeTorques(free[:2], rng.normal(size=2), n_bodies))
    builder.term(
        Attraction([[0, 5], [2, 6]], targets=rng.normal(size=(2, 3)), target_weight=[0.5, 1.5])
    )
    builder.mean_angle(free[1:])
    scene = builder.build()
    q = rng.uniform(0.1, 0.5, n_parameters)
    state = scene.with_driven(scene.initial.moved(0.1 * rng.normal(size=scene.n_dofs)), q)
    return Case(scene, q, state)


@pytest.fixture
def case_of():
    """A function of a seed that makes a random case."""
    return make_case
