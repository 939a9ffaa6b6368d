"""What can move without resistance is no equilibrium of a design."""

from __future__ import annotations

import numpy as np
import pytest

from kop_exudyn.equilibrium.newton import NewtonOptions, solve
from kop_exudyn.equilibrium.system import System
from kop_exudyn.errors import SimulationFailure
from kop_exudyn.rods.rotations import exp_so3
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.scene.loads import DeadForces
from kop_exudyn.structures.base import design_from_dict

STIFFNESS = np.array([2e5, 1e5, 1e5, 0.8, 1.0, 2.0])
UPRIGHT = np.column_stack([[0, 0, 1], [0, 1, 0], [-1, 0, 0.0]])


def frame(*, braced: bool, scale: float = 1.0, turn=(0.0, 0.0, 0.0)):
    """A table frame of three rods, its feet hinged: it sways unless a diagonal braces it."""
    build = SceneBuilder()
    R = exp_so3(np.array([turn], float))[0]
    places = scale * np.array([[0, 0, 0], [0, 0, 1], [1.3, 0, 1], [1.3, 0, 0.0]])
    bodies = build.bodies(places @ R.T, R)
    hinges = build.hinges(np.zeros(4), axis=(0.0, 1.0, 0.0))
    axes = [UPRIGHT, np.eye(3), UPRIGHT @ np.diag([-1.0, 1, -1])]
    K = STIFFNESS * np.repeat([1.0, scale**2], 3)
    for k in range(3):
        tail = build.nodes(bodies[k : k + 1], hinges[k : k + 1], axes[k])
        head = build.nodes(bodies[k + 1 : k + 2], -1 if k < 2 else hinges[3:], axes[k])
        inner = build.bodies((places[k] + places[k + 1])[None] / 2 @ R.T, (R @ axes[k])[None])
        build.rod(
            [tail[0], build.nodes(inner)[0], head[0]],
            K,
            length=float(np.linalg.norm(places[k + 1] - places[k])),
        )
    if braced:
        gap = places[2] - places[0]
        x = gap / np.linalg.norm(gap)
        axis = np.column_stack([x, [0, 1, 0], np.cross(x, [0, 1, 0])])
        middle = build.bodies(gap[None] / 2 @ R.T, (R @ axis)[None])
        ends = build.nodes(bodies[[0, 2]], -1, axis)
        build.rod([ends[0], build.nodes(middle)[0], ends[1]], K, length=float(np.linalg.norm(gap)))
    for body in (0, 3):
        build.pin(body)
    return build.build()


PLACES = [(1.0, (0, 0, 0)), (1e-3, (0.3, -1.0, 0.7)), (1e4, (2.0, 0.4, -0.5))]


@pytest.mark.parametrize("mixed", [True, False])
@pytest.mark.parametrize("scale, turn", PLACES)
def test_a_mechanism_is_refused_in_any_unit_and_attitude(scale, turn, mixed):
    options = NewtonOptions(mixed=mixed)
    with pytest.raises(SimulationFailure, match="mechanism"):
        solve(System(frame(braced=False, scale=scale, turn=turn)), np.zeros(0), options=options)
    found = solve(System(frame(braced=True, scale=scale, turn=turn)), np.zeros(0), options=options)
    assert found.stable


def test_a_free_body_is_a_mechanism(strut):
    """A rod that nothing holds, loaded in balance."""
    build = SceneBuilder()
    bodies = build.bodies(np.linspace([0, 0, 0], [1, 0, 0], 5))
    build.rod(build.nodes(bodies), STIFFNESS, length=1.0)
    build.term(DeadForces([0, 4], [[-0.1, 0, 0], [0.1, 0, 0]]))
    with pytest.raises(SimulationFailure, match="mechanism"):
        solve(System(build.build()), np.zeros(0))


@pytest.mark.parametrize("load", [0.9, 0.999, 1 - 1e-6])
def test_what_is_soft_but_stiff_to_more_than_rounding_stands(strut, load):
    """A cantilever up to a part in 1e6 below its Euler load: the discrete one of 8 elements."""
    critical = _critical(strut)
    assert solve(System(strut(force=load * critical)), np.zeros(0)).stable


def _critical(strut) -> float:
    """The force at which the straight cantilever of the fixture becomes indefinite."""
    low, high = 1.0, 4.0
    for _ in range(50):
        force = 0.5 * (low + high)
        system = System(strut(force=force))
        system.set_parameters(np.zeros(0))
        straight = system.scene.initial
        compressed = straight.positions.copy()
        compressed[:, 0] *= 1 - force / 2e4
        system.assemble(type(straight)(compressed, straight.rotations, straight.angles))
        low, high = (low, force) if system.factorise() else (force, high)
    return low


def flat_grid(u: int, v: int) -> dict:
    return {
        "format": "kop_exudyn/design",
        "version": 1,
        "class": "grid",
        "name": "flat",
        "material": {"young": 2.1e9, "poisson": 0.35},
        "section": {"type": "rectangle", "width": 0.004, "height": 0.03},
        "surface": {"type": "analytic", "name": "paraboloid", "a": 0.0, "b": 0.0},
        "network": {
            "type": "isolines",
            "u": np.linspace(-0.8, 0.8, u).tolist(),
            "v": np.linspace(-0.7, 0.7, v).tolist(),
        },
        "elements_per_piece": 2,
    }


@pytest.mark.parametrize("u, v", [(2, 2), (3, 4), (4, 4), (5, 3)])
def test_flat_grids_shear_and_are_no_designs_unless_held(u, v):
    with pytest.raises(SimulationFailure, match='mechanism.*"held"'):
        design_from_dict(flat_grid(u, v)).deploy()
    held = design_from_dict(flat_grid(u, v) | {"held": "corners"})
    assert held.deploy()["deployed"].stable
