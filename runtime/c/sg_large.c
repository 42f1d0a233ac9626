#pragma once
#include "sg_assemble.c"
#include "sg_solve.c"

/* Newton's direction in a large island. Every row yields a little to its percussion, which can then
   be eliminated by itself, friction with the normal percussion that presses it. What is left, K
   with the stiffness of the rows, has the pattern of the graph of bodies: its factors grow with the
   bodies, not with the cube of the contacts. Passes in which rows yield from where they were
   before take that back (the proximal point iteration). */

/* 1 if so many percussions act that they are eliminated row by row: none of them presses friction
   of other contacts through a joint, no radius depends on the motion. */
static int sg_is_large(const SG(work) * w, const sg_problem *pr) {
    return w->large.give > SG_C(0.0) ||
           (w->n_members > 1 && w->large.drawn && sg_acting(w, pr) > SG_LARGE);
}

/* How much contact row `row` yields while contacts are soft. */
static inline real sg_give(const SG(work) * w, int row) {
    return row % sg_rows_of_slot(w) < sg_first_normal(w) ? SG_C(0.0)
                                                         : w->large.give / w->scales.r_auto[row];
}

/* Kinematic rows of contacts that are soft. */
static void sg_give_way(SG(work) * w, const sg_problem *pr) {
    int a;
    for (a = 0; a < pr->n_slots * sg_n_R(w) && w->large.give > SG_C(0.0); ++a) {
        w->y[a] += sg_give(w, a) * w->R[pr->R + a];
    }
}

/* ---- rows ------------------------------------------------------------------------------------ */

/* How row `row` that stands for itself follows its kinematics. */
static void sg_yielding_row(SG(work) * w, const sg_problem *pr, int row) {
    const real own =
        SG_SOFTNESS + w->scales.prox_r[row] * (sg_compliance(w, pr->R + row) + sg_give(w, row));
    w->large.inverse[row * SG_N_SLIP] = SG_C(1.0) / own;
    w->large.weight[row * SG_TERMS] = w->scales.prox_r[row] / own;
}

/* The same of friction of contact k with first row f: phi + G dy + N dR_N + A dR = 0. */
static int sg_yielding_friction(SG(work) * w, const sg_problem *pr, int k, int f) {
    const int m = sg_contact_at(w, k)->components;
    const int pressing = sg_pressing(w, f);
    const int pressed = pressing >= 0 && w->rows.kind[f] == SG_ROW_SLIP;
    real A[SG_N_SLIP * SG_N_SLIP], G[SG_N_SLIP * SG_N_SLIP], N[SG_N_SLIP], even[SG_N_SLIP];
    int perm[SG_N_SLIP];
    int d, e, j;
    sg_fill(m, SG_C(0.0), &w->system.dy[f]);
    for (d = 0; d < m; ++d) {
        even[d] = SG_C(1.0);
        N[d] = pressed ? sg_phi_change(w, pr, f + d, w->system.dy, SG_C(0.0), pressing) : SG_C(0.0);
        for (e = 0; e < m; ++e) {
            A[d * m + e] = w->rows.kind[f] == SG_ROW_SLIP
                               ? sg_phi_change(w, pr, f + d, w->system.dy, SG_C(0.0), f + e)
                               : SG_C(0.0);
        }
        A[d * m + d] += SG_SOFTNESS;
    }
    for (e = 0; e < m; ++e) {
        w->system.dy[f + e] = SG_C(1.0);
        for (d = 0; d < m; ++d) {
            G[d * m + e] = sg_phi_change(w, pr, f + d, w->system.dy, SG_C(0.0), -1);
            A[d * m + e] += G[d * m + e] * sg_give(w, f + e);
        }
        w->system.dy[f + e] = SG_C(0.0);
    }
    if (!sg_lu_factor(m, A, even, perm)) {
        return 0;
    }
    for (e = 0; e < m; ++e) {
        real column[SG_N_SLIP];
        sg_fill(m, SG_C(0.0), column);
        column[e] = SG_C(1.0);
        sg_lu_solve(m, A, perm, column);
        for (d = 0; d < m; ++d) {
            w->large.inverse[(f + d) * SG_N_SLIP + e] = column[d];
        }
    }
    for (d = 0; d < m; ++d) {
        const real *inverse = &w->large.inverse[(f + d) * SG_N_SLIP];
        real *weight = &w->large.weight[(f + d) * SG_TERMS];
        w->large.share[f + d] = SG_C(0.0);
        for (j = 0; j < m; ++j) {
            w->large.share[f + d] += inverse[j] * N[j];
        }
        for (e = 0; e < m; ++e) {
            weight[e] = SG_C(0.0);
            for (j = 0; j < m; ++j) {
                weight[e] += inverse[j] * G[j * m + e];
            }
        }
        weight[SG_N_SLIP] =
            pressed ? -w->large.share[f + d] * w->large.weight[pressing * SG_TERMS] : SG_C(0.0);
    }
    return 1;
}

