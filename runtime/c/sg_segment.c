#pragma once
#include "sg_accelerations.c"
#include "sg_dense.c"

/* One segment: the smooth problem in which every contact keeps its mode. */

/* 1 if contact rows of a slot are solved as the modes say: judged by themselves, with the limits of
   the checker. */
static int sg_check_modes(const SG(work) * w, const sg_problem *pr, int problem,
                          const sg_solved *at, const sg_limit *limit) {
    int d, k;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const sg_contact *contact = sg_contact_at(w, k);
        const int n = sg_first_normal(w) + contact->normal;
        const int f = sg_first_slip(w) + contact->friction;
        const int gap = contact->normal >= 0 && sg_is_gap(w, pr, at->slot, n);
        if (contact->normal >= 0 &&
            (sg_holds(w, k)
                 ? !sg_small(at->y[n], gap ? w->h * w->scales.speed[n] : w->scales.speed[n],
                             gap ? w->scales.gap_floor[n] : SG_C(0.0), limit)
                 : at->R[n] != SG_C(0.0))) {
            return 0;
        }
        if (problem != SG_SEGMENT || at->slot == 0 || !sg_rubs(w, k)) {
            continue;
        }
        if (!sg_slips_in(w->segment.mode[k])) {
            for (d = 0; d < contact->components; ++d) {
                if (!sg_small(at->y[f + d], w->scales.speed[f + d],
                              w->scales.gap_floor[f + d] * sg_slot_rate(w, pr, at->slot), limit)) {
                    return 0;
                }
            }
        } else {
            /* on the boundary of its set; that it opposes the slip is asked of the whole segment */
            const real radius = sg_radius(w, at->slot * sg_n_R(w), k, &w->R[pr->R]);
            const real size = sg_friction_size(w, k, &at->R[f]);
            if (!sg_small(size - SG_FABS(radius), sg_max(w->scales.percussion_scale[f], size),
                          SG_C(0.0), limit)) {
                return 0;
            }
        }
    }
    return 1;
}

/* 1 if the segment is solved. */
static int sg_check_segment(SG(work) * w, const SG(options) * opt, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const sg_limit limit = sg_limits(opt);
    int slot;
    sg_keep_rows(w, problem);
    if (!sg_check_smooth(w, pr, &limit)) {
        return 0;
    }
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const sg_solved at = sg_solved_slot(w, pr, slot);
        if (!sg_check_bilateral(w, pr, &at, &limit) ||
            !sg_check_modes(w, pr, problem, &at, &limit)) {
            return 0;
        }
    }
    return 1;
}

/* Start of a problem of a segment of size h: velocities move on with the accelerations at its
   start, percussions are what acts there. */
static void sg_guess(SG(work) * w, int problem, real h) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const real part = h / w->segment.h;
    const int stages = problem == SG_SEGMENT ? SG_N_DENSE : pr->n_x / sg_n_q(w);
    const int parts = stages > 1 ? stages - 1 : 1;
    int i, c;
    for (i = 0; i < pr->n_x; ++i) {
        int stage = i / sg_n_q(w);
        real share;
        stage = stage < stages ? stage : stage - stages + 1; /* U^i behind V^i */
        share = stages > 1 ? (real)stage / (real)parts : SG_C(1.0);
        w->x[pr->x + i] = w->v[i % sg_n_q(w)];
        if (w->segment.known) {
            w->x[pr->x + i] += part * share * w->segment.acceleration[i % sg_n_q(w)];
        }
    }
    for (i = 0; i < pr->n_slots; ++i) {
        for (c = 0; c < sg_n_R(w); ++c) {
            w->R[pr->R + i * sg_n_R(w) + c] =
                w->segment.known ? part * w->segment.force[c] : SG_C(0.0);
        }
    }
}

/* Percussions of rows that are off are zero, exactly. */
static void sg_leave_off(SG(work) * w, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    int i;
    for (i = 0; i < pr->n_slots * sg_n_R(w); ++i) {
        if (w->rows.kind[i] == SG_ROW_ZERO) {
            w->R[pr->R + i] = SG_C(0.0);
        }
    }
}

