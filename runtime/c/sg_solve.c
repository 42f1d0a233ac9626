/* Solution of one problem: starting points, rescues, and the choice among several percussions. */

/* Cold start: velocities of the step's start, no percussions. After a position problem the
   percussions of the whole step start from the mean of its slots. */
static void sg_cold_start(SG(work) * w, int problem) {
    const sg_problem *pr = &sg_problems[problem];
    int i, c, slot;
    for (i = 0; i < pr->n_x; ++i) {
        w->x[pr->x + i] = w->v[i % SG_NQ];
    }
    sg_fill(pr->n_slots * SG_NC, SG_C(0.0), &w->lambda[pr->lambda]);
    if (pr->follows) {
        const sg_problem *before = &sg_problems[problem - 1];
        for (slot = 0; slot < before->n_slots; ++slot) {
            for (c = 0; c < SG_NC; ++c) {
                w->lambda[pr->lambda + c] +=
                    w->lambda[before->lambda + slot * SG_NC + c] / (real)before->n_slots;
            }
        }
    }
}

/* Start from the prediction in the state. */
static void sg_warm_start(SG(work) * w, const SG(state) * s, int problem) {
    const sg_problem *pr = &sg_problems[problem];
    sg_copy(pr->n_x, &s->x[pr->x], &w->x[pr->x]);
    sg_copy(pr->n_slots * SG_NC, &s->lambda[pr->lambda], &w->lambda[pr->lambda]);
}

/* Projected Gauss-Seidel sweeps over all percussions of the problem linearised at the current
   point: slow to converge but sure to find the contact states of most steps. */
static int sg_sweep(SG(work) * w, const SG(params) * par, int problem, int sweeps) {
    const sg_problem *pr = &sg_problems[problem];
    const int n_x = pr->n_x;
    const int n = pr->n_slots * SG_NC;
    real *lambda = &w->lambda[pr->lambda];
    int sweep, slot, a, b, c, d, i, k;
    sg_evaluate(w, par, problem);
    SG(derivatives)(w, par, problem);
    for (i = 0; i < n_x; ++i) {
        w->dx[i] = -w->r[i];
        w->pivot_scale[i] = w->root_inertia[i % SG_NQ];
    }
    if (!sg_lu_factor(n_x, w->A, w->pivot_scale, w->A_pivot)) {
        return 0;
    }
    sg_lu_solve(n_x, w->A, w->A_pivot, w->dx);
    for (a = 0; a < n; ++a) {
        sg_copy(n_x, &w->B[a * n_x], &w->Z[a * n_x]);
        sg_lu_solve(n_x, w->A, w->A_pivot, &w->Z[a * n_x]);
        w->lambda_old[a] = lambda[a];
        w->y[a] += sg_dot(n_x, &w->C[a * n_x], w->dx);
    }
    for (a = 0; a < n; ++a) {
        for (b = 0; b < n; ++b) {
            w->S[b * n + a] = -sg_dot(n_x, &w->C[a * n_x], &w->Z[b * n_x]);
        }
    }
    for (sweep = 0; sweep < sweeps; ++sweep) {
        for (slot = 0; slot < pr->n_slots; ++slot) {
            const int base = slot * SG_NC;
            for (k = -SG_NORMAL; k < SG_NK; ++k) {
                /* Rows of one block: a bilateral row, or a contact's normal, then its slip. */
                const sg_contact *contact = k < 0 ? 0 : &sg_contacts[k];
                const int exists = k < 0 || (w->exists[k] &&
                                             (!pr->follows || w->active[k] || contact->normal < 0));
                int part;
                for (part = 0; part < 2; ++part) {
                    real goal[2] = {SG_C(0.0), SG_C(0.0)};
                    int first = base + k + SG_NORMAL;
                    int count = 1;
                    if (k >= 0) {
                        first = base + (part == 0 ? SG_NORMAL + contact->normal
                                                  : SG_SLIP + contact->friction);
                        count = part == 0 ? (contact->normal >= 0) : contact->components;
                    } else if (part == 1) {
                        count = 0;
                    }
                    for (d = 0; d < count && exists; ++d) {
                        real stiffness = w->S[first * n + first];
                        if (count == 2) {
                            stiffness = sg_max(stiffness, w->S[(first + 1) * n + first + 1]);
                        }
                        goal[d] = lambda[first + d];
                        if (stiffness > SG_C(0.0)) {
                            goal[d] -= w->y[first + d] / stiffness;
                        }
                    }
                    if (k >= 0 && part == 0) {
                        goal[0] = sg_max(goal[0], SG_C(0.0));
                    } else if (k >= 0 && count > 0) {
                        real direction[2];
                        real ratio;
                        const real radius =
                            contact->normal >= 0
                                ? w->mu[k] *
                                      sg_max(lambda[base + SG_NORMAL + contact->normal], SG_C(0.0))
                                : w->radius[slot * SG_NB + contact->bound];
                        if (!sg_prox_ball(count, goal, radius, SG_C(0.0), direction, &ratio)) {
                            for (d = 0; d < count; ++d) {
                                goal[d] = radius * direction[d];
                            }
                        }
                    }
                    for (d = 0; d < count; ++d) {
                        const real change = goal[d] - lambda[first + d];
                        lambda[first + d] = goal[d];
                        if (change != SG_C(0.0)) {
                            for (c = 0; c < n; ++c) {
                                w->y[c] += w->S[(first + d) * n + c] * change;
                            }
                        }
                    }
                }
            }
        }
    }
    for (a = 0; a < n; ++a) {
        const real change = lambda[a] - w->lambda_old[a];
        for (i = 0; i < n_x; ++i) {
            w->dx[i] -= w->Z[a * n_x + i] * change;
        }
    }
    for (i = 0; i < n_x; ++i) {
        w->x[pr->x + i] += w->dx[i];
    }
    return sg_all_finite(n_x, &w->x[pr->x]) && sg_all_finite(n, lambda);
}

