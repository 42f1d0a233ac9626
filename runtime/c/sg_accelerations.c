#pragma once
#include "sg_modes.c"

/* Forces and accelerations at one place: (T4) with the modes held, or the contact problem of
   accelerations for modes that are sought. */

/* The problem is measured by the forces of a step, not by what moves already. */
static void sg_measure_forces(SG(work) * w) {
    int j;
    sg_copy(sg_n_R(w), w->drift, w->segment.drift);
    sg_fill(sg_n_R(w), SG_C(0.0), w->drift);
    sg_fill(sg_n_q(w), SG_C(0.0), w->v);
    for (j = 0; j < sg_n_q(w); ++j) {
        w->masses.momentum[j] = w->h * w->force_size[j];
    }
    w->scales.formed = 0;
}

/* The same for a step of size h again. */
static void sg_measure_motion(SG(work) * w, real h) {
    int j;
    sg_copy(sg_n_R(w), w->segment.drift, w->drift);
    sg_copy(sg_n_q(w), w->trial.v, w->v);
    w->h = h;
    for (j = 0; j < sg_n_q(w); ++j) {
        w->masses.momentum[j] = sg_max(SG_FABS(w->p[j]), h * w->force_size[j]);
    }
    w->scales.formed = 0;
}

/* Keep what was found: accelerations and percussions of all rows in a step. */
static void sg_keep_forces(SG(work) * w) {
    const sg_problem *pr = sg_problem_at(w, SG_ACCELERATIONS);
    int d, k;
    sg_copy(sg_n_q(w), &w->x[pr->x], w->segment.acceleration);
    sg_copy(sg_n_R(w), &w->R[pr->R], w->segment.force);
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const sg_contact *contact = sg_contact_at(w, k);
        for (d = 0; d < contact->components; ++d) {
            const int f = contact->friction + d;
            w->segment.force[sg_first_slip(w) + f] += w->given[sg_n_gamma(w) + f];
            if (contact->pressing >= 0) {
                w->segment.force[sg_first_slip(w) + f] +=
                    w->share[f] * w->segment.force[sg_first_normal(w) + contact->pressing];
            }
        }
    }
    w->segment.known = 1;
}

/* Given bounds at the place, times the size of the whole step. */
static void sg_find_bounds(SG(work) * w, const SG(params) * par) {
    sg_fill(sg_n_gamma(w) + sg_n_F(w), SG_C(0.0), w->given);
    sg_fill(sg_n_F(w), SG_C(0.0), w->share);
    sg_cold_start(w, SG_ACCELERATIONS);
    SG(values)(w, par, SG_ACCELERATIONS);
    sg_copy(sg_n_bounds(w), w->radius, w->segment.bound);
}

/* Forces with every contact in its mode, at the place where the step has begun and looks. */
static int sg_find_forces(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                          SG(report) * info) {
    real measure = SG_HUGE;
    int turn;
    int status = SG_K(NOT_CONVERGED);
    sg_measure_forces(w);
    for (turn = 0; turn < 2 && status != SG_K(OK); ++turn) {
        sg_find_bounds(w, par);
        sg_say_shares(w, SG_C(1.0));
        sg_say_modes(w, SG_ACCELERATIONS);
        w->smooth.pivoting = turn;
        w->newton.mode = SG_LATER_ATTEMPT;
        w->segment.held = 1;
        ++w->segment.solves;
        sg_prox_parameters(w, opt, SG_ACCELERATIONS);
        status = sg_newton(w, par, opt, SG_ACCELERATIONS, SG_PLAIN, 0, &info->iterations, &measure);
        w->segment.held = 0;
    }
    if (status == SG_K(OK)) {
        sg_keep_forces(w);
    }
    return status;
}

/* 1 if what was found agrees with the modes: contacts press, sticking friction lies in its set, a
   slip that begins goes on. Contact `but` is not asked. */
