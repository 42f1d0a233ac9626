#pragma once
#include "sg_law_elliptic_check.c"
#include "sg_limit.c"

/* What the checker asks of friction. */

/* Euclidean norm of a few components; no number if one of them is none. */
static inline real sg_check_norm(int n, const real *z) {
    real size = SG_FABS(z[0]);
    int i;
    for (i = 1; i < n; ++i) {
        const real top = sg_max(size, SG_FABS(z[i]));
        const real sum = size + SG_FABS(z[i]);
        size = top > SG_C(0.0) && sg_finite(sum)
                   ? top * SG_SQRT((size / top) * (size / top) + (z[i] / top) * (z[i] / top))
                   : sum;
    }
    return size;
}

/* Percussion in the disc, and against the slip: the dissipation radius |gamma| is attained. `floor`
   is the round-off of the slip velocity, `blur` that of the radius. */
static inline int sg_check_friction(int n, const real *gamma, real speed, const real *percussion,
                                    real radius, real scale, real floor, real blur,
                                    const sg_limit *limit) {
    const real size = sg_check_norm(n, percussion);
    const real slip = sg_check_norm(n, gamma);
    const real power = sg_dot(n, gamma, percussion);
    const real bound = sg_max(radius, SG_C(0.0));
    if (!sg_finite(size) || !sg_finite(slip)) {
        return 0;
    }
    if (size > bound && !sg_small(size - bound, sg_max(scale, bound), blur, limit)) {
        return 0;
    }
    return sg_small(bound * slip + power, sg_max(scale, bound) * sg_max(speed, slip),
                    sg_max(scale, bound) * floor + blur * slip, limit);
}

/* What normal row n presses with besides its percussion, in the expansion of an impact. */
static inline real sg_check_back(const SG(work) * w, int n) {
#if SG_N_EXPANDED > 0
    return w->expansion.back[n];
#else
    (void)w;
    (void)n;
    return SG_C(0.0);
#endif
}

/* Slip rows of contact k in a slot, which takes part if `joins`; `floor` is the round-off of the
   normal percussion that presses it. */
static int sg_check_slip_rows(const SG(work) * w, const sg_problem *pr, const sg_solved *at, int k,
                              int joins, real floor, const sg_limit *limit) {
    const sg_contact *contact = sg_contact_at(w, k);
    const int n = sg_first_normal(w) + contact->pressing;
    const int f = sg_first_slip(w) + contact->friction;
    const real *force = &at->R[f];
    const real *rate = &at->y[f];
    real scale = w->scales.percussion_scale[f];
    real radius;
    real blur = SG_C(0.0);
    real in_disc[SG_N_SLIP], at_rate[SG_N_SLIP];
    int d;
    if (!joins) {
        for (d = 0; d < contact->components; ++d) {
            if (force[d] != SG_C(0.0)) {
                return 0;
            }
        }
        return 1;
    }
    sg_check_in_disc(w, k, &force, &rate, in_disc, at_rate);
    if (contact->loads > 0) {
        int c;
        radius = w->mu[k] * sg_check_norm(contact->loads, &at->R[contact->load]);
        for (c = contact->load; c < contact->load + contact->loads; ++c) {
            scale = sg_max(scale, w->mu[k] * w->scales.percussion_scale[c]);
        }
    } else if (contact->pressing < 0) {
        const int row = (pr->R / sg_rows_of_slot(w) + at->slot) * sg_n_bounds(w) + contact->bound;
        radius = w->found.radius[row];
    } else {
        const real *own =
            &w->found.radius[(pr->R / sg_rows_of_slot(w) + at->slot) * sg_n_bounds(w)];
        const real mu = contact->varies < 0 ? w->mu[k] : own[contact->varies];
        radius = mu * (at->R[n] + sg_check_back(w, contact->pressing)) +
                 (contact->varies < 0 ? SG_C(0.0) : own[contact->varies + 1]);
        blur = w->mu[k] * floor;
        /* the radius is as uncertain as the normal percussion */
        scale = sg_max(scale, w->mu[k] * w->scales.percussion_scale[n]);
    }
    return sg_check_friction(contact->components, rate, w->scales.speed[f], force, radius, scale,
                             w->scales.gap_floor[f] * sg_slot_rate(w, pr, at->slot), blur, limit);
}
