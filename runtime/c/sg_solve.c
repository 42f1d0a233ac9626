/* Solution of one problem: starting points and rescues. What the checker rejects is not solved. */

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

/* Start from the prediction in the state. Percussions that are one of several stay as they are:
   their differences are of the choice, not of the motion. */
static void sg_warm_start(SG(work) * w, const SG(state) * s, int problem) {
    const sg_problem *pr = &sg_problems[problem];
    const real first = s->order > 0 ? SG_C(1.0) : SG_C(0.0);
    const real second = s->order > 1 ? SG_C(1.0) : SG_C(0.0);
    const int stay = s->choice[problem] != SG_UNIQUE;
    int i;
    for (i = pr->x; i < pr->x + pr->n_x; ++i) {
        w->x[i] = s->order < 0 ? w->v[(i - pr->x) % SG_NQ]
                               : s->x[i] + first * s->x_1[i] + second * s->x_2[i];
    }
    for (i = pr->lambda; i < pr->lambda + pr->n_slots * SG_NC; ++i) {
        const real change = first * s->lambda_1[i] + second * s->lambda_2[i];
        w->lambda[i] = s->lambda[i] + (stay ? SG_C(0.0) : change);
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
    for (k = 0; k < *count && !SG_SPATIAL; ++k) {
        if (ends[k] == here) {
            return 1;
        }
    }
    ends[*count] = here;
    ++*count;
    return 0;
}

/* Guess that contacts that touch at the start stick and hold everything. */
static void sg_hold(SG(work) * w, const SG(params) * par, const SG(options) * opt, int problem) {
    const sg_problem *pr = &sg_problems[problem];
    int slot, d, k;
    sg_fill(pr->n_x, SG_C(0.0), &w->x[pr->x]);
    sg_evaluate(w, par, opt, problem);
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * SG_NC;
        sg_bilateral_kinds(w, pr, slot);
        for (k = 0; k < SG_NK; ++k) {
            const sg_contact *contact = &sg_contacts[k];
            const int normal = base + SG_NORMAL + contact->normal;
            const int f = base + SG_SLIP + contact->friction;
            int closed = sg_joins(w, pr, k);
            if (contact->normal >= 0) {
                closed =
                    closed && !(w->r_auto[normal] * w->y[normal] > SG_BAND * w->phi_floor[normal]);
                w->kind[normal] = closed ? SG_ROW_FREE : SG_ROW_ZERO;
            }
            for (d = 0; d < contact->components; ++d) {
                w->kind[f + d] = closed && d < sg_rubbing(w, k) ? SG_ROW_FREE : SG_ROW_ZERO;
            }
        }
    }
}

/* Move percussions of contacts that stick well into their cones, each as little as possible.
   Returns how many were outside. */
static int sg_into_cones(SG(work) * w, const sg_problem *pr) {
    int outside = 0;
    int slot, d, k;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * SG_NC;
        real *lambda = &w->lambda[pr->lambda + base];
        for (k = 0; k < SG_NK; ++k) {
            const sg_contact *contact = &sg_contacts[k];
            const int normal = SG_NORMAL + contact->normal;
            const int f = SG_SLIP + contact->friction;
            const int sticks = contact->normal >= 0 && contact->components > 0 &&
                               w->kind[base + normal] == SG_ROW_FREE &&
                               w->kind[base + f] == SG_ROW_FREE;
            /* a percussion of friction that weighs as much as a unit of the normal one */
            const real unit = sticks ? sg_root_mass(w, f) / sg_root_mass(w, normal) : SG_C(1.0);
            const real mu = SG_C(0.984375) * w->mu[k] / unit;
            const real size = sticks ? sg_norm(contact->components, &lambda[f]) / unit : SG_C(0.0);
            if (sticks && unit * size > w->mu[k] * lambda[normal]) {
                const real push =
                    sg_max(lambda[normal] + mu * size, SG_C(0.0)) / (SG_C(1.0) + mu * mu);
                lambda[normal] = push;
                for (d = 0; d < contact->components && size > SG_C(0.0); ++d) {
                    lambda[f + d] *= mu * push / size;
                }
                ++outside;
            }
        }
    }
    return outside;
}