/* Where dependent rows leave the percussions open, move to those of least scaled norm in the
   present contact state; kept only if they still solve the problem in the same state. */
static int sg_least_norm(SG(work) * w, const SG(params) * par, const SG(options) * opt, int problem,
                         real *measure) {
    const sg_problem *pr = &sg_problems[problem];
    const int n_lambda = pr->n_slots * SG_NC;
    real *lambda = &w->lambda[pr->lambda];
    unsigned long state;
    real merit, stall;
    int n, rank, a, i;
    sg_evaluate(w, par, problem);
    state = sg_fingerprint(w, n_lambda);
    SG(derivatives)(w, par, problem);
    n = sg_reduce(w, problem);
    if (n <= 0) {
        return SG_UNIQUE;
    }
    rank = sg_cod_factor(n, w->S, w->perm, w->tau, w->tau_z);
    if (rank == n) {
        return SG_UNIQUE;
    }
    sg_copy(pr->n_x, &w->x[pr->x], w->x_old);
    sg_copy(n_lambda, lambda, w->lambda_old);
    sg_fill(pr->n_x, SG_C(0.0), w->dx);
    sg_fill(n_lambda, SG_C(0.0), w->dlambda);
    for (a = 0; a < n; ++a) {
        w->solution[a] = lambda[w->reduced[a]] / w->root_scale[a];
    }
    sg_cod_project(n, rank, w->S, w->perm, w->tau_z, w->scratch, w->solution);
    for (a = 0; a < n; ++a) {
        const int row = w->reduced[a];
        const real change = w->solution[a] * w->root_scale[a] - lambda[row];
        w->dlambda[row] = change;
        for (i = 0; i < pr->n_x; ++i) {
            w->dx[i] -= w->Z[a * pr->n_x + i] * change;
        }
    }
    sg_move(w, problem, SG_C(1.0));
    sg_evaluate(w, par, problem);
    *measure = sg_residual(w, opt, problem, &merit, &stall);
    if (*measure <= SG_C(1.0) && sg_fingerprint(w, n_lambda) == state) {
        return SG_LEAST_NORM;
    }
    sg_move(w, problem, SG_C(0.0));
    sg_evaluate(w, par, problem);
    *measure = sg_residual(w, opt, problem, &merit, &stall);
    return SG_AS_FOUND;
}

/* Solve one problem: warm start if there is one, then cold start, friction raised
   in steps with damping, sweeps. */
static int sg_solve(SG(work) * w, const SG(state) * s, const SG(params) * par,
                    const SG(options) * opt, SG(info) * info, int problem, int warm) {
    const int total = opt->max_iterations;
    int status = SG_K(NOT_CONVERGED);
    int attempt, round;
    real measure = SG_HUGE;
    int before = info->iterations;
    w->friction = SG_C(1.0);
    sg_prox_parameters(w, opt, problem);
    for (attempt = warm ? 0 : 1; attempt < 4; ++attempt) {
        const int left = total - (info->iterations - before);
        int budget = total / 8 + 1;
        if (left <= 0) {
            break;
        }
        budget = attempt < 3 && budget < left ? budget : left;
        if (attempt == 0) {
            sg_warm_start(w, s, problem);
        } else {
            sg_cold_start(w, problem);
        }
        if (attempt == 2 && SG_NF > 0) {
            /* Raise the friction from zero: without it the solution is easy to find. */
            for (round = 0; round < 4; ++round) {
                w->friction = SG_C(0.25) * (real)round;
                (void)sg_newton(w, par, opt, problem, total / 12 + 1, 1, &info->iterations,
                                &measure);
                if (!(measure < SG_HUGE)) {
                    sg_cold_start(w, problem);
                }
            }
            w->friction = SG_C(1.0);
        }
        if (attempt == 3) {
            for (round = 0; round < 4; ++round) {
                if (!sg_sweep(w, par, problem, 100)) {
                    sg_cold_start(w, problem);
                    break;
                }
            }
        }
        status = sg_newton(w, par, opt, problem, budget, attempt >= 2, &info->iterations, &measure);
        if (status == SG_K(OK)) {
            info->rescues |= attempt == 3           ? SG_SWEPT
                             : attempt == 2         ? SG_RAISED
                             : attempt == 1 && warm ? SG_COLD
                                                    : 0;
            break;
        }
    }
    if (status == SG_K(OK) && w->deficiency > 0) {
        const int choice = sg_least_norm(w, par, opt, problem, &measure);
        info->percussions = choice > info->percussions ? choice : info->percussions;
    }
    info->residual = sg_max(info->residual, measure * sg_max(opt->tol, SG_FLOOR));
    return status;
}
