/* Assembly of a scene's rods: energy, gradient and Hessian straight into the factorisation's
 * arrays. */
#include "rod_element.h"

enum { ENERGY, GRADIENT, HESSIAN }; /* as in scene/assembly.py */

/* Arrays of one scene and its solver, by the names of scene/assembly.py. */
typedef struct {
    int64_t n_elements;
    const int64_t *elements, *node_body, *node_hinge;
    const double *frame, *offset, *axes, *centres, *stiffness, *rest_strain;
    const double *weight; /* NULL without dead load */
    const int32_t *rows, *slots;
    double *gradient, *values, *strain, *strain_displacement, *predicted_stress;
} Rods;

/* A node of four elements: pose (x, R), and what its variations need. */
typedef struct {
    lanes x[3], R[3][3];
    lanes Rb[3][3], EC[3][3], y[3]; /* EC = E(a) C, y = p + E(a) o */
    lanes n[3], d[3], C[3][3];      /* axis (0: no hinge), n x (y - p), C */
    lanes T[6][4]; /* node increments from turns of the body and the hinge, see node_map */
} Node;

INLINE void gather(lanes *to, const double *from, int l, int count)
{
    for (int k = 0; k < count; k++)
        to[k][l] = from[k];
}

/* Poses behind hinges: E(a) = cos a I + sin a hat(n) + (1 - cos a) n n^T turns about the axis n. */
INLINE void node_pose(const Rods *rods, const double *positions, const double *rotations,
                      const double *angles, const int64_t e[LANES], int end, Node *node)
{
    lanes xb[3], o[3], p[3], sine, cosine;
    for (int l = 0; l < LANES; l++) {
        static const double none[3] = {0};
        int64_t m = rods->elements[2 * e[l] + end], body = rods->node_body[m],
                h = rods->node_hinge[m];
        gather(xb, positions + 3 * body, l, 3);
        gather(node->Rb[0], rotations + 9 * body, l, 9);
        gather(node->C[0], rods->frame + 9 * m, l, 9);
        gather(o, rods->offset + 3 * m, l, 3);
        gather(node->n, h < 0 ? none : rods->axes + 3 * h, l, 3);
        gather(p, h < 0 ? none : rods->centres + 3 * h, l, 3);
        sine[l] = h < 0 ? 0.0 : sin(angles[h]);
        cosine[l] = h < 0 ? 1.0 : cos(angles[h]);
    }
    const lanes *n = node->n;
    lanes share = 1 - cosine, along = share * dot3(n, o);
    lanes turned[3] = {cosine * o[0] + sine * (n[1] * o[2] - n[2] * o[1]) + along * n[0],
                       cosine * o[1] + sine * (n[2] * o[0] - n[0] * o[2]) + along * n[1],
                       cosine * o[2] + sine * (n[0] * o[1] - n[1] * o[0]) + along * n[2]};
    node->d[0] = n[1] * turned[2] - n[2] * turned[1];
    node->d[1] = n[2] * turned[0] - n[0] * turned[2];
    node->d[2] = n[0] * turned[1] - n[1] * turned[0];
    for (int c = 0; c < 3; c++) {
        lanes C[3] = {node->C[0][c], node->C[1][c], node->C[2][c]};
        along = share * dot3(n, C);
        node->EC[0][c] = cosine * C[0] + sine * (n[1] * C[2] - n[2] * C[1]) + along * n[0];
        node->EC[1][c] = cosine * C[1] + sine * (n[2] * C[0] - n[0] * C[2]) + along * n[1];
        node->EC[2][c] = cosine * C[2] + sine * (n[0] * C[1] - n[1] * C[0]) + along * n[2];
        node->y[c] = p[c] + turned[c];
    }
    for (int r = 0; r < 3; r++) {
        const lanes *b = node->Rb[r];
        node->x[r] = xb[r] + dot3(b, node->y);
        for (int c = 0; c < 3; c++)
            node->R[r][c] = b[0] * node->EC[0][c] + b[1] * node->EC[1][c] + b[2] * node->EC[2][c];
    }
}

/* T: dx = dx_b - R_b hat(y) w_b + R_b d da,   w = (EC)^T w_b + C^T n da; columns of dx_b are the
 * identity's. */
INLINE void node_map(Node *node)
{
    const lanes *y = node->y, *n = node->n;
    for (int r = 0; r < 3; r++) {
        const lanes *b = node->Rb[r];
        node->T[r][0] = b[2] * y[1] - b[1] * y[2];
        node->T[r][1] = b[0] * y[2] - b[2] * y[0];
        node->T[r][2] = b[1] * y[0] - b[0] * y[1];
        node->T[r][3] = dot3(b, node->d);
        for (int c = 0; c < 3; c++)
            node->T[3 + r][c] = node->EC[c][r];
        node->T[3 + r][3] = node->C[0][r] * n[0] + node->C[1][r] * n[1] + node->C[2][r] * n[2];
    }
}

