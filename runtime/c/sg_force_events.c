#pragma once
#include "sg_events.c"

/* Events of forces: a contact lets go, friction reaches the boundary of its set. */

/* What is known at the segment's start, kept while forces are found elsewhere. */
static void sg_keep_start(SG(work) * w) {
    sg_copy(sg_n_q(w), w->segment.acceleration, w->segment.start_acceleration);
    sg_copy(sg_n_R(w), w->segment.force, w->segment.start_force);
    sg_copy(sg_n_bounds(w), w->segment.bound, w->segment.start_bound);
    sg_copy(sg_n_F(w), w->segment.direction, w->segment.start_direction);
}

/* Forces in the present modes. Where rows depend on each other those of least norm may pull or
   leave their sets although others do not: then the contact problem is asked, and counts if it says
   that all stay in their modes. */
static int sg_find_any_forces(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                              SG(report) * info) {
    int mode[SG_MOST_CONTACTS];
    int status = sg_find_forces(w, par, opt, info);
    int same = 1;
    int k;
    if (status != SG_K(OK) || w->system.deficiency <= 0 || sg_forces_fit(w, -1)) {
        return status;
    }
    for (k = 0; k < sg_n_contacts(w); ++k) {
        mode[k] = w->segment.mode[k];
    }
    sg_measure_motion(w, w->segment.h);
    status = sg_seek_modes(w, par, opt, info);
    for (k = 0; k < sg_n_contacts(w); ++k) {
        same = same && mode[k] == w->segment.mode[k];
        w->segment.mode[k] = mode[k];
    }
    if (status == SG_K(OK) && same) {
        return status;
    }
    sg_measure_motion(w, w->segment.h);
    return sg_find_forces(w, par, opt, info);
}

/* Prepare the step at a place other than the segment's start, with the slips that are there. */
static int sg_visit(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                    SG(report) * info, real t, const real q[], const real v[]) {
    int status, k;
    w->segment.prepared = 0;
    w->segment.known = 0;
    sg_copy(sg_n_q(w), q, w->trial.q);
    sg_copy(sg_n_q(w), v, w->trial.v);
    status = sg_prepare(w, par, t, w->segment.h);
    sg_look(w, par, t, w->trial.q, w->trial.v);
    for (k = 0; k < sg_n_contacts(w); ++k) {
        w->found.exists[k] = w->segment.exists[k];
        w->segment.mu[k] = w->mu[k];
        if (sg_contact_at(w, k)->components > 1 && sg_rubs(w, k) &&
            sg_slips_in(w->segment.mode[k]) && sg_slip_size(w, k) > SG_C(1.0)) {
            const int f = sg_contact_at(w, k)->friction;
            (void)sg_friction_slip(w, k, &w->slip_rate[f], &w->segment.direction[f]);
        }
    }
    return status == SG_K(OK) ? sg_find_any_forces(w, par, opt, info) : status;
}

/* Back to the segment's start. */
static int sg_return(SG(work) * w, const SG(params) * par) {
    int status = SG_K(OK);
    if (!w->segment.prepared) {
        int k;
        sg_copy(sg_n_q(w), w->segment.q, w->trial.q);
        sg_copy(sg_n_q(w), w->segment.v, w->trial.v);
        status = sg_prepare(w, par, w->segment.t, w->segment.h);
        sg_look(w, par, w->segment.t, w->trial.q, w->trial.v);
        for (k = 0; k < sg_n_contacts(w); ++k) {
            w->found.exists[k] = w->segment.exists[k];
            w->segment.mu[k] = w->mu[k];
        }
        sg_copy(sg_n_q(w), w->segment.start_acceleration, w->segment.acceleration);
        sg_copy(sg_n_R(w), w->segment.start_force, w->segment.force);
        sg_copy(sg_n_bounds(w), w->segment.start_bound, w->segment.bound);
        sg_copy(sg_n_F(w), w->segment.start_direction, w->segment.direction);
        w->segment.prepared = 1;
    }
    return status;
}

/* 1 if percussions of contact k vary so little that it presses all along. Those of the stages are
   forces of earlier places: what they vary by is up to half of what the force does. */
static int sg_presses_clearly(const SG(work) * w, int k) {
    const int first = w->segment.rubs ? SG_SEGMENT : 0;
    const int last = w->segment.rubs ? SG_SEGMENT : SG_N_CHAIN - 1;
    const int n = sg_first_normal(w) + sg_contact_at(w, k)->normal;
    real least = SG_HUGE;
    real most = SG_C(0.0);
    int problem, slot;
    for (problem = first; problem <= last; ++problem) {
        const sg_problem *pr = sg_problem_at(w, problem);
        for (slot = 0; slot < pr->n_slots; ++slot) {
            const real push = w->R[pr->R + slot * sg_n_R(w) + n];
            least = sg_min(least, push);
            most = sg_max(most, push);
        }
    }
    return least - SG_CLEAR_GROWTH * (most - least) > SG_CLEAR_PUSH * most;
}

