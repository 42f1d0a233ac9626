#pragma once
#include "sg_force_events.c"
#include "sg_notes.c"

/* What happens at one place: impacts, then the modes in which the step goes on. */

#if SG_DERIVATIVES
/* How velocities behind an impact, and forces at a place, change along directions (sg_forward.c).
 */
static void sg_forward_impact(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                              int rests);
static void sg_forward_strike(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                              SG(report) * info);
static void sg_forward_jump(SG(work) * w);
static void sg_forward_place(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                             SG(report) * info, int struck);
#endif

/* Note an event of a located step. */
static void sg_tell(const SG(work) * w, SG(report) * info, real t, int k, int kind, real energy,
                    const real P[]) {
    const sg_contact *contact = sg_contact_at(w, k);
    if (info->n_events < SG_MOST_EVENTS) {
        SG(event) *event = &info->events[info->n_events];
        int d;
        event->t = t;
        event->contact = k;
        event->kind = kind;
        event->energy = energy;
        event->P_N =
            P != NULL && contact->normal >= 0 ? P[sg_first_normal(w) + contact->normal] : SG_C(0.0);
        for (d = 0; d < SG_N_SLIP; ++d) {
            event->P_F[d] = P != NULL && d < contact->components
                                ? P[sg_first_slip(w) + contact->friction + d]
                                : SG_C(0.0);
        }
    }
    ++info->n_events;
}

/* Tolerances at the place where the step begins, and which contacts touch there. Returns 0 if one
   penetrates. */
static int sg_touch(SG(work) * w) {
    int free_of_overlap = 1;
    int d, k;
    sg_cold_start(w, SG_IMPACT);
    w->scales.formed = 0;
    sg_scales(w, SG_IMPACT);
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const sg_contact *contact = sg_contact_at(w, k);
        w->segment.touching[k] = 0;
        w->segment.mu[k] = w->mu[k];
        for (d = 0; d < contact->components; ++d) {
            w->segment.slip_tolerance[contact->friction + d] =
                SG_TOUCH * w->scales.speed[sg_first_slip(w) + contact->friction + d];
        }
        if (contact->normal >= 0) {
            const int n = contact->normal;
            const real size = w->masses.reach[sg_first_normal(w) + n] +
                              w->h * w->scales.speed[sg_first_normal(w) + n];
            w->segment.gap_tolerance[n] = SG_TOUCH * size;
            w->segment.rate_tolerance[n] = SG_TOUCH * w->scales.speed[sg_first_normal(w) + n];
            w->segment.touching[k] = w->found.exists[k] && w->gap[n] <= w->segment.gap_tolerance[n];
            if (w->found.exists[k] && w->gap[n] < -w->segment.gap_tolerance[n]) {
                free_of_overlap = 0;
            }
        }
    }
    return free_of_overlap;
}

/* 1 if contact k touches and approaches. */
static int sg_strikes(const SG(work) * w, int k) {
    const int n = sg_contact_at(w, k)->normal;
    return n >= 0 && w->segment.touching[k] && w->gap_rate[n] < -w->segment.rate_tolerance[n];
}

/* The step begins at the trial state at time t, and looks there. Returns OK, or why it cannot. */
static int sg_stand(SG(work) * w, const SG(params) * par, real t) {
    const int status = sg_prepare(w, par, t, w->segment.h);
    int k;
    if (status != SG_K(OK)) {
        return status;
    }
    w->segment.t = t;
    w->segment.prepared = 1;
    w->segment.known = 0;
    sg_look(w, par, t, w->trial.q, w->trial.v);
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const int turned = w->segment.turned[k];
        w->segment.exists[k] = turned ? turned == SG_TURNED_ON : w->found.exists[k];
        w->found.exists[k] = w->segment.exists[k];
    }
    return sg_touch(w) ? SG_K(OK) : SG_K(REJECTED);
}

/* The impact equations at one place. A contact that was struck a moment ago comes to rest: its
   restitution is zero. */
static int sg_strike(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                     SG(report) * info) {
    const sg_problem *pr = sg_problem_at(w, SG_IMPACT);
    const real t = w->segment.t;
    const real before = sg_energy(w, t, w->trial.q, w->trial.v, par);
    const real *P = &w->R[pr->R];
    real energy;
    int rests = 0;
    int status, k;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const int n = sg_contact_at(w, k)->normal;
        const int presser = sg_contact_at(w, k)->presser;
        w->found.active[k] =
            n < 0 && presser >= 0 ? w->found.active[presser] : w->segment.touching[k];
        if (sg_strikes(w, k) && t - w->trial.t_impact[k] < SG_REST * w->segment.h) {
            rests = rests || w->e_N[k] > SG_C(0.0);
            w->e_N[k] = SG_C(0.0);
        }
    }
    ++w->segment.solves;
    status = sg_solve(w, &w->trial, par, opt, info, SG_IMPACT, 0, SG_WHOLE,
                      info->iterations + sg_end_of(opt, SG_WHOLE));
#if SG_N_EXPANDED > 0
    if (status == SG_K(OK)) {
        status = sg_expand_impact(w, &w->trial, par, opt, info, SG_IMPACT, SG_WHOLE,
                                  info->iterations + sg_end_of(opt, SG_WHOLE));
    }
#endif
    if (status != SG_K(OK)) {
        return status;
    }
#if SG_DERIVATIVES
    if (w->directions.moves) {
        sg_forward_impact(w, par, opt, rests);
    }
#else
    (void)rests;
