#pragma once
#include "sg_scale.c"
#include "sg_system.c"

/* Semismooth Newton method for one nonlinear problem of the scheme: smooth rows r(x, R) = 0 (R
   enters linearly), bilateral rows y(x) = 0, contact rows as prox equations (64). */

#if SG_JOINS
/* Directions where many percussions act (sg_large.c). */
static int sg_is_large(const SG(work) * w, const sg_problem *pr);
static int sg_large_direction(SG(work) * w, int problem);
static int sg_large_least(SG(work) * w, int problem);
static void sg_give_way(SG(work) * w, const sg_problem *pr);
#endif

/* Residual of a percussion row: of its kinematics, in units of percussion, while it is free. */
static inline real sg_row_residual(const SG(work) * w, int i) {
    return w->rows.kind[i] == SG_ROW_FREE ? w->scales.r_auto[i] * SG_FABS(w->y[i])
                                          : SG_FABS(w->rows.phi[i]);
}

/* Residual in units of its tolerance: at most 1 means solved. Not finite values give SG_HUGE. */
static real sg_residual(const SG(work) * w, const SG(options) * opt, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int n_rows = pr->n_slots * sg_n_R(w);
    const int relative = opt->scaling != SG_K(SCALING_NONE);
    const real tol = sg_max(opt->tol, SG_C(16.0) * SG_EPS);
    real sum = SG_C(0.0);
    real worst = SG_C(0.0);
    int i, j;
    for (i = 0; i < pr->n_x; i += sg_n_q(w)) {
        for (j = 0; j < sg_n_q(w); ++j) {
            const real size = SG_FABS(w->r[i + j]);
            sum += size;
            worst = sg_max(worst, relative ? size * w->scales.momentum_inverse[j] : size);
        }
    }
    worst /= relative ? tol : opt->tol;
    for (i = 0; i < n_rows; ++i) {
        const real own = SG_FABS(w->rows.phi[i]);
        sum += own;
        if (own > SG_C(0.0)) {
            worst = sg_max(worst, relative ? sg_row_residual(w, i) * w->scales.phi_inverse[i]
                                           : own / opt->tol);
        }
    }
    return sg_finite(sum) && worst < SG_HUGE ? worst : SG_HUGE;
}

/* Sum of squares of the residual in units of the scales. `stall` receives the residual in units of
   what an iteration may keep that gets no further. */
static real sg_merit(const SG(work) * w, int problem, real *stall) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int n_rows = pr->n_slots * sg_n_R(w);
    real sum = SG_C(0.0);
    real kept = SG_C(0.0);
    int i;
    for (i = 0; i < pr->n_x; ++i) {
        const real size = SG_FABS(w->r[i]);
        if (size > SG_C(0.0)) {
            const real share = size * w->scales.momentum_inverse[i % sg_n_q(w)];
            kept = sg_max(kept, share / SG_STAGNATION);
            sum += share * share;
        }
    }
    for (i = 0; i < n_rows; ++i) {
        const real scale = sg_max(
            w->scales.percussion_scale[i % sg_rows_of_slot(w)] + w->scales.phi_floor[i], SG_TINY);
        const real size = sg_row_residual(w, i);
        if (SG_FABS(w->rows.phi[i]) > SG_C(0.0)) {
            kept = sg_max(kept, size / (SG_STAGNATION * scale + SG_BAND * w->scales.rounding[i]));
            sum += (size / scale) * (size / scale);
        }
    }
    *stall = kept;
    return sum < SG_HUGE ? sum : SG_HUGE;
}

/* One Newton direction in w->smooth.dx, w->newton.dR. Returns the rank deficiency or -1. `soft`:
   where dependent contact rows contradict each other (one contact sticks, another wants to move
   it), a small compliance lets their percussions grow until one of them gives way. */
