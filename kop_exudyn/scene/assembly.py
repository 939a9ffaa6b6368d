"""Compiled assembly of a scene's rods: energy, gradient and Hessian straight into the
factorisation's arrays."""

from __future__ import annotations

import math

import numpy as np

from ..rods.element import element_energy, element_hessian, strain_displacement
from ..rods.kernels import kernel
from ..rods.rotations import bend_coefficient

ENERGY, GRADIENT, HESSIAN = 0, 1, 2


@kernel(inline="always")
def node_pose(xb, Rb, h, angles, axes, centres, plain, C, o, x, R, EC, y):
    """Pose (x, R) of a node behind hinge h (-1: none), with EC = E(a) C and y = p + E(a) o left for
    the variations.

    E(a) = cos a I + sin a hat(n) + (1 - cos a) n n^T turns about the hinge's axis n.
    """
    if plain:
        for r in range(3):
            x[r] = xb[r]
            for c in range(3):
                R[r, c] = Rb[r, c]
        return
    if h < 0:
        for r in range(3):
            y[r] = o[r]
            for c in range(3):
                EC[r, c] = C[r, c]
    else:
        # inlined and without views of rows: passing arrays about costs as much as the arithmetic
        n0, n1, n2 = axes[h, 0], axes[h, 1], axes[h, 2]
        p0, p1, p2 = centres[h, 0], centres[h, 1], centres[h, 2]
        co, si = math.cos(angles[h]), math.sin(angles[h])
        if n2 == 1.0:  # about z: most hinges, and half the work
            y[0], y[1], y[2] = p0 + co * o[0] - si * o[1], p1 + si * o[0] + co * o[1], p2 + o[2]
            for c in range(3):
                EC[0, c] = co * C[0, c] - si * C[1, c]
                EC[1, c] = si * C[0, c] + co * C[1, c]
                EC[2, c] = C[2, c]
        else:
            along = (1.0 - co) * (n0 * o[0] + n1 * o[1] + n2 * o[2])
            y[0] = p0 + co * o[0] + si * (n1 * o[2] - n2 * o[1]) + along * n0
            y[1] = p1 + co * o[1] + si * (n2 * o[0] - n0 * o[2]) + along * n1
            y[2] = p2 + co * o[2] + si * (n0 * o[1] - n1 * o[0]) + along * n2
            for c in range(3):
                along = (1.0 - co) * (n0 * C[0, c] + n1 * C[1, c] + n2 * C[2, c])
                EC[0, c] = co * C[0, c] + si * (n1 * C[2, c] - n2 * C[1, c]) + along * n0
                EC[1, c] = co * C[1, c] + si * (n2 * C[0, c] - n0 * C[2, c]) + along * n1
                EC[2, c] = co * C[2, c] + si * (n0 * C[1, c] - n1 * C[0, c]) + along * n2
    for r in range(3):
        x[r] = xb[r] + Rb[r, 0] * y[0] + Rb[r, 1] * y[1] + Rb[r, 2] * y[2]
        for c in range(3):
            R[r, c] = Rb[r, 0] * EC[0, c] + Rb[r, 1] * EC[1, c] + Rb[r, 2] * EC[2, c]


@kernel(inline="always")
def node_map(Rb, h, axes, centres, C, EC, y, T, d):
    """T (6,7): node increments (dx, w) from body increments and hinge angle, with d = n x (y - p)
    left behind.

    dx = dx_b - R_b hat(y) w_b + R_b d da,   w = (EC)^T w_b + C^T n da
    """
    for r in range(3):
        for c in range(3):
            T[r, c] = 1.0 if r == c else 0.0
            T[3 + r, c] = 0.0
            T[3 + r, 3 + c] = EC[c, r]
        T[r, 3] = -(Rb[r, 1] * y[2] - Rb[r, 2] * y[1])
        T[r, 4] = -(Rb[r, 2] * y[0] - Rb[r, 0] * y[2])
        T[r, 5] = -(Rb[r, 0] * y[1] - Rb[r, 1] * y[0])
        T[r, 6] = 0.0
        T[3 + r, 6] = 0.0
    if h < 0:
        return
    n0, n1, n2 = axes[h, 0], axes[h, 1], axes[h, 2]
    a0, a1, a2 = y[0] - centres[h, 0], y[1] - centres[h, 1], y[2] - centres[h, 2]
    d[0], d[1], d[2] = n1 * a2 - n2 * a1, n2 * a0 - n0 * a2, n0 * a1 - n1 * a0
    for r in range(3):
        T[r, 6] = Rb[r, 0] * d[0] + Rb[r, 1] * d[1] + Rb[r, 2] * d[2]
        T[3 + r, 6] = C[0, r] * n0 + C[1, r] * n1 + C[2, r] * n2


