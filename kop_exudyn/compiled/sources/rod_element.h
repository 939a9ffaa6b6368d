/* The geometrically exact rod element on SE(3), four at once; formulas and names as in
   rods/element.py.

   Two poses H_i = (R_i, x_i); h = log(H_0^-1 H_1) = (u, phi):

       R = R_0^T R_1,  phi = log R,  p = R_0^T (x_1 - x_0),  u = A(phi) p,  A = I - hat(phi)/2 + c
   hat(phi)^2 W = 1/(2L) e^T K e,   e = h - L gamma,   sigma = K e / L

   Variations x -> x + dx (global), R -> R exp(hat(w)) (body frame), in the order (dx_0, w_0, dx_1,
   w_1). */
#ifndef ROD_ELEMENT_H
#define ROD_ELEMENT_H

#include "lanes.h"
#include "rotations.h"

/* c(s) = (1 - (t/2) cot(t/2)) / s with t = sqrt(s), and its first two derivatives in s: the
   coefficient of hat(phi)^2 in the inverse left Jacobian of SO(3). */
static void bend_coefficients(lanes s, lanes *c, lanes *c1, lanes *c2)
{
    static const double b[] = {1.0 / 12,         1.0 / 720,      1.0 / 30240,
                               1.0 / 1209600,    1.0 / 47900160, 691 / 1307674368000.0,
                               1 / 74724249600.0};
    *c = b[0] + s * (b[1] + s * (b[2] + s * (b[3] + s * (b[4] + s * (b[5] + s * b[6])))));
    *c1 = b[1] + s * (2 * b[2] + s * (3 * b[3] + s * (4 * b[4] + s * (5 * b[5] + s * 6 * b[6]))));
    *c2 = 2 * b[2] + s * (6 * b[3] + s * (12 * b[4] + s * (20 * b[5] + s * 30 * b[6])));
    for (int l = 0; l < LANES; l++) {
        /* below, the closed form loses digits to cancellation; the series is exact to round-off
         * there */
        if (s[l] < 0.25)
            continue;
        double t = sqrt(s[l]), half = 0.5 * t, sine = sin(half), cosine = cos(half),
               cotangent = cosine / sine;
        double value = (1 - half * cotangent) / s[l], slope = cotangent - half / (sine * sine);
        double first = (-slope / (4 * t) - value) / s[l];
        double curve = -2 / (sine * sine) + 2 * half * cosine / (sine * sine * sine);
        (*c)[l] = value;
        (*c1)[l] = first;
        (*c2)[l] = (-(curve / (16 * s[l]) - slope / (8 * t * s[l])) - 2 * first) / s[l];
    }
}

/* p and phi of the relative pose. */
INLINE void relative_motion(const lanes *x0, const lanes R0[3][3], const lanes *x1,
                            const lanes R1[3][3], lanes *p, lanes *phi)
{
    lanes R[3][3];
    for (int r = 0; r < 3; r++) {
        p[r] = R0[0][r] * (x1[0] - x0[0]) + R0[1][r] * (x1[1] - x0[1]) + R0[2][r] * (x1[2] - x0[2]);
        for (int c = 0; c < 3; c++)
            R[r][c] = R0[0][r] * R1[0][c] + R0[1][r] * R1[1][c] + R0[2][r] * R1[2][c];
    }
    for (int l = 0; l < LANES; l++) {
        double one[9], turn[3];
        for (int k = 0; k < 9; k++)
            one[k] = R[k / 3][k % 3][l];
        rotation_vector(one, turn);
        for (int k = 0; k < 3; k++)
            phi[k][l] = turn[k];
    }
}

/* e = h - L gamma, with u = A(phi) p. */
INLINE void strain_of(const lanes *p, const lanes *phi, lanes c, lanes L, const lanes *gamma,
                      lanes *e)
{
    lanes s = dot3(phi, phi), pp = dot3(phi, p);
    e[0] = p[0] - 0.5 * (phi[1] * p[2] - phi[2] * p[1]) + c * (phi[0] * pp - s * p[0]);
    e[1] = p[1] - 0.5 * (phi[2] * p[0] - phi[0] * p[2]) + c * (phi[1] * pp - s * p[1]);
    e[2] = p[2] - 0.5 * (phi[0] * p[1] - phi[1] * p[0]) + c * (phi[2] * pp - s * p[2]);
    for (int r = 0; r < 3; r++) {
        e[3 + r] = phi[r] - L * gamma[3 + r];
        e[r] -= L * gamma[r];
    }
}

INLINE void add_hat(lanes M[3][3], const lanes *a, double factor)
{
    M[0][1] -= factor * a[2];
    M[0][2] += factor * a[1];
    M[1][0] += factor * a[2];
    M[1][2] -= factor * a[0];
    M[2][0] -= factor * a[1];
    M[2][1] += factor * a[0];
}

