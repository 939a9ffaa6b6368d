"""The geometrically exact rod element on SE(3): energy, gradient, Hessian and strain-displacement
matrix.

The element is Exudyn's `ObjectBeamGeometricallyExact` with `NodeRigidBodyRotVecLG` nodes (after
Sonneville, Cardona, Bruels, CMAME 268, 2014). Two poses H_i = (R_i, x_i); h = log(H_0^-1 H_1) = (u,
phi):

    R = R_0^T R_1,  phi = log R,  p = R_0^T (x_1 - x_0),
    u = A(phi) p,  A = I - hat(phi)/2 + c hat(phi)^2
    W = 1/(2L) e^T K e,   e = h - L gamma,   sigma = K e / L

with gamma (6,) the rest strain measure, (1,0,0,0,0,0) for a straight rod and (1,0,0,kappa) for a
pre-curved one. Variations are x -> x + dx (global) and R -> R exp(hat(w)) (body frame), in the
order (dx_0, w_0, dx_1, w_1). The Hessian is B^T (K/L) B + G(sigma); G may be taken at another
stress than the current one, which is what the mixed-stress Newton iteration does.

Scenes are assembled by the same formulas in C (compiled/sources/rod_element.h). This is their
readable form, all elements at once through batched 3x3 products: what tests compare the kernel
with, and what takes its place where there is no compiler.
"""

from __future__ import annotations

import numpy as np

from .rotations import bend_coefficients, hat, log_so3

_I3 = np.eye(3)[None]


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
    """Energies and derivatives of n separate elements.

    Parameters
    ----------
    x0, x1 : (n, 3) node positions; R0, R1 : (n, 3, 3) node rotations
    lengths : (n,) rest lengths; stiffness : (n, 6)
    rest_strain : (n, 6) gamma, default straight
    stress : (n, 6) generalised stress of the geometric part, default the current one

    Returns
    -------
    energy (n,), gradient (n, 12), hessian (n, 12, 12), strain e (n, 6), B (n, 6, 12)
    """
    n = len(lengths)
    if rest_strain is None:
        rest_strain = np.tile([1.0, 0, 0, 0, 0, 0], (n, 1))
    R0T = np.swapaxes(R0, 1, 2)
    p = _times(R0T, x1 - x0)
    phi = log_so3(R0T @ R1)
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


def length_derivative(
    strain: np.ndarray, lengths: np.ndarray, stiffness: np.ndarray, rest_strain: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """dW/dL (n,), dsigma/dL (n, 6) and d2W/dL2 (n,) at fixed poses; strain is e = h - L gamma, (n,
    6).

    With de/dL = -gamma: dW/dL = -e.Ke/(2 L^2) - gamma.Ke/L,  dsigma/dL = -Ke/L^2 - K gamma/L,
    d2W/dL2 = e.Ke/L^3 + 2 gamma.Ke/L^2 + gamma.K gamma/L.
    """
    Ke, Kg, L = stiffness * strain, stiffness * rest_strain, lengths
    eKe, gKe, gKg = (strain * Ke).sum(1), (rest_strain * Ke).sum(1), (rest_strain * Kg).sum(1)
    return (
        -eKe / (2 * L**2) - gKe / L,
        -Ke / L[:, None] ** 2 - Kg / L[:, None],
        eKe / L**3 + 2 * gKe / L**2 + gKg / L,
    )


def _derivative_of_product(
    phi: np.ndarray, s: np.ndarray, p: np.ndarray, c: np.ndarray, c_s: np.ndarray
) -> np.ndarray:
    """d(A(phi) p)/dphi (n, 3, 3)."""
    along = _dot(phi, p)
    return (
        0.5 * hat(p)
        + _scaled(c, _scaled(along, _I3) + _outer(phi, p) - 2 * _outer(p, phi))
        + _scaled(2 * c_s, _outer(_scaled(along, phi) - _scaled(s, p), phi))
    )


def _gradient_map(
    g: np.ndarray, phi: np.ndarray, s: np.ndarray, c: np.ndarray, c_s: np.ndarray
) -> np.ndarray:
    """N (n, 3, 3) with N v = d(g.A(phi) v)/dphi. For A^T in place of A it is N - hat(g)."""
    along = _dot(g, phi)
    return (
        0.5 * hat(g)
        + _scaled(c, _outer(g, phi) + _scaled(along, _I3) - 2 * _outer(phi, g))
        + _scaled(2 * c_s, _outer(phi, _scaled(along, phi) - _scaled(s, g)))
    )


def _geometric(
    R0T: np.ndarray,
    p: np.ndarray,
    phi: np.ndarray,
    s: np.ndarray,
    A: np.ndarray,
    coefficients: tuple[np.ndarray, np.ndarray, np.ndarray],
    p_x: np.ndarray,
    phi_x: np.ndarray,
    sigma: np.ndarray,
) -> np.ndarray:
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