/* Newton's method from where a rescue arrived, first in the contact states that it found: there,
   where percussions are not unique, some within all cones are sought. */
static int sg_land(SG(work) * w, const SG(params) * par, const SG(options) * opt, SG(info) * info,
                   int problem, int held, int end, real *measure) {
    const int last = info->iterations + sg_budget(info, end, held);
    int outside = 1;
    while (outside > 0 && info->iterations < last) {
        sg_settle(w, par, opt, problem, sg_budget(info, last, SG_HELD), &info->iterations);
        outside = sg_into_cones(w, &sg_problems[problem]);
    }
    return sg_newton(w, par, opt, problem, sg_budget(info, end, SG_LANDING), 0, &info->iterations,
                     measure);
}

/* Contact states along paths number `turn` to `turns` - 1, each linearised where the one before
   led; Newton's method in those that are new and from there. */
static int sg_follow(SG(work) * w, const SG(params) * par, const SG(options) * opt, SG(info) * info,
                     int problem, int turn, int turns, int end, real *measure) {
    const int n_lambda = sg_problems[problem].n_slots * SG_NC;
    unsigned long ends[SG_LAST_TURNS];
    int status = SG_K(NOT_CONVERGED);
    int count = 0;
    for (; turn < turns && info->iterations < end; ++turn) {
        ++info->iterations;
        if (!sg_path(w, par, opt, problem, turn)) {
            sg_cold_start(w, problem);
        } else if (!sg_ended_here(w, n_lambda, ends, &count)) {
            status = sg_land(w, par, opt, info, problem, SG_HELD, end, measure);
            if (status == SG_K(OK)) {
                return status;
            }
        }
    }
    return status;
}

/* The same along at most `turns` central paths, each linearised where the one before ended. */
static int sg_follow_central(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                             SG(info) * info, int problem, int turns, int end, real *measure) {
    const sg_problem *pr = &sg_problems[problem];
    const int n_lambda = pr->n_slots * SG_NC;
    int status = SG_K(NOT_CONVERGED);
    int turn;
    for (turn = 0; turn < turns && info->iterations < end; ++turn) {
        ++info->iterations;
        if (!sg_central(w, par, opt, problem, turn)) {
            sg_cold_start(w, problem);
            continue;
        }
        sg_copy(pr->n_x, &w->x[pr->x], w->x_kept);
        sg_copy(n_lambda, &w->lambda[pr->lambda], w->lambda_kept);
        status = sg_land(w, par, opt, info, problem, SG_HELD, end, measure);
        if (status == SG_K(OK)) {
            return status;
        }
        sg_copy(pr->n_x, w->x_kept, &w->x[pr->x]);
        sg_copy(n_lambda, w->lambda_kept, &w->lambda[pr->lambda]);
    }
    return status;
}

enum {
    SG_HOLD,
    SG_WARM_START,
    SG_COLD_START,
    SG_FOLLOW,
    SG_FOLLOW_ON,
    SG_FOLLOW_CENTRAL,
    SG_ATTEMPTS
};

/* How much is tried: for a whole step, for it again once that failed, in a substep. */
enum { SG_WHOLE, SG_AGAIN, SG_SUBSTEP };

/* 1 if an attempt belongs to the effort: paths in the plane, central paths in space, in a substep
   few of them; again only contacts that hold, in the problem that failed or that it follows. */