#endif
    sg_copy(sg_n_q(w), &w->x[pr->x], w->trial.v);
    energy = sg_energy(w, t, w->trial.q, w->trial.v, par) - before;
    for (k = 0; k < sg_n_R(w); ++k) {
        w->segment.P[k] += P[k];
    }
    for (k = 0; k < sg_n_contacts(w); ++k) {
        if (sg_strikes(w, k)) {
            w->trial.t_impact[k] = t;
            ++w->segment.impacts[k];
            sg_tell(w, info, t, k, SG_K(EVENT_IMPACT), energy, P);
            energy = SG_C(0.0); /* of all that struck at once, told with the first */
        }
    }
    return SG_K(OK);
}

/* 1 if the modes agree with gaps and velocities at the place; contact `but` was just said to
 * change.
 */
static int sg_modes_fit(const SG(work) * w, int but) {
    int k;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const int n = sg_contact_at(w, k)->normal;
        const int mode = w->segment.mode[k];
        const int presser = sg_contact_at(w, k)->presser;
        const int stays =
            n < 0 ? presser < 0 || sg_holds(w, presser)
                  : w->segment.touching[k] && w->gap_rate[n] <= w->segment.rate_tolerance[n];
        if (mode == SG_K(UNKNOWN) || (sg_holds(w, k) && !w->found.exists[k])) {
            return 0;
        }
        if (w->found.exists[k] && stays != sg_holds(w, k) && k != but) {
            return 0;
        }
        if (sg_rubs(w, k) && k != but) {
            const int slipping = sg_slip_size(w, k) > SG_C(1.0);
            if (slipping != sg_slips_in(mode) || (slipping && sg_slip_along(w, k) < SG_C(0.0))) {
                return 0;
            }
        }
    }
    return 1;
}

/* Directions of slip in space are those of the velocities at the place. */
static void sg_turn_slips(SG(work) * w) {
    int k;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const int mode = w->segment.mode[k];
        const int f = sg_contact_at(w, k)->friction;
        if (!sg_slips_in(mode)) {
            continue;
        }
        if (sg_contact_at(w, k)->components == 1) {
            w->segment.direction[f] =
                sg_times_axis(w, f, mode == SG_K(SLIP) ? SG_C(1.0) : SG_C(-1.0));
        } else if (sg_slip_size(w, k) > SG_C(1.0)) {
            (void)sg_friction_slip(w, k, &w->slip_rate[f], &w->segment.direction[f]);
        }
    }
}

/* 1 if the modes need forces at the place: friction or velocity constraints act, or they may have
   changed. */
static int sg_need_forces(SG(work) * w, int changed) {
    int k;
    w->segment.rubs = sg_n_gamma(w) > 0;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        w->segment.rubs = w->segment.rubs || sg_rubs(w, k);
    }
    return w->segment.rubs || changed;
}

/* Modes in which the step goes on from the place. `but`: the contact whose mode an event has
   changed, -1: none; `sought`: modes are sought whatever they were. */
static int sg_choose_modes(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                           SG(report) * info, int but, int sought) {
    int status = SG_K(OK);
    if (!sought) {
        sg_turn_slips(w);
        if (sg_modes_fit(w, but)) {
            if (!sg_need_forces(w, but >= 0)) {
                return SG_K(OK);
            }
            status = sg_find_forces(w, par, opt, info);
            if (status == SG_K(OK) && sg_forces_fit(w, but)) {
                return status;
            }
#if SG_DERIVATIVES
            if (status == SG_K(OK) && w->directions.moves) {
                sg_forward_jump(w);
            }
#endif
            sg_measure_motion(w, w->segment.h);
        }
    }
    status = sg_seek_modes(w, par, opt, info);
    (void)sg_need_forces(w, 1);
    return status;
}

/* Tell what became of the contacts at an event. */
static void sg_tell_changes(const SG(work) * w, SG(report) * info) {
    int k;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const int kind =
            sg_event_kind(w->segment.before[k], w->segment.mode[k], 0, w->found.exists[k]);
        const int struck = kind == SG_K(EVENT_CLOSE) && w->trial.t_impact[k] == w->segment.t;
        if (kind >= 0 && !struck) {
            sg_tell(w, info, w->segment.t, k, kind, SG_C(0.0), NULL);
        }
    }
}

/* Arrive at the trial state at time t: impacts, modes. `but`, `sought` as above. */
static int sg_enter(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                    SG(report) * info, real t, int but, int sought) {
    int status = sg_stand(w, par, t);
    int struck = 0;
    int k;
    for (k = 0; k < sg_n_contacts(w) && status == SG_K(OK); ++k) {
        struck = struck || sg_strikes(w, k);
    }
    if (status == SG_K(OK) && struck) {
#if SG_DERIVATIVES
        if (w->directions.moves) {
            sg_forward_strike(w, par, opt, info);
        }
#endif
        status = sg_strike(w, par, opt, info);
        if (status == SG_K(OK)) {
            status = sg_stand(w, par, t);
        }
        for (k = 0; k < sg_n_contacts(w) && status == SG_K(OK); ++k) {
            if (sg_strikes(w, k)) {
                status = SG_K(REJECTED);
            }
        }
    }
    if (status == SG_K(OK)) {
        status = sg_choose_modes(w, par, opt, info, struck ? -1 : but, struck || sought);
    }
#if SG_DERIVATIVES
    if (status == SG_K(OK) && w->directions.moves) {
        sg_forward_place(w, par, opt, info, struck);
    }
#endif
    return status;
}
