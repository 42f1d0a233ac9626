#pragma once
#include "sg_contract.h"

/* What the checker asks of anisotropic friction, from the coefficients themselves. */

/* Component d of a percussion of contact k in the disc that the ellipse becomes. */
static inline real sg_check_percussion(const SG(work) * w, int k, int d, real R) {
#if SG_N_AXES > 0
    const int c = sg_contacts[k].friction + d;
    return sg_contacts[k].normal >= 0 && w->mu[k] > SG_C(0.0) ? R * w->mu[k] / w->mu_F[c] : R;
#else
    (void)w;
    (void)k;
    (void)d;
    return R;
#endif
}

/* Component d of the slip velocity that belongs to it. */
static inline real sg_check_slip(const SG(work) * w, int k, int d, real gamma) {
#if SG_N_AXES > 0
    const int c = sg_contacts[k].friction + d;
    return sg_contacts[k].normal >= 0 && w->mu[k] > SG_C(0.0) ? gamma * w->mu_F[c] / w->mu[k]
                                                              : gamma;
#else
    (void)w;
    (void)k;
    (void)d;
    return gamma;
#endif
}