static int sg_forces_fit(const SG(work) * w, int but) {
    int d, k;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const sg_contact *contact = sg_contact_at(w, k);
        const int f = sg_first_slip(w) + contact->friction;
        const real *R = w->segment.force;
        real radius = SG_C(0.0);
        real tolerance = SG_C(0.0);
        if (k == but || !sg_holds(w, k)) {
            continue;
        }
        if (contact->pressing >= 0) {
            const int n = sg_first_normal(w) + contact->pressing;
            tolerance = SG_TOUCH * w->scales.percussion_scale[n];
            if (R[n] < -tolerance) {
                return 0;
            }
            radius = w->segment.mu[k] * R[n];
            tolerance *= w->segment.mu[k];
        } else {
            radius = w->segment.bound[contact->bound];
        }
        if (!sg_rubs(w, k)) {
            continue;
        }
        tolerance += SG_TOUCH * w->scales.percussion_scale[f];
        if (!sg_slips_in(w->segment.mode[k])) {
            if (sg_friction_size(w, k, &R[f]) > radius + tolerance) {
                return 0;
            }
        } else if (!(sg_slip_size(w, k) > SG_C(1.0))) {
            real along = SG_C(0.0);
            for (d = 0; d < contact->components; ++d) {
                along += w->y[f + d] * w->segment.direction[contact->friction + d];
            }
            if (along * w->masses.m_eff[f] < -tolerance) {
                return 0;
            }
        }
    }
    return 1;
}

/* Which contacts take part where modes are sought: those that touch and do not part. Where one
   slips its friction is known. */
static void sg_say_sought(SG(work) * w) {
    int k;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const int n = sg_contact_at(w, k)->normal;
        const int presser = sg_contact_at(w, k)->presser;
        const int rubs = presser < 0 || w->segment.mu[k] > SG_C(0.0);
        const int touches =
            n < 0 ? presser < 0 || w->found.active[presser]
                  : w->segment.touching[k] && w->gap_rate[n] <= w->segment.rate_tolerance[n];
        const int stays = w->found.exists[k] && touches;
        w->found.active[k] = stays;
        w->segment.mode[k] = !stays                                 ? SG_K(OPEN)
                             : sg_contact_at(w, k)->components == 0 ? SG_K(CLOSED)
                                                                    : SG_K(STICK);
        if (stays && sg_contact_at(w, k)->components > 0 && sg_slip_size(w, k) > SG_C(1.0)) {
            sg_say_slip(w, k);
            w->mu[k] = SG_C(0.0);
            w->found.exists[k] = presser >= 0 || !rubs;
        }
    }
}

/* Modes from the rows of the problem that was solved. */
static void sg_take_modes(SG(work) * w) {
    int d, k;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const sg_contact *contact = sg_contact_at(w, k);
        const int f = sg_first_slip(w) + contact->friction;
        if (!sg_is_pressed(w, 0, k)) {
            w->segment.mode[k] = SG_K(OPEN);
        }
        if (w->segment.mode[k] == SG_K(STICK) && sg_rubs(w, k) && w->rows.kind[f] == SG_ROW_SLIP) {
            for (d = 0; d < contact->components; ++d) {
                w->segment.direction[contact->friction + d] = w->rows.slip[f + d];
            }
            w->segment.mode[k] = contact->components == 1 && w->rows.slip[f] < SG_C(0.0)
                                     ? SG_K(SLIP_BACK)
                                     : SG_K(SLIP);
        }
    }
}

/* The contact problem of accelerations: modes of all contacts that touch, and the forces with them.
 */
static int sg_seek_modes(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                         SG(report) * info) {
    int status, k;
    sg_measure_forces(w);
    sg_find_bounds(w, par);
    sg_say_sought(w);
    sg_say_shares(w, SG_C(1.0));
    ++w->segment.solves;
    status = sg_solve(w, &w->trial, par, opt, info, SG_ACCELERATIONS, 0, SG_WHOLE,
                      info->iterations + sg_end_of(opt, SG_WHOLE));
    for (k = 0; k < sg_n_contacts(w); ++k) {
        w->mu[k] = w->segment.mu[k];
        w->found.exists[k] = w->segment.exists[k];
    }
    if (status == SG_K(OK)) {
        sg_take_modes(w);
        sg_keep_forces(w);
    }
    return status;
}
