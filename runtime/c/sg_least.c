#pragma once
#include "sg_settle.c"

/* Which percussions a step gets where dependent rows leave them open: those of least scaled norm
   in the closure of the present contact state, in which contacts press, sticking friction stays in
   its cone and sliding friction on the cone's boundary, against the same slip. */

/* Position of percussion `row` in the reduced system, not before `a`. */
static int sg_position(const SG(work) * w, int a, int row) {
    int at = a;
    while (w->system.reduced[at] != row) {
        ++at;
    }
    return at;
}

/* 1 if friction of contact k sticks in the slot with first row `base`. */
static int sg_is_sticking(const SG(work) * w, int base, int k) {
    return sg_contact_at(w, k)->components > 0 &&
           w->rows.kind[sg_slip_of(w, base, k)] == SG_ROW_FREE;
}

/* Slope of the cone of contact k in scaled percussions, where it is round: the normal percussion
   stands at a, friction at b. */
static real sg_slope(const SG(work) * w, int k, int a, int b) {
    return w->mu[k] * w->system.root_scale[a] /
           sg_over_axis(w, sg_contact_at(w, k)->friction, w->system.root_scale[b]);
}

/* The normal percussion at a, of contact k, and all sticking friction that it presses: to the
   nearest ones of which each lies in its cone. The normal percussion p is where
   p - p_0 = sum mu_i max(0, |f_i| - mu_i p), concave on the right, so that Newton's iteration
   rises to it; each friction is cut at mu_i p. */
static void sg_nearest_of_contact(const SG(work) * w, int base, int k, int a, real *z) {
    const real given = z[a];
    real push = given;
    int rises = 1;
    int d, i;
    while (rises) {
        real weight = SG_C(1.0);
        real pushed = given;
        for (i = k; i >= 0; i = sg_contact_at(w, i)->next) {
            if (sg_is_sticking(w, base, i)) {
                const int b = sg_position(w, a, sg_slip_of(w, base, i));
                const real mu = sg_slope(w, i, a, b);
                const real size = sg_norm(sg_contact_at(w, i)->components, &z[b]);
                if (size > mu * push) {
                    weight += mu * mu;
                    pushed += mu * size;
                }
            }
        }
        rises = pushed / weight > push;
        push = rises ? pushed / weight : push;
    }
    z[a] = sg_max(push, SG_C(0.0));
    for (i = k; i >= 0; i = sg_contact_at(w, i)->next) {
        if (sg_is_sticking(w, base, i)) {
            const int b = sg_position(w, a, sg_slip_of(w, base, i));
            const real most = sg_slope(w, i, a, b) * z[a];
            const real size = sg_norm(sg_contact_at(w, i)->components, &z[b]);
            for (d = 0; d < sg_contact_at(w, i)->components && size > most; ++d) {
                z[b + d] *= most / size;
            }
        }
    }
}

/* Move scaled percussions to the nearest ones within their cones. */
static void sg_nearest_in_cones(const SG(work) * w, const sg_problem *pr, real *z) {
    int a = 0; /* position in the reduced system, in the order in which sg_reduce fills it */
    int slot, c, d, k;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * sg_n_R(w);
        for (c = 0; c < sg_first_normal(w); ++c) {
            a += w->rows.kind[base + c] != SG_ROW_ZERO;
        }
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const sg_contact *contact = sg_contact_at(w, k);
            const int rubs =
                contact->components > 0 && w->rows.kind[sg_slip_of(w, base, k)] != SG_ROW_ZERO;
            if (contact->normal >= 0 && w->rows.kind[sg_normal_of(w, base, k)] == SG_ROW_FREE) {
                sg_nearest_of_contact(w, base, k, a, z);
                ++a;
            } else if (contact->presser < 0 && sg_is_sticking(w, base, k)) {
                const real radius = sg_radius(w, base, k, &w->R[pr->R]) / w->system.root_scale[a];
                const real size = sg_norm(contact->components, &z[a]);
                for (d = 0; d < contact->components && size > radius; ++d) {
                    z[a + d] *= radius / size;
                }
            }
            a += rubs ? contact->components : 0;
        }
    }
}

