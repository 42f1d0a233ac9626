#pragma once
#include "sg_part.h"
#include "sg_prox.c"

/* Signorini's law of a normal row, 0 <= y, 0 <= R, y R = 0 (61), as -R = prox(r y - R) (64): y is
   the gap where the slot holds gaps, xi_N where it holds velocities. */

/* Residual of row i where its kinematics y are to vanish. At rest round-off of a closed row is left
   as it is: a correction would have to be undone in the next step, for ever. */
static inline real sg_kinematic_residual(const SG(work) * w, int i) {
    return w->newton.mode == SG_AT_REST &&
                   w->scales.r_auto[i] * SG_FABS(w->y[i]) <= w->scales.phi_floor[i]
               ? SG_C(0.0)
               : w->scales.prox_r[i] * w->y[i];
}

/* 1 if the law says that normal row n presses. */
static inline int sg_signorini_closes(const SG(work) * w, int n, real R) {
    return sg_is_closed(w->scales.prox_r[n] * w->y[n] - R, SG_BAND * w->scales.phi_floor[n]);
}

/* State and residual of normal row n. */
static inline void sg_signorini_row(SG(work) * w, int n, real R, int closed) {
    w->rows.kind[n] = closed ? SG_ROW_FREE : SG_ROW_ZERO;
    w->rows.phi[n] = closed ? sg_kinematic_residual(w, n) : R;
}

/* Changes of a contact's state along a path. */
enum { SG_OPENS, SG_CLOSES, SG_STICKS, SG_SLIPS };

/* Smallest t > 0 at which value + rate t falls to zero; SG_HUGE if it does not. */
static inline real sg_path_zero(real value, real rate) {
    return rate < SG_C(0.0) ? sg_max(value, SG_C(0.0)) / -rate : SG_HUGE;
}

/* When normal row n closes or opens if tau moves on in the direction `way`, and which of the two.
   `was`: what its contact did at the last change, whose quantity is zero and grows. */
static inline real sg_signorini_event(const SG(work) * w, int n, real way, int was, int *what) {
    if (w->rows.kind[n] == SG_ROW_ZERO) {
        *what = SG_CLOSES;
        return was == SG_OPENS ? SG_HUGE : sg_path_zero(w->path.y[n], way * w->path.y_rate[n]);
    }
    *what = SG_OPENS;
    return was == SG_CLOSES ? SG_HUGE : sg_path_zero(w->path.R[n], way * w->path.R_rate[n]);
}
