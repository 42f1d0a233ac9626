/* Semismooth Newton method for one nonlinear problem of the scheme: smooth rows r(x, lambda) = 0
   (lambda enters linearly), bilateral rows y(x) = 0, contact rows as prox equations (64). */

/* Contact state and residual phi of every percussion row, in units of percussion. */
static void sg_contact_rows(SG(work) * w, int problem) {
    const sg_problem *pr = &sg_problems[problem];
    const real *lambda = &w->lambda[pr->lambda];
    int slot, c, k, d;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * SG_NC;
        for (c = 0; c < SG_NORMAL; ++c) {
            const int part = sg_takes_part(pr, slot, c);
            w->kind[base + c] = part ? SG_ROW_FREE : SG_ROW_ZERO;
            w->phi[base + c] = part ? w->prox_r[base + c] * w->y[base + c] : lambda[base + c];
        }
        for (k = 0; k < SG_NK; ++k) {
            const sg_contact *contact = &sg_contacts[k];
            const int f = base + SG_SLIP + contact->friction;
            const int frictionless = contact->normal >= 0 && !(w->mu[k] > SG_C(0.0));
            int open = !w->exists[k] || (pr->follows && contact->normal >= 0 && !w->active[k]);
            real radius = SG_C(0.0);
            if (contact->normal >= 0) {
                const int n = base + SG_NORMAL + contact->normal;
                if (!open) {
                    const real z = w->prox_r[n] * w->y[n] - lambda[n];
                    open = !sg_is_closed(z, SG_BAND * w->phi_floor[n]);
                }
                w->kind[n] = open ? SG_ROW_ZERO : SG_ROW_FREE;
                w->phi[n] = open ? lambda[n] : w->prox_r[n] * w->y[n];
                radius = w->friction * w->mu[k] * sg_max(lambda[n], SG_C(0.0));
            } else {
                radius = w->friction * w->radius[slot * SG_NB + contact->bound];
            }
            if (open || frictionless) {
                for (d = 0; d < contact->components; ++d) {
                    w->kind[f + d] = SG_ROW_ZERO;
                    w->phi[f + d] = lambda[f + d];
                }
            } else if (contact->components > 0) {
                real z[2];
                real ratio;
                for (d = 0; d < contact->components; ++d) {
                    z[d] = w->prox_r[f + d] * w->y[f + d] - lambda[f + d];
                }
                if (sg_prox_ball(contact->components, z, radius, w->phi_floor[f], &w->slip[f],
                                 &ratio)) {
                    for (d = 0; d < contact->components; ++d) {
                        w->kind[f + d] = SG_ROW_FREE;
                        w->phi[f + d] = w->prox_r[f + d] * w->y[f + d];
                    }
                } else {
                    for (d = 0; d < contact->components; ++d) {
                        w->kind[f + d] = SG_ROW_SLIP;
                        w->phi[f + d] = lambda[f + d] + radius * w->slip[f + d];
                        w->ratio[f + d] = ratio;
                    }
                }
            }
        }
    }
}

/* Residual of a percussion row: of its kinematics, in units of percussion, while it is free. */
static real sg_row_residual(const SG(work) * w, int i) {
    return w->kind[i] == SG_ROW_FREE ? w->r_auto[i] * SG_FABS(w->y[i]) : SG_FABS(w->phi[i]);
}

/* Residual in units of its tolerance: at most 1 means solved. Not finite values give SG_HUGE. */
static real sg_residual(const SG(work) * w, const SG(options) * opt, int problem) {
    const sg_problem *pr = &sg_problems[problem];
    const int n_lambda = pr->n_slots * SG_NC;
    const int relative = opt->scaling != SG_K(SCALING_NONE);
    const real tol = sg_max(opt->tol, SG_C(16.0) * SG_EPS);
    real sum = SG_C(0.0);
    real worst = SG_C(0.0);
    int i, j;
    for (i = 0; i < pr->n_x; i += SG_NQ) {
        for (j = 0; j < SG_NQ; ++j) {
            const real size = SG_FABS(w->r[i + j]);
            sum += size;
            if (size > SG_C(0.0)) {
                const real share = size * (relative ? w->momentum_inverse[j] : SG_C(1.0));
                worst = sg_max(worst, share);
            }
        }
    }
    worst /= relative ? tol : opt->tol;
    for (i = 0; i < n_lambda; ++i) {
        const real own = SG_FABS(w->phi[i]);
        sum += own;
        if (own > SG_C(0.0)) {
            worst = sg_max(worst,
                           relative ? sg_row_residual(w, i) * w->phi_inverse[i] : own / opt->tol);
        }
    }
    return sg_finite(sum) && worst < SG_HUGE ? worst : SG_HUGE;
}