static int sg_is_tried(const SG(work) * w, int problem, int attempt, int warm, int effort) {
    const int stuck = effort == SG_AGAIN && problem == w->stuck;
    const int ahead =
        effort == SG_AGAIN && problem + 1 == w->stuck && sg_problems[w->stuck].follows;
    switch (attempt) {
        case SG_HOLD:
            return stuck || ahead;
        case SG_WARM_START:
            return warm && !stuck;
        case SG_FOLLOW_ON:
            return !SG_SPATIAL && effort != SG_SUBSTEP && !stuck;
        case SG_FOLLOW_CENTRAL:
            return SG_SPATIAL && !stuck;
        default:
            return !stuck;
    }
}

/* Solve one problem: from the warm start if there is one, from a cold start, along paths. No
   attempt begins once info.iterations has reached `end`. */
static int sg_solve(SG(work) * w, const SG(state) * s, const SG(params) * par,
                    const SG(options) * opt, SG(info) * info, int problem, int warm, int effort,
                    int end) {
    static const int rescue[SG_ATTEMPTS] = {SG_PATH, 0, SG_COLD, SG_PATH, SG_PATH, SG_CENTRAL_PATH};
    int status = SG_K(NOT_CONVERGED);
    real measure = SG_HUGE;
    const int stuck = effort == SG_AGAIN && problem == w->stuck;
    /* of the first half of the iterations something is left for what comes after more paths */
    const int half = opt->max_iterations / 2;
    const int on = effort == SG_WHOLE && half < end ? half : end;
    int attempt;
    w->lenient = stuck;
    w->careful = stuck;
    sg_prox_parameters(w, opt, problem);
    for (attempt = SG_HOLD; attempt < SG_ATTEMPTS && status != SG_K(OK) && info->iterations < end;
         ++attempt) {
        const int before = status;
        const int used = info->iterations;
        if (!sg_is_tried(w, problem, attempt, warm, effort)) {
            continue;
        }
        w->at_rest = attempt == SG_WARM_START && s->order < 0;
        if (attempt == SG_WARM_START) {
            sg_warm_start(w, s, problem);
        } else {
            sg_cold_start(w, problem);
        }
        sg_leave_out(w, problem);
        if (attempt == SG_HOLD) {
            ++info->iterations;
            sg_hold(w, par, opt, problem);
            status = sg_land(w, par, opt, info, problem, SG_HOLDING, end, &measure);
        } else if (attempt == SG_FOLLOW) {
            status = sg_follow(w, par, opt, info, problem, 0, effort == SG_SUBSTEP ? 1 : SG_TURNS,
                               end, &measure);
        } else if (attempt == SG_FOLLOW_ON) {
            status = sg_follow(w, par, opt, info, problem, SG_TURNS, SG_LAST_TURNS, on, &measure);
        } else if (SG_SPATIAL &&
                   attempt == SG_FOLLOW_CENTRAL) { /* no code where it is not needed */
            status = sg_follow_central(w, par, opt, info, problem,
                                       effort == SG_SUBSTEP ? SG_SUBSTEP_TURNS : SG_CENTRAL_TURNS,
                                       end, &measure);
        } else {
            status = sg_newton(w, par, opt, problem, sg_budget(info, end, SG_PLAIN), 0,
                               &info->iterations, &measure);
        }
        w->careful = 1;
        if (status == SG_K(OK)) {
            sg_choose(w, s, par, opt, info, problem, info->iterations > used, &measure);
            sg_keep_rows(w, problem);
            status = sg_check_problem(w, opt, problem) ? SG_K(OK) : SG_K(REJECTED);
        }
        if (status == SG_K(NOT_CONVERGED)) {
            status = before; /* singular, not finite or rejected says more */
        }
        if (status == SG_K(OK) && (warm || attempt != SG_COLD_START)) {
            info->rescues |= rescue[attempt];
        }
    }
    if (status == SG_K(OK)) {
        const int choice = w->choice[problem];
        info->percussions = choice > info->percussions ? choice : info->percussions;
        info->residual = sg_max(info->residual, measure * sg_max(opt->tol, SG_FLOOR));
    }
    return status;
}
