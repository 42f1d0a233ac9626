#pragma once
#include "sg_linalg.c"
#include "sg_part.h"

/* The linear system of one problem: velocities dx, and bilateral percussions where their rows are
   independent. Vectors stand in elimination order: n_x velocities, then n_border - n_x percussions,
   which are zero where only the velocities are eliminated. */

/* 1 where K has so many rows that they are exchanged only if they must be. */
static inline int sg_is_heavy(const SG(work) * w) {
#if SG_JOINS
    return w->large.drawn;
#else
    (void)w;
    return 0;
#endif
}

/* Factorise K, with `border` up to its bilateral rows if these are independent
   (w->smooth.bordered). Rows are exchanged where pivots on the diagonal are too small or `pivoting`
   says so. Returns 0 if the block of the velocities is singular or not finite. */
static int sg_factor_smooth(SG(work) * w, int problem, int border) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int n_x = pr->n_x;
    int k;
    for (k = 0; k < n_x; ++k) {
        w->smooth.pivot_scale[k] = w->masses.inertia[pr->K.order[k] % sg_n_q(w)];
    }
    w->smooth.bordered = 0;
    w->smooth.exchanged = (w->smooth.pivoting && !sg_is_heavy(w)) || !SG(eliminate)(w, problem, 0);
    if (w->smooth.exchanged) {
        for (k = 0; k < n_x; ++k) {
            w->smooth.pivot_scale[k] =
                SG_C(1.0) / w->masses.root_inertia[pr->K.order[k] % sg_n_q(w)];
        }
        sg_expand(n_x, &pr->K, w->K, w->smooth.full);
        return sg_lu_factor(n_x, w->smooth.full, w->smooth.pivot_scale, w->smooth.perm);
    }
    if (border) {
        /* the answer of a row to its own percussion while all others are absent */
        for (k = n_x; k < pr->n_border; ++k) {
            w->smooth.pivot_scale[k] = SG_C(1.0) / w->scales.r_auto[pr->K.order[k] - n_x];
        }
        w->smooth.bordered = SG(eliminate)(w, problem, 1);
    }
    return 1;
}

/* b := K^-1 b, where b is zero before `first`. */
static void sg_solve_smooth(const SG(work) * w, int problem, int first, real *b) {
    const sg_problem *pr = sg_problem_at(w, problem);
    if (w->smooth.exchanged) {
        sg_lu_solve(pr->n_x, w->smooth.full, w->smooth.perm, b);
    } else if (w->smooth.bordered) {
        SG(substitute)(w, problem, first, b);
    } else {
        sg_sparse_solve(pr->n_x, &pr->K, w->smooth.factors, first, b);
    }
}

/* dx := -r and, with a border, minus the bilateral rows. */
static void sg_smooth_rows(SG(work) * w, const sg_problem *pr) {
    int k;
    for (k = 0; k < pr->n_x; ++k) {
        w->smooth.dx[k] = -w->r[pr->K.order[k]];
    }
    for (k = pr->n_x; k < pr->n_border; ++k) {
        w->smooth.dx[k] = w->smooth.bordered ? -w->y[pr->K.order[k] - pr->n_x] : SG_C(0.0);
    }
}

/* First velocity, in elimination order, that percussion k acts on; n_x if there is none. */
static inline int sg_first_answer(const sg_problem *pr, int k) {
    const int begin = pr->B.start[k];
#if SG_JOINS
    int first = pr->n_x; /* a coupling has them in the order of its own */
    int e;
    for (e = begin; e < pr->B.start[k + 1]; ++e) {
        first = pr->B.index[e] < first ? pr->B.index[e] : first;
    }
    return first;
#else
    return begin < pr->B.start[k + 1] ? pr->B.index[begin] : pr->n_x;
#endif
}

/* How the velocities answer to percussion k and `share` times percussion `tied`, with opposite
   sign. */
static inline void sg_answer(const SG(work) * w, int problem, int k, int tied, real share,
                             real *z) {
    const sg_problem *pr = sg_problem_at(w, problem);
    int first = sg_first_answer(pr, k);
    sg_fill(pr->n_border, SG_C(0.0), z);
    sg_add_row(&pr->B, w->B, k, SG_C(1.0), z);
    if (share != SG_C(0.0)) {
        const int other = sg_first_answer(pr, tied);
        first = other < first ? other : first;
        sg_add_row(&pr->B, w->B, tied, share, z);
    }
    if (first < pr->n_x) {
        sg_solve_smooth(w, problem, first, z);
    }
}
