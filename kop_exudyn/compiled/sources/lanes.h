/* Four elements at once: arithmetic on lanes, which compilers turn into the machine's vector
 * instructions. */
#ifndef LANES_H
#define LANES_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#define LANES 4
typedef double lanes __attribute__((vector_size(8 * LANES)));
typedef double lanes_u __attribute__((vector_size(8 * LANES), aligned(8))); /* at any address */

#define INLINE static inline __attribute__((always_inline))

INLINE lanes dot3(const lanes *a, const lanes *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

#endif
