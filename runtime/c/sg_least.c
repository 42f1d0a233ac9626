/* Which percussions a step gets where dependent rows leave them open: those of least scaled norm
   in the closure of the present contact state, in which contacts press, sticking friction stays in
   its cone and sliding friction on the cone's boundary, against the same slip. */

/* Move scaled percussions to the nearest ones within their cones. */
static void sg_nearest_in_cones(const SG(work) * w, const sg_problem *pr, real *z) {
    int a = 0; /* position in the reduced system, in the order in which sg_reduce fills it */
    int slot, c, d, k;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * SG_NC;
        for (c = 0; c < SG_NORMAL; ++c) {
            a += w->kind[base + c] != SG_ROW_ZERO;
        }
        for (k = 0; k < SG_NK; ++k) {
            const sg_contact *contact = &sg_contacts[k];
            const int f = base + SG_SLIP + contact->friction;
            const int rubs = contact->components > 0 && w->kind[f] != SG_ROW_ZERO;
            const int sticks = rubs && w->kind[f] == SG_ROW_FREE;
            if (contact->normal >= 0 &&
                w->kind[base + SG_NORMAL + contact->normal] == SG_ROW_FREE) {
                real *push = &z[a];
                ++a;
                if (sticks) {
                    const real slope = w->mu[k] * w->root_scale[a - 1] / w->root_scale[a];
                    const real size = sg_norm(contact->components, &z[a]);
                    if (size > slope * *push) {
                        const real along =
                            sg_max((*push + slope * size) / (SG_C(1.0) + slope * slope), SG_C(0.0));
                        for (d = 0; d < contact->components; ++d) {
                            z[a + d] *= slope * along / size;
                        }
                        *push = along;
                    }
                } else {
                    *push = sg_max(*push, SG_C(0.0));
                }
            } else if (contact->normal < 0 && sticks) {
                const real radius = w->radius[slot * SG_NB + contact->bound] / w->root_scale[a];
                const real size = sg_norm(contact->components, &z[a]);
                for (d = 0; d < contact->components && size > radius; ++d) {
                    z[a + d] *= radius / size;
                }
            }
            a += rubs ? contact->components : 0;
        }
    }
}

/* From the least norm of all percussions that solve the reduced system, in work.solution, to the
   least norm of those within the cones: Dykstra's alternating projections. */
static void sg_least_in_cones(SG(work) * w, const sg_problem *pr, int n, int rank) {
    real *z = w->solution;
    real *inside = w->within;
    int sweep, a;
    sg_copy(n, z, w->least);
    sg_fill(n, SG_C(0.0), w->correction);
    for (sweep = 0; sweep < SG_SWEEPS; ++sweep) {
        real apart = SG_C(0.0);
        real size = SG_C(0.0);
        for (a = 0; a < n; ++a) {
            w->correction[a] += z[a];
            inside[a] = w->correction[a];
        }
        sg_nearest_in_cones(w, pr, inside);
        sg_copy(n, inside, z);
        sg_cod_project(n, rank, w->S, w->perm, w->tau_z, w->scratch, z);
        for (a = 0; a < n; ++a) {
            w->correction[a] -= inside[a];
            z[a] = w->least[a] + (inside[a] - z[a]);
            apart = sg_max(apart, SG_FABS(z[a] - inside[a]));
            size = sg_max(size, SG_FABS(z[a]));
        }
        if (apart <= SG_C(4.0) * SG_EPS * size) {
            return;
        }
    }
}

/* Move to the percussions in work.solution and the velocities that belong to them. Returns 1 if
   they solve the problem in the contact state `state`. */
