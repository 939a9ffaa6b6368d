/* Coordinate descent on a quadratic function whose variables take values of a list. */
#include <stdint.h>

/* n_ways candidates that follow each other are those of one part, of which `left` more pieces may be
   taken; an element that gets another part gives its own back.

   Give each of `elements` groups of `width` variables the candidate that lowers slope.d + d.H d / 2
   most, one after the other, until none gains more than `least` any further; q (n), slope (n) and
   choice (elements) are brought up to date. indices (elements, width), candidates (n_candidates,
   width), hessian (n, n). Returns how many changes there were. */
int64_t descend(int64_t elements, int64_t width, int64_t n_candidates, int64_t n, double *q,
                double *slope, const double *hessian, const int64_t *indices,
                const double *candidates, int64_t *choice, double least,
                int64_t n_ways, int64_t *left)
{
    int64_t total = 0, changed = 1;
    while (changed) {
        changed = 0;
        for (int64_t e = 0; e < elements; e++) {
            const int64_t *at = indices + e * width;
            int64_t which = choice[e];
            double best = -least;
            int64_t own = which / n_ways;
            for (int64_t c = 0; c < n_candidates; c++) {
                if (c / n_ways != own && left[c / n_ways] <= 0)
                    continue;
                const double *to = candidates + c * width;
                double gain = 0.0;
                for (int64_t i = 0; i < width; i++) {
                    double d = to[i] - q[at[i]];
                    gain += slope[at[i]] * d;
                    for (int64_t j = 0; j < width; j++)
                        gain += 0.5 * d * hessian[at[i] * n + at[j]] * (to[j] - q[at[j]]);
                }
                if (gain < best)
                    best = gain, which = c;
            }
            if (which == choice[e])
                continue;
            for (int64_t i = 0; i < width; i++) {
                double d = candidates[which * width + i] - q[at[i]];
                for (int64_t j = 0; j < n; j++)
                    slope[j] += hessian[at[i] * n + j] * d;
                q[at[i]] = candidates[which * width + i];
            }
            left[own]++;
            left[which / n_ways]--;
            choice[e] = which;
            changed++;
        }
        total += changed;
    }
    return total;
}
