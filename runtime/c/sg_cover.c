#pragma once
#include "sg_poisson.c"

/* A step from its start to its end: problems in turn, check, substeps as the last resort. */

static int sg_is_coefficient(real x, real top) { return x >= SG_C(0.0) && x <= top; }

/* Contacts closed at the end of the step: the sign of (67), within the rounding band closed. */
static void sg_activity(SG(work) * w, const SG(options) * opt, SG(report) * info, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    int k, slot;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        /* friction elements act with the contact that presses them, which stands before them;
           what goes one way has no place where it could be open */
        int closed =
            sg_contact_at(w, k)->normal < 0
                ? sg_contact_at(w, k)->presser < 0 || w->found.active[sg_contact_at(w, k)->presser]
                : !sg_is_place(w, sg_contact_at(w, k)->normal);
        int pushed = 0;
        const int n = sg_first_normal(w) + sg_contact_at(w, k)->normal;
        for (slot = 0; slot < pr->n_slots && !closed && sg_contact_at(w, k)->normal >= 0; ++slot) {
            const int row = slot * sg_n_R(w) + n;
            const real percussion = w->R[pr->R + row];
            const int last = slot + 1 == pr->n_slots;
            pushed = pushed || percussion > SG_BAND * w->scales.phi_floor[row];
            if (last || opt->active_set != SG_K(ACTIVE_END)) {
                closed = sg_is_closed(w->scales.r_auto[row] * w->y[row] - percussion,
                                      SG_BAND * w->scales.phi_floor[row]);
            }
        }
        w->found.active[k] = closed && w->found.exists[k];
        if (pushed && !w->found.active[k]) {
            ++info->lost_impacts;
        }
    }
}

/* Smallest gap of rigid contacts at any stage of a solved problem. */
static void sg_smallest_gap(const SG(work) * w, SG(report) * info, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    int k, slot;
    for (slot = 0; slot < pr->gap_slots; ++slot) {
        for (k = 0; k < sg_n_contacts(w); ++k) {
            if (sg_contact_at(w, k)->normal >= 0 && sg_is_place(w, sg_contact_at(w, k)->normal) &&
                !sg_yields(w, sg_first_normal(w) + sg_contact_at(w, k)->normal) &&
                w->found.exists[k]) {
                const int row =
                    pr->R + slot * sg_n_R(w) + sg_first_normal(w) + sg_contact_at(w, k)->normal;
                const real gap = w->found.y[row];
                info->smallest_gap = gap < info->smallest_gap ? gap : info->smallest_gap;
            }
        }
    }
}

#if SG_JOINS
/* Those of every part by itself (sg_assemble.c). */
static void sg_retain(SG(work) * w, const SG(params) * par);
#else
/* Terms of (t_n, q_n): the step before left them in the state, unless something changed since. */
static void sg_recall(SG(work) * w, const SG(params) * par) {
#if SG_N_KEY > 0
    SG(part) *s = &w->trial;
    int k;
    SG(part_key)(sg_part_number(w), w->t, w->q, par, w->key);
    for (k = 0; k < sg_kind_of(w)->n_key; ++k) {
        s->has_terms = s->has_terms && s->key[k] == w->key[k];
    }
    if (!s->has_terms) {
        SG(part_terms)(sg_part_number(w), w->t, w->q, par, s->terms);
        sg_copy(sg_kind_of(w)->n_key, w->key, s->key);
        s->has_terms = 1;
    }
#else
    (void)w;
    (void)par;
#endif
}

/* Keep the terms of the end of the step, and what they belong to. */
static void sg_retain(SG(work) * w, const SG(params) * par) {
#if SG_N_KEY > 0
    SG(part_key)(sg_part_number(w), w->t + w->h, w->q_end, par, w->trial.key);
    sg_copy(sg_kind_of(w)->n_terms, &w->terms[(SG_N_STAGES - 2) * sg_kind_of(w)->n_terms],
            w->trial.terms);
    w->trial.has_terms = 1;
#else
    (void)w;
    (void)par;
#endif
}
#endif

/* Everything that is known at the start of a step of size h from the trial state at time t. */
static void sg_begin(SG(work) * w, const SG(params) * par, real t, real h) {
    w->t = t;
    w->h = h;
    sg_copy(sg_n_q(w), w->trial.q, w->q);
    sg_copy(sg_n_q(w), w->trial.v, w->v);
#if !SG_JOINS
    sg_recall(w, par);
#endif
    SG(start)(w, par);
}

