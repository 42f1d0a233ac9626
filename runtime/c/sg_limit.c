#pragma once
#include "sg_response.c"

/* What the checker accepts: a share of a row's scale, or an absolute value; never more than the
   share SG_CHECK_MOST. */
typedef struct {
    real share, absolute;
} sg_limit;

static sg_limit sg_limits(const SG(options) * opt) {
    const real wish = SG_C(16.0) * opt->tol;
    const int absolute = opt->scaling == SG_K(SCALING_NONE);
    sg_limit limit;
    limit.share = absolute ? SG_CHECK : sg_min(sg_max(SG_CHECK, wish), SG_CHECK_MOST);
    limit.absolute = absolute ? wish : SG_C(0.0);
    return limit;
}

/* |x| within the limit for `scale`, plus an absolute floor. NaN is not. */
static inline int sg_small(real x, real scale, real floor, const sg_limit *limit) {
    const real bound = limit->share * scale + SG_CHECK_FLOORS * floor;
    return SG_FABS(x) <=
           sg_max(sg_max(bound, SG_TINY), sg_min(limit->absolute, SG_CHECK_MOST * scale));
}

/* Kinematic rows and percussions of one slot at the solution. */
typedef struct {
    int slot;
    const real *y, *R;
} sg_solved;
