#pragma once
#include "sg_cover.c"

/* One step from state to state. */

#if SG_LOCATED
/* A step that is cut at its events (sg_located.c). */
static int sg_locate(SG(work) * w, const SG(part) * s, SG(report) * info, const SG(params) * par,
                     const SG(options) * opt, real h);
#endif

#if SG_JOINS
/* What a part goes on from; a stepped island has a struct of its own. */
#define SG_KEPT SG(kept)
#else
#define SG_KEPT SG(part)
#endif

static void sg_reset_guess(SG_KEPT *s, int n_contacts) {
    int k;
    sg_fill(SG_OWN_X_KEPT, SG_C(0.0), s->x);
    sg_fill(SG_OWN_ROWS_KEPT, SG_C(0.0), s->R);
    for (k = 0; k < n_contacts; ++k) {
        s->closed[k] = 0;
        s->contact[k] = SG_K(UNKNOWN);
    }
    sg_fill(SG_OWN_X_KEPT, SG_C(0.0), s->x_1);
    sg_fill(SG_OWN_X_KEPT, SG_C(0.0), s->x_2);
    sg_fill(SG_OWN_ROWS_KEPT, SG_C(0.0), s->R_1);
    sg_fill(SG_OWN_ROWS_KEPT, SG_C(0.0), s->R_2);
    for (k = 0; k < SG_N_PROBLEMS; ++k) {
        s->states[k] = 0;
        s->choice[k] = SG_UNIQUE;
    }
#if SG_LOCATED
    for (k = 0; k < n_contacts; ++k) {
        s->t_impact[k] = -SG_HUGE;
    }
    s->located = 0;
    s->segment = 0;
#endif
    s->warm = 0;
    s->order = 0;
    s->h_guess = SG_C(0.0);
#if SG_N_KEY > 0
    s->has_terms = 0;
    sg_fill(SG_OWN_KEY, SG_C(0.0), s->key);
    sg_fill(SG_OWN_TERMS, SG_C(0.0), s->terms);
#endif
#if SG_JOINS
    s->island = -1;
#endif
}

/* Forget what all parts would go on from. */
static void sg_reset_parts(SG(state) * s) {
#if SG_N_PARTS > 1
    int p, k;
    for (p = 0; p < SG_N_PARTS; ++p) {
        sg_reset_guess(&s->part[p], sg_kinds[sg_parts[p].kind].n_contacts);
    }
    for (k = 0; k < SG_N_CONTACTS; ++k) {
        s->contact[k] = SG_K(UNKNOWN);
    }
#else
    sg_reset_guess(s, SG_N_CONTACTS);
#endif
#if SG_JOINS
    s->n_links = 0;
#endif
}

int SG(set_state)(SG(state) * s, real t, const real q[], const real v[]) {
    if (s == NULL || q == NULL || v == NULL || !sg_finite(t) || !sg_all_finite(SG_N_Q, q) ||
        !sg_all_finite(SG_N_Q, v)) {
        return SG_K(BAD_ARGUMENT);
    }
    s->t = t;
    s->t_grid = t;
    s->h_grid = SG_C(0.0);
    s->n_grid = SG_C(0.0);
    sg_copy(SG_N_Q, q, s->q);
    sg_copy(SG_N_Q, v, s->v);
    sg_reset_parts(s);
    return SG_K(OK);
}

static int sg_are_options(const SG(options) * opt) {
    return opt->tol >= SG_C(0.0) && opt->tol <= SG_TOLERANCE_MOST && opt->r >= SG_C(0.0) &&
           sg_finite(opt->r) && opt->max_iterations >= 1 && opt->max_iterations <= 1000000 &&
           opt->max_halvings >= 0 && opt->max_halvings <= SG_MOST_HALVINGS &&
           (opt->active_set == SG_K(ACTIVE_ANY_STAGE) || opt->active_set == SG_K(ACTIVE_END)) &&
           (opt->scaling == SG_K(SCALING_ROWS) ||
            (opt->scaling == SG_K(SCALING_NONE) && opt->tol > SG_C(0.0)))
#if SG_LOCATED
           && (opt->events == SG_K(EVENTS_CAPTURED) ||
               (opt->events == SG_K(EVENTS_LOCATED) && opt->scaling == SG_K(SCALING_ROWS))) &&
           opt->max_events >= 1 && opt->max_events <= SG_MOST_EVENTS
#endif
        ;
}

/* 1 unless an argument of a step is none. */
static int sg_may_step(const SG(state) * s, const SG(work) * w, const SG(info) * info,
                       const SG(params) * par, const SG(options) * opt, const real u[], real h) {
    return s != NULL && w != NULL && info != NULL && par != NULL && opt != NULL &&
           (SG_N_U == 0 || u != NULL) && h > SG_C(0.0) && sg_finite(h) && sg_are_options(opt) &&
           (!sg_finite(s->t) || sg_finite(s->t + h));
}

/* The time behind a step of size h: t_n = t_0 + n h without a running sum, as long as h stays and
   nobody else sets the time. */
