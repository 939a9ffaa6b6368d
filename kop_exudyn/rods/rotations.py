"""Rotations and rigid motions: exponential and logarithm on SO(3) and SE(3), of many at once.

Conventions: rotation vectors in radians, matrices act on column vectors, `hat(a) b = a x b`. An
increment w of a rotation R is a body-frame one, R exp(hat(w)).
"""

from __future__ import annotations

import numpy as np

from ..compiled.library import address, library

# Below this squared angle the closed form of c loses digits to cancellation; the series is exact to
# round-off there.
_SERIES_LIMIT = 0.25
# c(s) = sum |B_2k| s^(k-1) / (2k)!, k = 1, 2, ... with the Bernoulli numbers B_2k
_SERIES = (
    1 / 12,
    1 / 720,
    1 / 30240,
    1 / 1209600,
    1 / 47900160,
    691 / 1307674368000,
    1 / 74724249600,
)
_SMALL = 1e-6  # rad, below which sines over angles are taken from their series
_I3 = np.eye(3)


def bend_coefficients(s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """c(s) = (1 - (t/2) cot(t/2)) / s with t = sqrt(s), and its first two derivatives in s.

    It is the coefficient of hat(phi)^2 in the inverse left Jacobian of SO(3), A(phi) = I -
    hat(phi)/2 + c hat(phi)^2.

    s : (n,) squared angles, rad^2
    """
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
    if not small.any():
        return c, c_s, c_ss
    near = np.where(small, s, 0.0)
    return (
        np.where(small, series(near), c),
        np.where(small, series.deriv()(near), c_s),
        np.where(small, series.deriv(2)(near), c_ss),
    )


def exp_so3(w: np.ndarray) -> np.ndarray:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3), radians. ValueError for arrays of
    another shape."""
    w = np.asarray(w, float)
    if w.shape[-1:] != (3,):
        raise ValueError(f"expected rotation vectors of shape (..., 3), got {w.shape}")
    flat = np.ascontiguousarray(w).reshape(-1, 3)
    kernels = library()
    if kernels is None:
        return _exponentials(flat).reshape(w.shape + (3,))
    out = np.empty((len(flat), 3, 3))
    kernels.rotation_matrices(len(flat), address(flat), address(out))
    return out.reshape(w.shape + (3,))


def log_so3(R: np.ndarray) -> np.ndarray:
    """Rotation vectors (..., 3), of length at most pi, of rotation matrices (..., 3, 3). ValueError
    for arrays of another shape."""
    R = np.asarray(R, float)
    if R.shape[-2:] != (3, 3):
        raise ValueError(f"expected rotations of shape (..., 3, 3), got {R.shape}")
    flat = np.ascontiguousarray(R).reshape(-1, 3, 3)
    kernels = library()
    if kernels is None:
        return _logarithms(flat).reshape(R.shape[:-1])
    out = np.empty((len(flat), 3))
    kernels.rotation_vectors(len(flat), address(flat), address(out))
    return out.reshape(R.shape[:-1])


def compose_increments(R: np.ndarray, w: np.ndarray) -> np.ndarray:
    """R_i exp(hat(w_i)) (n, 3, 3), followed by one Newton-Schulz step that keeps the columns
    orthonormal: thousands of products would otherwise drift off SO(3) by round-off.

    R : (n, 3, 3) rotations;  w : (n, 3) rotation vectors, radians

    Raises ValueError for arrays of another shape.
    """
    if R.ndim != 3 or R.shape[1:] != (3, 3) or w.shape != (len(R), 3):
        raise ValueError(
            f"expected rotations (n, 3, 3) and vectors (n, 3), got {R.shape}, {w.shape}"
        )
    kernels = library()
    if kernels is None:
        P = R @ _exponentials(w)
        return 1.5 * P - 0.5 * P @ (np.swapaxes(P, 1, 2) @ P)
    R, w = np.ascontiguousarray(R, float), np.ascontiguousarray(w, float)
    out = np.empty_like(R)
    kernels.compose_increments(len(w), address(R), address(w), address(out))
    return out


def _exponentials(w: np.ndarray) -> np.ndarray:
    """(n, 3, 3) by Rodrigues; half-angle form, so that no digits cancel at small angles."""
    s = np.einsum("ni,ni->n", w, w)
    t = np.sqrt(s)
    small = t < _SMALL
    safe = np.where(small, 1.0, t)
    a = np.where(small, 1 - s / 6, np.sin(safe) / safe)
    b = np.where(small, 0.5 - s / 24, 2 * (np.sin(0.5 * safe) / safe) ** 2)
    outer = b[:, None, None] * (w[:, :, None] * w[:, None, :])
    return outer + (1 - b * s)[:, None, None] * _I3 + hat(a[:, None] * w)


def _logarithms(R: np.ndarray) -> np.ndarray:
    """(n, 3). The symmetric matrix 4 q q^T of the unit quaternion q is linear in R; its row with
    the largest diagonal entry gives q without cancellation (Shepperd 1978)."""
    n = len(R)
    trace = np.trace(R, axis1=1, axis2=2)
    Q = np.empty((n, 4, 4))
    Q[:, 0, 0] = 1 + trace
    Q[:, 1:, 1:] = R + np.swapaxes(R, 1, 2) + (1 - trace)[:, None, None] * _I3
    Q[:, 0, 1:] = Q[:, 1:, 0] = np.stack(
        [R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1
    )
    q = Q[np.arange(n), np.argmax(Q[:, range(4), range(4)], axis=1)]
    q = q * np.where(q[:, :1] < 0, -1.0, 1.0) / np.linalg.norm(q, axis=1, keepdims=True)
    sine = np.linalg.norm(q[:, 1:], axis=1)
    small = sine < 1e-12
    factor = np.where(small, 2.0, 2 * np.arctan2(sine, q[:, 0]) / np.where(small, 1.0, sine))
    return factor[:, None] * q[:, 1:]


def hat(a: np.ndarray) -> np.ndarray:
    """Cross-product matrices (..., 3, 3) of vectors (..., 3): hat(a) b = a x b."""
    a = np.asarray(a, float)
    out = np.zeros(a.shape + (3,))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -a[..., 2], a[..., 1], -a[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = a[..., 2], -a[..., 1], a[..., 0]
    return out


def rotation_z(angle: np.ndarray | float) -> np.ndarray:
    """Rotations (..., 3, 3) about z by the given angles (...), radians."""
    angle = np.asarray(angle, float)
    return exp_so3(np.stack([np.zeros_like(angle), np.zeros_like(angle), angle], axis=-1))


def axes_along_z(axis: np.ndarray) -> np.ndarray:
    """A rotation (3, 3) whose z axis is a unit vector (3,); the identity for z itself."""
    x = np.eye(3)[np.argmin(np.abs(axis))]
    x = x - (x @ axis) * axis
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


def exp_se3(h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rigid motions of twists h = (u, phi) (..., 6): translations (..., 3) and rotations (..., 3,
    3).

    The translation is p = A(phi)^-1 u, with A the inverse left Jacobian, so that h is the element's
    generalised relative motion again (Sonneville, Cardona, Bruels, CMAME 2014).
    """
    h = np.asarray(h, float)
    flat = h.reshape(-1, 6)
    u, phi = flat[:, :3], flat[:, 3:]
    A = np.eye(3) - 0.5 * hat(phi)
    c = bend_coefficients(np.einsum("ni,ni->n", phi, phi))[0]
    A = A + c[:, None, None] * hat(phi) @ hat(phi)
    p = np.linalg.solve(A, u[..., None])[..., 0]
    return p.reshape(h.shape[:-1] + (3,)), exp_so3(phi).reshape(h.shape[:-1] + (3, 3))