/* Everything that is known at the start of a step of size h, if it can be taken from there. */
static int sg_prepare(SG(work) * w, const SG(params) * par, real t, real h) {
    int k;
    sg_begin(w, par, t, h);
#if SG_N_EXPANDED > 0
    w->expansion.expands = 0;
    sg_fill(sg_n_N(w), SG_C(0.0), w->expansion.back);
#endif
    for (k = 0; k < sg_n_contacts(w); ++k) {
        if (!sg_is_coefficient(w->mu[k], SG_HUGE) || !sg_is_coefficient(w->e_N[k], SG_C(1.0)) ||
            !sg_is_coefficient(w->e_F[k], SG_C(1.0))) {
            return SG_K(BAD_ARGUMENT);
        }
        w->found.exists[k] = !sg_contact_at(w, k)->guarded || w->guard[k] >= SG_C(0.0);
        w->found.active[k] = w->found.exists[k];
    }
    for (k = 0; k < sg_kind_of(w)->n_compliance; ++k) {
        if (!sg_is_coefficient(sg_compliance(w, k), SG_HUGE)) {
            return SG_K(BAD_ARGUMENT);
        }
    }
    if (!sg_elliptic_begin(w)) {
        return SG_K(BAD_ARGUMENT);
    }
    if (!sg_all_finite(sg_kind_of(w)->mass.start[sg_n_q(w)], w->mass) ||
        !sg_all_finite(sg_n_q(w), w->p) || !sg_all_finite(sg_n_q(w), w->force_size) ||
        !sg_all_finite(sg_n_contacts(w), w->guard)) {
        return SG_K(NONFINITE);
    }
    return sg_masses(w) ? SG_K(OK) : SG_K(SINGULAR);
}

/* Solve the step of size h from the trial state at time t; the result stays in the work struct. */
static int sg_attempt(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                      SG(report) * info, real t, real h, int effort, int end) {
    const SG(part) *s = &w->trial;
    int status = sg_prepare(w, par, t, h);
    int problem, warm;
    if (status != SG_K(OK)) {
        return status;
    }
    warm = s->warm && s->h_guess == h;
#if SG_LOCATED
    warm = warm && s->segment < 2; /* else it predicts another problem */
#endif
    for (problem = 0; problem < SG_N_CHAIN; ++problem) {
        status = sg_solve(w, s, par, opt, info, problem, warm, effort, end);
#if SG_N_EXPANDED > 0
        if (status == SG_K(OK) && problem + 1 == SG_N_CHAIN) {
            status = sg_expand_impact(w, s, par, opt, info, problem, effort, end);
        }
#endif
        if (status != SG_K(OK)) {
            w->found.stuck = problem;
            return status;
        }
        if (problem + 1 < SG_N_CHAIN && sg_problem_at(w, problem + 1)->follows) {
            sg_activity(w, opt, info, problem);
            if (!sg_check_active(w, opt, problem)) {
                w->found.stuck = problem;
                return SG_K(REJECTED);
            }
        }
        sg_smallest_gap(w, info, problem);
    }
    SG(finish)(w);
    return sg_all_finite(sg_n_q(w), w->q_end) && sg_all_finite(sg_n_q(w), w->v_end)
               ? SG_K(OK)
               : SG_K(NONFINITE);
}

/* Unknowns that a step was solved for, of those that the next starts from. */
typedef struct {
    int x, x_end, R, R_end;
} sg_range;

/* Backward differences of the solutions of steps of the same size and contact state, and the order
   to which they would have predicted this one best; -1 where the velocities are those of the
   step's start but for round-off. Differences of that size predict nothing: followed from step to
   step they would grow, and have to be corrected. */