static int sg_newton_direction(SG(work) * w, const SG(options) * opt, int problem, int soft) {
    const sg_problem *pr = sg_problem_at(w, problem);
    int n, rank, a;
    w->system.determined = -1;
#if SG_JOINS
    if (sg_is_large(w, pr) && sg_large_direction(w, problem)) {
        return 0;
    }
#endif
    n = sg_reduce(w, problem, w->system.deficiency == 0);
    w->system.left = n;
    w->system.rank = -1;
    if (n <= 0 && (n < 0 || w->smooth.bordered)) {
        sg_expand_direction(w, pr, 0);
        w->system.determined = n == 0 ? sg_state_of(w, pr) : -1;
        return n;
    }
    if (w->system.deficiency == 0 && sg_solve_regular(w, n)) {
        sg_expand_direction(w, pr, n);
        w->system.determined = sg_state_of(w, pr);
        return 0;
    }
    if (w->system.condensed) {
        n = sg_reduce(w, problem, 0);
        if (n < 0) {
            return n;
        }
    }
    rank = sg_cod_factor(n, w->system.S, w->system.perm, w->system.tau, w->system.tau_z);
    w->system.left = n;
    w->system.rank = rank;
    w->system.determined = rank == n ? sg_state_of(w, pr) : -1;
    sg_cod_solve(n, rank, w->system.S, w->system.perm, w->system.tau, w->system.tau_z,
                 w->system.rhs, w->system.scratch, w->system.solution);
    if (soft && rank < n && sg_is_contradictory(w, opt, n, rank)) {
        sg_percussion_system(w, pr, n);
        for (a = 0; a < n; ++a) {
            if (w->system.reduced[a] % sg_rows_of_slot(w) >= sg_first_normal(w)) {
                w->system.S[a * n + a] += SG_SOFTNESS;
            }
        }
        rank = sg_cod_factor(n, w->system.S, w->system.perm, w->system.tau, w->system.tau_z);
        sg_cod_solve(n, rank, w->system.S, w->system.perm, w->system.tau, w->system.tau_z,
                     w->system.rhs, w->system.scratch, w->system.solution);
    }
    sg_expand_direction(w, pr, n);
    return n - rank;
}

/* Rows of a problem at the unknowns; in an expansion with the percussions that are given. */
static inline void sg_rows_at(SG(work) * w, const SG(params) * par, int problem) {
    SG(values)(w, par, problem);
#if SG_JOINS
    sg_give_way(w, sg_problem_at(w, problem));
#endif
#if SG_N_EXPANDED > 0
    if (w->expansion.expands) {
        int i;
        for (i = 0; i < sg_n_q(w); ++i) {
            w->r[i] += w->expansion.momentum[i];
        }
    }
#endif
}

static inline void sg_evaluate(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                               int problem) {
    sg_rows_at(w, par, problem);
    sg_row_scales(w, opt, problem);
#if SG_LOCATED
    if (w->segment.held) {
        sg_held_rows(w, sg_problem_at(w, problem));
        return;
    }
#endif
    sg_contact_rows(w, problem);
}

/* Move along the Newton direction by the factor alpha from (x_old, lambda_old). */
static void sg_move(SG(work) * w, int problem, real alpha) {
    const sg_problem *pr = sg_problem_at(w, problem);
    int i;
    for (i = 0; i < pr->n_x; ++i) {
        const int unknown = pr->K.order[i];
        w->x[pr->x + unknown] = w->newton.x_old[unknown] + alpha * w->smooth.dx[i];
    }
    for (i = 0; i < pr->n_slots * sg_n_R(w); ++i) {
        w->R[pr->R + i] = w->newton.R_old[i] + alpha * w->newton.dR[i];
    }
}

/* Take the whole Newton direction. */
static inline void sg_advance(SG(work) * w, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const sg_index *order = pr->K.order;
    int i;
    for (i = 0; i < pr->n_x; ++i) {
        w->x[pr->x + order[i]] += w->smooth.dx[i];
    }
    for (i = 0; i < pr->n_slots * sg_n_R(w); ++i) {
        w->R[pr->R + i] += w->newton.dR[i];
    }
}

/* Solution of an iteration that gets no further: its nearest point, if that may be kept. The last
   attempt asks what the checker asks; for stages, whose response the checker's units do not know,
   at its end four times that, since there the checker alone can say. */
static int sg_keep_nearest(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                           int problem, int ends, real nearest, real *measure) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const real rough = ends && pr->gap_slots > 0 ? SG_C(4.0) : SG_C(1.0);
    if (nearest >
            (w->newton.mode == SG_LAST_RESORT ? rough * SG_CHECK / SG_STAGNATION : SG_C(1.0)) ||
        opt->scaling == SG_K(SCALING_NONE)) {
        return 0;
    }
    sg_copy(pr->n_x, w->newton.x_best, &w->x[pr->x]);
    sg_copy(pr->n_slots * sg_n_R(w), w->newton.R_best, &w->R[pr->R]);
    sg_evaluate(w, par, opt, problem);
    *measure = sg_residual(w, opt, problem);
    return 1;
}

/* Contact states and residuals of the last four iterations. */
typedef struct {
    unsigned long states[SG_CYCLE];
    real measure[SG_CYCLE];
} sg_past;

/* 1 if the contact states of this iteration were those of one of the last but the very last, and
   the residual has not become half as large since; keeps them. */