/* All rows: dR = base - sum of weight dy. Returns 0 where friction cannot be told. */
static int sg_yielding_rows(SG(work) * w, const sg_problem *pr) {
    const int n = pr->n_slots * sg_n_R(w);
    int slot, c, k;
    sg_fill(n * SG_TERMS, SG_C(0.0), w->large.weight);
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * sg_n_R(w);
        for (c = 0; c < sg_first_slip(w); ++c) {
            if (w->rows.kind[base + c] != SG_ROW_ZERO) {
                sg_yielding_row(w, pr, base + c);
            }
        }
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const int f = sg_slip_of(w, base, k);
            if (sg_contact_at(w, k)->components > 0 && w->rows.kind[f] != SG_ROW_ZERO &&
                !sg_yielding_friction(w, pr, k, f)) {
                return 0;
            }
        }
    }
    return 1;
}

/* ---- the matrix of the bodies ---------------------------------------------------------------- */

/* w->large.stiff += B (dR/dx) of the rows of member m. */
static void sg_add_stiffness(SG(work) * w, int m, int problem) {
    const SG(element) *e = &w->element[m];
    const sg_kind *kind = sg_member_kind(w, m);
    const sg_problem *own = &kind->problems[problem];
    const sg_problem *pr = sg_problem_at(w, problem);
    const int *position = &w->position[problem * SG_N_BORDER];
    const int n = own->n_x;
    real *block = w->large.block;
    int a, i, j, k, term;
    int touched = 0;
    for (a = 0; a < own->n_slots * kind->n_R; ++a) {
        const int row = sg_table_row(w, m, 0, a);
        if (w->rows.kind[row] == SG_ROW_ZERO) {
            continue;
        }
        if (!touched) {
            sg_fill(n * n, SG_C(0.0), block);
            touched = 1;
        }
        for (term = 0; term < SG_TERMS; ++term) {
            const int other = sg_term_of(kind, a, term);
            const real weight = w->large.weight[row * SG_TERMS + term];
            if (other < 0 || weight == SG_C(0.0)) {
                continue;
            }
            for (i = own->B.start[a]; i < own->B.start[a + 1]; ++i) {
                const real factor = weight * e->B[i];
                real *line = &block[own->B.index[i] * n];
                for (k = own->C.start[other]; k < own->C.start[other + 1]; ++k) {
                    line[own->C.index[k]] -= factor * e->C[k];
                }
            }
        }
    }
    if (!touched) {
        return;
    }
    for (i = 0; i < n; ++i) {
        w->spot[i] = position[sg_unknown_of(w, m, problem, own->K.order[i])];
    }
    for (i = 0; i < n; ++i) {
        for (j = 0; j < n; ++j) {
            if (block[i * n + j] != SG_C(0.0)) {
                w->large.stiff[sg_entry_of(&pr->K, w->spot[i], w->spot[j])] += block[i * n + j];
            }
        }
    }
}

