#pragma once
#include "sg_cover.c"
#include "sg_segment.h"

/* Modes of the contacts in a segment: each open, closed, sticking or slipping all along. */

/* Problems of a located step, behind those of a captured one. */
enum { SG_SEGMENT = SG_N_CHAIN, SG_ACCELERATIONS, SG_IMPACT };

/* 1 for the modes in which friction is at the boundary of its set. */
static inline int sg_slips_in(int mode) { return mode == SG_K(SLIP) || mode == SG_K(SLIP_BACK); }

/* 1 if the step has used what it may to be cut at its events. */
static int sg_spent(const SG(work) * w, const SG(options) * opt, const SG(report) * info) {
    return w->segment.solves >= SG_SOLVES || info->iterations / SG_EFFORT >= opt->max_iterations;
}

/* Contact k presses, or is a friction element that exists. */
static inline int sg_holds(const SG(work) * w, int k) { return w->segment.mode[k] > SG_K(OPEN); }

/* 1 if friction of contact k acts in the segment. */
static inline int sg_rubs(const SG(work) * w, int k) {
    return sg_holds(w, k) && sg_contact_at(w, k)->components > 0 &&
           (sg_contact_at(w, k)->presser < 0 || w->segment.mu[k] > SG_C(0.0));
}

/* Row kinds of a problem in which every contact keeps its mode. Friction is known at the first
   stage of a segment, and while it slips where accelerations are found. */
static void sg_say_modes(SG(work) * w, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    int slot, d, k;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * sg_n_R(w);
        const int known = problem < SG_SEGMENT || (problem == SG_SEGMENT && slot == 0);
        sg_bilateral_kinds(w, pr, slot);
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const int f = sg_slip_of(w, base, k);
            const int slips = sg_slips_in(w->segment.mode[k]);
            const int off = known || !sg_rubs(w, k) || (slips && problem != SG_SEGMENT);
            if (sg_contact_at(w, k)->normal >= 0) {
                w->rows.kind[sg_normal_of(w, base, k)] = sg_holds(w, k) ? SG_ROW_FREE : SG_ROW_ZERO;
            }
            for (d = 0; d < sg_contact_at(w, k)->components; ++d) {
                w->rows.kind[f + d] = off ? SG_ROW_ZERO : slips ? SG_ROW_SLIP : SG_ROW_FREE;
                w->rows.slip[f + d] = w->segment.direction[sg_contact_at(w, k)->friction + d];
            }
        }
    }
}

/* Friction of contacts that slip: against their direction, by what presses them or by the given
   bound in a time `part` of the step. What is given of the others is zero. */
static void sg_say_shares(SG(work) * w, real part) {
    int d, k;
    sg_fill(sg_n_gamma(w) + sg_n_F(w), SG_C(0.0), w->given);
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const sg_contact *contact = sg_contact_at(w, k);
        const int slips = sg_rubs(w, k) && sg_slips_in(w->segment.mode[k]);
        for (d = 0; d < contact->components; ++d) {
            const int f = contact->friction + d;
            w->share[f] = slips && contact->presser >= 0
                              ? -(w->segment.mu[k] * w->segment.direction[f])
                              : SG_C(0.0);
            if (slips && contact->presser < 0) {
                w->given[sg_n_gamma(w) + f] =
                    -(part * w->segment.bound[contact->bound] * w->segment.direction[f]);
            }
        }
    }
}

/* What the model says of gaps, velocities and guards at any place. */
static void sg_look(SG(work) * w, const SG(params) * par, real t, const real q[], const real v[]) {
    w->look_t = t;
    sg_copy(sg_n_q(w), q, w->look_q);
    sg_copy(sg_n_q(w), v, w->look_v);
    SG(watch)(w, par);
}

/* Slip velocity of contact k along the direction of its friction; positive while it slips. */
static real sg_slip_along(const SG(work) * w, int k) {
    const int f = sg_contact_at(w, k)->friction;
    real along = SG_C(0.0);
    int d;
    for (d = 0; d < sg_contact_at(w, k)->components; ++d) {
        along += w->slip_rate[f + d] * w->segment.direction[f + d];
    }
    return along;
}

/* Size of the slip velocity of contact k in units of its tolerance. */
static real sg_slip_size(const SG(work) * w, int k) {
    const int f = sg_contact_at(w, k)->friction;
    real size = SG_C(0.0);
    int d;
    for (d = 0; d < sg_contact_at(w, k)->components; ++d) {
        const real share = SG_FABS(w->slip_rate[f + d]);
        const real tolerance = sg_max(w->segment.slip_tolerance[f + d], SG_TINY);
        size = sg_max(size, share > SG_C(0.0) ? share / tolerance : SG_C(0.0));
    }
    return size;
}

/* Slip of contact k in the direction of its present velocity. */
static void sg_say_slip(SG(work) * w, int k) {
    const int f = sg_contact_at(w, k)->friction;
    (void)sg_friction_slip(w, k, &w->slip_rate[f], &w->segment.direction[f]);
    w->segment.mode[k] = sg_contact_at(w, k)->components == 1 && w->slip_rate[f] < SG_C(0.0)
                             ? SG_K(SLIP_BACK)
                             : SG_K(SLIP);
}