/* Fill A (3,3) and B (6,12) = d(u, phi)/d(dx_0, w_0, dx_1, w_1). */
INLINE void strain_displacement(const lanes R0[3][3], const lanes *p, const lanes *phi, lanes c,
                                lanes c1, lanes A[3][3], lanes B[6][12])
{
    lanes s = dot3(phi, phi), pp = dot3(phi, p), D[3][3], zero = {0};
    for (int r = 0; r < 3; r++) {
        for (int k = 0; k < 3; k++) {
            A[r][k] = c * phi[r] * phi[k];
            D[r][k] = c * (phi[r] * p[k] - 2 * p[r] * phi[k])
                      + 2 * c1 * (phi[r] * pp - s * p[r]) * phi[k];
        }
        A[r][r] += 1 - c * s;
        D[r][r] += c * pp;
    }
    add_hat(A, phi, -0.5);
    add_hat(D, p, 0.5);
    for (int r = 0; r < 3; r++) {
        for (int k = 0; k < 3; k++) {
            B[3 + r][k] = B[3 + r][6 + k] = zero;
            B[3 + r][3 + k] = -A[r][k];
            B[3 + r][9 + k] = A[k][r];
            B[r][6 + k] = A[r][0] * R0[k][0] + A[r][1] * R0[k][1] + A[r][2] * R0[k][2];
            B[r][k] = -B[r][6 + k];
            B[r][9 + k] = D[r][0] * A[k][0] + D[r][1] * A[k][1] + D[r][2] * A[k][2];
            B[r][3 + k] = -(D[r][0] * A[0][k] + D[r][1] * A[1][k] + D[r][2] * A[2][k]);
        }
        /* A hat(p) */
        B[r][3] += A[r][1] * p[2] - A[r][2] * p[1];
        B[r][4] += A[r][2] * p[0] - A[r][0] * p[2];
        B[r][5] += A[r][0] * p[1] - A[r][1] * p[0];
    }
}

/* Add G(sigma), the stress part of the Hessian, to the blocks of w_0, dx_1, w_1 in H (12,12).

   G collects the second variations of (u, phi) contracted with sigma: dphi.Mff dphi + 2 dphi.Mfp dp
   from A(phi) p, the derivative of the Jacobians that turn w_0, w_1 into dphi, and the second
   variation of p. Blocks below the diagonal are left alone. */
INLINE void geometric_stiffness(const lanes R0[3][3], const lanes *p, const lanes *phi, lanes c,
                                lanes c1, lanes c2, const lanes A[3][3], const lanes *sigma,
                                lanes H[12][12])
{
    const lanes *su = sigma, *sp = sigma + 3;
    lanes s = dot3(phi, phi), pp = dot3(phi, p), sph = dot3(su, phi), sup = dot3(su, p);
    lanes k0 = sph * pp - s * sup, g[3], kg[3], f[3];
    for (int r = 0; r < 3; r++) {
        kg[r] = su[r] * pp + p[r] * sph - 2 * phi[r] * sup;
        g[r] = sp[r] + c * kg[r] + 2 * c1 * k0 * phi[r];
        f[r] = A[0][r] * su[0] + A[1][r] * su[1] + A[2][r] * su[2];
    }
    g[0] -= 0.5 * (p[1] * su[2] - p[2] * su[1]);
    g[1] -= 0.5 * (p[2] * su[0] - p[0] * su[2]);
    g[2] -= 0.5 * (p[0] * su[1] - p[1] * su[0]);
    lanes gph = dot3(g, phi);

    /* halves of Mff, d(g . A w_0)/dphi and d(g . A^T w_1)/dphi, since they enter through P^T X +
     * X^T P; and Mfp */
    lanes M[3][3], N0[3][3], N1[3][3], Q[3][3], X[3][9];
    for (int r = 0; r < 3; r++) {
        for (int k = 0; k < 3; k++) {
            M[r][k] = 0.5 * c * (su[r] * p[k] + p[r] * su[k])
                      + c1 * (kg[r] * phi[k] + phi[r] * kg[k]) + 2 * c2 * k0 * phi[r] * phi[k];
            Q[r][k] = c * (su[r] * phi[k] - 2 * phi[r] * su[k])
                      + 2 * c1 * phi[r] * (sph * phi[k] - s * su[k]);
            N1[r][k] = 0.5
                       * (c * (g[r] * phi[k] - 2 * phi[r] * g[k])
                          + 2 * c1 * phi[r] * (gph * phi[k] - s * g[k]));
        }
        M[r][r] += -c * sup + c1 * k0;
        Q[r][r] += c * sph;
        N1[r][r] += 0.5 * c * gph;
    }
    memcpy(N0, N1, sizeof N0);
    add_hat(Q, su, 0.5);
    add_hat(N1, g, -0.25);
    add_hat(N0, g, 0.25);

    /* P^T X + X^T P with P = (-A, 0, A^T), the variation of phi, and X = M P + Q dp + (N1 w_1 - N0
       w_0)/2, where dp = R0^T dx_1 + hat(p) w_0 */
    for (int r = 0; r < 3; r++) {
        for (int k = 0; k < 3; k++) {
            X[r][k] = -(M[r][0] * A[0][k] + M[r][1] * A[1][k] + M[r][2] * A[2][k]) - N0[r][k];
            X[r][3 + k] = Q[r][0] * R0[k][0] + Q[r][1] * R0[k][1] + Q[r][2] * R0[k][2];
            X[r][6 + k] = M[r][0] * A[k][0] + M[r][1] * A[k][1] + M[r][2] * A[k][2] + N1[r][k];
        }
        X[r][0] += Q[r][1] * p[2] - Q[r][2] * p[1];
        X[r][1] += Q[r][2] * p[0] - Q[r][0] * p[2];
        X[r][2] += Q[r][0] * p[1] - Q[r][1] * p[0];
    }
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 9; k++)
            H[3 + i][3 + k] -= A[0][i] * X[0][k] + A[1][i] * X[1][k] + A[2][i] * X[2][k];
        for (int k = 0; k < 3; k++)
            H[9 + i][9 + k] +=
                A[i][0] * X[0][6 + k] + A[i][1] * X[1][6 + k] + A[i][2] * X[2][6 + k];
    }
    for (int i = 0; i < 9; i++)
        for (int k = 0; k < 3; k++)
            H[3 + i][9 + k] += X[0][i] * A[k][0] + X[1][i] * A[k][1] + X[2][i] * A[k][2];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            H[3 + i][3 + k] -= X[0][i] * A[0][k] + X[1][i] * A[1][k] + X[2][i] * A[2][k];

    /* f . d2p */
    lanes pf = dot3(p, f);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            H[3 + i][3 + k] += 0.5 * (f[i] * p[k] + p[i] * f[k]);
        H[3 + i][3 + i] -= pf;
        H[3][6 + i] += f[1] * R0[i][2] - f[2] * R0[i][1];
        H[4][6 + i] += f[2] * R0[i][0] - f[0] * R0[i][2];
        H[5][6 + i] += f[0] * R0[i][1] - f[1] * R0[i][0];
    }
}

