#pragma once
#include "sg_numbers.h"

/* Proximal points (64), (65) and what their derivatives need. */

/* prox onto the nonpositive numbers; a value inside the band counts as nonpositive. */
static inline int sg_is_closed(real z, real band) { return z <= band; }

/* Euclidean norm of a few components; no intermediate overflow. */
static inline real sg_norm(int n, const real *z) {
    real top = SG_C(0.0);
    real sum = SG_C(0.0);
    int i;
    for (i = 0; i < n; ++i) {
        top = sg_max(top, SG_FABS(z[i]));
    }
    if (n == 1 || !(top > SG_C(0.0))) {
        return top;
    }
    for (i = 0; i < n; ++i) {
        sum += (z[i] / top) * (z[i] / top);
    }
    return top * SG_SQRT(sum);
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