static void sg_remember(SG(part) * s, const SG(work) * w, int same, const sg_range *of) {
    const int known = same && s->h_guess == w->h ? s->warm : 0;
    real error[3];
    real noise = SG_C(0.0);
    real apart = SG_C(0.0);
    int i, j;
    sg_fill(3, SG_C(0.0), error);
    if (known > 0) {
        for (i = of->x; i < of->x_end; i += sg_n_q(w)) {
            for (j = 0; j < sg_n_q(w); ++j) {
                const real d_1 = w->x[i + j] - s->x[i + j];
                const real d_2 = d_1 - s->x_1[i + j];
                const real d_3 = d_2 - s->x_2[i + j];
                /* velocities of the stages are as rough as the positions over the step size */
                noise += SG_FLOOR * (w->scales.pace[j] + SG_FABS(w->q[j]) / w->h) *
                         w->masses.root_inertia[j];
                apart += SG_FABS(w->x[i + j] - w->v[j]) * w->masses.root_inertia[j];
                error[0] += SG_FABS(d_1) * w->masses.root_inertia[j];
                error[1] += SG_FABS(d_2) * w->masses.root_inertia[j];
                error[2] += SG_FABS(d_3) * w->masses.root_inertia[j];
                s->x[i + j] = w->x[i + j];
                s->x_1[i + j] = d_1;
                s->x_2[i + j] = d_2;
            }
        }
        for (i = of->R; i < of->R_end; ++i) {
            const real d_1 = w->R[i] - s->R[i];
            s->R_2[i] = d_1 - s->R_1[i];
            s->R_1[i] = d_1;
            s->R[i] = w->R[i];
        }
    } else {
        /* at first velocities move on by the change of v */
        for (i = of->x; i < of->x_end; ++i) {
            s->x[i] = w->x[i];
            s->x_1[i] = w->v_end[i % sg_n_q(w)] - w->v[i % sg_n_q(w)];
            s->x_2[i] = SG_C(0.0);
        }
        for (i = of->R; i < of->R_end; ++i) {
            s->R[i] = w->R[i];
            s->R_1[i] = SG_C(0.0);
            s->R_2[i] = SG_C(0.0);
        }
    }
    s->order = (known > 0 && !(error[1] < SG_C(0.5) * error[0])) ? 0 : 1;
    if (known > 1 && s->order > 0 && error[2] < SG_C(0.5) * error[1]) {
        s->order = 2;
    }
    if (known > 0 && error[0] <= noise) {
        s->order = apart <= noise ? -1 : 0;
    }
    s->warm = !same ? 0 : known < 2 ? known + 1 : 2;
}

/* State of contact k at the end of the (sub)step, from its rows in the last problem. */
static int sg_contact_state(const SG(work) * w, int k) {
    const sg_problem *pr = sg_problem_at(w, SG_N_CHAIN - 1);
    const sg_contact *contact = sg_contact_at(w, k);
    const int base = (pr->n_slots - 1) * sg_n_R(w);
    const int f = sg_first_slip(w) + contact->friction;
    const real *slip = &w->found.y[pr->R + base + f];
    if (contact->presser >= 0 && (!w->found.active[k] || !sg_is_pressed(w, base, k))) {
        return SG_K(OPEN);
    }
    if (contact->components == 0) {
        return SG_K(CLOSED);
    }
    if (w->rows.kind[base + f] == SG_ROW_FREE ||
        !(sg_norm(contact->components, slip) > SG_FLOOR * w->scales.speed[f])) {
        return SG_K(STICK);
    }
    return contact->components == 1 && slip[0] < SG_C(0.0) ? SG_K(SLIP_BACK) : SG_K(SLIP);
}

/* 1 if the gap of contact k was closing at the start of the (sub)step, beyond round-off. */
static int sg_approaches(const SG(work) * w, int k) {
    const int n = sg_first_normal(w) + sg_contact_at(w, k)->normal;
    const real rate = w->drift[n] + sg_row_dot(&sg_kind_of(w)->direction, w->direction, n, w->v);
    return rate < -SG_CHECK * w->scales.speed[n];
}

/* Take over the end of the step; where contacts opened, closed or impacted the next starts cold. */
static void sg_commit(SG(work) * w, const SG(params) * par, SG(report) * info) {
    const sg_problem *last = sg_problem_at(w, SG_N_CHAIN - 1);
    const sg_range all = {0, last->x + last->n_x, 0, last->R + last->n_slots * sg_n_R(w)};
    SG(part) *s = &w->trial;
    int k;
    int same = 1;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const int closed = w->found.active[k];
        const int now = sg_contact_state(w, k);
        if (closed != s->closed[k]) {
            same = 0;
        }
        if (sg_contact_at(w, k)->normal >= 0 && now != SG_K(OPEN) && s->contact[k] <= SG_K(OPEN) &&
            sg_approaches(w, k)) {
            ++info->impacts[k];
        }
        s->closed[k] = closed;
        s->contact[k] = now;
        info->contact[k] = now;
    }
    sg_remember(s, w, same, &all);
    sg_copy(sg_n_q(w), w->q_end, s->q);
    sg_copy(sg_n_q(w), w->v_end, s->v);
    sg_retain(w, par);
    s->h_guess = w->h;
