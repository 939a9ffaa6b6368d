"""The geometrically exact rod element on SE(3): energy, gradient, Hessian and strain-displacement
matrix, compiled.

The element is Exudyn's `ObjectBeamGeometricallyExact` with `NodeRigidBodyRotVecLG` nodes (after
Sonneville, Cardona, Bruels, CMAME 268, 2014). Two poses H_i = (R_i, x_i); h = log(H_0^-1 H_1) = (u,
phi):

    R = R_0^T R_1,  phi = log R,  p = R_0^T (x_1 - x_0),  u = A(phi) p,  A = I - hat(phi)/2 + c
    hat(phi)^2 W = 1/(2L) e^T K e,   e = h - L gamma,   sigma = K e / L

with gamma (6,) the rest strain measure, (1,0,0,0,0,0) for a straight rod and (1,0,0,kappa) for a
pre-curved one. Variations are x -> x + dx (global) and R -> R exp(hat(w)) (body frame), in the
order (dx_0, w_0, dx_1, w_1). The Hessian is B^T (K/L) B + G(sigma); G may be taken at another
stress than the current one, which is what the mixed-stress Newton iteration does.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from .kernels import kernel
from .rotations import bend_coefficient, log_into


@kernel(inline="always")
def relative_motion(x0, R0, x1, R1, p, phi, R):
    """p and phi of the relative pose; R is scratch (3, 3)."""
    for r in range(3):
        p[r] = R0[0, r] * (x1[0] - x0[0]) + R0[1, r] * (x1[1] - x0[1]) + R0[2, r] * (x1[2] - x0[2])
        for c in range(3):
            R[r, c] = R0[0, r] * R1[0, c] + R0[1, r] * R1[1, c] + R0[2, r] * R1[2, c]
    log_into(R, phi)


@kernel(inline="always")
def add_hat(M, a, factor):
    """M += factor hat(a)."""
    M[0, 1] -= factor * a[2]
    M[0, 2] += factor * a[1]
    M[1, 0] += factor * a[2]
    M[1, 2] -= factor * a[0]
    M[2, 0] -= factor * a[1]
    M[2, 1] += factor * a[0]


@kernel(inline="always")
def dot3(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel(inline="always")
def stretch_measure(p, phi, c, u):
    """u = A(phi) p."""
    s, pp = dot3(phi, phi), dot3(phi, p)
    u[0] = p[0] - 0.5 * (phi[1] * p[2] - phi[2] * p[1]) + c * (phi[0] * pp - s * p[0])
    u[1] = p[1] - 0.5 * (phi[2] * p[0] - phi[0] * p[2]) + c * (phi[1] * pp - s * p[1])
    u[2] = p[2] - 0.5 * (phi[0] * p[1] - phi[1] * p[0]) + c * (phi[2] * pp - s * p[2])


@kernel
def strain_displacement(R0, p, phi, c, c1, A, D, B):
    """Fill A (3,3), D = d(A p)/dphi (3,3) and B (6,12) = d(u, phi)/d(dx_0, w_0, dx_1, w_1)."""
    s, pp = dot3(phi, phi), dot3(phi, p)
    for r in range(3):
        for k in range(3):
            A[r, k] = c * phi[r] * phi[k]
            D[r, k] = (
                c * (phi[r] * p[k] - 2 * p[r] * phi[k]) + 2 * c1 * (phi[r] * pp - s * p[r]) * phi[k]
            )
        A[r, r] += 1 - c * s
        D[r, r] += c * pp
    add_hat(A, phi, -0.5)
    add_hat(D, p, 0.5)
    for r in range(3):
        for k in range(3):
            B[3 + r, k] = 0.0
            B[3 + r, 6 + k] = 0.0
            B[3 + r, 3 + k] = -A[r, k]
            B[3 + r, 9 + k] = A[k, r]
            B[r, 6 + k] = A[r, 0] * R0[k, 0] + A[r, 1] * R0[k, 1] + A[r, 2] * R0[k, 2]
            B[r, k] = -B[r, 6 + k]
            B[r, 9 + k] = D[r, 0] * A[k, 0] + D[r, 1] * A[k, 1] + D[r, 2] * A[k, 2]
            B[r, 3 + k] = -(D[r, 0] * A[0, k] + D[r, 1] * A[1, k] + D[r, 2] * A[2, k])
        # A hat(p)
        B[r, 3] += A[r, 1] * p[2] - A[r, 2] * p[1]
        B[r, 4] += A[r, 2] * p[0] - A[r, 0] * p[2]
        B[r, 5] += A[r, 0] * p[1] - A[r, 1] * p[0]


@kernel(fastmath={"contract"})
def geometric_stiffness(R0, p, phi, c, c1, c2, A, sigma, X, T, H):
    """Add G(sigma), the stress part of the Hessian, to the blocks of w_0, dx_1, w_1 in H (12,12).

    G collects the second variations of (u, phi) contracted with sigma: dphi.Mff dphi + 2 dphi.Mfp
    dp from A(phi) p, the derivative of the Jacobians that turn w_0, w_1 into dphi, and the second
    variation of p. Blocks below the diagonal are left alone. X (3,9) and T (5,3,3) are scratch.
    """
    su, sp = sigma[:3], sigma[3:]
    s, pp = dot3(phi, phi), dot3(phi, p)
    sph, sup = dot3(su, phi), dot3(su, p)
    k0 = sph * pp - s * sup
    g, kg, f = T[4, 0], T[4, 1], T[4, 2]
    for r in range(3):
        kg[r] = su[r] * pp + p[r] * sph - 2 * phi[r] * sup
        g[r] = sp[r] + c * kg[r] + 2 * c1 * k0 * phi[r]
        f[r] = A[0, r] * su[0] + A[1, r] * su[1] + A[2, r] * su[2]
    g[0] -= 0.5 * (p[1] * su[2] - p[2] * su[1])
    g[1] -= 0.5 * (p[2] * su[0] - p[0] * su[2])
    g[2] -= 0.5 * (p[0] * su[1] - p[1] * su[0])
    gph = dot3(g, phi)

    # halves of Mff, d(g . A w_0)/dphi and d(g . A^T w_1)/dphi, since they enter through P^T X + X^T
    # P; and Mfp
    M, N0, N1, Q = T[0], T[1], T[2], T[3]
    for r in range(3):
        for k in range(3):
            M[r, k] = (
                0.5 * c * (su[r] * p[k] + p[r] * su[k])
                + c1 * (kg[r] * phi[k] + phi[r] * kg[k])
                + 2 * c2 * k0 * phi[r] * phi[k]
            )
            Q[r, k] = c * (su[r] * phi[k] - 2 * phi[r] * su[k]) + 2 * c1 * phi[r] * (
                sph * phi[k] - s * su[k]
            )
            N1[r, k] = 0.5 * (
                c * (g[r] * phi[k] - 2 * phi[r] * g[k])
                + 2 * c1 * phi[r] * (gph * phi[k] - s * g[k])
            )
        M[r, r] += -c * sup + c1 * k0
        Q[r, r] += c * sph
        N1[r, r] += 0.5 * c * gph
    for r in range(3):
        for k in range(3):
            N0[r, k] = N1[r, k]
    add_hat(Q, su, 0.5)
    add_hat(N1, g, -0.25)
    add_hat(N0, g, 0.25)

    # P^T X + X^T P with P = (-A, 0, A^T), the variation of phi, and X = M P + Q dp + (N1 w_1 - N0
    # w_0)/2, where dp = R0^T dx_1 + hat(p) w_0
    for r in range(3):
        for k in range(3):
            X[r, k] = -(M[r, 0] * A[0, k] + M[r, 1] * A[1, k] + M[r, 2] * A[2, k]) - N0[r, k]
            X[r, 3 + k] = Q[r, 0] * R0[k, 0] + Q[r, 1] * R0[k, 1] + Q[r, 2] * R0[k, 2]
            X[r, 6 + k] = M[r, 0] * A[k, 0] + M[r, 1] * A[k, 1] + M[r, 2] * A[k, 2] + N1[r, k]
        X[r, 0] += Q[r, 1] * p[2] - Q[r, 2] * p[1]
        X[r, 1] += Q[r, 2] * p[0] - Q[r, 0] * p[2]
        X[r, 2] += Q[r, 0] * p[1] - Q[r, 1] * p[0]
    for i in range(3):
        for k in range(9):
            H[3 + i, 3 + k] -= A[0, i] * X[0, k] + A[1, i] * X[1, k] + A[2, i] * X[2, k]
        for k in range(3):
            H[9 + i, 9 + k] += A[i, 0] * X[0, 6 + k] + A[i, 1] * X[1, 6 + k] + A[i, 2] * X[2, 6 + k]
    for i in range(9):
        for k in range(3):
            H[3 + i, 9 + k] += X[0, i] * A[k, 0] + X[1, i] * A[k, 1] + X[2, i] * A[k, 2]
        if i < 3:
            for k in range(3):
                H[3 + i, 3 + k] -= X[0, i] * A[0, k] + X[1, i] * A[1, k] + X[2, i] * A[2, k]

    # f . d2p
    pf = dot3(p, f)
    for i in range(3):
        for k in range(3):
            H[3 + i, 3 + k] += 0.5 * (f[i] * p[k] + p[i] * f[k])
        H[3 + i, 3 + i] -= pf
        H[3, 6 + i] += f[1] * R0[i, 2] - f[2] * R0[i, 1]
        H[4, 6 + i] += f[2] * R0[i, 0] - f[0] * R0[i, 2]
        H[5, 6 + i] += f[0] * R0[i, 1] - f[1] * R0[i, 0]


@kernel
def element_energy(x0, R0, x1, R1, L, gamma, K, p, phi, R, e):
    """Elastic energy; leaves p, phi and e = h - L gamma (6,) behind."""
    relative_motion(x0, R0, x1, R1, p, phi, R)
    c = bend_coefficient(dot3(phi, phi))[0]
    stretch_measure(p, phi, c, e)
    W = 0.0
    for r in range(3):
        e[3 + r] = phi[r] - L * gamma[3 + r]
        e[r] -= L * gamma[r]
    for r in range(6):
        W += K[r] * e[r] * e[r]
    return 0.5 * W / L


@kernel(fastmath={"contract"})
def element_hessian(R0, L, K, p, phi, sigma, A, D, B, KB, X, T, H):
    """Fill B (6,12) and the symmetric H (12,12) = B^T (K/L) B + G(sigma). KB (6,12), X and T are
    scratch.

    Only blocks of w_0, dx_1 and w_1 are computed: the energy depends on x_1 - x_0, so those of dx_0
    are minus dx_1's. phi does not depend on positions, so products with columns of dx_1 have three
    rows.
    """
    c, c1, c2 = bend_coefficient(dot3(phi, phi))
    strain_displacement(R0, p, phi, c, c1, A, D, B)
    for r in range(6):
        for k in range(3, 12):
            KB[r, k] = K[r] / L * B[r, k]
    for i in range(3):
        for k in range(3, 12):
            H[3 + i, k] = KB[0, 3 + i] * B[0, k] + KB[1, 3 + i] * B[1, k] + KB[2, 3 + i] * B[2, k]
        for k in range(6, 12):
            H[6 + i, k] = KB[0, 6 + i] * B[0, k] + KB[1, 6 + i] * B[1, k] + KB[2, 6 + i] * B[2, k]
        for k in range(9, 12):
            H[9 + i, k] = KB[0, 9 + i] * B[0, k] + KB[1, 9 + i] * B[1, k] + KB[2, 9 + i] * B[2, k]
    for i in range(3):
        for k in range(3):
            H[3 + i, 3 + k] += (
                KB[3, 3 + i] * B[3, 3 + k] + KB[4, 3 + i] * B[4, 3 + k] + KB[5, 3 + i] * B[5, 3 + k]
            )
            H[3 + i, 9 + k] += (
                KB[3, 3 + i] * B[3, 9 + k] + KB[4, 3 + i] * B[4, 9 + k] + KB[5, 3 + i] * B[5, 9 + k]
            )
            H[9 + i, 9 + k] += (
                KB[3, 9 + i] * B[3, 9 + k] + KB[4, 9 + i] * B[4, 9 + k] + KB[5, 9 + i] * B[5, 9 + k]
            )
    geometric_stiffness(R0, p, phi, c, c1, c2, A, sigma, X, T, H)
    for i in range(3):
        for k in range(3):
            H[6 + i, 3 + k] = H[3 + k, 6 + i]
            H[9 + i, 3 + k] = H[3 + k, 9 + i]
            H[9 + i, 6 + k] = H[6 + k, 9 + i]
            if k < i:
                for at in (3, 6, 9):
                    H[at + i, at + k] = H[at + k, at + i]
    for i in range(3):
        for k in range(3, 12):
            H[i, k] = -H[6 + i, k]
        for k in range(3):
            H[i, k] = H[6 + i, 6 + k]
    for i in range(3, 12):
        for k in range(3):
            H[i, k] = -H[i, 6 + k]


@nb.njit(cache=True)
def _evaluate(x0, R0, x1, R1, L, gamma, K, sigma, mixed, W, G, H, e, B):
    p, phi, R = np.empty(3), np.empty(3), np.empty((3, 3))
    A, D, KB, X = np.empty((3, 3)), np.empty((3, 3)), np.empty((6, 12)), np.empty((3, 9))
    T = np.empty((5, 3, 3))
    stress = np.empty(6)
    for n in range(len(W)):
        W[n] = element_energy(x0[n], R0[n], x1[n], R1[n], L[n], gamma[n], K[n], p, phi, R, e[n])
        for r in range(6):
            stress[r] = sigma[n, r] if mixed else K[n, r] * e[n, r] / L[n]
        element_hessian(R0[n], L[n], K[n], p, phi, stress, A, D, B[n], KB, X, T, H[n])
        for k in range(12):
            v = 0.0
            for r in range(6):
                v += B[n, r, k] * K[n, r] * e[n, r]
            G[n, k] = v / L[n]


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
    """Energies and derivatives of n separate elements (for tests and for looking; scenes are
    assembled elsewhere).

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
    W, G, H, e, B = (
        np.empty(n),
        np.empty((n, 12)),
        np.empty((n, 12, 12)),
        np.empty((n, 6)),
        np.empty((n, 6, 12)),
    )
    sigma = np.zeros((n, 6)) if stress is None else np.ascontiguousarray(stress, float)
    _evaluate(
        x0, R0, x1, R1, lengths, rest_strain, stiffness, sigma, stress is not None, W, G, H, e, B
    )
    return W, G, H, e, B


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


def rest_strain_derivative(
    strain: np.ndarray, lengths: np.ndarray, stiffness: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """dW/dgamma (n, 6) and the diagonal of dsigma/dgamma (n, 6) at fixed poses: -K e and -K."""
    return -stiffness * strain, -stiffness
