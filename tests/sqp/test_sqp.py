from __future__ import annotations

import io

import numpy as np
import pytest
import scipy.sparse as sp

from kop_exudyn.errors import InputError, SimulationFailure
from kop_exudyn.sqp.constraints import LinearConstraints
from kop_exudyn.sqp.history import SQPState
from kop_exudyn.sqp.model import Region, build_model, convexify, minimise_model, projected_gradient
from kop_exudyn.sqp.options import SQPOptions
from kop_exudyn.sqp.problem import Derivatives, LiftedTerm, Point
from kop_exudyn.sqp.qp import QPSolver
from kop_exudyn.sqp.solver import minimise


class Chain:
    """A chained Rosenbrock function of n variables that counts its calls and may refuse points."""

    def __init__(
        self, n=6, lower=-3.0, upper=3.0, constraints=None, refuses=lambda x: False, scale=None
    ):
        self.n, self.refuses = n, refuses
        self.lower, self.upper = np.full(n, lower), np.full(n, upper)
        self.constraints = constraints or LinearConstraints.none(n)
        self.scale = np.ones(n) if scale is None else scale
        self.evaluated, self.differentiated, self.previous = [], [], []

    def evaluate(self, x, previous):
        self.evaluated.append(x.tobytes())
        self.previous.append(None if previous is None else previous.x.copy())
        if self.refuses(x):
            raise SimulationFailure("buckled", where="test")
        r = x[1:] - x[:-1] ** 2
        return Point(x, float(np.sum(20 * r**2 + (1 - x[:-1]) ** 2)), data="equilibrium")

    def derivatives(self, point):
        assert point.data == "equilibrium"
        x = point.x
        self.differentiated.append(x.tobytes())
        r, i = x[1:] - x[:-1] ** 2, np.arange(self.n - 1)
        g, H = np.zeros(self.n), np.zeros((self.n, self.n))
        g[1:] += 40 * r
        g[:-1] += -80 * x[:-1] * r - 2 * (1 - x[:-1])
        H[i + 1, i + 1] += 40
        H[i, i] += -80 * r + 160 * x[:-1] ** 2 + 2
        H[i, i + 1] = H[i + 1, i] = -80 * x[:-1]
        return Derivatives(g, sp.csc_matrix(H))


START = np.array([-1.2, 1.0, -0.5, 1.5, 0.3, 2.0])
ROW = LinearConstraints(sp.csr_matrix(np.ones((1, 6))), [-np.inf], [4.0])


@pytest.mark.parametrize("hessian", ["exact", "bfgs"])
@pytest.mark.parametrize("constraints", [None, ROW])
def test_nothing_is_evaluated_twice_and_derivatives_only_at_accepted_points(hessian, constraints):
    problem, accepted = Chain(constraints=constraints), []
    options = SQPOptions(hessian=hessian)
    result = minimise(
        problem, START, options, checkpoint=lambda s, p: accepted.append(p.x.tobytes())
    )
    assert result.converged
    assert len(set(problem.evaluated)) == len(problem.evaluated) == result.evaluations
    assert problem.differentiated == [problem.evaluated[0], *accepted]
    assert len(problem.evaluated) > len(accepted) + 1  # there were rejected points
    assert sum(record.trials for record in result.history) + 1 == result.evaluations


def test_the_last_accepted_point_is_handed_to_each_evaluation():
    problem, accepted = Chain(), [START]
    result = minimise(problem, START, checkpoint=lambda s, p: accepted.append(p.x))
    expected = [x for x, record in zip(accepted, result.history) for _ in range(record.trials)]
    assert problem.previous[0] is None
    assert np.array_equal(problem.previous[1:], expected)


