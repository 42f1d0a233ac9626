#pragma once
#include "sg_modes.c"

/* Dense output of a segment: positions by the polynomial of degree s + 1 through Q^1 ... Q^s with
   the velocities at both ends; velocities by its derivative or, where the velocities of the stages
   are known, by the polynomial through these, so that what sticks there sticks. */

/* Keep what the output needs of the segment just solved. */
static void sg_keep_dense(SG(work) * w, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    int i;
    sg_copy(sg_n_q(w), w->trial.q, w->segment.q);
    sg_copy(sg_n_q(w), w->trial.v, w->segment.v);
    sg_copy(sg_n_q(w), w->v_end, w->segment.v_end);
    sg_copy(SG_N_DENSE * sg_n_q(w), w->Q, w->segment.Q);
    if (problem == SG_SEGMENT) {
        sg_copy(sg_n_q(w), w->trial.v, w->segment.U);
        for (i = 1; i < SG_N_DENSE; ++i) {
            sg_copy(sg_n_q(w), &w->x[pr->x + (SG_N_DENSE - 1 + i) * sg_n_q(w)],
                    &w->segment.U[i * sg_n_q(w)]);
        }
    }
}

/* Value of a polynomial of degree n - 1, and its derivative. */
static real sg_polynomial(int n, const real *c, real x, real *slope) {
    real value = SG_C(0.0);
    int k;
    *slope = SG_C(0.0);
    for (k = n - 1; k >= 0; --k) {
        *slope = *slope * x + value;
        value = value * x + c[k];
    }
    return value;
}

/* q and v at the share x of the segment. */
static void sg_dense(const SG(work) * w, real x, real q[], real v[]) {
    const real span = w->segment.span;
    const int order = SG_N_DENSE + 2;
    int i, j;
    sg_copy(sg_n_q(w), w->segment.q, q);
    sg_fill(sg_n_q(w), SG_C(0.0), v);
    for (i = 1; i < SG_N_DENSE; ++i) {
        real slope;
        const real value = sg_polynomial(order, sg_dense_q[i], x, &slope);
        for (j = 0; j < sg_n_q(w); ++j) {
            const real way = w->segment.Q[i * sg_n_q(w) + j] - w->segment.q[j];
            q[j] += value * way;
            v[j] += slope * way / span;
        }
    }
    for (i = 0; i < 2; ++i) {
        const real *rate = i == 0 ? w->segment.v : w->segment.v_end;
        real slope;
        const real value = sg_polynomial(order, sg_dense_q[SG_N_DENSE + i], x, &slope);
        for (j = 0; j < sg_n_q(w); ++j) {
            q[j] += span * value * rate[j];
            v[j] += slope * rate[j];
        }
    }
    if (w->segment.rubs) {
        sg_fill(sg_n_q(w), SG_C(0.0), v);
        for (i = 0; i < SG_N_DENSE; ++i) {
            real slope;
            const real value = sg_polynomial(SG_N_DENSE, sg_dense_v[i], x, &slope);
            for (j = 0; j < sg_n_q(w); ++j) {
                v[j] += value * w->segment.U[i * sg_n_q(w) + j];
            }
        }
    }
}

/* Look at the share x of the segment. */
static void sg_look_along(SG(work) * w, const SG(params) * par, real x) {
    sg_dense(w, x, w->look_q, w->look_v);
    w->look_t = w->segment.t + x * w->segment.span;
    SG(watch)(w, par);
}
