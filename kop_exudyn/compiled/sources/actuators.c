/* Linear actuators of umbrella cells; formulas and names as in scene/actuators.py. */
#include <math.h>
#include <stdint.h>

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* out (3, 3) = A^T B */
static void transposed_product(const double A[3][3], const double B[3][3], double out[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            out[i][k] = A[0][i] * B[0][k] + A[1][i] * B[1][k] + A[2][i] * B[2][k];
}

/* dn/dw of n = R exp(hat(w)) e_z:  R (w x e_z) = w_y R_x - w_x R_y. */
static void normal_map(const double *R, double J[3][3])
{
    for (int r = 0; r < 3; r++)
        J[r][0] = -R[3 * r + 1], J[r][1] = R[3 * r], J[r][2] = 0.0;
}

/* Add w A (3, 3) to a symmetric H (12, 12), in its rows from i and its columns from k on. */
static void add_block(double *H, int i, int k, const double A[3][3], double w)
{
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            H[12 * (i + r) + k + c] += w * A[r][c];
            if (i != k)
                H[12 * (k + c) + i + r] += w * A[r][c];
        }
}

/* Add the second variation of g.n: with f = R^T g, (f e_z^T + e_z f^T)/2 - f_z I. */
static void add_normal_curvature(double *H, int at, const double *R, const double *g, double w)
{
    double f[3];
    for (int k = 0; k < 3; k++)
        f[k] = R[k] * g[0] + R[3 + k] * g[1] + R[6 + k] * g[2];
    for (int k = 0; k < 3; k++) {
        H[12 * (at + k) + at + k] -= w * f[2];
        H[12 * (at + 2) + at + k] += 0.5 * w * f[k];
        H[12 * (at + k) + at + 2] += 0.5 * w * f[k];
    }
}

/* Gradients (m, 12) and Hessians (m, 12, 12) in (dx_t, w_t, dx_b, w_b); returns the energy.

   factors (3): alignment, extension and shear. */
double actuate(int64_t m, const int64_t *top, const int64_t *bottom, const double *spacing,
               const double *weight, const double *factors, const double *positions,
               const double *rotations, double *g, double *H)
{
    double total = 0.0, alignment = factors[0], extension = factors[1], shear = factors[2];
    for (int64_t e = 0; e < m; e++, g += 12, H += 144) {
        const double *R_t = rotations + 9 * top[e], *R_b = rotations + 9 * bottom[e];
        const double n_t[3] = {R_t[2], R_t[5], R_t[8]}, n_b[3] = {R_b[2], R_b[5], R_b[8]};
        double axis[3], gap[3], h_n[3], g_t[3], g_b[3], g_u[3], w = weight[e];
        for (int k = 0; k < 3; k++) {
            axis[k] = n_t[k] - n_b[k];
            gap[k] = positions[3 * top[e] + k] - positions[3 * bottom[e] + k];
        }
        double length = sqrt(dot(axis, axis));
        for (int k = 0; k < 3; k++)
            axis[k] /= length;
        double h = dot(axis, gap), curve = extension - shear;
        double slope = extension * (h - spacing[e]) - shear * h;
        total +=
            w
            * (alignment * dot(n_t, n_b) + 0.5 * extension * (h - spacing[e]) * (h - spacing[e])
               + 0.5 * shear * (dot(gap, gap) - h * h));

        /* derivatives in the normals and in the gap; the normals enter h by their difference */
        double H_nn[3][3], H_nu[3][3], H_uu[3][3], H_tb[3][3], across[3];
        for (int k = 0; k < 3; k++) {
            across[k] = gap[k] - h * axis[k];
            h_n[k] = across[k] / length;
            g_t[k] = slope * h_n[k] + alignment * n_b[k];
            g_b[k] = -slope * h_n[k] + alignment * n_t[k];
            g_u[k] = slope * axis[k] + shear * gap[k];
        }
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++) {
                double one = i == k, project = one - axis[i] * axis[k];
                double h_nn =
                    -(h * project + axis[i] * across[k] + across[i] * axis[k]) / (length * length);
                H_nn[i][k] = slope * h_nn + curve * h_n[i] * h_n[k];
                H_nu[i][k] = slope * project / length + curve * h_n[i] * axis[k];
                H_uu[i][k] = shear * one + curve * axis[i] * axis[k];
                H_tb[i][k] = alignment * one - H_nn[i][k];
            }

        double J_t[3][3], J_b[3][3], right[3][3], block[3][3];
        normal_map(R_t, J_t);
        normal_map(R_b, J_b);
        for (int k = 0; k < 3; k++) {
            g[k] = w * g_u[k];
            g[6 + k] = -w * g_u[k];
            g[3 + k] = w * (J_t[0][k] * g_t[0] + J_t[1][k] * g_t[1] + J_t[2][k] * g_t[2]);
            g[9 + k] = w * (J_b[0][k] * g_b[0] + J_b[1][k] * g_b[1] + J_b[2][k] * g_b[2]);
        }
        for (int k = 0; k < 144; k++)
            H[k] = 0.0;
        add_block(H, 0, 0, H_uu, w);
        add_block(H, 6, 6, H_uu, w);
        add_block(H, 0, 6, H_uu, -w);
        transposed_product(J_t, H_nu, block);
        add_block(H, 3, 0, block, w);
        add_block(H, 3, 6, block, -w);
        transposed_product(J_b, H_nu, block);
        add_block(H, 9, 6, block, w);
        add_block(H, 9, 0, block, -w);
        transposed_product(H_nn, J_t, right); /* H_nn is symmetric */
        transposed_product(J_t, right, block);
        add_block(H, 3, 3, block, w);
        transposed_product(H_nn, J_b, right);
        transposed_product(J_b, right, block);
        add_block(H, 9, 9, block, w);
        transposed_product(H_tb, J_b, right);
        transposed_product(J_t, right, block);
        add_block(H, 3, 9, block, w);
        add_normal_curvature(H, 3, R_t, g_t, w);
        add_normal_curvature(H, 9, R_b, g_b, w);
    }
    return total;
}
