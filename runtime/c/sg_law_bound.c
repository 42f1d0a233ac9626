#pragma once
#include "sg_prox.c"
#include "sg_part.h"

/* The radius of friction: mu R_N of the contact that presses it, its own or another one (rolling
   and drilling resistance, a brake shoe), mu |R_g| of the bilateral rows that press it (a slot, a
   screw, a joint), or a bound that the model gives as a function of time, place and velocity. */

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

/* What normal row n gives back in the expansion of an impact: it presses friction, too. */
static inline real sg_back(const SG(work) * w, int n) {
#if SG_N_EXPANDED > 0
    return w->expansion.back[n];
#else
    (void)w;
    (void)n;
    return SG_C(0.0);
#endif
}

/* Size of the bilateral percussions that press friction of contact k in a slot. */
static inline real sg_load(const SG(work) * w, int base, int k, const real *R) {
    const sg_contact *contact = sg_contact_at(w, k);
    return contact->loads > 0 ? sg_norm(contact->loads, &R[base + contact->load]) : SG_C(0.0);
}

/* How the radius of contact k grows with percussion c of its slot, apart from its coefficient: a
   unit vector of the bilateral percussions that press it. */
static inline real sg_load_share(const SG(work) * w, int base, int k, int c, const real *R) {
    const sg_contact *contact = sg_contact_at(w, k);
    const real size = sg_load(w, base, k, R);
    return c >= contact->load && c < contact->load + contact->loads && size > SG_C(0.0)
               ? R[base + c] / size
               : SG_C(0.0);
}

/* Coefficient of friction of contact k in a slot with first row `base`. */
static inline real sg_coefficient(const SG(work) * w, int base, int k) {
#if SG_N_VARYING > 0
    if (sg_contact_at(w, k)->varies >= 0) {
        return w->radius[base / sg_rows_of_slot(w) * sg_n_bounds(w) + sg_contact_at(w, k)->varies];
    }
#endif
    (void)base;
    return w->mu[k];
}

/* What the radius has besides: percussions of earlier stages with their coefficients. */
static inline real sg_rest_of_radius(const SG(work) * w, int base, int k) {
#if SG_N_VARYING > 0
    if (sg_contact_at(w, k)->varies >= 0) {
        return w
            ->radius[base / sg_rows_of_slot(w) * sg_n_bounds(w) + sg_contact_at(w, k)->varies + 1];
    }
#endif
    (void)w;
    (void)base;
    (void)k;
    return SG_C(0.0);
}

/* Radius of contact k in a slot with first row `base`, for percussions R of the problem. */
static inline real sg_radius(const SG(work) * w, int base, int k, const real *R) {
    const sg_contact *contact = sg_contact_at(w, k);
    if (contact->loads > 0) {
        return w->mu[k] * sg_load(w, base, k, R);
    }
    if (contact->pressing >= 0) {
        const real pressed = R[base + sg_first_normal(w) + contact->pressing];
        return sg_coefficient(w, base, k) * (pressed + sg_back(w, contact->pressing)) +
               sg_rest_of_radius(w, base, k);
    }
    return w->radius[base / sg_rows_of_slot(w) * sg_n_bounds(w) + contact->bound];
}

/* Change of the radius in row `row` along z: of a given bound, or by the coefficient of a stage;
   zero for other rows. */
static inline real sg_bound_change(const SG(work) * w, const sg_problem *pr, int row,
                                   const real *z) {
    const int c = row % sg_rows_of_slot(w) - sg_first_slip(w);
    if (sg_n_bounds(w) > 0 && c >= 0 && w->rows.kind[row] == SG_ROW_SLIP) {
        const int bound = sg_contact_at(w, sg_slip_at(w, c)->contact)->bound;
#if SG_N_VARYING > 0
        const int varies = sg_contact_at(w, sg_slip_at(w, c)->contact)->varies;
        if (varies >= 0) {
            const int base = row - row % sg_rows_of_slot(w);
            const int pressing = sg_contact_at(w, sg_slip_at(w, c)->contact)->pressing;
            return w->R[pr->R + base + sg_first_normal(w) + pressing] *
                   sg_row_dot(&pr->C_radius, w->C_radius,
                              row / sg_rows_of_slot(w) * sg_n_bounds(w) + varies, z);
        }
#endif
        if (bound >= 0) {
            return sg_row_dot(&pr->C_radius, w->C_radius,
                              row / sg_rows_of_slot(w) * sg_n_bounds(w) + bound, z);
        }
    }
    return SG_C(0.0);
}
