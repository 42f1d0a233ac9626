#pragma once
#include "sg_forward.h"
#include "sg_step.c"

/* How the solution of one problem changes along a direction: the implicit function theorem at the
   point where the iteration has ended. */

/* Why there is no derivative. */
enum {
    SG_KNOWN,
    SG_CAPTURED_STEP,
    SG_GRAZES,
    SG_TOGETHER,
    SG_RESTED,
    SG_ON_EDGE,
    SG_IS_SINGULAR,
    SG_OF_MAP
};

static void sg_lose(SG(work) * w, int why, int k) {
    if (w->directions.lost == SG_KNOWN) {
        w->directions.lost = why;
        w->directions.contact = k;
        w->directions.at = w->directions.now;
    }
}

/* 1 if a small change of the data leaves every row of contact k in a slot of a solved problem in
   its kind. */
static int sg_is_sharp(const SG(work) * w, const sg_problem *pr, int slot, int k) {
    const sg_contact *contact = sg_contact_at(w, k);
    const int base = slot * sg_n_R(w);
    const int n = sg_first_normal(w) + contact->pressing;
    const int f = sg_first_slip(w) + contact->friction;
    const real *R = &w->R[pr->R + base];
    const int takes_part = pr->follows ? w->found.active[k] : w->found.exists[k];
    if (contact->pressing < 0 || !takes_part) {
        return 1;
    }
    if (w->rows.kind[base + n] == SG_ROW_ZERO) {
        const real time = sg_is_gap(w, pr, slot, n) ? w->h : SG_C(1.0);
        return SG_FABS(w->y[base + n]) > SG_TOUCH * time * w->scales.speed[n];
    }
    if (!(R[n] > SG_TOUCH * w->scales.percussion_scale[n])) {
        return 0;
    }
    return contact->components == 0 || w->rows.kind[base + f] != SG_ROW_FREE ||
           !(w->mu[k] > SG_C(0.0)) ||
           sg_friction_size(w, k, &R[f]) < w->mu[k] * R[n] * (SG_C(1.0) - SG_TOUCH);
}

/* The scratch changes along direction j, from the place at hand, by h in the size of what is solved
   from there. */
static void sg_turn_to(SG(work) * w, const SG(params) * par, int j, real h) {
    const SG(directions) *d = &w->directions;
    w->forward.t = d->t[j];
    w->forward.h = h;
    sg_copy(sg_n_q(w), &d->q[j * sg_n_q(w)], w->forward.q);
    sg_copy(sg_n_q(w), &d->v[j * sg_n_q(w)], w->forward.v);
    sg_copy(SG_N_U, &d->u[j * SG_N_U], w->forward.u);
    SG(change_parameters)(w, &d->par[j * SG_N_PAR]);
    SG(start_forward)(w, par);
}

/* Change of the residual of percussion row i where unknowns stay. */
static real sg_row_forward(const SG(work) * w, const sg_problem *pr, int i) {
    const SG(forward) *f = &w->forward;
    const int c = i % sg_rows_of_slot(w) - sg_first_slip(w);
    real radius = SG_C(0.0);
    if (w->rows.kind[i] == SG_ROW_ZERO) {
        return SG_C(0.0);
    }
    if (c < 0 || w->rows.kind[i] == SG_ROW_FREE) {
        return w->scales.prox_r[i] * f->y[i];
    }
    if (sg_contact_at(w, sg_slip_at(w, c)->contact)->pressing >= 0) {
        const int slot = i / sg_rows_of_slot(w);
        const int n = sg_first_normal(w) + sg_contact_at(w, sg_slip_at(w, c)->contact)->pressing;
        radius = f->mu[sg_slip_at(w, c)->contact] * w->R[pr->R + slot * sg_n_R(w) + n];
    } else {
        radius = f->radius[i / sg_rows_of_slot(w) * sg_n_bounds(w) +
                           sg_contact_at(w, sg_slip_at(w, c)->contact)->bound];
    }
    return w->rows.slip[i] * radius + sg_phi_change(w, pr, i, f->y, SG_C(0.0), -1);
}

/* The direction for other residuals of the problem whose system was solved last. */
static void sg_solve_again(SG(work) * w, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int n = w->system.left;
    int a;
    sg_smooth_rows(w, pr);
    sg_fill(pr->n_slots * sg_n_R(w), SG_C(0.0), w->newton.dR);
    for (a = 0; a < n; ++a) {
        const int follower = w->system.follower[w->system.reduced[a]];
        if (follower >= 0) {
            sg_leave(w, pr, follower, w->rows.phi[follower]);
        }
    }
    sg_solve_smooth(w, problem, 0, w->smooth.dx);
    for (a = 0; a < n; ++a) {
        sg_right_side(w, pr, a);
        w->system.solution[a] = w->system.rhs[a];
    }
    if (w->system.rank >= 0) {
        sg_cod_solve(n, w->system.rank, w->system.S, w->system.perm, w->system.tau, w->system.tau_z,
                     w->system.rhs, w->system.scratch, w->system.solution);
    } else if (n == 1) {
        w->system.solution[0] = w->system.rhs[0] / w->system.S[0];
    } else if (n > 1) {
        sg_lu_solve(n, w->system.LU, w->system.perm, w->system.solution);
    }
    sg_expand_direction(w, pr, n);
}

/* Changes of the rows of a problem along the direction at hand where its unknowns stay. */
static void sg_ask_forward(SG(work) * w, const SG(params) * par, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    sg_fill(pr->n_x, SG_C(0.0), &w->forward.x[pr->x]);
    sg_fill(pr->n_slots * sg_n_R(w), SG_C(0.0), &w->forward.R[pr->R]);
    SG(values_forward)(w, par, problem);
}

/* Changes of the unknowns that make up for them, for direction j; the solution stands in the work
   struct with its derivatives. For the first direction the system is factorised. */
static void sg_answer_forward(SG(work) * w, const SG(options) * opt, int problem, int j) {
    const sg_problem *pr = sg_problem_at(w, problem);
    SG(forward) *f = &w->forward;
    const int n_rows = pr->n_slots * sg_n_R(w);
    int i;
    sg_copy(pr->n_x, f->r, w->r);
    sg_copy(n_rows, f->y, w->y);
    for (i = 0; i < n_rows; ++i) {
        w->rows.phi[i] = sg_row_forward(w, pr, i);
    }
    if (j > 0) {
        sg_solve_again(w, problem);
    } else {
        w->system.deficiency = 0;
        if (sg_newton_direction(w, opt, problem, 0) < 0) {
            sg_lose(w, SG_IS_SINGULAR, -1);
            w->system.left = 0;
        }
    }
    for (i = 0; i < pr->n_x; ++i) {
        f->x[pr->x + pr->K.order[i]] = w->smooth.dx[i];
    }
    sg_copy(n_rows, w->newton.dR, &f->R[pr->R]);
}

static void sg_solve_forward(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                             int problem, int j) {
    sg_ask_forward(w, par, problem);
    sg_answer_forward(w, opt, problem, j);
}
