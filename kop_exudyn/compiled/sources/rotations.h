/* Rotation vectors and matrices (row by row), one at a time; formulas and conventions as in
 * rods/rotations.py. */
#ifndef ROTATIONS_H
#define ROTATIONS_H

#include <math.h>

/* The rotation vector of R (angle at most pi), through the quaternion with the largest component.
 */
static inline void rotation_vector(const double R[9], double phi[3])
{
    double trace = R[0] + R[4] + R[8], w, x, y, z, S;
    if (trace > 0) {
        S = sqrt(trace + 1) * 2;
        w = 0.25 * S, x = (R[7] - R[5]) / S, y = (R[2] - R[6]) / S, z = (R[3] - R[1]) / S;
    } else if (R[0] > R[4] && R[0] > R[8]) {
        S = sqrt(1 + R[0] - R[4] - R[8]) * 2;
        w = (R[7] - R[5]) / S, x = 0.25 * S, y = (R[1] + R[3]) / S, z = (R[2] + R[6]) / S;
    } else if (R[4] > R[8]) {
        S = sqrt(1 + R[4] - R[0] - R[8]) * 2;
        w = (R[2] - R[6]) / S, x = (R[1] + R[3]) / S, y = 0.25 * S, z = (R[5] + R[7]) / S;
    } else {
        S = sqrt(1 + R[8] - R[0] - R[4]) * 2;
        w = (R[3] - R[1]) / S, x = (R[2] + R[6]) / S, y = (R[5] + R[7]) / S, z = 0.25 * S;
    }
    if (w < 0)
        w = -w, x = -x, y = -y, z = -z;
    double n = sqrt(x * x + y * y + z * z), factor = n < 1e-12 ? 2.0 : 2 * atan2(n, w) / n;
    phi[0] = factor * x, phi[1] = factor * y, phi[2] = factor * z;
}

/* exp(hat(w)) by Rodrigues; half-angle form, so that no digits cancel at small angles. */
static inline void rotation_matrix(const double w[3], double R[9])
{
    double s = w[0] * w[0] + w[1] * w[1] + w[2] * w[2], t = sqrt(s), a, b;
    if (t < 1e-6) {
        a = 1 - s / 6, b = 0.5 - s / 24;
    } else {
        double half = sin(0.5 * t) / t;
        a = sin(t) / t, b = 2 * half * half;
    }
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            R[3 * i + j] = b * w[i] * w[j];
        R[4 * i] += 1 - b * s;
    }
    R[1] -= a * w[2], R[2] += a * w[1], R[3] += a * w[2];
    R[5] -= a * w[0], R[6] -= a * w[1], R[7] += a * w[0];
}

#endif