/* Sum of squares of the residual in units of the scales. `stall` receives the residual in units of
   what an iteration may keep that gets no further. */
static real sg_merit(const SG(work) * w, int problem, real *stall) {
    const sg_problem *pr = &sg_problems[problem];
    const int n_lambda = pr->n_slots * SG_NC;
    real sum = SG_C(0.0);
    real kept = SG_C(0.0);
    int i;
    for (i = 0; i < pr->n_x; ++i) {
        const real size = SG_FABS(w->r[i]);
        if (size > SG_C(0.0)) {
            const real share = size * w->momentum_inverse[i % SG_NQ];
            kept = sg_max(kept, share / SG_STAGNATION);
            sum += share * share;
        }
    }
    for (i = 0; i < n_lambda; ++i) {
        const real scale = w->percussion_scale[i % SG_ROWS] + w->phi_floor[i];
        const real size = sg_row_residual(w, i);
        if (SG_FABS(w->phi[i]) > SG_C(0.0)) {
            kept = sg_max(kept, size / (SG_STAGNATION * scale + SG_BAND * w->rounding[i]));
            sum += (size / scale) * (size / scale);
        }
    }
    *stall = kept;
    return sum < SG_HUGE ? sum : SG_HUGE;
}

/* Contact of percussion row c of a slot and the component of its slip velocity. */
static int sg_contact_of_slip(int c, int *component) {
    int k;
    for (k = 0; k < SG_NK; ++k) {
        const int d = c - SG_SLIP - sg_contacts[k].friction;
        if (d >= 0 && d < sg_contacts[k].components) {
            *component = d;
            return k;
        }
    }
    return 0; /* not reached: every slip row belongs to a contact */
}

/* Change of phi in row `index` of the reduced system for given changes of all kinematic rows, the
   change of the radius and the change of the percussion `column` (-1: none). */
static real sg_phi_change(const SG(work) * w, const sg_problem *pr, int index, const real *dy,
                          real d_radius, int column) {
    if (SG_NF == 0 || w->kind[index] == SG_ROW_FREE) {
        return w->prox_r[index] * dy[index];
    } else {
        const int slot = index / SG_ROWS;
        int d = 0;
        int e;
        const int k = sg_contact_of_slip(index % SG_ROWS, &d);
        const sg_contact *contact = &sg_contacts[k];
        const int first = index - d;
        real change = index == column ? SG_C(1.0) : SG_C(0.0);
        /* Radius: mu R_N, or the given bound along dx. */
        if (contact->normal >= 0) {
            const int n = slot * SG_NC + SG_NORMAL + contact->normal;
            if (column == n && w->lambda[pr->lambda + n] >= SG_C(0.0)) {
                change += w->slip[index] * w->friction * w->mu[k];
            }
        } else {
            change += w->slip[index] * w->friction * d_radius;
        }
        /* Direction: ratio (1 - n n^T) (r C dx - dlambda). */
        for (e = 0; e < contact->components; ++e) {
            const int other = first + e;
            const real projector =
                (d == e ? SG_C(1.0) : SG_C(0.0)) - w->slip[index] * w->slip[other];
            if (contact->components > 1) {
                real turn = w->prox_r[other] * dy[other];
                if (other == column) {
                    turn -= SG_C(1.0);
                }
                change += w->ratio[index] * projector * turn;
            }
        }
        return change;
    }
}

/* Change of the given bound in row `index` along z; zero for rows of contacts. */
static real sg_bound_change(const SG(work) * w, const sg_problem *pr, int index, const real *z) {
    if (SG_NB > 0 && w->kind[index] == SG_ROW_SLIP) {
        int d = 0;
        const sg_contact *contact = &sg_contacts[sg_contact_of_slip(index % SG_ROWS, &d)];
        if (contact->normal < 0) {
            const int row = index / SG_ROWS * SG_NB + contact->bound;
            return sg_row_dot(&pr->C_radius, w->C_radius, row, z);
        }
    }
    return SG_C(0.0);
}