/* out[:, at7:at7+7] = M[:, at6:at6+6] T for the first rows. */
INLINE void transform_columns(int n_rows, int width, const lanes M[][width], int at6,
                              const Node *node, lanes out[][14], int at7)
{
    for (int r = 0; r < n_rows; r++) {
        for (int c = 0; c < 3; c++)
            out[r][at7 + c] = M[r][at6 + c];
        for (int c = 0; c < 4; c++) {
            lanes v = M[r][at6] * node->T[0][c];
            for (int k = 1; k < 6; k++)
                v += M[r][at6 + k] * node->T[k][c];
            out[r][at7 + 3 + c] = v;
        }
    }
}

/* out[at7:at7+7, at7:] = T^T M[at6:at6+6, at7:]. */
INLINE void transform_rows(const lanes M[12][14], int at6, const Node *node, lanes out[14][14],
                           int at7)
{
    for (int c = at7; c < 14; c++) {
        for (int r = 0; r < 3; r++)
            out[at7 + r][c] = M[at6 + r][c];
        for (int r = 0; r < 4; r++) {
            lanes v = node->T[0][r] * M[at6][c];
            for (int k = 1; k < 6; k++)
                v += node->T[k][r] * M[at6 + k][c];
            out[at7 + 3 + r][c] = v;
        }
    }
}

/* Add the second variation of the node map, contracted with the node's force (global) and moment
   (node axes).

   f = R_b^T force, b = C^T n:  w.(f y^T)w - (f.y) w.w,  w.(d x f) da,  f.(n x d) da^2,  and half of
   w.EC (b x moment) da. */
INLINE void map_curvature(const Node *node, const lanes *force, const lanes *moment,
                          lanes H[14][14], int at)
{
    const lanes *y = node->y, *n = node->n, *d = node->d;
    lanes f[3], b[3] = {node->T[3][3], node->T[4][3], node->T[5][3]};
    for (int k = 0; k < 3; k++)
        f[k] = node->Rb[0][k] * force[0] + node->Rb[1][k] * force[1] + node->Rb[2][k] * force[2];
    lanes fy = dot3(f, y);
    for (int i = 0; i < 3; i++) {
        H[at + 3 + i][at + 3 + i] += f[i] * y[i] - fy;
        for (int k = i + 1; k < 3; k++)
            H[at + 3 + i][at + 3 + k] += 0.5 * (f[i] * y[k] + f[k] * y[i]);
    }
    lanes t[3] = {b[1] * moment[2] - b[2] * moment[1], b[2] * moment[0] - b[0] * moment[2],
                  b[0] * moment[1] - b[1] * moment[0]};
    H[at + 3][at + 6] += d[1] * f[2] - d[2] * f[1] + 0.5 * dot3(node->EC[0], t);
    H[at + 4][at + 6] += d[2] * f[0] - d[0] * f[2] + 0.5 * dot3(node->EC[1], t);
    H[at + 5][at + 6] += d[0] * f[1] - d[1] * f[0] + 0.5 * dot3(node->EC[2], t);
    H[at + 6][at + 6] += f[0] * (n[1] * d[2] - n[2] * d[1]) + f[1] * (n[2] * d[0] - n[0] * d[2])
                         + f[2] * (n[0] * d[1] - n[1] * d[0]);
}

/* Forces and moments at both ends (12): B^T sigma, and half of the dead load on each. */
INLINE void node_forces(const lanes B[6][12], const lanes *sigma, const lanes *load, lanes G[12])
{
    for (int k = 0; k < 12; k++) {
        G[k] = B[0][k] * sigma[0];
        for (int r = 1; r < 6; r++)
            G[k] += B[r][k] * sigma[r];
    }
    for (int k = 0; k < 3; k++) {
        G[k] -= load[k];
        G[6 + k] -= load[k];
    }
}

INLINE void scatter_gradient(const lanes G[12], const Node *node, int end,
                             const int32_t *const rows[LANES], int valid, double *gradient)
{
    lanes own[7];
    for (int c = 0; c < 7; c++) {
        own[c] = c < 3 ? G[6 * end + c] : node->T[0][c - 3] * G[6 * end];
        for (int k = 1; c >= 3 && k < 6; k++)
            own[c] += node->T[k][c - 3] * G[6 * end + k];
    }
    for (int l = 0; l < valid; l++)
        for (int c = 0; c < 7; c++) {
            int32_t row = rows[l][7 * end + c];
            if (row >= 0)
                gradient[row] += own[c][l];
        }
}