/* Factors of K with the stiffness of the rows. Returns 0 if a pivot is too small. */
static int sg_factor_stiff(SG(work) * w, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    int k, m;
    sg_copy(pr->K.start[pr->n_x], w->K, w->large.stiff);
    for (m = 0; m < w->n_members; ++m) {
        sg_add_stiffness(w, m, problem);
    }
    for (k = 0; k < pr->n_x; ++k) {
        w->smooth.pivot_scale[k] = w->masses.inertia[pr->K.order[k] % sg_n_q(w)];
    }
    return sg_sparse_factor(0, pr->n_x, &pr->K, w->smooth.pivot_scale, SG_SMALL, w->large.stiff,
                            w->smooth.factors, w->smooth.row);
}

/* ---- passes ---------------------------------------------------------------------------------- */

/* What percussions change by while the bodies stay: rows yield from w->large.before. `phi`: 1, or
   0 if the rows are solved. */
static void sg_base_of_rows(SG(work) * w, const sg_problem *pr, real phi) {
    int slot, c, d, e, k;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * sg_n_R(w);
        for (c = 0; c < sg_first_slip(w); ++c) {
            const int a = base + c;
            w->large.base[a] = w->rows.kind[a] == SG_ROW_ZERO
                                   ? -phi * w->R[pr->R + a]
                                   : w->large.inverse[a * SG_N_SLIP] *
                                         (SG_SOFTNESS * w->large.before[a] - phi * w->rows.phi[a]);
        }
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const int f = sg_slip_of(w, base, k);
            const int pressing = sg_contact_at(w, k)->components > 0 ? sg_pressing(w, f) : -1;
            for (d = 0; d < sg_contact_at(w, k)->components; ++d) {
                real sum = SG_C(0.0);
                if (w->rows.kind[f] == SG_ROW_ZERO) {
                    w->large.base[f + d] = -phi * w->R[pr->R + f + d];
                    continue;
                }
                for (e = 0; e < sg_contact_at(w, k)->components; ++e) {
                    sum += w->large.inverse[(f + d) * SG_N_SLIP + e] *
                           (SG_SOFTNESS * w->large.before[f + e] - phi * w->rows.phi[f + e]);
                }
                w->large.base[f + d] =
                    sum -
                    (pressing >= 0 ? w->large.share[f + d] * w->large.base[pressing] : SG_C(0.0));
            }
        }
    }
}

/* One pass: w->smooth.dx and w->newton.dR. Returns by how much the rows are not solved yet, in
   units of their tolerance. */
static real sg_take_pass(SG(work) * w, int problem, real phi) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int n = pr->n_slots * sg_n_R(w);
    real worst = SG_C(0.0);
    int a, k;
    sg_base_of_rows(w, pr, phi);
    for (k = 0; k < pr->n_x; ++k) {
        w->smooth.dx[k] = -phi * w->r[pr->K.order[k]];
    }
    for (a = 0; a < n; ++a) {
        if (w->large.base[a] != SG_C(0.0)) {
            sg_add_row(&pr->B, w->B, a, -w->large.base[a], w->smooth.dx);
        }
    }
    sg_sparse_solve(pr->n_x, &pr->K, w->smooth.factors, 0, w->smooth.dx);
    for (a = 0; a < n; ++a) {
        w->large.dy[a] =
            w->rows.kind[a] == SG_ROW_ZERO ? SG_C(0.0) : sg_row_dot(&pr->C, w->C, a, w->smooth.dx);
    }
    for (a = 0; a < n; ++a) {
        real change = w->large.base[a];
        int term;
        for (term = 0; term < SG_TERMS && w->rows.kind[a] != SG_ROW_ZERO; ++term) {
            const int other = sg_term_of(sg_kind_of(w), a, term);
            if (other >= 0) {
                change -= w->large.weight[a * SG_TERMS + term] * w->large.dy[other];
            }
        }
        w->newton.dR[a] = change;
        if (w->rows.kind[a] != SG_ROW_ZERO) {
            worst = sg_max(worst, SG_SOFTNESS * SG_FABS(change - w->large.before[a]) *
                                      w->scales.phi_inverse[a]);
        }
    }
    return sg_all_finite(pr->n_x, w->smooth.dx) && sg_all_finite(n, w->newton.dR) ? worst : SG_HUGE;
}