/* From the least norm of all percussions that solve the reduced system, in work.system.solution, to
   the least norm of those within the cones: Dykstra's alternating projections. */
static void sg_least_in_cones(SG(work) * w, const sg_problem *pr, int n, int rank) {
    real *z = w->system.solution;
    real *inside = w->least.within;
    int sweep, a;
    sg_copy(n, z, w->least.norm);
    sg_fill(n, SG_C(0.0), w->least.correction);
    for (sweep = 0; sweep < SG_SWEEPS; ++sweep) {
        real apart = SG_C(0.0);
        real size = SG_C(0.0);
        for (a = 0; a < n; ++a) {
            w->least.correction[a] += z[a];
            inside[a] = w->least.correction[a];
        }
        sg_nearest_in_cones(w, pr, inside);
        sg_copy(n, inside, z);
        sg_cod_project(n, rank, w->system.S, w->system.perm, w->system.tau_z, w->system.scratch, z);
        for (a = 0; a < n; ++a) {
            w->least.correction[a] -= inside[a];
            z[a] = w->least.norm[a] + (inside[a] - z[a]);
            apart = sg_max(apart, SG_FABS(z[a] - inside[a]));
            size = sg_max(size, SG_FABS(z[a]));
        }
        if (apart <= SG_C(4.0) * SG_EPS * size) {
            return;
        }
    }
}

/* Take the direction. Returns 1 if it leads to a solution of the problem in the contact state
   `state`. */
static int sg_arrives(SG(work) * w, const SG(params) * par, const SG(options) * opt, int problem,
                      unsigned long state, int *iterations, real *measure) {
    const sg_problem *pr = sg_problem_at(w, problem);
    sg_advance(w, problem);
    sg_evaluate(w, par, opt, problem);
    *measure = sg_residual(w, opt, problem);
    if (*measure > SG_C(1.0) && sg_fingerprint(w, pr->n_slots * sg_n_R(w)) == state) {
        /* the problem is not linear: the same contact states, solved */
        sg_settle(w, par, opt, problem, SG_HELD, iterations);
        sg_evaluate(w, par, opt, problem);
        *measure = sg_residual(w, opt, problem);
    }
    return *measure <= SG_C(1.0) && sg_fingerprint(w, pr->n_slots * sg_n_R(w)) == state;
}

/* Move to the percussions in work.system.solution and the velocities that belong to them. Returns 1
   if they solve the problem in the contact state `state`. */
static int sg_take_solution(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                            int problem, int n, unsigned long state, int *iterations,
                            real *measure) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const real *R = &w->R[pr->R];
    int a, i;
    sg_fill(pr->n_x, SG_C(0.0), w->smooth.dx);
    sg_fill(pr->n_slots * sg_n_R(w), SG_C(0.0), w->newton.dR);
    for (a = 0; a < n; ++a) {
        const int row = w->system.reduced[a];
        const real change = w->system.solution[a] * w->system.root_scale[a] - R[row];
        w->newton.dR[row] = change;
        for (i = 0; i < pr->n_x; ++i) {
            w->smooth.dx[i] -= w->system.Z[a * pr->n_border + i] * change;
        }
    }
    return sg_arrives(w, par, opt, problem, state, iterations, measure);
}

#if SG_JOINS
/* The same as below where many percussions act, the cones left aside. */
static int sg_least_of_many(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                            int problem, unsigned long state, int *iterations, real *measure) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int n_rows = pr->n_slots * sg_n_R(w);
    if (!sg_large_least(w, problem)) {
        return SG_UNIQUE;
    }
    sg_copy(pr->n_x, &w->x[pr->x], w->newton.x_old);
    sg_copy(n_rows, &w->R[pr->R], w->newton.R_old);
    if (sg_arrives(w, par, opt, problem, state, iterations, measure)) {
        return SG_LEAST_NORM;
    }
    sg_copy(pr->n_x, w->newton.x_old, &w->x[pr->x]);
    sg_copy(n_rows, w->newton.R_old, &w->R[pr->R]);
    sg_evaluate(w, par, opt, problem);
    *measure = sg_residual(w, opt, problem);
    return SG_AS_FOUND;
}
#endif