static int sg_take_solution(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                            int problem, int n, unsigned long state, int *iterations,
                            real *measure) {
    const sg_problem *pr = &sg_problems[problem];
    const real *lambda = &w->lambda[pr->lambda];
    int a, i;
    sg_fill(pr->n_x, SG_C(0.0), w->dx);
    sg_fill(pr->n_slots * SG_NC, SG_C(0.0), w->dlambda);
    for (a = 0; a < n; ++a) {
        const int row = w->reduced[a];
        const real change = w->solution[a] * w->root_scale[a] - lambda[row];
        w->dlambda[row] = change;
        for (i = 0; i < pr->n_x; ++i) {
            w->dx[i] -= w->Z[a * pr->n_border + i] * change;
        }
    }
    sg_advance(w, problem);
    sg_evaluate(w, par, opt, problem);
    *measure = sg_residual(w, opt, problem);
    if (*measure > SG_C(1.0) && sg_fingerprint(w, pr->n_slots * SG_NC) == state) {
        /* the problem is not linear: the same contact states, solved */
        sg_settle(w, par, opt, problem, SG_HELD, iterations);
        sg_evaluate(w, par, opt, problem);
        *measure = sg_residual(w, opt, problem);
    }
    return *measure <= SG_C(1.0) && sg_fingerprint(w, pr->n_slots * SG_NC) == state;
}

/* Where dependent rows leave the percussions open, move to those of least scaled norm; kept only if
   they still solve the problem in the same contact state. */
static int sg_least_norm(SG(work) * w, const SG(params) * par, const SG(options) * opt, int problem,
                         int *iterations, real *measure) {
    const sg_problem *pr = &sg_problems[problem];
    const int n_lambda = pr->n_slots * SG_NC;
    real *lambda = &w->lambda[pr->lambda];
    unsigned long state;
    int n, rank, a, turn;
    sg_evaluate(w, par, opt, problem);
    *measure = sg_residual(w, opt, problem);
    if (*measure > SG_C(1.0)) {
        return SG_AS_FOUND;
    }
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
    for (turn = 0; turn < 2; ++turn) {
        for (a = 0; a < n; ++a) {
            w->solution[a] = lambda[w->reduced[a]] / w->root_scale[a];
        }
        sg_cod_project(n, rank, w->S, w->perm, w->tau_z, w->scratch, w->solution);
        if (turn > 0) {
            sg_least_in_cones(w, pr, n, rank);
        }
        if (sg_take_solution(w, par, opt, problem, n, state, iterations, measure)) {
            return SG_LEAST_NORM;
        }
        sg_copy(pr->n_x, w->x_old, &w->x[pr->x]);
        sg_copy(n_lambda, w->lambda_old, lambda);
        sg_evaluate(w, par, opt, problem);
        *measure = sg_residual(w, opt, problem);
        if (turn == 0) {
            /* settling may have overwritten the factors */
            SG(derivatives)(w, par, problem);
            n = sg_reduce(w, problem, 0);
            rank = n > 0 ? sg_cod_factor(n, w->S, w->perm, w->tau, w->tau_z) : n;
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
        for (c = 0; c < SG_NORMAL; ++c) {
            acting += w->kind[slot * SG_NC + c] != SG_ROW_ZERO;
        }
        for (k = 0; k < SG_NK; ++k) {
            const sg_contact *contact = &sg_contacts[k];
            acting += contact->normal >= 0
                          ? w->kind[slot * SG_NC + SG_NORMAL + contact->normal] == SG_ROW_FREE
                          : 1;
        }
        if (acting > 1) {
            return 1;
        }
    }
    return 0;
}

/* Choose among the percussions that solve the problem, and note the contact state for which the
   choice holds: work.states, work.choice. As long as the state stays, what was found of it in the
   step before is not found again. */
static void sg_choose(SG(work) * w, const SG(state) * s, const SG(params) * par,
                      const SG(options) * opt, SG(info) * info, int problem, int iterated,
                      real *measure) {
    const sg_problem *pr = &sg_problems[problem];
    const unsigned long print = sg_fingerprint(w, pr->n_slots * SG_NC) & 0x7fffffffUL;
    const int state = (int)print;
    const int same = s->warm > 0 && s->h_guess == w->h && s->states[problem] == state;
    int choice = SG_UNIQUE;
    if (same && (!iterated || (s->choice[problem] == SG_UNIQUE && w->deficiency == 0))) {
        choice = s->choice[problem];
    } else if (sg_may_depend(w, pr)) {
        choice = sg_least_norm(w, par, opt, problem, &info->iterations, measure);
    }
    w->states[problem] = state;
    w->choice[problem] = choice;
}
