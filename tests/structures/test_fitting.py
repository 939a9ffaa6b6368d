"""Target fitting: derivatives, invariance under rigid motions and units, degenerate joints, bad
input."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from kop_exudyn.errors import InputError
from kop_exudyn.structures.base import Target
from kop_exudyn.structures.fitting import Placement, TargetFitting, best_placement


def height(x, y):
    return 0.3 * x**2 - 0.2 * y**2 + 0.1 * x * y


def saddle_target(n=9, unit=1.0):
    """A saddle, finely triangulated, wider than its 5 x 5 joints; the joints aren't vertices of
    it."""
    x, y = (
        a.ravel() for a in np.meshgrid(np.linspace(-2, 2, n), np.linspace(-2, 2, n), indexing="ij")
    )
    vertices = unit * np.column_stack([x, y, height(x, y)])
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate(
        [
            np.column_stack([corner, corner + n, corner + n + 1]),
            np.column_stack([corner, corner + n + 1, corner + 1]),
        ]
    )
    u, v = (
        a.ravel()
        for a in np.meshgrid(np.linspace(-1, 1.03, 5), np.linspace(-1.04, 1, 5), indexing="ij")
    )
    positions = unit * np.column_stack([u, v, height(u, v)])
    return Target(vertices, faces, positions, float(np.linalg.norm(np.ptp(vertices, axis=0))))


TARGET = saddle_target()


def joints(noise=0.1, seed=0):
    return TARGET.positions + noise * np.random.default_rng(seed).normal(
        size=TARGET.positions.shape
    )


def motion(seed=1):
    rng = np.random.default_rng(seed)
    return Placement(Rotation.random(random_state=rng).as_matrix(), rng.normal(size=3))


def gauss_newton(fit):
    """(3n, 3n) model of the Hessian in the joints: exact but for terms that vanish with the
    residual."""
    factor = fit.weighted_rows(np.eye(3 * len(fit.blocks)))
    return factor.T @ factor


@pytest.mark.parametrize("level", [None, 0.01])
@pytest.mark.parametrize("share", [0.1, 0.7, 1.0])
def test_gradient_by_taylor(share, level):
    fitting, x = TargetFitting(TARGET, share, level=level), motion().apply(joints())
    fit = fitting(x)
    direction = np.random.default_rng(2).normal(size=x.shape)
    steps = 1e-4 * 0.5 ** np.arange(4)
    remainders = [
        abs(fitting(x + h * direction).value - fit.value - h * np.sum(fit.gradient * direction))
        for h in steps
    ]
    slopes = np.diff(np.log(remainders)) / np.diff(np.log(steps))
    np.testing.assert_allclose(slopes, 2, atol=0.05)


def test_placement_is_the_minimum():
    fitting, x = TargetFitting(TARGET), motion(3).apply(joints(0.03))
    fit = fitting(x)
    forces, y = fit.gradient @ fit.placement.rotation.T, fit.placement.apply(x)
    assert np.abs(forces.sum(axis=0)).max() < 1e-14
    assert np.abs(np.cross(y, forces).sum(axis=0)).max() < 1e-14

    def value(motion):
        y = fit.placement.moved(np.zeros(3), motion[:3], motion[3:]).apply(x)
        squares = np.sum((y - TARGET.positions) ** 2, axis=1)
        return np.mean(0.1 * squares + 0.9 * fitting.surface.closest(y).squared_distances)

    found = minimize(value, np.full(6, 0.02), method="BFGS", options={"gtol": 1e-9})
    assert fit.value <= found.fun + 1e-12 and found.fun == pytest.approx(fit.value, rel=1e-6)


def test_warm_start_ends_at_the_same_placement():
    fitting, x = TargetFitting(TARGET), joints(0.03)
    cold = fitting(x)
    warm = fitting(x, cold.placement.moved(np.zeros(3), np.full(3, 0.1), np.full(3, 0.1)))
    np.testing.assert_allclose(warm.placement.rotation, cold.placement.rotation, atol=1e-9)
    assert warm.value == pytest.approx(cold.value, rel=1e-14)


@pytest.mark.parametrize("level", [None, 1e-4])
@pytest.mark.parametrize("noise, tolerance", [(0.05, 0.1), (0.0005, 1e-3)])
def test_gauss_newton_is_exact_for_small_residuals(noise, tolerance, level):
    fitting, x = TargetFitting(TARGET, level=level), motion().apply(joints(noise))
    fit = fitting(x)
    direction = np.random.default_rng(5).normal(size=x.shape)
    h = 1e-7
    exact = (fitting(x + h * direction).gradient - fitting(x - h * direction).gradient).ravel() / (
        2 * h
    )
    model = gauss_newton(fit) @ direction.ravel()
    assert np.linalg.norm(exact - model) < tolerance * np.linalg.norm(exact)
    assert direction.ravel() @ model == pytest.approx(
        np.sum(fit.weighted_rows(direction.reshape(-1, 1)) ** 2)
    )


def test_gauss_newton_equals_the_schur_complement():
    fitting, x = TargetFitting(TARGET), motion().apply(joints())
    fit = fitting(x)
    hessian = np.zeros((len(x), 3, len(x), 3))
    derivative = fitting.surface.closest(fit.placement.apply(x)).derivative
    for i in range(len(x)):
        in_place = 2 / len(x) * (0.1 * np.eye(3) + 0.9 * (np.eye(3) - derivative[i]))
        hessian[i, :, i] = fit.placement.rotation.T @ in_place @ fit.placement.rotation
    hessian = hessian.reshape(3 * len(x), -1)
    turns = [np.cross(axis, x).ravel() for axis in np.eye(3)]
    rigid = np.column_stack([*turns, np.tile(np.eye(3), (len(x), 1))])
    mixed = hessian @ rigid
    expected = hessian - mixed @ np.linalg.solve(rigid.T @ mixed, mixed.T)
    np.testing.assert_allclose(gauss_newton(fit), expected, atol=1e-13)
    assert np.abs(gauss_newton(fit) @ rigid).max() < 1e-13


def test_rigid_motions_change_nothing():
    fitting, x, move = TargetFitting(TARGET), joints(0.2), motion(4)
    fit, moved = fitting(x), fitting(move.apply(x))
    assert moved.value == pytest.approx(fit.value, rel=1e-12)
    np.testing.assert_allclose(moved.gradient, fit.gradient @ move.rotation.T, atol=1e-12)
    np.testing.assert_allclose(moved.distances, fit.distances, atol=1e-12)


def test_units_scale_out():
    x, unit = joints(0.2), 250.0
    fit, scaled = TargetFitting(TARGET)(x), TargetFitting(saddle_target(unit=unit))(unit * x)
    assert scaled.value == pytest.approx(unit**2 * fit.value, rel=1e-11)
    np.testing.assert_allclose(scaled.gradient, unit * fit.gradient, atol=1e-9)
    np.testing.assert_allclose(gauss_newton(scaled), gauss_newton(fit), atol=1e-9)
    assert scaled.max_percent == pytest.approx(fit.max_percent, rel=1e-9)
    assert scaled.mean_percent == pytest.approx(fit.mean_percent, rel=1e-9)


def test_percentages_by_hand():
    plane = Target(
        [[-5, -5, 0], [5, -5, 0], [5, 5, 0], [-5, 5, 0]],
        [[0, 1, 2], [0, 2, 3]],
        [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]],
        10 * np.sqrt(2),
    )
    bent = np.array(plane.positions) + [[0, 0, 0.3], [0, 0, -0.3], [0, 0, 0.3], [0, 0, -0.3]]
    fit = TargetFitting(plane)(bent)
    np.testing.assert_allclose(fit.distances, 0.3, rtol=1e-12)
    assert fit.max_percent == pytest.approx(30 / (10 * np.sqrt(2)))
    assert fit.value == pytest.approx(0.09)


def test_large_distances_count_with_their_fourth_power():
    """By the formula, and so that the largest one is smaller at the best placement."""
    x = motion().apply(joints())
    plain, levelled = TargetFitting(TARGET)(x), TargetFitting(TARGET, level=0.005)(x)
    squares, s = levelled.distances**2, 0.005 * TARGET.size
    felt = 0.1 * levelled.displacements**2 + 0.9 * squares * (1 + squares / (2 * s**2))
    assert levelled.value == pytest.approx(felt.mean(), rel=1e-12)
    assert levelled.max_percent < 0.99 * plain.max_percent
    small = TargetFitting(TARGET, level=1e6)(x)
    assert small.value == pytest.approx(plain.value, rel=1e-9)


def heights(bend):
    """Joints over a square of the plane, that far above it, and the plane."""
    sides = np.linspace(-1, 1, 9)
    flat = np.stack([*np.meshgrid(sides, sides), np.zeros((9, 9))], axis=-1).reshape(-1, 3)
    corners = np.array([[-3, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]], dtype=float)
    plane = Target(corners, np.array([[0, 1, 2], [0, 2, 3]]), flat, 2.0)
    return flat + bend(flat)[:, None] * [0, 0, 1], plane


@pytest.mark.parametrize(
    "bend, least",
    [
        (lambda x: 0.1 * x[:, 0] ** 2, 0.05),  # 0 to 0.1
        (lambda x: 0.1 * x[:, 0] * x[:, 1], 0.1),  # opposite corners
        (lambda x: 0.01 * (np.arange(len(x)) == 40), 0.005),  # one joint sticks out
        (lambda x: 0.02 * x[:, 0] ** 3, 0.005),  # x^3 - 3 x / 4 is Chebyshev's
    ],
)
def test_the_minimum_zone_is_the_best_approximation(bend, least):
    """Where the least largest distance is known (Chebyshev's approximation by a plane)."""
    x, plane = heights(bend)
    fitting = TargetFitting(plane)
    zone = fitting.minimum_zone(motion(5).apply(x))
    assert 0.99 * least <= zone.distances.max() <= 1.05 * least
    assert zone.distances.max() <= (1 + 1e-9) * fitting(x).distances.max()


def test_the_minimum_zone_against_a_general_minimiser():
    fitting, x = TargetFitting(TARGET), motion(3).apply(joints(0.03))
    fit = fitting(x)
    zone = fitting.minimum_zone(x, fit)
    assert zone.max_percent < 0.95 * fit.max_percent

    def largest(motion):
        y = zone.placement.moved(np.zeros(3), motion[:3], motion[3:]).apply(x)
        return np.sqrt(fitting.surface.closest(y).squared_distances.max())

    simplex = 0.01 * np.vstack([np.zeros(6), np.eye(6)])
    options = {"initial_simplex": simplex, "maxiter": 4000, "xatol": 1e-7, "fatol": 1e-9}
    found = minimize(largest, np.zeros(6), method="Nelder-Mead", options=options)
    assert zone.distances.max() <= 1.05 * found.fun
    np.testing.assert_allclose(zone.distances.max(), largest(np.zeros(6)), rtol=1e-12)


def test_a_search_doesnt_see_the_minimum_zone():
    """Value, gradient and model stay those of T, where it is least."""
    fitting, x = TargetFitting(TARGET), motion().apply(joints())
    fit = fitting(x)
    zone = fitting.minimum_zone(x, fit)
    assert zone.value == fit.value and zone.fitted is fit.placement
    rows = np.random.default_rng(1).normal(size=(x.size, 2))
    np.testing.assert_array_equal(zone.gradient, fit.gradient)
    np.testing.assert_array_equal(zone.weighted_rows(rows), fit.weighted_rows(rows))


def test_the_minimum_zone_doesnt_depend_on_where_joints_come_from():
    fitting, x = TargetFitting(TARGET), joints(0.03)
    here, there = (fitting.minimum_zone(m.apply(x)) for m in (motion(1), motion(2)))
    np.testing.assert_allclose(here.distances, there.distances, atol=1e-9 * TARGET.size)
    again = fitting.minimum_zone(x, fitting.minimum_zone(x))
    np.testing.assert_allclose(again.distances, here.distances, atol=1e-3 * here.distances.max())
    scaled = TargetFitting(saddle_target(unit=1e3)).minimum_zone(1e3 * x)
    assert scaled.max_percent == pytest.approx(here.max_percent, rel=1e-9)
    tiny = TargetFitting(saddle_target(unit=1e-6)).minimum_zone(1e-6 * x)  # nothing overflows
    assert tiny.max_percent == pytest.approx(here.max_percent, rel=1e-9)
    exact = fitting.surface.closest(TARGET.positions).points
    assert TargetFitting(replace(TARGET, positions=exact)).minimum_zone(exact).max_percent < 1e-7


def test_weights_move_the_placement():
    x = joints(0.2)
    weights = np.ones(len(x))
    weights[0] = 1e6
    fit = TargetFitting(TARGET, weights=weights)(x)
    assert fit.distances[0] < 0.01 * TargetFitting(TARGET)(x).distances[0]
    even = TargetFitting(TARGET, weights=np.full(len(x), 3.0))(x)
    assert even.value == pytest.approx(TargetFitting(TARGET)(x).value, rel=1e-14)


@pytest.mark.parametrize("share", [0.0, 0.1])
def test_collinear_joints(share):
    line = Target(
        TARGET.vertices, TARGET.faces, np.outer(np.linspace(-1, 1, 4), [1, 0, 0]), TARGET.size
    )
    fit = TargetFitting(line, share)(np.outer(np.linspace(-1, 1.1, 4), [0, 1, 0]))
    assert np.isfinite(fit.gradient).all() and np.isfinite(gauss_newton(fit)).all()
    assert fit.max_percent < 5


def test_best_placement_is_a_rotation_even_for_mirrored_points():
    mirrored = TARGET.positions * [1, 1, -1]
    found = best_placement(mirrored, TARGET.positions, np.full(len(mirrored), 1 / len(mirrored)))
    assert np.linalg.det(found.rotation) == pytest.approx(1)
    move = motion(6)
    back = best_placement(
        move.apply(TARGET.positions), TARGET.positions, np.full(len(mirrored), 1 / len(mirrored))
    )
    np.testing.assert_allclose(
        back.apply(move.apply(TARGET.positions)), TARGET.positions, atol=1e-13
    )


def test_results_and_fitting_travel_between_processes():
    fitting, x = TargetFitting(TARGET), joints()
    fit = fitting(x)
    again = pickle.loads(pickle.dumps(fitting))(x)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(fit)).gradient, again.gradient)


def test_bad_input():
    with pytest.raises(InputError, match="share"):
        TargetFitting(TARGET, share=1.5)
    with pytest.raises(InputError, match="level = 0.0"):
        TargetFitting(TARGET, level=0.0)
    with pytest.raises(InputError, match="weights"):
        TargetFitting(TARGET, weights=np.zeros(25))
    with pytest.raises(InputError, match="25 finite joints"):
        TargetFitting(TARGET)(np.zeros((3, 3)))
    with pytest.raises(InputError, match="positions"):
        TargetFitting(Target(TARGET.vertices, TARGET.faces, np.full((25, 3), np.nan), 1.0))
