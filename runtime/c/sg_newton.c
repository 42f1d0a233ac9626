/* Semismooth Newton method for one nonlinear problem of the scheme: smooth rows r(x, lambda) = 0
   (lambda enters linearly), bilateral rows y(x) = 0, contact rows as prox equations (64). */

/* Residual of row i where its kinematics y are to vanish. At rest round-off of a closed row is left
   as it is: a correction would have to be undone in the next step, for ever. */
static inline real sg_kinematic_residual(const SG(work) * w, int i) {
    return w->at_rest && w->r_auto[i] * SG_FABS(w->y[i]) <= w->phi_floor[i]
               ? SG_C(0.0)
               : w->prox_r[i] * w->y[i];
}

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
            w->phi[base + c] = part ? sg_kinematic_residual(w, base + c) : lambda[base + c];
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
                w->phi[n] = open ? lambda[n] : sg_kinematic_residual(w, n);
                radius = w->mu[k] * sg_max(lambda[n], SG_C(0.0));
            } else {
                radius = w->radius[slot * SG_NB + contact->bound];
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
                        w->phi[f + d] = sg_kinematic_residual(w, f + d);
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
static inline real sg_row_residual(const SG(work) * w, int i) {
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
            worst = sg_max(worst, relative ? size * w->momentum_inverse[j] : size);
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
        const real scale = sg_max(w->percussion_scale[i % SG_ROWS] + w->phi_floor[i], SG_TINY);
        const real size = sg_row_residual(w, i);
        if (SG_FABS(w->phi[i]) > SG_C(0.0)) {
            kept = sg_max(kept, size / (SG_STAGNATION * scale + SG_BAND * w->rounding[i]));
            sum += (size / scale) * (size / scale);
        }
    }
    *stall = kept;
    return sum < SG_HUGE ? sum : SG_HUGE;
}

/* Percussion of the contact that presses slip row k, -1 for other rows. */
static inline int sg_pressing(int k) {
    const int c = k % SG_ROWS - SG_SLIP;
    const int normal = c < 0 ? -1 : sg_contacts[sg_slips[c].contact].normal;
    return normal < 0 ? -1 : k / SG_ROWS * SG_NC + SG_NORMAL + normal;
}

/* Change of phi in row `row` of the reduced system for given changes of the kinematic rows, the
   change of the radius and the change of the percussion `column` (-1: none). */
static inline real sg_phi_change(const SG(work) * w, const sg_problem *pr, int row, const real *dy,
                                 real d_radius, int column) {
    const int c = row % SG_ROWS - SG_SLIP;
    if (c < 0 || w->kind[row] == SG_ROW_FREE) {
        return w->prox_r[row] * dy[row];
    } else {
        const sg_slip *own = &sg_slips[c];
        const sg_contact *contact = &sg_contacts[own->contact];
        const int first = row / SG_ROWS * SG_NC + SG_SLIP + contact->friction;
        real change = row == column ? SG_C(1.0) : SG_C(0.0);
        int e;
        /* Radius: mu R_N, or the given bound along dx. */
        if (contact->normal < 0) {
            change += w->slip[row] * d_radius;
        } else if (column >= 0 && column == sg_pressing(row) &&
                   w->lambda[pr->lambda + column] >= SG_C(0.0)) {
            change += w->slip[row] * w->mu[own->contact];
        }
        /* Direction: ratio (1 - n n^T) (r C dx - dlambda). */
        for (e = 0; e < contact->components && contact->components > 1; ++e) {
            const int other = first + e;
            const real projector =
                (row == other ? SG_C(1.0) : SG_C(0.0)) - w->slip[row] * w->slip[other];
            real turn = w->prox_r[other] * dy[other];
            if (other == column) {
                turn -= SG_C(1.0);
            }
            change += w->ratio[row] * projector * turn;
        }
        return change;
    }
}

/* Change of the given bound in row `row` along z; zero for rows of contacts. */
static inline real sg_bound_change(const SG(work) * w, const sg_problem *pr, int row,
                                   const real *z) {
    const int c = row % SG_ROWS - SG_SLIP;
    if (SG_NB > 0 && c >= 0 && w->kind[row] == SG_ROW_SLIP) {
        const int bound = sg_contacts[sg_slips[c].contact].bound;
        if (bound >= 0) {
            return sg_row_dot(&pr->C_radius, w->C_radius, row / SG_ROWS * SG_NB + bound, z);
        }
    }
    return SG_C(0.0);
}

/* Row a of the reduced system where its kinematics are to vanish. */
static inline void sg_free_row(SG(work) * w, const sg_problem *pr, int n, int a) {
    const int row = w->reduced[a];
    const real r = w->prox_r[row];
    const real weight = r * w->inverse_scale[a];
    int b;
    w->rhs[a] = -(w->phi[row] + r * sg_row_dot(&pr->C, w->C, row, w->dx)) * w->inverse_scale[a];
    for (b = 0; b < n; ++b) {
        const real dy = sg_row_dot(&pr->C, w->C, row, &w->Z[b * pr->n_border]);
        w->S[b * n + a] = -(weight * w->root_scale[b]) * dy;
    }
}

