"""The element, compiled and in NumPy: by Taylor tests, by invariances, and against each other."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.elements import evaluate_compiled

from kop_exudyn.compiled.library import library
from kop_exudyn.rods import element
from kop_exudyn.rods.rotations import exp_se3, exp_so3


class Elements:
    """Random elements whose two nodes are turned by given angles (n,) against each other."""

    def __init__(self, seed: int, angles: np.ndarray, curved: bool = True):
        rng = np.random.default_rng(seed)
        n = len(angles)
        axes = rng.normal(size=(n, 3))
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        self.R0 = exp_so3(2 * rng.normal(size=(n, 3)))
        self.R1 = self.R0 @ exp_so3(angles[:, None] * axes)
        self.x0 = rng.normal(size=(n, 3))
        self.x1 = self.x0 + np.einsum(
            "nij,nj->ni", self.R0, [1.0, 0, 0] + 0.3 * rng.normal(size=(n, 3))
        )
        self.L = rng.uniform(0.5, 2.0, n)
        self.K = 10 ** rng.uniform(-2, 2, (n, 6))
        self.gamma = np.tile([1.0, 0, 0, 0, 0, 0], (n, 1))
        if curved:
            self.gamma += 0.3 * rng.normal(size=(n, 6))

    form = staticmethod(element.evaluate)

    def evaluate(self, **options):
        return self.form(self.x0, self.R0, self.x1, self.R1, self.L, self.K, self.gamma, **options)

    def moved(self, d: np.ndarray) -> Elements:
        """After increments d (n, 12)."""
        other = object.__new__(Elements)
        other.__dict__.update(self.__dict__)
        other.x0, other.x1 = self.x0 + d[:, :3], self.x1 + d[:, 6:9]
        other.R0, other.R1 = self.R0 @ exp_so3(d[:, 3:6]), self.R1 @ exp_so3(d[:, 9:])
        return other

    def with_(self, **fields) -> Elements:
        other = object.__new__(Elements)
        other.__dict__.update(self.__dict__)
        other.__dict__.update(fields)
        return other


@pytest.fixture(params=["compiled", "numpy"], scope="module", autouse=True)
def form(request):
    """Both forms of the element, for all tests."""
    if request.param == "compiled" and library() is None:
        pytest.skip("there are no compiled kernels")
    forms = {"compiled": evaluate_compiled, "numpy": element.evaluate}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Elements, "form", staticmethod(forms[request.param]))
        yield


def spread_angles(seed: int, n: int) -> np.ndarray:
    """From zero over the limit of the series (0.5) to 3 rad."""
    rng = np.random.default_rng(seed)
    return np.concatenate(
        [
            np.zeros(5),
            10 ** rng.uniform(-12, -1, n),
            rng.uniform(0.49, 0.51, n),
            rng.uniform(0, 3, n),
        ]
    )


def largest_relative(a: np.ndarray, b: np.ndarray) -> float:
    n = len(b)
    return float(np.max(np.abs(a - b).reshape(n, -1).max(1) / np.abs(b).reshape(n, -1).max(1)))


@pytest.mark.parametrize("mixed", [False, True])
@pytest.mark.parametrize("curved", [False, True])
def test_compiled_and_numpy_forms_agree(curved, mixed):
    elements = Elements(1, spread_angles(1, 200), curved)
    stress = np.random.default_rng(2).normal(size=(len(elements.L), 6)) if mixed else None
    given = (
        elements.x0,
        elements.R0,
        elements.x1,
        elements.R1,
        elements.L,
        elements.K,
        elements.gamma,
    )
    for compiled, plain in zip(
        evaluate_compiled(*given, stress), element.evaluate(*given, stress=stress)
    ):
        assert largest_relative(compiled, plain) < 1e-12


def taylor_slopes(value, first, second, steps=2.0 ** -np.arange(5, 10)) -> tuple[float, float]:
    """Orders at which the remainders (n,), summed over elements, fall after one and after two
    terms."""
    remainders = np.array(
        [
            [
                np.abs(value(h) - value(0.0) - h * first).sum(),
                np.abs(value(h) - value(0.0) - h * first - 0.5 * h * h * second).sum(),
            ]
            for h in steps
        ]
    )
    return tuple(np.polyfit(np.log(steps), np.log(remainders), 1)[0])


@pytest.mark.parametrize("angle", [0.0, 1e-6, 1e-3, 0.499, 0.5, 0.501, 1.0, 2.0, 2.8])
def test_gradient_and_hessian_by_taylor(angle):
    elements = Elements(10, np.full(20, angle))
    elements = elements.with_(K=np.ones_like(elements.K) + elements.K / 100)
    d = np.random.default_rng(11).normal(size=(20, 12)) / 4
    _, g, H, _, _ = elements.evaluate()
    first, second = np.einsum("ni,ni->n", g, d), np.einsum("ni,nij,nj->n", d, H, d)
    slopes = taylor_slopes(lambda h: elements.moved(h * d).evaluate()[0], first, second)
    assert slopes == pytest.approx((2, 3), abs=0.1)


@settings(max_examples=50, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    angle=st.one_of(st.just(0.0), st.floats(0, 1e-3), st.floats(0.45, 0.55), st.floats(0, 2.8)),
)
def test_derivatives_against_differences(seed, angle):
    elements = Elements(seed, np.array([angle]))
    d = np.random.default_rng(seed).normal(size=(1, 12))
    W, g, H, _, B = (a[0] for a in elements.evaluate())
    h = 1e-4
    ahead, back = (elements.moved(sign * h * d).evaluate() for sign in (1, -1))
    # where the increments compose, second differences of the energy are the Hessian's; gradients
    # would need a transport
    second = (ahead[0][0] - 2 * W + back[0][0]) / h**2
    assert second == pytest.approx(float(d[0] @ H @ d[0]), rel=1e-5, abs=1e-5 * np.abs(H).max())
    assert (ahead[0][0] - back[0][0]) / (2 * h) == pytest.approx(
        float(g @ d[0]), rel=1e-6, abs=1e-6 * np.abs(H).max()
    )
    assert np.allclose(
        (ahead[3][0] - back[3][0]) / (2 * h), B @ d[0], atol=1e-6 * (1 + np.abs(B).max())
    )
    assert np.allclose(H, H.T, rtol=0, atol=1e-14 * np.abs(H).max())


def test_rest_length_and_rest_shape_derivatives():
    elements = Elements(12, np.linspace(0, 2, 20))
    _, _, _, e, _ = elements.evaluate()
    dW, dsigma, ddW = element.length_derivative(e, elements.L, elements.K, elements.gamma)
    # relative steps, so that every length stays positive
    slopes = taylor_slopes(
        lambda h: elements.with_(L=elements.L * (1 + h)).evaluate()[0],
        elements.L * dW,
        elements.L**2 * ddW,
    )
    assert slopes == pytest.approx((2, 3), abs=0.1)

    def stress(elements):
        return elements.K * elements.evaluate()[3] / elements.L[:, None]

    h = 1e-5
    change = (
        stress(elements.with_(L=elements.L + h)) - stress(elements.with_(L=elements.L - h))
    ) / (2 * h)
    assert np.allclose(change, dsigma, rtol=1e-8, atol=1e-7)


def test_rigid_motions_change_nothing():
    elements = Elements(5, spread_angles(5, 30))
    Q, t = exp_so3(np.array([0.4, -2.0, 1.1])), np.array([3.0, -2.0, 5.0])
    turned = elements.with_(
        x0=elements.x0 @ Q.T + t, x1=elements.x1 @ Q.T + t, R0=Q @ elements.R0, R1=Q @ elements.R1
    )
    W, g, H, e, _ = elements.evaluate()
    W2, g2, H2, e2, _ = turned.evaluate()
    assert np.allclose(W2, W, rtol=1e-12) and np.allclose(e2, e, atol=1e-13)
    T = np.kron(np.diag([1, 0, 1, 0]), Q) + np.kron(np.diag([0, 1, 0, 1]), np.eye(3))
    assert np.allclose(g2, g @ T.T, atol=1e-10 * np.abs(g).max())
    assert np.allclose(H2, T @ H @ T.T, atol=1e-10 * np.abs(H).max())


def test_energy_gradient_vanishes_along_rigid_motions():
    elements = Elements(6, spread_angles(6, 30))
    _, g, _, _, _ = elements.evaluate()
    rng = np.random.default_rng(0)
    spin, shift = rng.normal(size=3), rng.normal(size=3)
    d = np.concatenate(
        [
            shift + np.cross(spin, elements.x0),
            np.einsum("nji,j->ni", elements.R0, spin),
            shift + np.cross(spin, elements.x1),
            np.einsum("nji,j->ni", elements.R1, spin),
        ],
        axis=1,
    )
    assert np.abs(np.einsum("ni,ni->n", g, d)).max() < 1e-12 * np.abs(g).max()


def test_mirror_images_have_the_same_energy():
    """Reflection in the plane z = 0: vectors flip z; twist and bending about y flip, bending about
    z stays."""
    elements = Elements(7, spread_angles(7, 30))
    S = np.diag([1.0, 1.0, -1.0])
    flip = np.array([1, 1, -1, -1, -1, 1.0])
    mirrored = elements.with_(
        x0=elements.x0 @ S,
        x1=elements.x1 @ S,
        R0=S @ elements.R0 @ S,
        R1=S @ elements.R1 @ S,
        gamma=elements.gamma * flip,
    )
    assert np.allclose(mirrored.evaluate()[0], elements.evaluate()[0], rtol=1e-12)
    assert np.allclose(mirrored.evaluate()[3], elements.evaluate()[3] * flip, atol=1e-13)


def test_turning_an_element_around_changes_nothing():
    """Nodes exchanged, axes turned by half a turn about z: the rod read from its other end."""
    elements = Elements(8, spread_angles(8, 30))
    Z = np.diag([-1.0, -1.0, 1.0])
    flip = np.array([1, 1, -1, 1, 1, -1.0])
    reversed_ = elements.with_(
        x0=elements.x1,
        x1=elements.x0,
        R0=elements.R1 @ Z,
        R1=elements.R0 @ Z,
        gamma=elements.gamma * flip,
    )
    assert np.allclose(reversed_.evaluate()[0], elements.evaluate()[0], rtol=1e-12)


def test_units_scale_the_energy():
    """Lengths in another unit: EA and GA scale as force, bending stiffnesses as force length^2,
    energy as length."""
    elements = Elements(9, spread_angles(9, 30))
    m = 1e3
    scaled = elements.with_(
        x0=m * elements.x0,
        x1=m * elements.x1,
        L=m * elements.L,
        K=elements.K * np.array([1, 1, 1, m**2, m**2, m**2]),
        gamma=elements.gamma / np.array([1, 1, 1, m, m, m]),
    )
    assert np.allclose(scaled.evaluate()[0], m * elements.evaluate()[0], rtol=1e-12)


def test_constant_strain_is_exact_in_one_element():
    """exp(L eps) from end to end: the element's strain is eps everywhere (why helices are
    exact)."""
    eps = np.array([1.02, 0.03, -0.01, 0.8, -0.4, 1.1])
    L = np.array([1.7])
    p, R = exp_se3(L[:, None] * eps)
    K = np.array([[50.0, 20, 20, 1, 2, 3]])
    W, g, _, e, _ = element.evaluate(np.zeros((1, 3)), np.eye(3)[None], p, R, L, K)
    strain = eps - [1, 0, 0, 0, 0, 0]
    assert np.allclose(e[0] / L, strain, atol=1e-14)
    assert W[0] == pytest.approx(0.5 * L[0] * float(strain @ (K[0] * strain)), rel=1e-13)
