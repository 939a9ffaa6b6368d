/* Many rotations at once. */
#include <stdint.h>

#include "rotations.h"

void rotation_vectors(int64_t n, const double *R, double *phi)
{
    for (int64_t i = 0; i < n; i++)
        rotation_vector(R + 9 * i, phi + 3 * i);
}

void rotation_matrices(int64_t n, const double *w, double *R)
{
    for (int64_t i = 0; i < n; i++)
        rotation_matrix(w + 3 * i, R + 9 * i);
}

/* out_i = R_i exp(hat(w_i)), followed by one Newton-Schulz step that keeps the columns orthonormal:
   thousands of products would otherwise drift off SO(3) by round-off. */
void compose_increments(int64_t n, const double *R, const double *w, double *out)
{
    for (int64_t i = 0; i < n; i++, R += 9, out += 9, w += 3) {
        double E[9], P[9], gram[9];
        rotation_matrix(w, E);
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                P[3 * r + c] = R[3 * r] * E[c] + R[3 * r + 1] * E[3 + c] + R[3 * r + 2] * E[6 + c];
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 3; c++)
                gram[3 * k + c] = P[k] * P[c] + P[3 + k] * P[3 + c] + P[6 + k] * P[6 + c];
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                out[3 * r + c] = 1.5 * P[3 * r + c]
                                 - 0.5
                                       * (P[3 * r] * gram[c] + P[3 * r + 1] * gram[3 + c]
                                          + P[3 * r + 2] * gram[6 + c]);
    }
}