/* Row a of the reduced system, slip row c of a slot, where its contact slips. */
static void sg_slipping_row(SG(work) * w, const sg_problem *pr, int n, int a, int c) {
    const int row = w->reduced[a];
    const sg_contact *contact = &sg_contacts[sg_slips[c].contact];
    const int first = row / SG_ROWS * SG_NC + SG_SLIP + contact->friction;
    real *dy = w->scratch;
    int b, e;
    for (b = -1; b < n; ++b) {
        const real *z = b < 0 ? w->dx : &w->Z[b * pr->n_border];
        const real sign = b < 0 ? SG_C(1.0) : SG_C(-1.0);
        const int column = b < 0 ? -1 : w->reduced[b];
        real change;
        for (e = 0; e < contact->components; ++e) {
            dy[first + e] = sign * sg_row_dot(&pr->C, w->C, first + e, z);
        }
        change = sg_phi_change(w, pr, row, dy, sign * sg_bound_change(w, pr, row, z), column);
        if (b < 0) {
            w->rhs[a] = -(w->phi[row] + change) * w->inverse_scale[a];
        } else {
            w->S[b * n + a] = change * w->root_scale[b] * w->inverse_scale[a];
        }
    }
}

/* Right-hand side and matrix S of the reduced system, by columns, in scaled percussions. */
static void sg_percussion_system(SG(work) * w, const sg_problem *pr, int n) {
    int a;
    for (a = 0; a < n; ++a) {
        const int row = w->reduced[a];
        const int c = row % SG_ROWS - SG_SLIP;
        if (c < 0 || w->kind[row] == SG_ROW_FREE) {
            sg_free_row(w, pr, n, a);
        } else {
            sg_slipping_row(w, pr, n, a, c);
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

/* The share of the normal percussion `normal` that friction row k follows where its contact slips
   in the plane: dlambda_F = -phi_F + share dlambda_N. */
static inline real sg_share(const SG(work) * w, const sg_problem *pr, int k, int normal) {
    const int c = k % SG_ROWS - SG_SLIP;
    const real mu = c < 0 ? SG_C(0.0) : w->mu[sg_slips[c].contact];
    return w->lambda[pr->lambda + normal] >= SG_C(0.0) ? -(w->slip[k] * mu) : SG_C(0.0);
}

/* Take percussion k into the reduced system, with what follows it. */
static void sg_take_in(SG(work) * w, int problem, int n, int k) {
    const sg_problem *pr = &sg_problems[problem];
    const int f = w->follower[k];
    const real share = f < 0 ? SG_C(0.0) : sg_share(w, pr, f, k);
    sg_answer(w, problem, k, f, share, &w->Z[n * pr->n_border]);
    w->reduced[n] = k;
    w->root_scale[n] = sg_root_mass(w, k);
    w->inverse_scale[n] = SG_C(1.0) / w->root_scale[n];
}

/* Set the change of percussion k to -known, for now, and add its effect to the right-hand side. */
static inline void sg_leave(SG(work) * w, const sg_problem *pr, int k, real known) {
    w->dlambda[k] = -known;
    if (known != SG_C(0.0)) {
        sg_add_row(&pr->B, w->B, k, known, w->dx);
    }
}

/* Eliminate the velocities and reduce to the percussions that are not zero. With `lean` the
   bilateral percussions, if their rows are independent, and friction that follows a normal
   percussion are eliminated, too. Returns the number of percussions left, or -1 if the smooth block
   is singular. */
static int sg_reduce(SG(work) * w, int problem, int lean) {
    const sg_problem *pr = &sg_problems[problem];
    const real *lambda = &w->lambda[pr->lambda];
    int n = 0;
    int slot, c, d, k;
    if (!sg_factor_smooth(w, problem, lean)) {
        return -1;
    }
    w->lean = lean;
    sg_smooth_rows(w, pr);
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * SG_NC;
        for (c = 0; c < SG_NORMAL; ++c) {
            w->follower[base + c] = -1;
            w->dlambda[base + c] = SG_C(0.0);
            if (w->kind[base + c] == SG_ROW_ZERO) {
                sg_leave(w, pr, base + c, lambda[base + c]);
            } else if (!w->bordered) {
                sg_take_in(w, problem, n, base + c);
                ++n;
            }
        }
        for (k = 0; k < SG_NK; ++k) {
            const sg_contact *contact = &sg_contacts[k];
            const int normal = base + SG_NORMAL + contact->normal;
            const int f = base + SG_SLIP + contact->friction;
            const int pressed = contact->normal >= 0 && w->kind[normal] == SG_ROW_FREE;
            const int tied =
                lean && pressed && contact->components == 1 && w->kind[f] == SG_ROW_SLIP;
            if (pressed) {
                w->follower[normal] = tied ? f : -1;
                w->dlambda[normal] = SG_C(0.0);
                sg_take_in(w, problem, n, normal);
                ++n;
            } else if (contact->normal >= 0) {
                sg_leave(w, pr, normal, lambda[normal]);
            }
            for (d = 0; d < contact->components; ++d) {
                if (tied || w->kind[f + d] == SG_ROW_ZERO) {
                    sg_leave(w, pr, f + d, tied ? w->phi[f + d] : lambda[f + d]);
                } else {
                    w->follower[f + d] = -1;
                    w->dlambda[f + d] = SG_C(0.0);
                    sg_take_in(w, problem, n, f + d);
                    ++n;
                }
            }
        }
    }
    sg_solve_smooth(w, problem, 0, w->dx);
    sg_percussion_system(w, pr, n);
    return n;
}

/* Solution of the reduced system if its rows are clearly independent; w->S stays as it is. */
static int sg_solve_regular(SG(work) * w, int n) {
    int a, b;
    if (n == 1 && SG_FABS(w->S[0]) > SG_C(0.0) && sg_finite(w->S[0])) {
        w->solution[0] = w->rhs[0] / w->S[0];
        return 1;
    }
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
        const int row = w->reduced[a];
        const int follower = w->follower[row];
        w->dlambda[row] = change;
        if (follower >= 0) {
            w->dlambda[follower] += sg_share(w, pr, follower, row) * change;
        }
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
    if (w->lean) {
        n = sg_reduce(w, problem, 0);
        if (n < 0) {
            return n;
        }
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

static inline void sg_evaluate(SG(work) * w, const SG(params) * par, const SG(options) * opt,
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

/* Take the whole Newton direction. */
static inline void sg_advance(SG(work) * w, int problem) {
    const sg_problem *pr = &sg_problems[problem];
    const sg_index *order = &sg_table[pr->K.order];
    int i;
    for (i = 0; i < pr->n_x; ++i) {
        w->x[pr->x + order[i]] += w->dx[i];
    }
    for (i = 0; i < pr->n_slots * SG_NC; ++i) {
        w->lambda[pr->lambda + i] += w->dlambda[i];
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

/* Solution of an iteration that gets no further: its nearest point, if that may be kept. The last
   attempt asks what the checker asks; for stages, whose response the checker's units do not know,
   at its end four times that, since there the checker alone can say. */
static int sg_keep_nearest(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                           int problem, int ends, real nearest, real *measure) {
    const sg_problem *pr = &sg_problems[problem];
    const real rough = ends && pr->gap_slots > 0 ? SG_C(4.0) : SG_C(1.0);
    if (nearest > (w->lenient ? rough * SG_CHECK / SG_STAGNATION : SG_C(1.0)) ||
        opt->scaling == SG_K(SCALING_NONE)) {
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
    const int before = *iterations;
    int nearer; /* whether this point is clearly the nearest so far */
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
        if (iteration > 0 || damped || w->careful) {
            merit = sg_merit(w, problem, &stall);
        }
        nearer = stall < SG_C(0.25) * nearest;
        if (stall < nearest) {
            nearest = stall;
            sg_copy(pr->n_x, &w->x[pr->x], w->x_best);
            sg_copy(n_lambda, &w->lambda[pr->lambda], w->lambda_best);
        }
        /* Stalled at the level of round-off, or going round there. */
        if (((iteration >= 3 && !nearer) || iteration >= max_iterations) &&
            sg_keep_nearest(w, par, opt, problem, iteration >= max_iterations, nearest, measure)) {
            return SG_K(OK);
        }
        if (iteration >= max_iterations) {
            return SG_K(NOT_CONVERGED);
        }
        now = sg_fingerprint(w, n_lambda);
        for (i = 2; i <= 4; ++i) {
            const int last = (iteration + 4 - i) % 4;
            if (iteration >= i && seen[last] == now && *measure > SG_C(0.5) * past[last]) {
                damped = 1;
            }
        }
        seen[iteration % 4] = now;
        past[iteration % 4] = *measure;
        SG(derivatives)(w, par, problem);
        deficiency = sg_newton_direction(w, opt, problem, damped);
        *iterations = before + iteration + 1;
        if (deficiency < 0) {
            return sg_all_finite(sg_table[pr->K.start + pr->n_x], w->K) ? SG_K(SINGULAR)
                                                                        : SG_K(NONFINITE);
        }
        w->deficiency = deficiency;
        if (!damped) {
            sg_advance(w, problem);
            sg_evaluate(w, par, opt, problem);
            *measure = sg_residual(w, opt, problem);
        } else {
            const real start = merit;
            real best = SG_HUGE;
            real best_alpha = SG_C(1.0);
            real alpha = SG_C(1.0);
            int halving;
            sg_copy(pr->n_x, &w->x[pr->x], w->x_old);
            sg_copy(n_lambda, &w->lambda[pr->lambda], w->lambda_old);
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