static void sg_tick(SG(state) * to, const SG(state) * s, real h) {
    if (to->h_grid != h || to->n_grid >= SG_GRID_MOST ||
        s->t != s->t_grid + s->n_grid * s->h_grid) {
        to->t_grid = s->t;
        to->h_grid = h;
        to->n_grid = SG_C(0.0);
    }
    to->n_grid += SG_C(1.0);
    to->t = to->t_grid + to->n_grid * h;
}

#if SG_JOINS
/* Copy what an island goes on from, as much as the one at hand has. */
static void sg_copy_part(const SG(work) * w, const SG(part) * from, SG(part) * to) {
    const int n_x = SG_BLOCKS_KEPT * sg_n_q(w);
    const int n_R = SG_SLOTS_KEPT * sg_n_R(w);
    int k;
    to->t = from->t;
    to->warm = from->warm;
    to->order = from->order;
    to->h_guess = from->h_guess;
    sg_copy(sg_n_q(w), from->q, to->q);
    sg_copy(sg_n_q(w), from->v, to->v);
    sg_copy(n_x, from->x, to->x);
    sg_copy(n_x, from->x_1, to->x_1);
    sg_copy(n_x, from->x_2, to->x_2);
    sg_copy(n_R, from->R, to->R);
    sg_copy(n_R, from->R_1, to->R_1);
    sg_copy(n_R, from->R_2, to->R_2);
    for (k = 0; k < sg_n_contacts(w); ++k) {
        to->closed[k] = from->closed[k];
        to->contact[k] = from->contact[k];
#if SG_LOCATED
        to->t_impact[k] = from->t_impact[k];
#endif
    }
    for (k = 0; k < SG_N_PROBLEMS; ++k) {
        to->states[k] = from->states[k];
        to->choice[k] = from->choice[k];
    }
#if SG_LOCATED
    to->located = from->located;
    to->segment = from->segment;
#endif
}
#endif

/* The step of one part from w->trial, where its end will stand, too; *s is the same and stays. */
static int sg_step_part(const SG(part) * s, SG(work) * w, SG(report) * info, const SG(params) * par,
                        const SG(options) * opt, real h) {
    int status;
    w->found.stuck = -1;
#if SG_LOCATED
    w->segment.held = 0;
    status = opt->events == SG_K(EVENTS_LOCATED) ? sg_locate(w, s, info, par, opt, h)
                                                 : sg_cover(w, s->t, info, par, opt, h);
    w->trial.located = opt->events == SG_K(EVENTS_LOCATED);
#else
    status = sg_cover(w, s->t, info, par, opt, h);
#endif
    return status;
}

#if SG_N_PARTS > 1
/* Nothing is reported of a step yet (sg_islands.c). */
static void sg_reset_info(SG(info) * info);

/* The steps of all parts, and how the model stands behind them. */
static int sg_step_islands(SG(state) * s, SG(work) * w, SG(info) * info, const SG(params) * par,
                           const SG(options) * opt, real h);
#else
/* Nothing is reported of a step yet. */
static void sg_reset_info(SG(info) * info) { sg_reset_report(info, SG_N_CONTACTS, SG_N_R); }
#endif

static int sg_take_step(SG(state) * s, SG(work) * w, SG(info) * info, const SG(params) * par,
                        const SG(options) * opt, const real u[], real h) {
    int j, status;
    if (!sg_may_step(s, w, info, par, opt, u, h)) {
        if (info != NULL) {
            sg_reset_info(info);
            info->status = SG_K(BAD_ARGUMENT);
        }
        return SG_K(BAD_ARGUMENT);
    }
    sg_reset_info(info);
    if (!sg_all_finite(SG_N_Q, s->q) || !sg_all_finite(SG_N_Q, s->v) || !sg_finite(s->t) ||
        !sg_all_finite(SG_N_U, u)) {
        info->status = SG_K(NONFINITE);
        return info->status;
    }
    for (j = 0; j < SG_N_U; ++j) {
        w->u[j] = u[j];
    }
#if SG_N_PARTS > 1
    status = sg_step_islands(s, w, info, par, opt, h);
#else
    w->trial = *s;
    status = sg_step_part(s, w, info, par, opt, h);
#endif
    if (status != SG_K(OK)) {
        info->status = status;
        return status;
    }
#if SG_N_PARTS > 1
    sg_tick(s, s, h);
#else
    sg_tick(&w->trial, s, h);
    *s = w->trial;
#endif
    info->status = info->substeps > 0  ? SG_K(OK_SUBSTEPPED)
                   : info->rescues > 0 ? SG_K(OK_RESCUED)
                                       : SG_K(OK);
    return info->status;
}

int SG(step)(SG(state) * s, SG(work) * w, SG(info) * info, const SG(params) * par,
             const SG(options) * opt, const real u[], real h) {
#if SG_DERIVATIVES
    if (w != NULL) {
        w->directions.moves = 0;
    }
#endif
    return sg_take_step(s, w, info, par, opt, u, h);
}