/* Solve one problem of the segment from where its unknowns are. */
static int sg_solve_held(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                         SG(report) * info, int problem) {
    real measure = SG_HUGE;
    int status;
    sg_prox_parameters(w, opt, problem);
    sg_say_modes(w, problem);
    sg_leave_off(w, problem);
    w->segment.held = 1;
    ++w->segment.solves;
    status = sg_newton(w, par, opt, problem, SG_HOLDING, 0, &info->iterations, &measure);
    w->segment.held = 0;
    if (status == SG_K(OK)) {
        info->residual = sg_max(info->residual, measure * sg_max(opt->tol, SG_FLOOR));
        status = sg_check_segment(w, opt, problem) ? SG_K(OK) : SG_K(REJECTED);
    }
    return status;
}

/* What is known of friction and velocity constraints at the first stage of a segment of size h. */
static void sg_say_given(SG(work) * w, real h) {
    const real part = h / w->segment.h;
    int c, d, k;
    sg_say_shares(w, part);
    for (c = 0; c < sg_n_gamma(w); ++c) {
        w->given[c] = part * w->segment.force[sg_n_g(w) + c];
    }
    for (k = 0; k < sg_n_contacts(w); ++k) {
        for (d = 0; d < sg_contact_at(w, k)->components; ++d) {
            const int f = sg_contact_at(w, k)->friction + d;
            if (sg_rubs(w, k) && !sg_slips_in(w->segment.mode[k])) {
                w->given[sg_n_gamma(w) + f] = part * w->segment.force[sg_first_slip(w) + f];
            }
        }
    }
}

/* 1 if the last step was one segment of this size in the same modes, so that it predicts this one.
 */
static int sg_is_predicted(const SG(work) * w, real h) {
    const SG(part) *s = &w->trial;
    return s->warm && s->h_guess == h && s->segment == 1 + w->segment.rubs;
}

/* What is measured by the size of the step. */
static void sg_resize(SG(work) * w, real h) {
    int i;
    w->h = h;
    for (i = 0; i < sg_n_q(w); ++i) {
        w->masses.momentum[i] = sg_max(SG_FABS(w->p[i]), h * w->force_size[i]);
    }
    w->scales.formed = 0;
}

/* Solve the segment of size h from the trial state, where the step has been prepared. `again`: from
   the solution of a segment of size `again` from the same start. */
static int sg_solve_segment(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                            SG(report) * info, real h, real again) {
    const int first = w->segment.rubs ? SG_SEGMENT : 0;
    const int last = w->segment.rubs ? SG_SEGMENT : SG_N_CHAIN - 1;
    const int warm = sg_is_predicted(w, h);
    int problem, i;
    int status = SG_K(OK);
    if (w->h != h) {
        sg_resize(w, h);
    }
    w->smooth.pivoting = 0;
    w->newton.mode = SG_FIRST_ATTEMPT;
    sg_say_given(w, h);
    for (problem = first; problem <= last && status == SG_K(OK); ++problem) {
        const sg_problem *pr = sg_problem_at(w, problem);
        if (again > SG_C(0.0)) {
            for (i = 0; i < pr->n_x; ++i) {
                const real v = w->v[i % sg_n_q(w)];
                w->x[pr->x + i] = v + (w->x[pr->x + i] - v) * (h / again);
            }
            for (i = 0; i < pr->n_slots * sg_n_R(w); ++i) {
                w->R[pr->R + i] *= h / again;
            }
        } else if (warm) {
            sg_warm_start(w, &w->trial, problem);
        } else {
            sg_guess(w, problem, h);
        }
        status = sg_solve_held(w, par, opt, info, problem);
        if (status != SG_K(OK)) {
            w->smooth.pivoting = 1;
            sg_guess(w, problem, h);
            status = sg_solve_held(w, par, opt, info, problem);
        }
        w->found.states[problem] = 0;
        w->found.choice[problem] = SG_UNIQUE;
    }
    if (status == SG_K(OK)) {
        if (w->segment.rubs) {
            SG(finish_segment)(w);
        } else {
            SG(finish)(w);
        }
        w->segment.span = h;
        sg_keep_dense(w, last);
        status = sg_all_finite(sg_n_q(w), w->q_end) && sg_all_finite(sg_n_q(w), w->v_end)
                     ? SG_K(OK)
                     : SG_K(NONFINITE);
    }
    return status;
}
