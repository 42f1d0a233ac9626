#pragma once
#include "sg_directions.c"

/* Derivatives of a captured step: those of its map, in the contact states in which it was solved.
 */

/* The scratch changes along direction j by h in the size of the (sub)step; unknowns of the problems
   before `problem` change as was found, with all that follows from them. */
static void sg_turn_along(SG(work) * w, const SG(params) * par, int j, real h, int problem) {
    const SG(directions) *d = &w->directions;
    int p;
    sg_turn_to(w, par, j, h);
    sg_copy(SG_N_X_KEPT, &d->x[j * SG_N_X_KEPT], w->forward.x);
    sg_copy(SG_N_ROWS_KEPT, &d->R[j * SG_N_ROWS_KEPT], w->forward.R);
    for (p = 0; p < problem; ++p) {
        SG(values_forward)(w, par, p);
    }
}

/* Changes of the unknowns of a solved problem. `share`: of the rest of the step, by this one. */
static void sg_forward_problem(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                               int problem, real share) {
    SG(directions) *d = &w->directions;
    const sg_problem *pr = sg_problem_at(w, problem);
    int j, k, slot;
    sg_prox_parameters(w, opt, problem);
    sg_evaluate(w, par, opt, problem);
    for (slot = 0; slot < pr->n_slots; ++slot) {
        for (k = 0; k < sg_n_contacts(w); ++k) {
            if (!sg_is_sharp(w, pr, slot, k)) {
                sg_lose(w, SG_ON_EDGE, k);
            }
        }
    }
    SG(derivatives)(w, par, problem);
    for (j = 0; j < d->count; ++j) {
        sg_turn_along(w, par, j, share * (d->grid[j] - d->t[j]), problem);
        sg_solve_forward(w, par, opt, problem, j);
        sg_copy(pr->n_x, &w->forward.x[pr->x], &d->x[j * SG_N_X_KEPT + pr->x]);
        sg_copy(pr->n_slots * sg_n_R(w), &w->forward.R[pr->R], &d->R[j * SG_N_ROWS_KEPT + pr->R]);
    }
}

/* How the end of the (sub)step just solved changes; it takes `share` of what is left of the step.
 */
static void sg_forward_captured(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                                real share) {
    SG(directions) *d = &w->directions;
    int problem, j;
#if SG_LOCATED
    if (opt->events == SG_K(EVENTS_LOCATED)) {
        return; /* a rest that had to be captured is said to have no derivative */
    }
#endif
    d->now = w->t;
    sg_fill(d->count * SG_N_X_KEPT, SG_C(0.0), d->x);
    sg_fill(d->count * SG_N_ROWS_KEPT, SG_C(0.0), d->R);
    for (problem = 0; problem < SG_N_CHAIN; ++problem) {
        sg_forward_problem(w, par, opt, problem, share);
    }
    for (j = 0; j < d->count; ++j) {
        const real longer = share * (d->grid[j] - d->t[j]);
        sg_turn_along(w, par, j, longer, SG_N_CHAIN);
        SG(finish_forward)(w);
        sg_copy(sg_n_q(w), w->forward.q_end, &d->q[j * sg_n_q(w)]);
        sg_copy(sg_n_q(w), w->forward.v_end, &d->v[j * sg_n_q(w)]);
        d->t[j] += longer;
    }
}