@kernel
def transform_columns(M, n_rows, at6, plain, T, out, at7):
    """out[:, at7:at7+7] = M[:, at6:at6+6] T, for the first n_rows rows."""
    for r in range(n_rows):
        if plain:
            for c in range(6):
                out[r, at7 + c] = M[r, at6 + c]
            out[r, at7 + 6] = 0.0
            continue
        for c in range(3):
            out[r, at7 + c] = M[r, at6 + c]
        for c in range(3, 7):
            v = 0.0
            for k in range(6):
                v += M[r, at6 + k] * T[k, c]
            out[r, at7 + c] = v


@kernel
def transform_rows(M, at6, plain, T, out, at7):
    """out[at7:at7+7, at7:] = T^T M[at6:at6+6, at7:], for 14 columns."""
    for c in range(at7, 14):
        if plain:
            for r in range(6):
                out[at7 + r, c] = M[at6 + r, c]
            out[at7 + 6, c] = 0.0
            continue
        for r in range(3):
            out[at7 + r, c] = M[at6 + r, c]
        for r in range(3, 7):
            v = 0.0
            for k in range(6):
                v += T[k, r] * M[at6 + k, c]
            out[at7 + r, c] = v


@kernel
def map_curvature(Rb, h, axes, EC, y, T, d, force, moment, H, at):
    """Add the second variation of the node map, contracted with the node's force (global) and
    moment (node axes).

    f = R_b^T force, b = C^T n:  w.(f y^T)w - (f.y) w.w,  w.(d x f) da,  f.(n x d) da^2,  and half
    of w.EC (b x moment) da.
    """
    f0 = Rb[0, 0] * force[0] + Rb[1, 0] * force[1] + Rb[2, 0] * force[2]
    f1 = Rb[0, 1] * force[0] + Rb[1, 1] * force[1] + Rb[2, 1] * force[2]
    f2 = Rb[0, 2] * force[0] + Rb[1, 2] * force[1] + Rb[2, 2] * force[2]
    fy = f0 * y[0] + f1 * y[1] + f2 * y[2]
    H[at + 3, at + 3] += f0 * y[0] - fy
    H[at + 4, at + 4] += f1 * y[1] - fy
    H[at + 5, at + 5] += f2 * y[2] - fy
    H[at + 3, at + 4] += 0.5 * (f0 * y[1] + f1 * y[0])
    H[at + 3, at + 5] += 0.5 * (f0 * y[2] + f2 * y[0])
    H[at + 4, at + 5] += 0.5 * (f1 * y[2] + f2 * y[1])
    if h < 0:
        return
    n0, n1, n2 = axes[h, 0], axes[h, 1], axes[h, 2]
    b0, b1, b2 = T[3, 6], T[4, 6], T[5, 6]
    t0 = b1 * moment[2] - b2 * moment[1]
    t1 = b2 * moment[0] - b0 * moment[2]
    t2 = b0 * moment[1] - b1 * moment[0]
    H[at + 3, at + 6] += (
        d[1] * f2 - d[2] * f1 + 0.5 * (EC[0, 0] * t0 + EC[0, 1] * t1 + EC[0, 2] * t2)
    )
    H[at + 4, at + 6] += (
        d[2] * f0 - d[0] * f2 + 0.5 * (EC[1, 0] * t0 + EC[1, 1] * t1 + EC[1, 2] * t2)
    )
    H[at + 5, at + 6] += (
        d[0] * f1 - d[1] * f0 + 0.5 * (EC[2, 0] * t0 + EC[2, 1] * t1 + EC[2, 2] * t2)
    )
    H[at + 6, at + 6] += (
        f0 * (n1 * d[2] - n2 * d[1]) + f1 * (n2 * d[0] - n0 * d[2]) + f2 * (n0 * d[1] - n1 * d[0])
    )


