#pragma once
#include "sg_numbers.h"

/* Proximal points (64), (65) and what their derivatives need. */

/* prox onto the nonpositive numbers; a value inside the band counts as nonpositive. */
static inline int sg_is_closed(real z, real band) { return z <= band; }

/* Euclidean norm of one or two components; no intermediate overflow. */
static inline real sg_norm(int n, const real *z) {
    if (n == 1) {
        return SG_FABS(z[0]);
    } else {
        const real a = SG_FABS(z[0]);
        const real b = SG_FABS(z[1]);
        const real top = sg_max(a, b);
        if (!(top > SG_C(0.0))) {
            return top;
        }
        return top * SG_SQRT((a / top) * (a / top) + (b / top) * (b / top));
    }
}

/* prox onto the ball of a radius >= 0: returns 1 inside (identity), else 0 with the unit vector
   `direction` of z and `ratio` = radius / |z|, so that prox(z) = radius * direction. */
static inline int sg_prox_ball(int n, const real *z, real radius, real band, real *direction,
                               real *ratio) {
    const real size = sg_norm(n, z);
    int i;
    if (size <= radius + band) {
        *ratio = SG_C(1.0);
        return 1;
    }
    for (i = 0; i < n; ++i) {
        direction[i] = z[i] / size;
    }
    *ratio = radius / size;
    return 0;
}