/* Right-hand side and matrix S of the reduced system, by columns, in scaled percussions. */
static void sg_percussion_system(SG(work) * w, const sg_problem *pr, int n) {
    real *dy = w->scratch;
    int a, b;
    for (b = -1; b < n; ++b) {
        const real *z = b < 0 ? w->dx : &w->Z[b * pr->n_border];
        const int column = b < 0 ? -1 : w->reduced[b];
        const real sign = b < 0 ? SG_C(1.0) : SG_C(-1.0);
        for (a = 0; a < n; ++a) {
            dy[w->reduced[a]] = sign * sg_row_dot(&pr->C, w->C, w->reduced[a], z);
        }
        for (a = 0; a < n; ++a) {
            const int row = w->reduced[a];
            const real change =
                sg_phi_change(w, pr, row, dy, sign * sg_bound_change(w, pr, row, z), column);
            if (b < 0) {
                w->rhs[a] = -(w->phi[row] + change) * w->inverse_scale[a];
            } else {
                w->S[b * n + a] = change * w->root_scale[b] * w->inverse_scale[a];
            }
        }
    }
}

/* 1 if the part of the right-hand side that dependent rows cannot reach matters. */
static int sg_is_contradictory(const SG(work) * w, const SG(options) * opt, int n, int rank) {
    real scale = SG_C(0.0);
    int a;
    for (a = 0; a < n; ++a) {
        const int c = w->reduced[a] % SG_ROWS;
        scale = sg_max(scale, w->percussion_scale[c] / w->root_scale[a]);
    }
    for (a = rank; a < n; ++a) {
        if (SG_FABS(w->rhs[a]) > sg_max(opt->tol, SG_FLOOR) * scale) {
            return 1;
        }
    }
    return 0;
}

/* Eliminate the velocities, with `border` the bilateral percussions too if their rows are
   independent, and reduce to the other percussions that are not zero. Returns their number, or -1
   if the smooth block is singular. */
static int sg_reduce(SG(work) * w, int problem, int border) {
    const sg_problem *pr = &sg_problems[problem];
    const int n_lambda = pr->n_slots * SG_NC;
    const real *lambda = &w->lambda[pr->lambda];
    int n = 0;
    int k;
    if (!sg_factor_smooth(w, problem, border)) {
        return -1;
    }
    sg_smooth_rows(w, pr);
    for (k = 0; k < n_lambda; ++k) {
        w->dlambda[k] = SG_C(0.0);
        if (w->kind[k] == SG_ROW_ZERO) {
            w->dlambda[k] = -lambda[k];
            if (lambda[k] != SG_C(0.0)) {
                sg_add_row(&pr->B, w->B, k, lambda[k], w->dx);
            }
        } else if (!w->bordered || k % SG_ROWS >= SG_NORMAL) {
            sg_answer(w, problem, k, &w->Z[n * pr->n_border]);
            w->reduced[n] = k;
            w->root_scale[n] = w->root_mass[k % SG_ROWS];
            w->inverse_scale[n] = SG_C(1.0) / w->root_scale[n];
            ++n;
        }
    }
    sg_solve_smooth(w, problem, 0, w->dx);
    sg_percussion_system(w, pr, n);
    return n;
}

/* Solution of the reduced system if its rows are clearly independent; w->S stays as it is. */
static int sg_solve_regular(SG(work) * w, int n) {
    int a, b;
    for (a = 0; a < n; ++a) {
        w->tau[a] = SG_C(1.0);
        w->solution[a] = w->rhs[a];
        for (b = 0; b < n; ++b) {
            w->cell[a * n + b] = w->S[b * n + a];
        }
    }
    if (!sg_lu_factor(n, w->cell, w->tau, w->perm) || !sg_lu_is_regular(n, w->cell, SG_SMALL)) {
        return 0;
    }
    sg_lu_solve(n, w->cell, w->perm, w->solution);
    return 1;
}