/* The symmetric H (12,12) = B^T (K/L) B + G(sigma).

   Only blocks of w_0, dx_1 and w_1 are computed: the energy depends on x_1 - x_0, so those of dx_0
   are minus dx_1's. phi does not depend on positions, so products with columns of dx_1 have three
   rows. */
INLINE void element_hessian(const lanes R0[3][3], lanes L, const lanes *K, const lanes *p,
                            const lanes *phi, lanes c, lanes c1, lanes c2, const lanes A[3][3],
                            const lanes B[6][12], const lanes *sigma, lanes H[12][12])
{
    lanes KB[6][12];
    for (int r = 0; r < 6; r++)
        for (int k = 3; k < 12; k++)
            KB[r][k] = K[r] / L * B[r][k];
    for (int i = 0; i < 3; i++) {
        for (int k = 3; k < 12; k++)
            H[3 + i][k] = KB[0][3 + i] * B[0][k] + KB[1][3 + i] * B[1][k] + KB[2][3 + i] * B[2][k];
        for (int k = 6; k < 12; k++)
            H[6 + i][k] = KB[0][6 + i] * B[0][k] + KB[1][6 + i] * B[1][k] + KB[2][6 + i] * B[2][k];
        for (int k = 9; k < 12; k++)
            H[9 + i][k] = KB[0][9 + i] * B[0][k] + KB[1][9 + i] * B[1][k] + KB[2][9 + i] * B[2][k];
    }
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            H[3 + i][3 + k] += KB[3][3 + i] * B[3][3 + k] + KB[4][3 + i] * B[4][3 + k]
                               + KB[5][3 + i] * B[5][3 + k];
            H[3 + i][9 + k] += KB[3][3 + i] * B[3][9 + k] + KB[4][3 + i] * B[4][9 + k]
                               + KB[5][3 + i] * B[5][9 + k];
            H[9 + i][9 + k] += KB[3][9 + i] * B[3][9 + k] + KB[4][9 + i] * B[4][9 + k]
                               + KB[5][9 + i] * B[5][9 + k];
        }
    geometric_stiffness(R0, p, phi, c, c1, c2, A, sigma, H);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            H[6 + i][3 + k] = H[3 + k][6 + i];
            H[9 + i][3 + k] = H[3 + k][9 + i];
            H[9 + i][6 + k] = H[6 + k][9 + i];
            if (k < i)
                for (int at = 3; at < 12; at += 3)
                    H[at + i][at + k] = H[at + k][at + i];
        }
    for (int i = 0; i < 3; i++) {
        for (int k = 3; k < 12; k++)
            H[i][k] = -H[6 + i][k];
        for (int k = 0; k < 3; k++)
            H[i][k] = H[6 + i][6 + k];
    }
    for (int i = 3; i < 12; i++)
        for (int k = 0; k < 3; k++)
            H[i][k] = -H[i][6 + k];
}

#endif
