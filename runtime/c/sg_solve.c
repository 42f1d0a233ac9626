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
    const real first = s->order > 0 ? SG_C(1.0) : SG_C(0.0);
    const real second = s->order > 1 ? SG_C(1.0) : SG_C(0.0);
    int i;
    for (i = pr->x; i < pr->x + pr->n_x; ++i) {
        w->x[i] = s->x[i] + first * s->x_1[i] + second * s->x_2[i];
    }
    for (i = pr->lambda; i < pr->lambda + pr->n_slots * SG_NC; ++i) {
        w->lambda[i] = s->lambda[i] + first * s->lambda_1[i] + second * s->lambda_2[i];
    }
}

/* Contacts that take no part have no percussion, exactly. */
static void sg_leave_out(SG(work) * w, int problem) {
    const sg_problem *pr = &sg_problems[problem];
    int slot, k, d;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        real *lambda = &w->lambda[pr->lambda + slot * SG_NC];
        for (k = 0; k < SG_NK; ++k) {
            const sg_contact *contact = &sg_contacts[k];
            if (!sg_joins(w, pr, k)) {
                if (contact->normal >= 0) {
                    lambda[SG_NORMAL + contact->normal] = SG_C(0.0);
                }
                for (d = 0; d < contact->components; ++d) {
                    lambda[SG_SLIP + contact->friction + d] = SG_C(0.0);
                }
            }
        }
    }
}

/* Where dependent rows leave the percussions open, move to those of least scaled norm in the
   present contact state; kept only if they still solve the problem in the same state. */
static int sg_least_norm(SG(work) * w, const SG(params) * par, const SG(options) * opt, int problem,
                         real *measure) {
    const sg_problem *pr = &sg_problems[problem];
    const int n_lambda = pr->n_slots * SG_NC;
    real *lambda = &w->lambda[pr->lambda];
    unsigned long state;
    int n, rank, a, i;
    sg_evaluate(w, par, opt, problem);
    state = sg_fingerprint(w, n_lambda);
    SG(derivatives)(w, par, problem);
    n = sg_reduce(w, problem, 0);
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
            w->dx[i] -= w->Z[a * pr->n_border + i] * change;
        }
    }
    sg_move(w, problem, SG_C(1.0));
    sg_evaluate(w, par, opt, problem);
    *measure = sg_residual(w, opt, problem);
    if (*measure <= SG_C(1.0) && sg_fingerprint(w, n_lambda) == state) {
        return SG_LEAST_NORM;
    }
    sg_move(w, problem, SG_C(0.0));
    sg_evaluate(w, par, opt, problem);
    *measure = sg_residual(w, opt, problem);
    return SG_AS_FOUND;
}

/* Iterations for an attempt: `wish`, unless fewer are left. */
static int sg_budget(const SG(info) * info, int end, int wish) {
    const int left = end - info->iterations;
    return left < wish ? left : wish;
}

/* 1 if an earlier path ended in the present contact states; keeps them in `ends`. In space they say
   little, the direction of slip gets better from path to path. */
static int sg_ended_here(const SG(work) * w, int n_lambda, unsigned long *ends, int *count) {
    const unsigned long here = sg_fingerprint(w, n_lambda);
    int k;
    for (k = 0; k < *count && SG_NF <= SG_NK; ++k) {
        if (ends[k] == here) {
            return 1;
        }
    }
    ends[*count] = here;
    ++*count;
    return 0;
}

/* Guess contact states: contacts that the motion at the start would close stick, or slip as they do
   there; those that stick hold everything. */