/* Take over the solution of the reduced system into w->dx, w->dlambda. */
static void sg_expand_direction(SG(work) * w, const sg_problem *pr, int n) {
    int a, i;
    for (a = 0; a < n; ++a) {
        const real change = w->solution[a] * w->root_scale[a];
        const real *Z = &w->Z[a * pr->n_border];
        w->dlambda[w->reduced[a]] = change;
        for (i = 0; i < pr->n_border; ++i) {
            w->dx[i] -= Z[i] * change;
        }
    }
    for (i = pr->n_x; i < pr->n_border && w->bordered; ++i) {
        w->dlambda[sg_table[pr->K.order + i] - pr->n_x] = w->dx[i];
    }
}

/* One Newton direction in w->dx, w->dlambda. Returns the rank deficiency or -1. `soft`: where
   dependent contact rows contradict each other (one contact sticks, another wants to move it), a
   small compliance lets their percussions grow until one of them gives way. */
static int sg_newton_direction(SG(work) * w, const SG(options) * opt, int problem, int soft) {
    const sg_problem *pr = &sg_problems[problem];
    int n = sg_reduce(w, problem, w->deficiency == 0);
    int rank, a;
    if (n <= 0 && (n < 0 || w->bordered)) {
        sg_expand_direction(w, pr, 0);
        return n;
    }
    if (w->deficiency == 0 && sg_solve_regular(w, n)) {
        sg_expand_direction(w, pr, n);
        return 0;
    }
    if (w->bordered) {
        n = sg_reduce(w, problem, 0);
    }
    rank = sg_cod_factor(n, w->S, w->perm, w->tau, w->tau_z);
    sg_cod_solve(n, rank, w->S, w->perm, w->tau, w->tau_z, w->rhs, w->scratch, w->solution);
    if (soft && rank < n && sg_is_contradictory(w, opt, n, rank)) {
        sg_percussion_system(w, pr, n);
        for (a = 0; a < n; ++a) {
            if (w->reduced[a] % SG_ROWS >= SG_NORMAL) {
                w->S[a * n + a] += SG_SOFTNESS;
            }
        }
        rank = sg_cod_factor(n, w->S, w->perm, w->tau, w->tau_z);
        sg_cod_solve(n, rank, w->S, w->perm, w->tau, w->tau_z, w->rhs, w->scratch, w->solution);
    }
    sg_expand_direction(w, pr, n);
    return n - rank;
}

static void sg_evaluate(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                        int problem) {
    SG(values)(w, par, problem);
    sg_row_scales(w, opt, problem);
    sg_contact_rows(w, problem);
}

/* Move along the Newton direction by the factor alpha from (x_old, lambda_old). */
static void sg_move(SG(work) * w, int problem, real alpha) {
    const sg_problem *pr = &sg_problems[problem];
    int i;
    for (i = 0; i < pr->n_x; ++i) {
        const int unknown = sg_table[pr->K.order + i];
        w->x[pr->x + unknown] = w->x_old[unknown] + alpha * w->dx[i];
    }
    for (i = 0; i < pr->n_slots * SG_NC; ++i) {
        w->lambda[pr->lambda + i] = w->lambda_old[i] + alpha * w->dlambda[i];
    }
}

/* A number that tells sets of row kinds apart, for the detection of cycles. */
static unsigned long sg_fingerprint(const SG(work) * w, int n_lambda) {
    unsigned long hash = 5381UL;
    int i;
    for (i = 0; i < n_lambda; ++i) {
        unsigned long code = (unsigned long)w->kind[i];
        if (w->kind[i] == SG_ROW_SLIP && w->slip[i] < SG_C(0.0)) {
            code = 3UL;
        }
        hash = (hash * 33UL + code) & 0xffffffffUL;
    }
    return hash;
}

/* Solution of an iteration that gets no further: its nearest point, if that may be kept. */
static int sg_keep_nearest(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                           int problem, real nearest, real *measure) {
    const sg_problem *pr = &sg_problems[problem];
    if (nearest > SG_C(1.0) || opt->scaling == SG_K(SCALING_NONE)) {
        return 0;
    }
    sg_copy(pr->n_x, w->x_best, &w->x[pr->x]);
    sg_copy(pr->n_slots * SG_NC, w->lambda_best, &w->lambda[pr->lambda]);
    sg_evaluate(w, par, opt, problem);
    *measure = sg_residual(w, opt, problem);
    return 1;
}