/* Passes until the rows are solved as the tolerance asks. Returns 0 if they get no nearer: rows
   that depend on each other contradict each other. */
static int sg_take_passes(SG(work) * w, int problem, real phi) {
    const int n = sg_problem_at(w, problem)->n_slots * sg_n_R(w);
    real before = SG_HUGE;
    int pass;
    for (pass = 0; pass < SG_PASSES; ++pass) {
        const real left = sg_take_pass(w, problem, phi);
        if (left <= SG_NEAR_ENOUGH) {
            return 1;
        }
        if (!(left < SG_C(0.5) * before)) {
            return 0;
        }
        before = left;
        sg_copy(n, w->newton.dR, w->large.before);
    }
    return 0;
}

/* One Newton direction in w->smooth.dx, w->newton.dR, in which rows that contradict each other
   yield. Returns 0 if there is none. */
static int sg_large_direction(SG(work) * w, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int n = pr->n_slots * sg_n_R(w);
    if (!sg_yielding_rows(w, pr) || !sg_factor_stiff(w, problem)) {
        return 0;
    }
    sg_fill(n, SG_C(0.0), w->large.before);
    if (sg_take_passes(w, problem, SG_C(1.0))) {
        return 1;
    }
    sg_fill(n, SG_C(0.0), w->large.before);
    return sg_take_pass(w, problem, SG_C(1.0)) < SG_HUGE;
}

/* Direction from percussions that solve the problem to those of least norm that do. Returns 0 if
   there is none, or if they are the same. */
static int sg_large_least(SG(work) * w, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int n = pr->n_slots * sg_n_R(w);
    real apart = SG_C(0.0);
    int a;
    if (!sg_yielding_rows(w, pr) || !sg_factor_stiff(w, problem)) {
        return 0;
    }
    for (a = 0; a < n; ++a) {
        w->large.before[a] = -w->R[pr->R + a];
    }
    if (!sg_take_passes(w, problem, SG_C(0.0))) {
        return 0;
    }
    for (a = 0; a < n; ++a) {
        apart = sg_max(apart, SG_FABS(w->newton.dR[a]) * w->scales.phi_inverse[a]);
    }
    return apart > SG_C(1.0);
}

/* Newton's method with soft contacts, searching along its directions; they become harder and
   harder, so that the states of many contacts are found one after the other: less at a time where
   it does not arrive. Then from there. */
static int sg_harden(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                     SG(report) * info, int problem, int end, real *measure) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int n_rows = pr->n_slots * sg_n_R(w);
    real share = SG_HARDER;
    real soft = SG_C(1.0) / SG_HARDER; /* nothing has been found yet */
    while (soft > SG_HARD && share < SG_HARDER_AT_LEAST && info->iterations < end) {
        w->large.give = soft * share;
        if (sg_newton(w, par, opt, problem, sg_budget(info, end, SG_SOFTLY), 1, &info->iterations,
                      measure) == SG_K(OK)) {
            soft = w->large.give;
            share = sg_max(SG_HARDER, share * share);
            sg_copy(pr->n_x, &w->x[pr->x], w->large.x_soft);
            sg_copy(n_rows, &w->R[pr->R], w->large.R_soft);
        } else if (soft > SG_C(1.0)) {
            break;
        } else {
            share = SG_SQRT(share);
            sg_copy(pr->n_x, w->large.x_soft, &w->x[pr->x]);
            sg_copy(n_rows, w->large.R_soft, &w->R[pr->R]);
        }
    }
    w->large.give = SG_C(0.0);
    return sg_land(w, par, opt, info, problem, SG_HELD, end, measure);
}