/* Energies (2,): elastic, and the dead load's potential. Up to `order` also strain (always),
   gradient, Hessian values and strain-displacement matrices, at a state and rest lengths. mixed:
   geometric part at the predicted stress. */
void assemble_rods(const Rods *rods, int order, int mixed, const double *positions,
                   const double *rotations, const double *angles, const double *lengths,
                   double *energies)
{
    double elastic = 0.0, potential = 0.0;
    for (int64_t first = 0; first < rods->n_elements; first += LANES) {
        int valid = rods->n_elements - first < LANES ? (int)(rods->n_elements - first) : LANES;
        int64_t e[LANES];
        const int32_t *rows[LANES];
        Node ends[2];
        lanes L, K[6], gamma[6], load[3], p[3], phi[3], strain[6], sigma[6], c, c1, c2;
        memset(load, 0, sizeof load);
        for (int l = 0; l < LANES; l++) {
            e[l] = l < valid ? first + l : first; /* lanes left over repeat the first element */
            rows[l] = rods->rows + 14 * e[l];
            L[l] = lengths[e[l]];
            gather(K, rods->stiffness + 6 * e[l], l, 6);
            gather(gamma, rods->rest_strain + 6 * e[l], l, 6);
            if (rods->weight)
                for (int k = 0; k < 3; k++)
                    load[k][l] = 0.5 * L[l] * rods->weight[3 * e[l] + k];
        }
        for (int end = 0; end < 2; end++)
            node_pose(rods, positions, rotations, angles, e, end, &ends[end]);
        relative_motion(ends[0].x, ends[0].R, ends[1].x, ends[1].R, p, phi);
        bend_coefficients(dot3(phi, phi), &c, &c1, &c2);
        strain_of(p, phi, c, L, gamma, strain);
        lanes energy = {0}, sum[3];
        for (int r = 0; r < 6; r++) {
            sigma[r] = K[r] * strain[r] / L;
            energy += strain[r] * sigma[r];
        }
        for (int r = 0; r < 3; r++)
            sum[r] = ends[0].x[r] + ends[1].x[r];
        lanes own = dot3(load, sum);
        for (int l = 0; l < valid; l++) {
            elastic += 0.5 * energy[l];
            potential -= own[l];
            for (int r = 0; r < 6; r++)
                rods->strain[6 * e[l] + r] = strain[r][l];
        }
        if (order == ENERGY)
            continue;

        lanes A[3][3], B[6][12], G[12];
        strain_displacement(ends[0].R, p, phi, c, c1, A, B);
        node_forces(B, sigma, load, G);
        for (int end = 0; end < 2; end++) {
            node_map(&ends[end]);
            scatter_gradient(G, &ends[end], end, rows, valid, rods->gradient);
        }
        if (order == GRADIENT)
            continue;

        lanes H[12][12], M[12][14], H14[14][14], B14[6][14];
        if (mixed) {
            for (int l = 0; l < LANES; l++)
                gather(sigma, rods->predicted_stress + 6 * e[l], l, 6);
            node_forces(B, sigma, load, G);
        }
        element_hessian(ends[0].R, L, K, p, phi, c, c1, c2, A, B, sigma, H);
        transform_columns(6, 12, H, 0, &ends[0], M,
                          0); /* of H14 what is on and above the diagonal is used */
        transform_columns(12, 12, H, 6, &ends[1], M, 7);
        transform_rows(M, 0, &ends[0], H14, 0);
        transform_rows(M, 6, &ends[1], H14, 7);
        for (int end = 0; end < 2; end++) {
            map_curvature(&ends[end], G + 6 * end, G + 6 * end + 3, H14, 7 * end);
            transform_columns(6, 12, B, 6 * end, &ends[end], B14, 7 * end);
        }
        for (int l = 0; l < valid; l++) {
            const int32_t *slots = rods->slots + 105 * e[l];
            for (int a = 0; a < 14; a++)
                for (int b = a; b < 14; b++, slots++)
                    if (*slots >= 0)
                        rods->values[*slots] += H14[a][b][l];
            double *out = rods->strain_displacement + 84 * e[l];
            for (int r = 0; r < 6; r++)
                for (int c = 0; c < 14; c++)
                    *out++ = B14[r][c][l];
        }
    }
    energies[0] = elastic;
    energies[1] = potential;
}