def scratch_arrays() -> tuple[np.ndarray, ...]:
    """The small arrays that `assemble_rods` works in, in the order in which it names them."""
    poses = [3, 3, (3, 3), (3, 3), (3, 3), (3, 3), 3, 3, 3, 3, (6, 7), (6, 7)]
    strains = [3, 3, (3, 3), (3, 3), (3, 3), (6, 12), (3, 9), (5, 3, 3), (6, 12)]
    derivatives = [(12, 12), (12, 14), (14, 14), 12, 6]
    return tuple(np.zeros(shape) for shape in poses + strains + derivatives)


@kernel
def assemble_rods(
    order,
    positions,
    rotations,
    angles,
    axes,
    centres,
    node_body,
    node_hinge,
    plain,
    frame,
    offset,
    elements,
    L,
    gamma,
    K,
    weight,
    stress,
    mixed,
    rows,
    slots,
    gradient,
    values,
    strain,
    B14,
    scratch,
):
    """Elastic energy and load potential; at GRADIENT also the gradient, at HESSIAN also values, and
    B14 (E,6,14).

    stress (E, 6) is used in the geometric part when mixed, else the current stress is. weight has
    no rows when the
    scene has none. strain e (E, 6) is always written. scratch : of `scratch_arrays`, for one caller
        at a time.
    """
    (
        x0,
        x1,
        R0,
        R1,
        E0,
        E1,
        y0,
        y1,
        d0,
        d1,
        T0,
        T1,
        p,
        phi,
        R,
        A,
        D,
        KB,
        X,
        T,
        B,
        H,
        M,
        H14,
        G,
        sigma,
    ) = scratch
    elastic = 0.0
    potential = 0.0
    weighted = weight.shape[0] > 0
    for e in range(elements.shape[0]):
        n0, n1 = elements[e, 0], elements[e, 1]
        b0, b1, h0, h1 = node_body[n0], node_body[n1], node_hinge[n0], node_hinge[n1]
        Rb0, Rb1 = rotations[b0], rotations[b1]
        node_pose(
            positions[b0],
            Rb0,
            h0,
            angles,
            axes,
            centres,
            plain[n0],
            frame[n0],
            offset[n0],
            x0,
            R0,
            E0,
            y0,
        )
        node_pose(
            positions[b1],
            Rb1,
            h1,
            angles,
            axes,
            centres,
            plain[n1],
            frame[n1],
            offset[n1],
            x1,
            R1,
            E1,
            y1,
        )
        elastic += element_energy(x0, R0, x1, R1, L[e], gamma[e], K[e], p, phi, R, strain[e])
        if weighted:
            for k in range(3):
                potential -= 0.5 * L[e] * weight[e, k] * (x0[k] + x1[k])
        if order == ENERGY:
            continue

        for k in range(6):
            sigma[k] = K[e, k] * strain[e, k] / L[e]
        if order == GRADIENT:
            c, c1, _ = bend_coefficient(phi[0] ** 2 + phi[1] ** 2 + phi[2] ** 2)
            strain_displacement(R0, p, phi, c, c1, A, D, B)
        else:
            element_hessian(
                R0, L[e], K[e], p, phi, stress[e] if mixed else sigma, A, D, B, KB, X, T, H
            )
        for k in range(12):
            G[k] = (
                B[0, k] * sigma[0]
                + B[1, k] * sigma[1]
                + B[2, k] * sigma[2]
                + B[3, k] * sigma[3]
                + B[4, k] * sigma[4]
                + B[5, k] * sigma[5]
            )
        if weighted:
            for k in range(3):
                G[k] -= 0.5 * L[e] * weight[e, k]
                G[6 + k] -= 0.5 * L[e] * weight[e, k]
        plain0, plain1 = plain[n0], plain[n1]
        if not plain0:
            node_map(Rb0, h0, axes, centres, frame[n0], E0, y0, T0, d0)
        if not plain1:
            node_map(Rb1, h1, axes, centres, frame[n1], E1, y1, T1, d1)
        scatter_gradient(G, 0, plain0, T0, rows[e, :7], gradient)
        scatter_gradient(G, 6, plain1, T1, rows[e, 7:], gradient)
        if order == GRADIENT:
            continue

        # of H14 the blocks on and above the diagonal are used
        transform_columns(H, 6, 0, plain0, T0, M, 0)
        transform_columns(H, 12, 6, plain1, T1, M, 7)
        transform_rows(M, 0, plain0, T0, H14, 0)
        transform_rows(M, 6, plain1, T1, H14, 7)
        transform_columns(B, 6, 0, plain0, T0, B14[e], 0)
        transform_columns(B, 6, 6, plain1, T1, B14[e], 7)
        if mixed:
            for k in range(12):
                G[k] = 0.0
                for r in range(6):
                    G[k] += B[r, k] * stress[e, r]
                if weighted and k % 6 < 3:
                    G[k] -= 0.5 * L[e] * weight[e, k % 6]
        if not plain0:
            map_curvature(Rb0, h0, axes, E0, y0, T0, d0, G[:3], G[3:6], H14, 0)
        if not plain1:
            map_curvature(Rb1, h1, axes, E1, y1, T1, d1, G[6:9], G[9:12], H14, 7)
        s = 0
        for a in range(14):
            for b in range(a, 14):
                slot = slots[e, s]
                if slot >= 0:
                    values[slot] += H14[a, b]
                s += 1
    return elastic, potential