@pytest.mark.parametrize("constraints", [None, ROW])
def test_values_fall_and_records_add_up(constraints):
    records = []
    problem = Chain(constraints=constraints)
    first = problem.evaluate(START, None).value
    result = minimise(problem, START, observer=records.append)
    values = [first, *(record.value for record in records)]
    assert np.allclose(-np.diff(values), [record.actual for record in records]) and np.all(
        np.diff(values) < 0
    )
    assert tuple(records) == result.history and [record.step for record in records] == [
        *range(1, result.steps + 1)
    ]
    assert all(record.length <= 1.05 * record.radius for record in records)
    assert all(set(record.seconds) == {"derivatives", "qp", "evaluate"} for record in records[1:])
    assert any(record.convexified for record in records)


@pytest.mark.parametrize("hessian", ["exact", "bfgs"])
@pytest.mark.parametrize("constraints", [None, ROW])
@pytest.mark.parametrize("upper", [3.0, 0.8])
def test_a_resumed_run_is_the_undisturbed_one_bit_for_bit(hessian, constraints, upper):
    options, states = SQPOptions(hessian=hessian), []
    start = np.minimum(START, upper)
    problem = Chain(upper=upper, constraints=constraints)
    whole = minimise(problem, start, options, checkpoint=lambda s, p: states.append(s))
    assert whole.converged and whole.steps >= 4
    for stop in (0, 2, whole.steps // 2, whole.steps - 1):
        file = io.BytesIO()
        np.savez(file, **states[stop].to_arrays())
        file.seek(0)
        with np.load(file, allow_pickle=False) as arrays:
            state = SQPState.from_arrays(dict(arrays))
        resumed = minimise(Chain(upper=upper, constraints=constraints), start, options, state=state)
        assert np.array_equal(resumed.x, whole.x)
        assert [r.value for r in resumed.history] == [r.value for r in whole.history]
        assert [r.damping for r in resumed.history] == [r.damping for r in whole.history]
        assert resumed.evaluations == whole.evaluations + 1  # the point at which it goes on


def test_a_known_point_is_not_evaluated_again():
    part = minimise(Chain(), START, SQPOptions(max_steps=3))
    assert not part.converged and part.steps == 3 and "raise max_steps" in part.status
    problem = Chain()
    rest = minimise(problem, START, state=part.state, start=part.point)
    whole = minimise(Chain(), START)
    assert part.x.tobytes() not in problem.evaluated
    assert rest.evaluations == whole.evaluations and np.array_equal(rest.x, whole.x)


@pytest.mark.parametrize("hit", [1, 3, 5])
def test_failing_regions_are_avoided_and_counted(hit):
    free = Chain()
    minimise(free, START)
    hole = np.frombuffer(free.evaluated[hit])
    problem = Chain(refuses=lambda x: np.linalg.norm(x - hole) < 0.1)
    result = minimise(problem, START)
    assert result.converged and result.failures > 0
    assert result.failures == sum(record.failures for record in result.history)
    assert np.linalg.norm(problem.derivatives(result.point).gradient) < 1e-2


def test_behind_a_wall_it_stops_at_the_wall():
    problem = Chain(refuses=lambda x: x[5] < 1.4)
    result = minimise(problem, START)
    assert not result.converged and "could not be simulated" in result.status
    assert 1.4 <= result.x[5] < START[5] and result.failures > 10


def test_surrounded_by_failures_it_says_so():
    result = minimise(Chain(refuses=lambda x: not np.array_equal(x, START)), START)
    assert not result.converged and result.steps == 0
    assert "could not be simulated" in result.status and "buckled" in result.status
    assert result.failures == result.evaluations - 1
    assert np.array_equal(result.x, START)


def test_a_start_that_fails_is_an_error():
    with pytest.raises(SimulationFailure, match="buckled"):
        minimise(Chain(refuses=lambda x: True), START)


def test_not_a_number_is_a_rejected_trial():
    class Hole(Chain):
        def evaluate(self, x, previous):
            point = super().evaluate(x, previous)
            inside = np.linalg.norm(x) > 2.5 and not np.array_equal(x, START)
            return Point(x, np.nan, point.data) if inside else point

    result = minimise(Hole(), START)
    assert np.isfinite(result.point.value) and result.steps > 0


def test_wrong_derivatives_are_reported():
    class Wrong(Chain):
        def derivatives(self, point):
            return Derivatives(
                -super().derivatives(point).gradient, sp.identity(self.n, format="csc")
            )

    result = minimise(Wrong(), START)
    assert not result.converged and "derivatives are wrong" in result.status


def test_a_start_outside_is_moved_to_the_nearest_point():
    problem = Chain(
        upper=0.5, constraints=LinearConstraints(sp.csr_matrix(np.ones((1, 6))), [1.0], [2.0])
    )
    first = []
    minimise(
        problem, np.full(6, 4.0), SQPOptions(max_steps=1), checkpoint=lambda s, p: first.append(p.x)
    )
    start = np.frombuffer(problem.evaluated[0])
    assert np.allclose(start, 1 / 3, atol=1e-6)  # the projection of equal entries onto sum <= 2
    assert np.all(first[0] <= 0.5) and problem.constraints.violation(first[0]) < 1e-8


def test_bad_requests():
    apart = LinearConstraints(sp.csr_matrix(np.ones((1, 6))), [50.0], [np.inf])
    with pytest.raises(InputError, match="exclude each other"):
        minimise(Chain(constraints=apart), START)
    with pytest.raises(InputError, match="x0"):
        minimise(Chain(), START[:3])
    with pytest.raises(InputError, match="scale"):
        minimise(Chain(scale=np.r_[np.ones(5), 0]), START)
    with pytest.raises(InputError, match="hessian = 'newton'"):
        SQPOptions(hessian="newton")
    with pytest.raises(InputError, match="radius"):
        SQPOptions(radius=0.0)
    with pytest.raises(InputError, match="columns"):
        minimise(Chain(constraints=LinearConstraints.none(5)), START)
    problem = Chain()
    problem.block_sizes = (2, 3)
    with pytest.raises(InputError, match="add up to 6"):
        minimise(problem, START)


class Clusters:
    """Wavy functions of q plus w/2 sum (q - mean of its cluster)^2, with the means kept as extra
    unknowns or not."""

    def __init__(self, lifted: bool, constraints=None, n=12, parts=3, weight=30.0):
        self.n, self.lifted, self.weight = n, lifted, weight
        self.lower, self.upper = np.full(n, -2.0), np.full(n, 1.1)
        self.constraints = constraints or LinearConstraints.none(n)
        self.scale = np.linspace(0.5, 2.0, n)
        self.centre = np.random.default_rng(0).uniform(-1, 1.5, n)
        self.V = sp.csc_matrix((np.ones(n), (np.arange(n), np.arange(n) % parts)), shape=(n, parts))
        self.counts = np.asarray(self.V.sum(axis=0)).ravel()

    def away(self, q):
        return q - self.V @ ((self.V.T @ q) / self.counts)

    def evaluate(self, q, previous):
        wave = np.sum((q - self.centre) ** 2 + 0.3 * np.cos(2 * q))
        return Point(q, float(wave + 0.5 * self.weight * np.sum(self.away(q) ** 2)))

    def derivatives(self, point):
        q, w = point.x, self.weight
        gradient = 2 * (q - self.centre) - 0.6 * np.sin(2 * q) + w * self.away(q)
        hessian = sp.diags(2 - 1.2 * np.cos(2 * q), format="csc")
        if self.lifted:
            pp = w * sp.diags(self.counts, format="csc")
            extra = LiftedTerm(w * sp.identity(self.n, format="csc"), -w * self.V, pp)
            return Derivatives(gradient, hessian, extra)
        eliminated = w * (sp.identity(self.n) - self.V @ sp.diags(1 / self.counts) @ self.V.T)
        return Derivatives(gradient, sp.csc_matrix(hessian + eliminated))


@pytest.mark.parametrize("rows", [False, True])
def test_lifted_form_equals_eliminated_form(rows):
    constraints = LinearConstraints(sp.csr_matrix(np.ones((1, 12))), [1.0], [1.0]) if rows else None
    start = np.linspace(-1, 1, 12)
    options = SQPOptions(gradient_tolerance=1e-9, decrease_tolerance=1e-15)
    lifted = minimise(Clusters(True, constraints), start, options)
    eliminated = minimise(Clusters(False, constraints), start, options)
    assert lifted.converged and eliminated.converged and lifted.steps == eliminated.steps
    predicted = [[r.predicted for r in result.history] for result in (lifted, eliminated)]
    assert np.allclose(*predicted, rtol=1e-4, atol=1e-12)
    assert np.allclose(lifted.x, eliminated.x, atol=1e-7)


def test_the_model_step_of_both_forms_agrees_within_a_trust_radius():
    q = np.linspace(-1, 1, 12)
    steps = []
    for lifted in (True, False):
        problem = Clusters(lifted)
        region = Region(problem.lower, problem.upper, problem.constraints, problem.scale)
        derivatives = problem.derivatives(Point(q, 0.0))
        model = build_model(q, derivatives, derivatives.hessian, region)
        steps.append(minimise_model(model, 0.2, QPSolver(), (np.zeros(0), np.zeros(12))))
    assert 0.15 <= steps[0].length <= 0.21 and steps[0].damping > 0
    assert np.allclose(steps[0].u, steps[1].u, atol=1e-8)
    assert steps[0].predicted == pytest.approx(steps[1].predicted, rel=1e-8)


def test_bfgs_reaches_the_same_minimum_in_more_steps():
    start = np.abs(START)  # with negative entries there is a second minimum
    exact = minimise(Chain(), start, SQPOptions())
    bfgs = minimise(Chain(), start, SQPOptions(hessian="bfgs"))
    assert exact.converged and bfgs.converged
    assert np.allclose(exact.x, bfgs.x, atol=1e-3) and exact.steps < bfgs.steps


def test_units_change_nothing():
    """The same problem in other units, with the scale to match, takes the same steps."""
    unit = 1e-3

    class Metres(Chain):
        def evaluate(self, x, previous):
            return Point(x, super().evaluate(x / unit, previous).value, "equilibrium")

        def derivatives(self, point):
            inner = super().derivatives(Point(point.x / unit, point.value, point.data))
            return Derivatives(inner.gradient / unit, sp.csc_matrix(inner.hessian / unit**2))

    one = minimise(Chain(), START)
    other = minimise(Metres(lower=-3 * unit, upper=3 * unit, scale=np.full(6, unit)), START * unit)
    assert one.steps == other.steps and np.allclose(one.x, other.x / unit, atol=1e-6)


def test_convexification_leaves_definite_blocks_alone_and_flips_negative_curvature():
    good = np.array([[2.0, 1.0], [1.0, 3.0]])
    vectors, _ = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))
    bad = vectors @ np.diag([-4.0, 0.0, 2.0]) @ vectors.T
    result = convexify(sp.csc_matrix(sp.block_diag([good, bad]))).toarray()
    assert np.array_equal(result[:2, :2], good) and np.all(result[:2, 2:] == 0)
    assert np.allclose(result[2:, 2:], vectors @ np.diag([4.0, 4e-8, 2.0]) @ vectors.T, atol=1e-12)


def test_projected_gradient_by_bounds_equals_that_by_constraints():
    rng = np.random.default_rng(4)
    x, g, scale = rng.uniform(0, 1, 5), rng.standard_normal(5), rng.uniform(0.5, 2, 5)
    x[0], x[1] = 0.0, 1.0
    free = np.full(5, np.inf)
    bounds = Region(np.zeros(5), np.ones(5), LinearConstraints.none(5), scale)
    rows = Region(-free, free, LinearConstraints(sp.identity(5), np.zeros(5), np.ones(5)), scale)
    expected = projected_gradient(x, g, bounds, QPSolver())
    assert projected_gradient(x, g, rows, QPSolver()) == pytest.approx(expected, rel=1e-7)
    assert expected < np.linalg.norm(scale * g)
