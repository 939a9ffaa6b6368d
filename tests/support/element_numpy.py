"""The rod element in plain NumPy: the readable form of `element.py`, which tests compare it with.

Same element, same conventions, all elements at once through batched 3x3 products. It is what the
compiled form's speed is measured against.
"""

from __future__ import annotations

import numpy as np

from kop_exudyn.rods.rotations import hat

_SERIES_LIMIT = 0.25
# c(s) = sum |B_2k| s^(k-1) / (2k)!, k = 1, 2, ... with the Bernoulli numbers B_2k
_SERIES = np.array(
    [1 / 12, 1 / 720, 1 / 30240, 1 / 1209600, 1 / 47900160, 691 / 1307674368000, 1 / 74724249600]
)
_I3 = np.eye(3)[None]


def bend_coefficients(s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """c, dc/ds and d2c/ds2 (n,) of c(s) = (1 - (t/2) cot(t/2))/s at s = t^2 (n,)."""
    series = np.polynomial.Polynomial(_SERIES)
    small = s < _SERIES_LIMIT
    large = np.where(small, 1.0, s)
    t = np.sqrt(large)
    cot, csc2 = 1 / np.tan(t / 2), 1 / np.sin(t / 2) ** 2
    # with k(t) = (t/2) cot(t/2): c = (1 - k)/s, and d/ds = d/dt / (2 t)
    k, k_t, k_tt = t / 2 * cot, cot / 2 - t / 4 * csc2, -csc2 / 2 + t / 4 * csc2 * cot
    k_s, k_ss = k_t / (2 * t), (k_tt - k_t / t) / (4 * large)
    c = (1 - k) / large
    c_s = -(k_s + c) / large
    c_ss = -(k_ss + 2 * c_s) / large
    closed, derivatives = (c, c_s, c_ss), (series, series.deriv(), series.deriv(2))
    value, first, second = (
        np.where(small, d(np.where(small, s, 0.0)), f) for d, f in zip(derivatives, closed)
    )
    return value, first, second


def rotation_vectors(R: np.ndarray) -> np.ndarray:
    """Rotation vectors (n, 3), of length at most pi, of rotations (n, 3, 3).

    The symmetric matrix 4 q q^T of the unit quaternion q is linear in R; its row with the largest
    diagonal entry gives q without cancellation (Shepperd 1978).
    """
    n = len(R)
    trace = np.trace(R, axis1=1, axis2=2)
    Q = np.empty((n, 4, 4))
    Q[:, 0, 0] = 1 + trace
    Q[:, 1:, 1:] = R + np.swapaxes(R, 1, 2) + (1 - trace)[:, None, None] * _I3
    Q[:, 0, 1:] = Q[:, 1:, 0] = np.stack(
        [R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1
    )
    each = np.arange(n)
    q = Q[each, np.argmax(Q[:, range(4), range(4)], axis=1)]
    q = q * np.where(q[:, :1] < 0, -1.0, 1.0) / np.linalg.norm(q, axis=1, keepdims=True)
    sine = np.linalg.norm(q[:, 1:], axis=1)
    small = sine < 1e-12
    factor = np.where(small, 2.0, 2 * np.arctan2(sine, q[:, 0]) / np.where(small, 1.0, sine))
    return factor[:, None] * q[:, 1:]


def evaluate(
    x0: np.ndarray,
    R0: np.ndarray,
    x1: np.ndarray,
    R1: np.ndarray,
    lengths: np.ndarray,
    stiffness: np.ndarray,
    rest_strain: np.ndarray | None = None,
    stress: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Energies and derivatives of n elements; arguments and results are those of
    `element.evaluate`."""
    n = len(lengths)
    if rest_strain is None:
        rest_strain = np.tile([1.0, 0, 0, 0, 0, 0], (n, 1))
    R0T = np.swapaxes(R0, 1, 2)
    p = _times(R0T, x1 - x0)
    phi = rotation_vectors(R0T @ R1)
    s = _dot(phi, phi)
    c, c_s, c_ss = bend_coefficients(s)
    A = _I3 - 0.5 * hat(phi) + c[:, None, None] * hat(phi) @ hat(phi)

    e = np.concatenate([_times(A, p), phi], axis=1) - lengths[:, None] * rest_strain
    sigma = stiffness * e / lengths[:, None]
    energy = 0.5 * _dot(e, sigma)

    # Jacobians of p, phi and u = A p in (dx_0, w_0, dx_1, w_1)
    p_x, phi_x = np.zeros((n, 3, 12)), np.zeros((n, 3, 12))
    p_x[:, :, 0:3], p_x[:, :, 3:6], p_x[:, :, 6:9] = -R0T, hat(p), R0T
    phi_x[:, :, 3:6], phi_x[:, :, 9:12] = -A, np.swapaxes(A, 1, 2)
    B = np.concatenate([A @ p_x + _derivative_of_product(phi, s, p, c, c_s) @ phi_x, phi_x], axis=1)
    BT = np.swapaxes(B, 1, 2)
    gradient = _times(BT, sigma)
    material = BT @ (B * (stiffness / lengths[:, None])[:, :, None])
    geometric = _geometric(
        R0T, p, phi, s, A, (c, c_s, c_ss), p_x, phi_x, sigma if stress is None else stress
    )
    return energy, gradient, material + geometric, e, B


def _derivative_of_product(phi, s, p, c, c_s) -> np.ndarray:
    """d(A(phi) p)/dphi (n, 3, 3)."""
    along = _dot(phi, p)
    return (
        0.5 * hat(p)
        + _scaled(c, _scaled(along, _I3) + _outer(phi, p) - 2 * _outer(p, phi))
        + _scaled(2 * c_s, _outer(_scaled(along, phi) - _scaled(s, p), phi))
    )


def _gradient_map(g, phi, s, c, c_s) -> np.ndarray:
    """N (n, 3, 3) with N v = d(g.A(phi) v)/dphi. For A^T in place of A it is N - hat(g)."""
    along = _dot(g, phi)
    return (
        0.5 * hat(g)
        + _scaled(c, _outer(g, phi) + _scaled(along, _I3) - 2 * _outer(phi, g))
        + _scaled(2 * c_s, _outer(phi, _scaled(along, phi) - _scaled(s, g)))
    )


def _geometric(R0T, p, phi, s, A, coefficients, p_x, phi_x, sigma) -> np.ndarray:
    """G(sigma) (n, 12, 12): second variations of u and phi contracted with sigma."""
    c, c_s, c_ss = coefficients
    su, sphi = sigma[:, :3], sigma[:, 3:]
    su_phi, phi_p, su_p = _dot(su, phi), _dot(phi, p), _dot(su, p)
    # su.A p = su.p - phi.(p x su)/2 + c k,  k = (su.phi)(phi.p) - s su.p
    k = su_phi * phi_p - s * su_p
    k_phi = _scaled(phi_p, su) + _scaled(su_phi, p) - 2 * _scaled(su_p, phi)
    k_phi_phi = _outer(su, p) + _outer(p, su) - _scaled(2 * su_p, _I3)
    m = -0.5 * np.cross(p, su) + _scaled(c, k_phi) + _scaled(2 * c_s * k, phi)
    second = (
        _scaled(c, k_phi_phi)
        + _scaled(2 * c_s, _outer(phi, k_phi) + _outer(k_phi, phi))
        + _scaled(2 * c_s * k, _I3)
        + _scaled(4 * c_ss * k, _outer(phi, phi))
    )
    mixed = _gradient_map(su, phi, s, c, c_s)
    G = _transposed(phi_x) @ second @ phi_x + _twice_symmetric(_transposed(phi_x) @ mixed @ p_x)

    # the Jacobians -A and A^T in dphi turn with phi
    g = sphi + m
    turning = np.zeros_like(phi_x)
    by_A = _gradient_map(g, phi, s, c, c_s)
    turning[:, :, 3:6], turning[:, :, 9:12] = -by_A, by_A - hat(g)
    G += 0.5 * _twice_symmetric(_transposed(phi_x) @ turning)

    # second variation of p: w_0 x (w_0 x p) - 2 w_0 x R_0^T (dx_1 - dx_0)
    f = _times(_transposed(A), su)
    second_p = np.zeros_like(G)
    second_p[:, 3:6, 3:6] = 0.5 * _outer(f, p) - _scaled(0.5 * _dot(f, p), _I3)
    second_p[:, 3:6, 6:9] = hat(f) @ R0T
    second_p[:, 3:6, 0:3] = -second_p[:, 3:6, 6:9]
    return G + _twice_symmetric(second_p)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("ni,ni->n", a, b)


def _times(M: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.einsum("nij,nj->ni", M, v)


def _outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, :, None] * b[:, None, :]


def _scaled(factor: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Factors (n,) times vectors (n, 3) or matrices (n or 1, 3, 3)."""
    return factor.reshape((-1,) + (1,) * (a.ndim - 1)) * a


def _transposed(M: np.ndarray) -> np.ndarray:
    return np.swapaxes(M, 1, 2)


def _twice_symmetric(M: np.ndarray) -> np.ndarray:
    return M + _transposed(M)