/* 1 if contact k sticks all along: what its friction uses of the radius at the start and at the
   stages does not reach it, even where it grows on as it did. */
static int sg_sticks_clearly(const SG(work) * w, int k) {
    const sg_problem *pr = sg_problem_at(w, SG_SEGMENT);
    const sg_contact *contact = sg_contact_at(w, k);
    const int f = sg_first_slip(w) + contact->friction;
    const real radius =
        contact->pressing >= 0
            ? w->segment.mu[k] * w->segment.force[sg_first_normal(w) + contact->pressing]
            : w->segment.bound[contact->bound];
    real most = sg_friction_size(w, k, &w->segment.force[f]) / radius;
    real least = most;
    int slot;
    for (slot = 1; slot < pr->n_slots; ++slot) {
        const real use = sg_friction_size(w, k, &w->R[pr->R + slot * sg_n_R(w) + f]) /
                         sg_radius(w, slot * sg_n_R(w), k, &w->R[pr->R]);
        least = sg_min(least, use);
        most = sg_max(most, use);
    }
    return most + SG_CLEAR_GROWTH * (most - least) < SG_CLEAR_FRICTION;
}

/* 1 if the percussions of the segment leave no doubt about the modes of all contacts. */
static int sg_press_clearly(const SG(work) * w) {
    int k;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const int holds = sg_holds(w, k);
        const int sticks = holds && sg_rubs(w, k) && !sg_slips_in(w->segment.mode[k]);
        if ((holds && sg_contact_at(w, k)->normal >= 0 && !sg_presses_clearly(w, k)) ||
            (sticks && !sg_sticks_clearly(w, k))) {
            return 0;
        }
    }
    return 1;
}

/* The event function of forces that has fallen to zero first, between the values at a place before
   and those found now; its share between them comes into *event. Contacts whose function is not
   clearly negative have none. */
static void sg_force_falls(SG(work) * w, const SG(options) * opt, const real before[],
                           sg_happening *first) {
    int i, k;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        for (i = 0; i < 2; ++i) {
            const int what = i == 0 ? SG_FORCE_ENDS : SG_SLIP_BEGINS;
            if (sg_may_happen(w, what, k)) {
                const real now = sg_force_value(w, what, k);
                const real then = before[2 * k + i];
                const real at = then > now ? sg_max(then, SG_C(0.0)) / (then - now) : SG_C(0.0);
                if (now < -sg_event_noise(w, opt, what, k) && at < first->at) {
                    first->what = what;
                    first->contact = k;
                    first->at = at;
                }
            }
        }
    }
}

static void sg_keep_force_values(const SG(work) * w, real values[]) {
    int k;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        values[2 * k] =
            sg_may_happen(w, SG_FORCE_ENDS, k) ? sg_force_value(w, SG_FORCE_ENDS, k) : SG_C(0.0);
        values[2 * k + 1] =
            sg_may_happen(w, SG_SLIP_BEGINS, k) ? sg_force_value(w, SG_SLIP_BEGINS, k) : SG_C(0.0);
    }
}

/* Earliest event of forces up to the share `end`, looked for at both ends and `SG_FORCE_SAMPLES` -
   1 places between. */
static int sg_detect_forces(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                            SG(report) * info, real end, sg_happening *first) {
    real before[2 * SG_MOST_CONTACTS];
    int status = SG_K(OK);
    int j;
    *first = sg_no_event();
    for (j = 0; j <= SG_FORCE_SAMPLES && status == SG_K(OK); ++j) {
        const real x = end * (real)j / (real)SG_FORCE_SAMPLES;
        real q[SG_MOST_Q], v[SG_MOST_Q];
        sg_dense(w, x, q, v);
        status = sg_visit(w, par, opt, info, w->segment.t + x * w->segment.span, q, v);
        if (status == SG_K(OK) && j == 0) {
            sg_keep_force_values(w, before);
        }
        if (status == SG_K(OK)) {
            first->at = SG_C(2.0);
            sg_force_falls(w, opt, before, first);
            if (first->what != SG_NOTHING && j == 0) {
                return SG_K(REJECTED); /* inputs may have changed: other modes from the start on */
            }
            if (first->what != SG_NOTHING) {
                const int last = j - 1;
                const real a = end * (real)last / (real)SG_FORCE_SAMPLES;
                const real now = sg_force_value(w, first->what, first->contact);
                const int i = 2 * first->contact + (first->what == SG_SLIP_BEGINS);
                first->slope = (now - before[i]) / (x - a);
                first->at = a + first->at * (x - a);
                return status;
            }
        }
        sg_keep_force_values(w, before);
    }
    return status;
}