static void sg_guess(SG(work) * w, const SG(params) * par, const SG(options) * opt, int problem,
                     int stick) {
    const sg_problem *pr = &sg_problems[problem];
    int slot, c, d, k;
    sg_cold_start(w, problem);
    sg_leave_out(w, problem);
    sg_evaluate(w, par, opt, problem);
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * SG_NC;
        for (c = 0; c < SG_NORMAL; ++c) {
            w->kind[base + c] = sg_takes_part(pr, slot, c) ? SG_ROW_FREE : SG_ROW_ZERO;
        }
        for (k = 0; k < SG_NK; ++k) {
            const sg_contact *contact = &sg_contacts[k];
            const int normal = base + SG_NORMAL + contact->normal;
            const int f = base + SG_SLIP + contact->friction;
            const int rubbing = sg_rubbing(w, k);
            int closed = sg_joins(w, pr, k);
            if (contact->normal >= 0) {
                closed = closed && !(w->y[normal] > SG_BAND * w->gap_floor[normal % SG_ROWS]);
                w->kind[normal] = closed ? SG_ROW_FREE : SG_ROW_ZERO;
            }
            for (d = 0; d < contact->components; ++d) {
                const real slip = sg_norm(contact->components, &w->y[f]);
                const int slips = !stick && slip > SG_C(0.0);
                w->slip[f + d] = slips ? w->y[f + d] / slip : SG_C(0.0);
                w->kind[f + d] = !closed || d >= rubbing ? SG_ROW_ZERO
                                 : slips                 ? SG_ROW_SLIP
                                                         : SG_ROW_FREE;
            }
        }
    }
    if (stick) {
        sg_fill(pr->n_x, SG_C(0.0), &w->x[pr->x]);
    }
}

/* Contact states that are guessed, if `first` says that others failed, then those along paths;
   Newton's method in those that are new and from there. */
static int sg_follow(SG(work) * w, const SG(params) * par, const SG(options) * opt, SG(info) * info,
                     int problem, int first, int turns, int end, real *measure) {
    const int n_lambda = sg_problems[problem].n_slots * SG_NC;
    unsigned long ends[SG_LAST_TURNS];
    int status = SG_K(NOT_CONVERGED);
    int count = 0;
    int turn;
    for (turn = first > 0 ? first - 2 : 0; turn < turns && info->iterations < end; ++turn) {
        int found = 1;
        ++info->iterations;
        if (turn < first) {
            sg_guess(w, par, opt, problem, turn + 1 < first);
        } else {
            found = sg_path(w, par, opt, problem, turn);
        }
        if (!found) {
            sg_cold_start(w, problem);
        } else if (!sg_ended_here(w, n_lambda, ends, &count)) {
            sg_settle(w, par, opt, problem, sg_budget(info, end, SG_HELD), &info->iterations);
            status = sg_newton(w, par, opt, problem, sg_budget(info, end, 5), 0, &info->iterations,
                               measure);
            if (status == SG_K(OK)) {
                return status;
            }
        }
    }
    return status;
}

/* In space the direction of slip turns on the way. */
#define SG_SPATIAL (SG_NF > SG_NK ? 1 : 0)

/* Raise all friction radii from zero, where the solution is easy to find, to their values: in
   steps that grow after a success and shrink after a failure. With `again` from where the radii
   were left. */
static int sg_raise(SG(work) * w, const SG(params) * par, const SG(options) * opt, SG(info) * info,
                    int problem, int again, int end, real *measure) {
    const sg_problem *pr = &sg_problems[problem];
    const int n_lambda = pr->n_slots * SG_NC;
    const int wish = again ? (end - info->iterations) / 2 : (1 + SG_SPATIAL) * SG_RAISING;
    const int last = info->iterations + sg_budget(info, end, wish);
    int status = SG_K(NOT_CONVERGED);
    real reached = again ? w->raised : SG_C(-1.0); /* the largest factor solved so far */
    real step = again ? w->raise_step : SG_C(1.0);
    if (again) {
        sg_copy(pr->n_x, w->x_kept, &w->x[pr->x]);
        sg_copy(n_lambda, w->lambda_kept, &w->lambda[pr->lambda]);
    }
    while (info->iterations < last && reached < SG_C(1.0) && step > SG_C(0.0078125)) {
        const real goal = reached < SG_C(0.0) ? SG_C(0.0) : reached + step;
        w->friction = goal < SG_C(1.0) ? goal : SG_C(1.0);
        status = sg_newton(w, par, opt, problem,
                           sg_budget(info, last, reached < SG_C(0.0) ? SG_PLAIN : 6), 1,
                           &info->iterations, measure);
        if (status == SG_K(OK)) {
            step = reached < SG_C(0.0) ? SG_C(0.5) : SG_C(2.0) * step;
            reached = w->friction;
            sg_copy(pr->n_x, &w->x[pr->x], w->x_kept);
            sg_copy(n_lambda, &w->lambda[pr->lambda], w->lambda_kept);
        } else if (reached < SG_C(0.0)) {
            break;
        } else {
            step = SG_C(0.5) * (w->friction - reached);
            sg_copy(pr->n_x, w->x_kept, &w->x[pr->x]);
            sg_copy(n_lambda, w->lambda_kept, &w->lambda[pr->lambda]);
        }
    }
    w->friction = SG_C(1.0);
    w->raised = reached;
    w->raise_step = step;
    return reached < SG_C(1.0) ? SG_K(NOT_CONVERGED) : status;
}