/* Add a term's block gradients (m, k) and symmetric Hessians (m, k, k; NULL: only gradients). */
void scatter_blocks(int64_t m, int64_t k, const int32_t *rows, const int32_t *slots,
                    const double *g, const double *H, double *gradient, double *values)
{
    for (int64_t e = 0; e < m; e++, rows += k, g += k) {
        for (int64_t a = 0; a < k; a++)
            if (rows[a] >= 0)
                gradient[rows[a]] += g[a];
        if (!H)
            continue;
        for (int64_t a = 0; a < k; a++)
            for (int64_t b = a; b < k; b++, slots++)
                if (*slots >= 0)
                    values[*slots] +=
                        a != b && rows[a] == rows[b] ? 2 * H[a * k + b] : H[a * k + b];
        H += k * k;
    }
}

/* stress (E, 6) = (K/L) (e + B d), what a linear step d (over the kept unknowns) leads to. */
void predict_stress(const Rods *rods, const double *lengths, const double *increment,
                    double *stress)
{
    for (int64_t e = 0; e < rods->n_elements; e++) {
        const int32_t *rows = rods->rows + 14 * e;
        const double *B = rods->strain_displacement + 84 * e;
        double d[14];
        for (int c = 0; c < 14; c++)
            d[c] = rows[c] >= 0 ? increment[rows[c]] : 0.0;
        for (int r = 0; r < 6; r++) {
            double v = rods->strain[6 * e + r];
            for (int c = 0; c < 14; c++)
                v += B[14 * r + c] * d[c];
            stress[6 * e + r] = rods->stiffness[6 * e + r] * v / lengths[e];
        }
    }
}

/* Largest force and moment in the elements, and largest K_0 / L (3,); NaN where a strain is. */
void largest_forces(const Rods *rods, const double *lengths, double *out)
{
    out[0] = out[1] = out[2] = 0.0;
    for (int64_t e = 0; e < rods->n_elements; e++) {
        const double *K = rods->stiffness + 6 * e, *strain = rods->strain + 6 * e;
        out[2] = fmax(out[2], K[0] / lengths[e]);
        for (int r = 0; r < 6; r++) {
            double force = fabs(K[r] * strain[r] / lengths[e]);
            if (force > out[r / 3] || force != force) /* nothing is larger than NaN, so it stays */
                out[r / 3] = force;
        }
    }
}

/* n separate elements: energies W (n), gradients G (n, 12), Hessians H (n, 12, 12), strains e (n,
   6) and B (n, 6, 12). stress (n, 6) of the geometric part, NULL: the current one. */
void evaluate_elements(int64_t n, const double *x0, const double *R0, const double *x1,
                       const double *R1, const double *lengths, const double *stiffness,
                       const double *rest_strain, const double *stress, double *W, double *G,
                       double *H, double *e, double *B)
{
    static const lanes no_load[3];
    for (int64_t i = 0; i < n; i++) { /* all lanes the same: for tests and for looking */
        lanes first[3], second[3], axes[2][3][3], K[6], gamma[6], p[3], phi[3], strain[6], sigma[6],
            c, c1, c2;
        lanes A[3][3], own[6][12], force[12], square[12][12], L;
        for (int l = 0; l < LANES; l++) {
            L[l] = lengths[i];
            gather(first, x0 + 3 * i, l, 3);
            gather(second, x1 + 3 * i, l, 3);
            gather(axes[0][0], R0 + 9 * i, l, 9);
            gather(axes[1][0], R1 + 9 * i, l, 9);
            gather(K, stiffness + 6 * i, l, 6);
            gather(gamma, rest_strain + 6 * i, l, 6);
        }
        relative_motion(first, axes[0], second, axes[1], p, phi);
        bend_coefficients(dot3(phi, phi), &c, &c1, &c2);
        strain_of(p, phi, c, L, gamma, strain);
        W[i] = 0.0;
        for (int r = 0; r < 6; r++) {
            sigma[r] = K[r] * strain[r] / L;
            W[i] += 0.5 * strain[r][0] * sigma[r][0];
            e[6 * i + r] = strain[r][0];
        }
        strain_displacement(axes[0], p, phi, c, c1, A, own);
        node_forces(own, sigma, no_load, force);
        if (stress)
            for (int l = 0; l < LANES; l++)
                gather(sigma, stress + 6 * i, l, 6);
        element_hessian(axes[0], L, K, p, phi, c, c1, c2, A, own, sigma, square);
        for (int k = 0; k < 12; k++)
            G[12 * i + k] = force[k][0];
        for (int k = 0; k < 144; k++)
            H[144 * i + k] = square[k / 12][k % 12][0];
        for (int k = 0; k < 72; k++)
            B[72 * i + k] = own[k / 12][k % 12][0];
    }
}
