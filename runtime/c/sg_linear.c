#pragma once
#include "sg_newton.c"

/* One problem linearised at the current point and reduced to its percussions: y = y_0 + S R. Paths
   of both kinds lead to its solution. */

/* Linearise at the current point: w->smooth.dx, w->system.Z, the responses w->system.S[b * n + a] =
   dy_a/dlambda_b and w->linear.y_0, the kinematic rows without any percussion. Returns 0 if the
   smooth block is singular, or if there is no room. */
static int sg_linearise(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                        int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int n = pr->n_slots * sg_n_R(w);
    const real *R = &w->R[pr->R];
    int a, b;
    if (!sg_have_room(n)) {
        return 0;
    }
    sg_evaluate(w, par, opt, problem);
    SG(derivatives)(w, par, problem);
    if (!sg_factor_smooth(w, problem, 0)) {
        return 0;
    }
    sg_smooth_rows(w, pr);
    sg_solve_smooth(w, problem, 0, w->smooth.dx);
    for (b = 0; b < n; ++b) {
        sg_answer(w, problem, b, b, SG_C(0.0), &w->system.Z[b * pr->n_border]);
    }
    for (a = 0; a < n; ++a) {
        w->linear.y_0[a] = w->y[a] + sg_row_dot(&pr->C, w->C, a, w->smooth.dx);
        for (b = 0; b < n; ++b) {
            w->system.S[b * n + a] = -sg_row_dot(&pr->C, w->C, a, &w->system.Z[b * pr->n_border]) +
                                     (a == b ? sg_compliance(w, pr->R + a) : SG_C(0.0));
            w->linear.y_0[a] -= w->system.S[b * n + a] * R[b];
        }
    }
    return 1;
}

/* Compliance of a row: where rows are dependent their percussions grow until one gives way. */
static real sg_softness(const SG(work) * w, int n, int row) {
    return SG_GIVE * SG_FABS(w->system.S[row * (n + 1)]);
}

/* Kinematic rows y = constant + S R, with their compliance. */
static void sg_linear_rows(const SG(work) * w, int n, const real *R, real *y) {
    int a, b;
    for (a = 0; a < n; ++a) {
        y[a] += sg_softness(w, n, a) * R[a];
    }
    for (b = 0; b < n; ++b) {
        for (a = 0; a < n && R[b] != SG_C(0.0); ++a) {
            y[a] += w->system.S[b * n + a] * R[b];
        }
    }
}

/* Move the unknowns to the percussions R in the linearised problem. Returns 0 if they are not
   finite there. */
static int sg_arrive(SG(work) * w, const sg_problem *pr, const real *to) {
    const int n = pr->n_slots * sg_n_R(w);
    real *R = &w->R[pr->R];
    int a, i;
    for (a = 0; a < n; ++a) {
        const real step = to[a] - R[a];
        R[a] = to[a];
        for (i = 0; i < pr->n_x; ++i) {
            w->smooth.dx[i] -= w->system.Z[a * pr->n_border + i] * step;
        }
    }
    for (i = 0; i < pr->n_x; ++i) {
        w->x[pr->x + pr->K.order[i]] += w->smooth.dx[i];
    }
    return sg_all_finite(pr->n_x, &w->x[pr->x]) && sg_all_finite(n, R);
}