enum { SG_WARM_START, SG_COLD_START, SG_FOLLOW, SG_RAISE, SG_FOLLOW_ON, SG_ATTEMPTS };

/* How much is tried: in a substep, for a whole step, for a whole step once substeps have failed. */
enum { SG_SUBSTEP, SG_WHOLE, SG_LAST };

/* Solve one problem: from the warm start if there is one, from a cold start, along the path, with
   raised friction; in a substep along one path at most. The last time the problem that failed is,
   in space, raised further, and followed along more paths. No attempt begins once info.iterations
   has reached `end`. */
static int sg_solve(SG(work) * w, const SG(state) * s, const SG(params) * par,
                    const SG(options) * opt, SG(info) * info, int problem, int warm, int effort,
                    int end) {
    int status = SG_K(NOT_CONVERGED);
    real measure = SG_HUGE;
    const int last = effort == SG_LAST && problem == w->stuck;
    const int again = last && SG_SPATIAL && w->raised > SG_C(0.0);
    const int first = again ? SG_RAISE : last ? SG_FOLLOW_ON : warm ? SG_WARM_START : SG_COLD_START;
    const int more = last || (effort == SG_WHOLE && !SG_SPATIAL);
    const int attempts = more ? SG_ATTEMPTS : effort == SG_WHOLE ? SG_FOLLOW_ON : SG_RAISE;
    /* before substeps only the first half of the iterations goes into more paths */
    const int half = opt->max_iterations / 2;
    const int on = last || end < half ? end : half;
    int attempt;
    w->lenient = last;
    w->friction = SG_C(1.0);
    sg_prox_parameters(w, opt, problem);
    for (attempt = first; attempt < attempts && status != SG_K(OK) && info->iterations < end;
         ++attempt) {
        const int before = status;
        w->careful = last || attempt != first;
        if (attempt == SG_WARM_START) {
            sg_warm_start(w, s, problem);
        } else {
            sg_cold_start(w, problem);
        }
        sg_leave_out(w, problem);
        if (attempt == SG_FOLLOW) {
            status = sg_follow(w, par, opt, info, problem, 0, effort == SG_SUBSTEP ? 1 : SG_TURNS,
                               end, &measure);
        } else if (attempt == SG_FOLLOW_ON) {
            status = sg_follow(w, par, opt, info, problem, SG_TURNS, SG_LAST_TURNS, on, &measure);
        } else if (attempt == SG_RAISE) {
            status = sg_raise(w, par, opt, info, problem, again, end, &measure);
        } else {
            status = sg_newton(w, par, opt, problem, sg_budget(info, end, SG_PLAIN), 0,
                               &info->iterations, &measure);
        }
        if (status == SG_K(NOT_CONVERGED)) {
            status = before; /* singular or not finite says more */
        }
        if (status == SG_K(OK)) {
            info->rescues |= attempt == SG_FOLLOW || attempt == SG_FOLLOW_ON ? SG_PATH
                             : attempt == SG_RAISE                           ? SG_RAISED
                             : attempt == SG_COLD_START && warm              ? SG_COLD
                                                                             : 0;
        }
    }
    if (status == SG_K(OK) && w->deficiency > 0) {
        const int choice = sg_least_norm(w, par, opt, problem, &measure);
        info->percussions = choice > info->percussions ? choice : info->percussions;
    }
    if (status == SG_K(OK)) {
        info->residual = sg_max(info->residual, measure * sg_max(opt->tol, SG_FLOOR));
    }
    return status;
}