static int sg_goes_round(sg_past *past, int iteration, unsigned long now, real measure) {
    int found = 0;
    int i;
    for (i = 2; i <= SG_CYCLE; ++i) {
        const int then = (iteration + SG_CYCLE - i) % SG_CYCLE;
        if (iteration >= i && past->states[then] == now &&
            measure > SG_C(0.5) * past->measure[then]) {
            found = 1;
        }
    }
    past->states[iteration % SG_CYCLE] = now;
    past->measure[iteration % SG_CYCLE] = measure;
    return found;
}

/* Evaluate the point that the unknowns have been moved to; returns its residual. */
static inline real sg_measure(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                              int problem) {
    sg_evaluate(w, par, opt, problem);
    return sg_residual(w, opt, problem);
}

/* Search along the direction from a point with the merit `start`: halve the step until the merit
   falls, at worst take the best of all. Returns the residual there. */
static real sg_search(SG(work) * w, const SG(params) * par, const SG(options) * opt, int problem,
                      real start) {
    const sg_problem *pr = sg_problem_at(w, problem);
    real best = SG_HUGE;
    real best_alpha = SG_C(1.0);
    real alpha = SG_C(1.0);
    int halving;
    sg_copy(pr->n_x, &w->x[pr->x], w->newton.x_old);
    sg_copy(pr->n_slots * sg_n_R(w), &w->R[pr->R], w->newton.R_old);
    for (halving = 0; halving < SG_SEARCHES; ++halving) {
        real measure, merit, stall;
        sg_move(w, problem, alpha);
        measure = sg_measure(w, par, opt, problem);
        merit = sg_merit(w, problem, &stall);
        if (measure < SG_HUGE && merit < best) {
            best = merit;
            best_alpha = alpha;
        }
        if (merit <= (SG_C(1.0) - SG_DESCENT * alpha) * start) {
            return measure;
        }
        alpha *= SG_C(0.5);
    }
    sg_move(w, problem, best_alpha);
    return sg_measure(w, par, opt, problem);
}

/* Iterate from the point in work.x, work.R. `search`: search along each direction from the start;
   otherwise only after the contact states went round in a cycle. Adds the iterations to
   *iterations; on success *measure is the residual in units of its tolerance. */
static int sg_newton(SG(work) * w, const SG(params) * par, const SG(options) * opt, int problem,
                     int max_iterations, int search, int *iterations, real *measure) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int n_rows = pr->n_slots * sg_n_R(w);
    const int before = *iterations;
    sg_past past;
    real nearest = SG_HUGE;
    int damped = search;
    int iteration = 0;
    *measure = sg_measure(w, par, opt, problem);
    w->system.deficiency = 0;
    w->system.determined = -1;
    for (;;) {
        real merit = SG_HUGE;
        real stall = SG_HUGE;
        int nearer; /* whether this point is clearly the nearest so far */
        int deficiency;
        if (!(*measure < SG_HUGE)) {
            return SG_K(NONFINITE);
        }
        if (*measure <= SG_C(1.0)) {
            return SG_K(OK);
        }
        if (iteration > 0 || damped || w->newton.mode >= SG_LATER_ATTEMPT) {
            merit = sg_merit(w, problem, &stall);
        }
        nearer = stall < SG_CLEARLY * nearest;
        if (stall < nearest) {
            nearest = stall;
            sg_copy(pr->n_x, &w->x[pr->x], w->newton.x_best);
            sg_copy(n_rows, &w->R[pr->R], w->newton.R_best);
        }
        /* Stalled at the level of round-off, or going round there. */
        if (((iteration >= 3 && !nearer) || iteration >= max_iterations) &&
            sg_keep_nearest(w, par, opt, problem, iteration >= max_iterations, nearest, measure)) {
            return SG_K(OK);
        }
        if (iteration >= max_iterations) {
            return SG_K(NOT_CONVERGED);
        }
        damped |= sg_goes_round(&past, iteration, sg_fingerprint(w, n_rows), *measure);
        SG(derivatives)(w, par, problem);
        deficiency = sg_newton_direction(w, opt, problem, damped);
        *iterations = before + iteration + 1;
        if (deficiency < 0) {
            return sg_all_finite(pr->K.start[pr->n_x], w->K) ? SG_K(SINGULAR) : SG_K(NONFINITE);
        }
        w->system.deficiency = deficiency;
        if (damped) {
            *measure = sg_search(w, par, opt, problem, merit);
        } else {
            sg_advance(w, problem);
            *measure = sg_measure(w, par, opt, problem);
        }
        ++iteration;
    }
}