#if SG_LOCATED
    s->segment = 0;
#endif
    for (k = 0; k < SG_N_CHAIN; ++k) {
        s->states[k] = w->found.states[k];
        s->choice[k] = w->found.choice[k];
    }
}

/* Nothing is reported yet. */
static void sg_reset_report(SG(report) * info, int n_contacts, int n_R) {
    int k;
    for (k = 0; k < n_contacts; ++k) {
        info->contact[k] = SG_K(UNKNOWN);
        info->impacts[k] = 0;
    }
    info->status = SG_K(OK);
    info->iterations = 0;
    info->substeps = 0;
    info->rescues = 0;
    info->percussions = SG_UNIQUE;
    info->lost_impacts = 0;
    info->residual = SG_C(0.0);
    info->smallest_gap = SG_HUGE;
    sg_fill(n_R, SG_C(0.0), info->P);
#if SG_LOCATED
    info->captured = 0;
    info->t_captured = SG_C(0.0);
    info->n_events = 0;
#endif
}

/* Report anew, but for the iterations. */
static void sg_forget(const SG(work) * w, SG(report) * info) {
    const int used = info->iterations;
#if SG_LOCATED
    const int events = info->n_events;
    const int captured = info->captured;
#endif
    sg_reset_report(info, sg_n_contacts(w), sg_n_R(w));
    info->iterations = used;
#if SG_LOCATED
    info->n_events = events;
    info->captured = captured;
#endif
}

/* Iterations that a step may have used at the end of an effort: by the whole step, by it again with
   contacts said to hold, by substeps. */
static int sg_end_of(const SG(options) * opt, int effort) {
    const int total = opt->max_iterations;
    const int part = effort == SG_WHOLE                            ? SG_PART_WHOLE
                     : effort == SG_AGAIN && opt->max_halvings > 0 ? SG_PART_AGAIN
                                                                   : SG_PARTS;
    return total - total / SG_PARTS * (SG_PARTS - part);
}

#if SG_DERIVATIVES
/* How the end of a solved (sub)step changes along directions (sg_forward_map.c). */
static void sg_forward_captured(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                                real share);
#endif

/* Cover the step of size h from the trial state at t_n by solved (sub)steps. Returns the status of
   the one that could not be solved, or OK. */
static int sg_cover(SG(work) * w, real t_n, SG(report) * info, const SG(params) * par,
                    const SG(options) * opt, real h) {
    const int rest = SG_FINEST; /* the position in the step is counted in units of h / SG_FINEST */
    int effort = SG_WHOLE;
    int done = 0;
    int level = 0;
    int stride = rest;
    int j;
    while (done < rest) {
        const real t = t_n + h * ((real)done / (real)rest);
        const int status = sg_attempt(w, par, opt, info, t, h * ((real)stride / (real)rest), effort,
                                      sg_end_of(opt, effort));
        if (status == SG_K(OK)) {
#if SG_DERIVATIVES
            if (w->directions.moves) {
                sg_forward_captured(w, par, opt, (real)stride / (real)(rest - done));
            }
#endif
            done += stride;
            sg_commit(w, par, info);
            for (j = 0; j < sg_n_R(w); ++j) {
                info->P[j] += w->P[j];
            }
            if (level > 0) {
                ++info->substeps;
                if (done % (2 * stride) == 0) {
                    stride *= 2;
                    --level;
                }
            }
        } else if ((status == SG_K(NOT_CONVERGED) || status == SG_K(REJECTED)) &&
                   effort == SG_WHOLE) {
            effort = SG_AGAIN;
            sg_forget(w, info);
        } else if (status != SG_K(BAD_ARGUMENT) && level < opt->max_halvings) {
            if (level == 0) {
                sg_forget(w, info); /* what is reported is of the substeps alone */
            }
            effort = SG_SUBSTEP;
            stride /= 2;
            ++level;
        } else {
            sg_forget(w, info); /* nothing is reported of a step that is not taken */
            return status;
        }
    }
    return SG_K(OK);
}
