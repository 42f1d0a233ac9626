#pragma once
#include "sg_part.h"

/* What the checker asks of anisotropic friction, from the coefficients themselves. */

/* Percussions R of contact k in the disc that the ellipse becomes, and the slip velocities gamma
   that belong to them; of other contacts as they are. */
static inline void sg_check_in_disc(const SG(work) * w, int k, const real **R, const real **gamma,
                                    real *force, real *rate) {
#if SG_N_AXES > 0
    const sg_contact *contact = sg_contact_at(w, k);
    int d;
    if (contact->pressing < 0 || !(w->mu[k] > SG_C(0.0))) {
        return;
    }
    for (d = 0; d < contact->components; ++d) {
        const real mu = w->mu_F[contact->friction + d];
        force[d] = (*R)[d] * w->mu[k] / mu;
        rate[d] = (*gamma)[d] * mu / w->mu[k];
    }
    *R = force;
    *gamma = rate;
#else
    (void)w;
    (void)k;
    (void)R;
    (void)gamma;
    (void)force;
    (void)rate;
#endif
}
