"""Rotations and rigid motions: exponential and logarithm on SO(3) and SE(3), compiled, and their
NumPy-array forms.

Conventions: rotation vectors in radians, matrices act on column vectors, `hat(a) b = a x b`. An
increment w of a rotation R is a body-frame one, R exp(hat(w)).
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from .kernels import kernel

# Below this squared angle the closed form of c loses digits to cancellation; the series is exact to
# round-off there.
_SERIES_LIMIT = 0.25


@kernel(inline="always")
def bend_coefficient(s):
    """c(s) = (1 - (t/2) cot(t/2)) / s with t = sqrt(s), and its first two derivatives in s.

    It is the coefficient of hat(phi)^2 in the inverse left Jacobian of SO(3), A(phi) = I -
    hat(phi)/2 + c hat(phi)^2.
    """
    if s < _SERIES_LIMIT:
        b = (
            1 / 12,
            1 / 720,
            1 / 30240,
            1 / 1209600,
            1 / 47900160,
            691 / 1307674368000,
            1 / 74724249600,
        )
        c = b[0] + s * (b[1] + s * (b[2] + s * (b[3] + s * (b[4] + s * (b[5] + s * b[6])))))
        c1 = b[1] + s * (2 * b[2] + s * (3 * b[3] + s * (4 * b[4] + s * (5 * b[5] + s * 6 * b[6]))))
        c2 = 2 * b[2] + s * (6 * b[3] + s * (12 * b[4] + s * (20 * b[5] + s * 30 * b[6])))
        return c, c1, c2
    t = math.sqrt(s)
    half = 0.5 * t
    sine = math.sin(half)
    cotangent = math.cos(half) / sine
    c = (1 - half * cotangent) / s
    slope = cotangent - half / sine**2
    c1 = (-slope / (4 * t) - c) / s
    curve = -2 / sine**2 + 2 * half * math.cos(half) / sine**3
    c2 = (-(curve / (16 * s) - slope / (8 * t * s)) - 2 * c1) / s
    return c, c1, c2


@kernel(inline="always")
def log_into(R, phi):
    """Write the rotation vector of R (angle at most pi) into phi, through the quaternion with the
    largest component."""
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    if trace > 0:
        S = math.sqrt(trace + 1) * 2
        w, x, y, z = (
            0.25 * S,
            (R[2, 1] - R[1, 2]) / S,
            (R[0, 2] - R[2, 0]) / S,
            (R[1, 0] - R[0, 1]) / S,
        )
    elif R[0, 0] > R[1, 1] and R[0, 0] > R[2, 2]:
        S = math.sqrt(1 + R[0, 0] - R[1, 1] - R[2, 2]) * 2
        w, x, y, z = (
            (R[2, 1] - R[1, 2]) / S,
            0.25 * S,
            (R[0, 1] + R[1, 0]) / S,
            (R[0, 2] + R[2, 0]) / S,
        )
    elif R[1, 1] > R[2, 2]:
        S = math.sqrt(1 + R[1, 1] - R[0, 0] - R[2, 2]) * 2
        w, x, y, z = (
            (R[0, 2] - R[2, 0]) / S,
            (R[0, 1] + R[1, 0]) / S,
            0.25 * S,
            (R[1, 2] + R[2, 1]) / S,
        )
    else:
        S = math.sqrt(1 + R[2, 2] - R[0, 0] - R[1, 1]) * 2
        w, x, y, z = (
            (R[1, 0] - R[0, 1]) / S,
            (R[0, 2] + R[2, 0]) / S,
            (R[1, 2] + R[2, 1]) / S,
            0.25 * S,
        )
    if w < 0:
        w, x, y, z = -w, -x, -y, -z
    n = math.sqrt(x * x + y * y + z * z)
    factor = 2.0 if n < 1e-12 else 2 * math.atan2(n, w) / n
    phi[0], phi[1], phi[2] = factor * x, factor * y, factor * z


@kernel(inline="always")
def exp_into(w, R):
    """Write exp(hat(w)) into R (Rodrigues; half-angle form, so that no digits cancel at small
    angles)."""
    s = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]
    t = math.sqrt(s)
    if t < 1e-6:
        a, b = 1 - s / 6, 0.5 - s / 24
    else:
        a, b = math.sin(t) / t, 2 * (math.sin(0.5 * t) / t) ** 2
    for i in range(3):
        for j in range(3):
            R[i, j] = b * w[i] * w[j]
        R[i, i] += 1 - b * s
    R[0, 1] -= a * w[2]
    R[0, 2] += a * w[1]
    R[1, 0] += a * w[2]
    R[1, 2] -= a * w[0]
    R[2, 0] -= a * w[1]
    R[2, 1] += a * w[0]


@kernel
def _exp_all(w, out):
    for i in range(w.shape[0]):
        exp_into(w[i], out[i])


@kernel
def _log_all(R, out):
    for i in range(R.shape[0]):
        log_into(R[i], out[i])


@nb.njit(cache=True)
def compose_increments(R, w, out):
    """out_i = R_i exp(hat(w_i)), followed by one Newton-Schulz step that keeps the columns
    orthonormal.

    Thousands of products would otherwise drift off SO(3) by round-off.
    """
    E = np.empty((3, 3))
    P = np.empty((3, 3))
    for i in range(R.shape[0]):
        exp_into(w[i], E)
        for r in range(3):
            for c in range(3):
                P[r, c] = R[i, r, 0] * E[0, c] + R[i, r, 1] * E[1, c] + R[i, r, 2] * E[2, c]
        for r in range(3):
            for c in range(3):
                total = 1.5 * P[r, c]
                for k in range(3):
                    gram = P[0, k] * P[0, c] + P[1, k] * P[1, c] + P[2, k] * P[2, c]
                    total -= 0.5 * P[r, k] * gram
                out[i, r, c] = total


def exp_so3(w: np.ndarray) -> np.ndarray:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3), radians."""
    w = np.asarray(w, float)
    out = np.empty(w.shape + (3,))
    _exp_all(np.ascontiguousarray(w).reshape(-1, 3), out.reshape(-1, 3, 3))
    return out


def log_so3(R: np.ndarray) -> np.ndarray:
    """Rotation vectors (..., 3), of length at most pi, of rotation matrices (..., 3, 3)."""
    R = np.asarray(R, float)
    out = np.empty(R.shape[:-1])
    _log_all(np.ascontiguousarray(R).reshape(-1, 3, 3), out.reshape(-1, 3))
    return out


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
    c = np.array([bend_coefficient(float(s))[0] for s in np.einsum("ni,ni->n", phi, phi)])
    A = A + c[:, None, None] * hat(phi) @ hat(phi)
    p = np.linalg.solve(A, u[..., None])[..., 0]
    return p.reshape(h.shape[:-1] + (3,)), exp_so3(phi).reshape(h.shape[:-1] + (3, 3))
