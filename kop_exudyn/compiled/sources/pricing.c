/* Parts that elements pay for: what they earn, and bounds of it over boxes of parts.

   An element j of k_e parameters stands for weights[j] like ones and pays prices[j]. A part p
   realises it in variant v at V_v p, or anywhere from there to (V_v + W_v) p. V, W (n_v, k_e, k_p). */
#include <math.h>
#include <stdint.h>

enum { MOST = 16 }; /* variants times parameters of an element */

static double squared(int64_t k_e, const double *value, const double *at, const double *width)
{
    double total = 0.0;
    for (int64_t e = 0; e < k_e; e++) {
        double residual = value[e] - at[e];
        if (residual > 0.0)
            residual = fmax(0.0, residual - width[e]);
        total += residual * residual;
    }
    return total;
}

/* Adds to earned (m) what each of the parts (m, k_p) earns, and unless normal is null to normal (m,
   k_p, k_p) and right (m, k_p) the normal equations of the elements that it serves at a profit. */
void served_by_parts(int64_t m, int64_t n, int64_t n_v, int64_t k_e, int64_t k_p, int64_t exact,
                     const double *parts, const double *values, const double *V, const double *W,
                     const double *weights, const double *prices, double *earned, double *normal,
                     double *right)
{
    double at[MOST], width[MOST];
    for (int64_t i = 0; i < m; i++) {
        const double *p = parts + i * k_p;
        for (int64_t row = 0; row < n_v * k_e; row++) {
            at[row] = width[row] = 0.0;
            for (int64_t k = 0; k < k_p; k++) {
                at[row] += V[row * k_p + k] * p[k];
                width[row] += W[row * k_p + k] * p[k];
            }
        }
        for (int64_t j = 0; j < n; j++) {
            const double *value = values + j * k_e;
            double least = prices[j];
            int64_t which = -1;
            for (int64_t v = 0; v < n_v; v++) {
                double total = squared(k_e, value, at + v * k_e, width + v * k_e);
                if (total < least)
                    least = total, which = v;
            }
            if (which < 0)
                continue;
            earned[i] += weights[j] * (prices[j] - least);
            if (!normal)
                continue;
            for (int64_t e = 0; e < k_e; e++) {
                int64_t row = which * k_e + e;
                double residual = value[e] - at[row];
                int beyond = residual > width[row];
                if (!exact && residual >= 0.0 && !beyond)
                    continue;
                for (int64_t k = 0; k < k_p; k++) {
                    double a = V[row * k_p + k] + (beyond ? W[row * k_p + k] : 0.0);
                    if (a == 0.0)
                        continue;
                    right[i * k_p + k] += weights[j] * a * value[e];
                    for (int64_t o = 0; o < k_p; o++) {
                        double b = V[row * k_p + o] + (beyond ? W[row * k_p + o] : 0.0);
                        normal[(i * k_p + k) * k_p + o] += weights[j] * a * b;
                    }
                }
            }
        }
    }
}

/* Adds what the elements earn at most in the boxes from low to high (m, k_p): those taken one by one
   to alone (m), those taken together as alone + 2 slope.p - curvature.p^2, slope and curvature (m,
   k_p). */
void most_in_boxes(int64_t m, int64_t n, int64_t n_v, int64_t k_e, int64_t k_p, int64_t exact,
                   const double *low, const double *high, const double *values, const double *V,
                   const double *W, const double *weights, const double *prices, double *alone,
                   double *curvature, double *slope)
{
    double first[MOST], last[MOST], longest[MOST];
    for (int64_t i = 0; i < m; i++) {
        for (int64_t row = 0; row < n_v * k_e; row++) {
            first[row] = last[row] = longest[row] = 0.0;
            for (int64_t k = 0; k < k_p; k++) {
                double a = V[row * k_p + k];
                first[row] += a * (a > 0.0 ? low : high)[i * k_p + k];
                last[row] += a * (a > 0.0 ? high : low)[i * k_p + k];
                longest[row] += W[row * k_p + k] * high[i * k_p + k];
            }
        }
        for (int64_t j = 0; j < n; j++) {
            const double *value = values + j * k_e;
            double nearest = INFINITY, farthest = 0.0, second = INFINITY;
            int64_t which = 0;
            for (int64_t v = 0; v < n_v; v++) {
                double near = 0.0, far = 0.0;
                for (int64_t e = 0; e < k_e; e++) {
                    int64_t row = v * k_e + e;
                    double below = first[row] - value[e], above = value[e] - last[row];
                    double d = fmax(fmax(0.0, below), above - longest[row]);
                    near += d * d;
                    d = fmax(fabs(below), fabs(above));
                    far += d * d;
                }
                if (near < nearest)
                    second = nearest, nearest = near, farthest = far, which = v;
                else if (near < second)
                    second = near;
            }
            if (nearest >= prices[j])
                continue;
            if (!exact || farthest > second || farthest > prices[j]) {
                alone[i] += weights[j] * (prices[j] - nearest);
                continue;
            }
            alone[i] += weights[j] * prices[j];
            for (int64_t e = 0; e < k_e; e++) {
                alone[i] -= weights[j] * value[e] * value[e];
                for (int64_t k = 0; k < k_p; k++) {
                    double a = V[(which * k_e + e) * k_p + k];
                    curvature[i * k_p + k] += weights[j] * a * a;
                    slope[i * k_p + k] += weights[j] * a * value[e];
                }
            }
        }
    }
}