/* Where dependent rows leave the percussions open, move to those of least scaled norm; kept only if
   they still solve the problem in the same contact state. */
static int sg_least_norm(SG(work) * w, const SG(params) * par, const SG(options) * opt, int problem,
                         int *iterations, real *measure) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int n_rows = pr->n_slots * sg_n_R(w);
    real *R = &w->R[pr->R];
    unsigned long state;
    int n, rank, a, turn;
    sg_evaluate(w, par, opt, problem);
    *measure = sg_residual(w, opt, problem);
    if (*measure > SG_C(1.0)) {
        return SG_AS_FOUND;
    }
    state = sg_fingerprint(w, n_rows);
    SG(derivatives)(w, par, problem);
#if SG_JOINS
    if (sg_is_large(w, pr)) {
        return sg_least_of_many(w, par, opt, problem, state, iterations, measure);
    }
#endif
    n = sg_reduce(w, problem, 0);
    if (n <= 0) {
        return SG_UNIQUE;
    }
    rank = sg_cod_factor(n, w->system.S, w->system.perm, w->system.tau, w->system.tau_z);
    if (rank == n) {
        return SG_UNIQUE;
    }
    sg_copy(pr->n_x, &w->x[pr->x], w->newton.x_old);
    sg_copy(n_rows, R, w->newton.R_old);
    for (turn = 0; turn < 2; ++turn) {
        const int used = *iterations;
        for (a = 0; a < n; ++a) {
            w->system.solution[a] = R[w->system.reduced[a]] / w->system.root_scale[a];
        }
        sg_cod_project(n, rank, w->system.S, w->system.perm, w->system.tau_z, w->system.scratch,
                       w->system.solution);
        if (turn > 0) {
            sg_least_in_cones(w, pr, n, rank);
        }
        if (sg_take_solution(w, par, opt, problem, n, state, iterations, measure)) {
            return SG_LEAST_NORM;
        }
        sg_copy(pr->n_x, w->newton.x_old, &w->x[pr->x]);
        sg_copy(n_rows, w->newton.R_old, R);
        sg_evaluate(w, par, opt, problem);
        *measure = sg_residual(w, opt, problem);
        if (turn == 0 && *iterations > used) {
            /* settling has overwritten the factors */
            SG(derivatives)(w, par, problem);
            n = sg_reduce(w, problem, 0);
            rank = n > 0 ? sg_cod_factor(n, w->system.S, w->system.perm, w->system.tau,
                                         w->system.tau_z)
                         : n;
            if (n <= 0 || rank == n) {
                return SG_AS_FOUND;
            }
        }
    }
    return SG_AS_FOUND;
}

/* 1 if more than one percussion acts in a slot, so that they may depend on each other. */
static int sg_may_depend(const SG(work) * w, const sg_problem *pr) {
    int slot, c, k;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        int acting = 0;
        for (c = 0; c < sg_first_normal(w); ++c) {
            acting += w->rows.kind[slot * sg_n_R(w) + c] != SG_ROW_ZERO;
        }
        for (k = 0; k < sg_n_contacts(w); ++k) {
            acting += sg_is_pressed(w, slot * sg_n_R(w), k);
        }
        if (acting > 1) {
            return 1;
        }
    }
    return 0;
}

/* Choose among the percussions that solve the problem, and note the contact state for which the
   choice holds: work.found.states, work.found.choice. As long as the state stays, what was found of
   it in the step before is not found again; nor is that rows do not depend on each other where the
   last direction saw it. */
static void sg_choose(SG(work) * w, const SG(part) * s, const SG(params) * par,
                      const SG(options) * opt, SG(report) * info, int problem, int iterated,
                      real *measure) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int state = sg_state_of(w, pr);
    const int same = s->warm > 0 && s->h_guess == w->h && s->states[problem] == state;
    int choice = SG_UNIQUE;
    if (same && (!iterated || (s->choice[problem] == SG_UNIQUE && w->system.deficiency == 0))) {
        choice = s->choice[problem];
    } else if (state != w->system.determined && sg_may_depend(w, pr)) {
        choice = sg_least_norm(w, par, opt, problem, &info->iterations, measure);
    }
    w->found.states[problem] = state;
    w->found.choice[problem] = choice;
}