@kernel
def scatter_gradient(G, at, plain, T, rows, gradient):
    """gradient[rows] += T^T G[at:at+6]."""
    for c in range(7):
        if rows[c] < 0:
            continue
        if plain:
            v = G[at + c]
        else:
            v = 0.0
            for k in range(6):
                v += T[k, c] * G[at + k]
        gradient[rows[c]] += v


@kernel
def scatter_blocks(rows, slots, g, H, second_order, gradient, values):
    """Add a term's block gradients (m, k) and symmetric Hessians (m, k, k)."""
    m, k = rows.shape
    for e in range(m):
        s = 0
        for a in range(k):
            if rows[e, a] >= 0:
                gradient[rows[e, a]] += g[e, a]
            if not second_order:
                continue
            for b in range(a, k):
                slot = slots[e, s]
                if slot >= 0:
                    values[slot] += (
                        H[e, a, b] if a == b or rows[e, a] != rows[e, b] else 2 * H[e, a, b]
                    )
                s += 1


@kernel
def predict_stress(strain, B14, rows, increment, K, L, stress):
    """stress = (K/L) (e + B d), the stress that a linear step d (over the kept unknowns) leads
    to."""
    for e in range(strain.shape[0]):
        for r in range(6):
            v = strain[e, r]
            for c in range(14):
                if rows[e, c] >= 0:
                    v += B14[e, r, c] * increment[rows[e, c]]
            stress[e, r] = K[e, r] * v / L[e]


@kernel
def largest_forces(strain, K, L):
    """Largest force and moment in the elements, and largest K_0 / L; NaN where a strain is."""
    force, moment, stretch = 0.0, 0.0, 0.0
    for e in range(strain.shape[0]):
        stretch = max(stretch, K[e, 0] / L[e])
        for r in range(3):
            f, m = abs(K[e, r] * strain[e, r] / L[e]), abs(K[e, r + 3] * strain[e, r + 3] / L[e])
            if f > force or f != f:  # nothing is larger than NaN, so it stays
                force = f
            if m > moment or m != m:
                moment = m
    return force, moment, stretch
