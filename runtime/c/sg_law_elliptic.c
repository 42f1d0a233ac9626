#pragma once
#include "sg_part.h"

/* The ellipse of anisotropic friction, |(R_1 / mu_1, R_2 / mu_2)| <= R_N, opposite to the slip in
   the sense of the largest dissipation. With a_d = mu_d / mu, mu the larger coefficient, it is the
   disc of radius mu R_N for the percussions R_d / a_d, whose slip velocities are a_d gamma_d: the
   work is the same. All that Coulomb's law does, it does with these. Where a model has no such
   contact the semi-axes are left out. */

/* Percussion of slip component c (counted over all contacts) in units of its semi-axis. */
static inline real sg_over_axis(const SG(work) * w, int c, real R) {
#if SG_N_AXES > 0
    return R / w->elliptic.axis[c];
#else
    (void)w;
    (void)c;
    return R;
#endif
}

/* What belongs to the disc, for the ellipse: a percussion, or a slip velocity for the disc. */
static inline real sg_times_axis(const SG(work) * w, int c, real x) {
#if SG_N_AXES > 0
    return x * w->elliptic.axis[c];
#else
    (void)w;
    (void)c;
    return x;
#endif
}

/* Semi-axes of this step; returns 0 where one coefficient of a contact is zero and another not, or
   one is negative or not a number. */
static inline int sg_elliptic_begin(SG(work) * w) {
#if SG_N_AXES > 0
    int d, k;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const int f = sg_contact_at(w, k)->friction;
        const int rubs = sg_contact_at(w, k)->pressing >= 0 && w->mu[k] > SG_C(0.0);
        for (d = 0; d < sg_contact_at(w, k)->components; ++d) {
            const real share = rubs ? w->mu_F[f + d] / w->mu[k] : SG_C(1.0);
            if (!(share > SG_C(0.0) && share <= SG_C(1.0))) {
                return 0;
            }
            w->elliptic.axis[f + d] = share;
        }
    }
#else
    (void)w;
#endif
    return 1;
}