/* Iterate from the point in work.x, work.lambda. `search`: search along each direction from the
   start; otherwise only after the contact states went round in a cycle. Adds the iterations to
   *iterations; on success *measure is the residual in units of its tolerance. */
static int sg_newton(SG(work) * w, const SG(params) * par, const SG(options) * opt, int problem,
                     int max_iterations, int search, int *iterations, real *measure) {
    const sg_problem *pr = &sg_problems[problem];
    const int n_lambda = pr->n_slots * SG_NC;
    unsigned long seen[4] = {0UL, 1UL, 2UL, 3UL};
    real past[4] = {SG_HUGE, SG_HUGE, SG_HUGE, SG_HUGE};
    real merit, stall;
    real nearest = SG_HUGE;
    int since = 0; /* iterations since the nearest point */
    int damped = search;
    int iteration, i;
    sg_evaluate(w, par, opt, problem);
    *measure = sg_residual(w, opt, problem);
    w->deficiency = 0;
    iteration = 0;
    for (;;) {
        unsigned long now;
        int deficiency;
        if (!(*measure < SG_HUGE)) {
            return SG_K(NONFINITE);
        }
        if (*measure <= SG_C(1.0)) {
            return SG_K(OK);
        }
        stall = SG_HUGE;
        merit = SG_HUGE;
        if (iteration > 0 || damped) {
            merit = sg_merit(w, problem, &stall);
        }
        ++since;
        if (stall < SG_C(0.25) * nearest) {
            since = 0;
        }
        if (stall < nearest) {
            nearest = stall;
            sg_copy(pr->n_x, &w->x[pr->x], w->x_best);
            sg_copy(n_lambda, &w->lambda[pr->lambda], w->lambda_best);
        }
        /* Stalled at the level of round-off, or going round there. */
        if (((iteration >= 3 && since > 0) || iteration >= max_iterations) &&
            sg_keep_nearest(w, par, opt, problem, nearest, measure)) {
            return SG_K(OK);
        }
        if (iteration >= max_iterations) {
            return SG_K(NOT_CONVERGED);
        }
        now = sg_fingerprint(w, n_lambda);
        for (i = 2; i <= 4; ++i) {
            const int before = (iteration + 4 - i) % 4;
            if (iteration >= i && seen[before] == now && *measure > SG_C(0.5) * past[before]) {
                damped = 1;
            }
        }
        seen[iteration % 4] = now;
        past[iteration % 4] = *measure;
        SG(derivatives)(w, par, problem);
        deficiency = sg_newton_direction(w, opt, problem, damped);
        ++*iterations;
        if (deficiency < 0) {
            return sg_all_finite(sg_table[pr->K.start + pr->n_x], w->K) ? SG_K(SINGULAR)
                                                                        : SG_K(NONFINITE);
        }
        w->deficiency = deficiency;
        sg_copy(pr->n_x, &w->x[pr->x], w->x_old);
        sg_copy(n_lambda, &w->lambda[pr->lambda], w->lambda_old);
        if (!damped) {
            sg_move(w, problem, SG_C(1.0));
            sg_evaluate(w, par, opt, problem);
            *measure = sg_residual(w, opt, problem);
        } else {
            const real start = merit;
            real best = SG_HUGE;
            real best_alpha = SG_C(1.0);
            real alpha = SG_C(1.0);
            int halving;
            for (halving = 0; halving < 6; ++halving) {
                sg_move(w, problem, alpha);
                sg_evaluate(w, par, opt, problem);
                *measure = sg_residual(w, opt, problem);
                merit = sg_merit(w, problem, &stall);
                if (*measure < SG_HUGE && merit < best) {
                    best = merit;
                    best_alpha = alpha;
                }
                if (merit <= (SG_C(1.0) - SG_C(0.125) * alpha) * start) {
                    break;
                }
                alpha *= SG_C(0.5);
            }
            if (halving == 6) {
                sg_move(w, problem, best_alpha);
                sg_evaluate(w, par, opt, problem);
                *measure = sg_residual(w, opt, problem);
            }
        }
        ++iteration;
    }
}
