#pragma once
#include "sg_work.h"

/* The radius of friction: mu R_N of the contact that presses it, its own or another one (rolling
   and drilling resistance, a brake shoe), or a bound that the model gives as a function of time,
   place and velocity. */

/* 1 where friction follows the normal percussion whatever sign that has: in a segment whose
   contacts keep their modes, so that it is smooth up to the event that ends it and beyond. */
static inline int sg_is_followed(const SG(work) * w) {
#if SG_LOCATED
    return w->segment.held;
#else
    (void)w;
    return 0;
#endif
}

/* Radius of contact k in a slot with first row `base`, for percussions R of the problem. */
static inline real sg_radius(const SG(work) * w, int base, int k, const real *R) {
    const sg_contact *contact = &sg_contacts[k];
    return contact->pressing >= 0
               ? w->mu[k] * R[base + SG_NORMAL + contact->pressing]
               : w->radius[base / SG_ROWS_OF_SLOT * SG_N_BOUNDS + contact->bound];
}

/* Change of the given bound in row `row` along z; zero for rows of contacts. */
static inline real sg_bound_change(const SG(work) * w, const sg_problem *pr, int row,
                                   const real *z) {
    const int c = row % SG_ROWS_OF_SLOT - SG_SLIP;
    if (SG_N_BOUNDS > 0 && c >= 0 && w->rows.kind[row] == SG_ROW_SLIP) {
        const int bound = sg_contacts[sg_slips[c].contact].bound;
        if (bound >= 0) {
            return sg_row_dot(&pr->C_radius, w->C_radius,
                              row / SG_ROWS_OF_SLOT * SG_N_BOUNDS + bound, z);
        }
    }
    return SG_C(0.0);
}
