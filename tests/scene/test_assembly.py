"""Assembled energy, gradient and Hessian of scenes with every feature."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kop_exudyn.equilibrium.system import System
from kop_exudyn.rods import element
from kop_exudyn.rods.rotations import axes_along_z
from kop_exudyn.scene.assembly import ENERGY, GRADIENT, HESSIAN
from kop_exudyn.scene.state import State

pytestmark = pytest.mark.usefixtures("kernels")
SEEDS = [0, 1, 2, 3, 4]


def potential_by_hand(scene, q, state) -> tuple[float, float]:
    """Elastic energy and potential, from node poses and the NumPy element."""
    x, R = scene.node_poses(state)
    tail, head = scene.elements.T
    L = scene.rest_lengths(q)
    elastic = element.evaluate(
        x[tail], R[tail], x[head], R[head], L, scene.stiffness, scene.rest_strain
    )[0].sum()
    load = -0.5 * np.einsum("e,ei,ei->", L, scene.weight, x[tail] + x[head])
    return elastic, elastic + load + sum(term.energy(state) for term in scene.terms)


def kept_hessian(system: System) -> np.ndarray:
    """The assembled matrix (n_kept, n_kept), driven unknowns last."""
    s = system.sparsity
    n = s.n_free
    upper = np.zeros((n + s.n_driven,) * 2)
    upper[:n, :n] = s.free_matrix(system.values).toarray()
    block, corner = s.driven_columns(system.values[s.n_factor_values :])
    upper[:n, n:], upper[n:, n:] = block.toarray(), corner.toarray()
    return upper + np.triu(upper, 1).T


def assembled(case, state=None, order=HESSIAN, mixed=False):
    system = System(case.scene)
    system.set_parameters(case.q)
    energy = system.assemble(case.state if state is None else state, order, mixed)
    return system, energy


@pytest.mark.parametrize("seed", SEEDS)
def test_energies_of_all_orders_are_those_of_the_numpy_element(case_of, seed):
    case = case_of(seed)
    elastic, potential = potential_by_hand(case.scene, case.q, case.state)
    for order in (ENERGY, GRADIENT, HESSIAN):
        energy = assembled(case, order=order)[1]
        assert energy.elastic == pytest.approx(elastic, rel=1e-12)
        assert energy.potential == pytest.approx(potential, rel=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_gradient_and_hessian_by_taylor(case_of, seed):
    """Along increments of all unknowns that are not pinned, the driven ones included."""
    case = case_of(seed)
    system, energy = assembled(case)
    g, H = system.gradient.copy(), kept_hessian(system)
    kept = np.flatnonzero(system.sparsity.kept >= 0)
    place = system.sparsity.kept[kept]
    directions = np.random.default_rng(seed).normal(size=(8, len(place))) / 10
    steps = 2.0 ** -np.arange(3, 8)
    remainders = np.zeros((len(steps), 2))
    for d in directions:
        increment = np.zeros(case.scene.n_dofs)
        increment[kept] = d[place]
        for row, h in zip(remainders, steps):
            change = (
                assembled(case, case.state.moved(h * increment), ENERGY)[1].potential
                - energy.potential
            )
            row += abs(change - h * (g @ d)), abs(change - h * (g @ d) - 0.5 * h * h * (d @ H @ d))
    slopes = np.polyfit(np.log(steps), np.log(remainders), 1)[0]
    assert slopes == pytest.approx([2, 3], abs=0.15)


@pytest.mark.parametrize("seed", SEEDS)
def test_gradient_alone_is_the_same(case_of, seed):
    case = case_of(seed)
    with_hessian, alone = assembled(case)[0], assembled(case, order=GRADIENT)[0]
    assert np.allclose(
        alone.gradient, with_hessian.gradient, rtol=1e-13, atol=1e-13 * np.abs(alone.gradient).max()
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_mixed_assembly_at_the_own_stress_is_the_plain_one(case_of, seed):
    """The predicted stress enters the Hessian alone, and linearly."""
    case = case_of(seed)
    system, _ = assembled(case)
    plain, gradient, stress = system.values.copy(), system.gradient.copy(), system.stress()
    system.predicted_stress[:] = stress
    system.assemble(case.state, mixed=True)
    assert np.allclose(system.values, plain, atol=1e-12 * np.abs(plain).max())
    other = np.random.default_rng(0).normal(size=stress.shape)
    shares = []
    for predicted in (other, 2 * other, 0 * other):
        system.predicted_stress[:] = predicted
        system.assemble(case.state, mixed=True)
        assert np.allclose(system.gradient, gradient)
        shares.append(system.values.copy())
    assert np.allclose(
        shares[1] - shares[0], shares[0] - shares[2], atol=1e-11 * np.abs(plain).max()
    )
    assert not np.allclose(shares[0], plain)


@pytest.mark.parametrize("seed", SEEDS)
def test_predicted_stress_is_the_linearised_one(case_of, seed):
    case = case_of(seed)
    system, _ = assembled(case)
    d = np.random.default_rng(seed).normal(size=system.n_unknowns)
    h = 1e-6
    system.predict_stress(np.zeros_like(d))
    now = system.predicted_stress.copy()
    assert np.allclose(now, system.stress())
    system.predict_stress(d)
    change = system.predicted_stress - now
    ahead, back = (
        assembled(case, case.state.moved(system.increment(sign * h * d)))[0].stress()
        for sign in (1, -1)
    )
    assert np.allclose((ahead - back) / (2 * h), change, atol=1e-7 * np.abs(change).max())


def test_elements_add_up(case_of):
    """The assembled matrix against a dense sum over scenes of one element or one term each."""
    case = case_of(7)
    scene = case.scene
    system, _ = assembled(case)
    H, g = np.zeros((scene.n_dofs,) * 2), np.zeros(scene.n_dofs)
    alone = [
        replace(
            scene,
            **{
                name: getattr(scene, name)[[e]]
                for name in (
                    "elements",
                    "stiffness",
                    "rest_strain",
                    "length_constant",
                    "length_factor",
                    "length_parameter",
                    "weight",
                )
            },
            terms=(),
        )
        for e in range(len(scene.elements))
    ]
    for part in alone:
        small = System(part)
        small.set_parameters(case.q)
        small.assemble(case.state)
        _add(H, g, small)
    for term in scene.terms:
        _, blocks, squares = term.gradient_hessian(case.state)
        for rows, block, square in zip(term.dofs, blocks, squares):
            np.add.at(g, rows, block)
            np.add.at(H, np.ix_(rows, rows), square)
    kept = np.argsort(np.where(system.sparsity.kept < 0, scene.n_dofs, system.sparsity.kept))[
        : len(system.gradient)
    ]
    assert np.allclose(system.gradient, g[kept], atol=1e-12 * np.abs(g).max())
    assert np.allclose(kept_hessian(system), H[np.ix_(kept, kept)], atol=1e-12 * np.abs(H).max())


def _add(H: np.ndarray, g: np.ndarray, system: System) -> None:
    kept = np.flatnonzero(system.sparsity.kept >= 0)
    place = system.sparsity.kept[kept]
    g[kept] += system.gradient[place]
    H[np.ix_(kept, kept)] += kept_hessian(system)[np.ix_(place, place)]


def test_rigid_placement_does_not_matter(case_of):
    """A turned and shifted scene without loads: the same energy, forces turned, moments in body
    axes the same."""
    case = case_of(3)
    scene = case.scene.with_terms().with_weight(None).with_pins(np.zeros(case.scene.n_dofs, bool))
    Q, t = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]), np.array([1.0, 2, 3])
    system = System(scene)
    system.set_parameters(case.q)
    energies, gradients = [], []
    for state in (case.state, case.state.transformed(Q, t)):
        energies.append(system.assemble(state).elastic)
        gradients.append(system.gradient[system.sparsity.kept])
    assert energies[1] == pytest.approx(energies[0], rel=1e-12)
    n = 6 * scene.n_bodies
    (on_bodies, turned), (on_hinges, same) = (
        [g[:n].reshape(-1, 6) for g in gradients],
        [g[n:] for g in gradients],
    )
    assert np.allclose(on_bodies[:, :3] @ Q.T, turned[:, :3]) and np.allclose(
        on_bodies[:, 3:], turned[:, 3:]
    )
    assert np.allclose(on_hinges, same)


@pytest.mark.parametrize("seed", SEEDS)
def test_hinges_with_axes_of_their_own_are_those_of_bodies_turned(case_of, seed):
    """The same scene with every hinged body's axes laid into its hinge, whose axis is then the
    body's z axis."""
    case = case_of(seed)
    scene = case.scene.with_terms()
    axes, centres = np.tile(np.eye(3), (scene.n_bodies, 1, 1)), np.zeros((scene.n_bodies, 3))
    for body, hinge in zip(scene.node_body, scene.node_hinge):
        if hinge >= 0:
            axes[body], centres[body] = (
                axes_along_z(scene.hinge_axis[hinge]),
                scene.hinge_centre[hinge],
            )
    A, p = (
        axes[scene.node_body],
        np.where(scene.node_hinge[:, None] < 0, centres[scene.node_body], 0.0),
    )
    laid = replace(
        scene,
        hinge_axis=np.tile([0.0, 0, 1], (scene.n_hinges, 1)),
        hinge_centre=np.zeros((scene.n_hinges, 3)),
        node_frame=np.swapaxes(A, 1, 2) @ scene.node_frame,
        node_offset=np.einsum("nji,nj->ni", A, scene.node_offset - p),
    )
    state = case.state
    places = state.positions + np.einsum("bij,bj->bi", state.rotations, centres)
    same = State(places, state.rotations @ axes, state.angles)
    for first, second in zip(scene.node_poses(state), laid.node_poses(same)):
        assert np.allclose(first, second, atol=1e-13)
    systems = System(scene), System(laid)
    for system, at in zip(systems, (state, same)):
        system.set_parameters(case.q)
        assert system.assemble(at).elastic == pytest.approx(
            systems[0].assemble(state).elastic, rel=1e-12
        )
    hinges = systems[0].sparsity.kept[6 * scene.n_bodies :]
    assert np.allclose(*(system.gradient[hinges[hinges >= 0]] for system in systems), rtol=1e-10)
    blocks = [
        kept_hessian(system)[np.ix_(hinges[hinges >= 0], hinges[hinges >= 0])] for system in systems
    ]
    assert np.allclose(*blocks, atol=1e-10 * np.abs(blocks[0]).max())
