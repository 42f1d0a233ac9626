/* Contact percussions of the problem linearised at the current point, found along a path. At its
   start all contacts are far apart: the gap rows are y + tau d with large tau. Then tau falls to
   zero; between two changes of a contact state the percussions are affine in tau, and where the
   path folds back tau rises for a while. In the plane this is the path of Lemke's method; in space
   a contact keeps the direction in which it began to slip. */

/* Linearise at the current point: w->dx, w->Z, the responses w->S[b * n + a] = dy_a/dlambda_b and
   w->phi, the kinematic rows without any percussion. Returns 0 if the smooth block is singular. */
static int sg_linearise(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                        int problem) {
    const sg_problem *pr = &sg_problems[problem];
    const int n = pr->n_slots * SG_NC;
    const real *lambda = &w->lambda[pr->lambda];
    int a, b;
    sg_evaluate(w, par, opt, problem);
    SG(derivatives)(w, par, problem);
    if (!sg_factor_smooth(w, problem, 0)) {
        return 0;
    }
    sg_smooth_rows(w, pr);
    sg_solve_smooth(w, problem, 0, w->dx);
    for (b = 0; b < n; ++b) {
        sg_answer(w, problem, b, b, SG_C(0.0), &w->Z[b * pr->n_border]);
    }
    for (a = 0; a < n; ++a) {
        w->phi[a] = w->y[a] + sg_row_dot(&pr->C, w->C, a, w->dx);
        for (b = 0; b < n; ++b) {
            w->S[b * n + a] = -sg_row_dot(&pr->C, w->C, a, &w->Z[b * pr->n_border]);
            w->phi[a] -= w->S[b * n + a] * lambda[b];
        }
    }
    return 1;
}

/* 1 if contact k takes part in the problem. */
static inline int sg_joins(const SG(work) * w, const sg_problem *pr, int k) {
    return w->exists[k] && (!pr->follows || w->active[k] || sg_contacts[k].normal < 0);
}

/* Slip components of contact k that friction acts on. */
static int sg_rubbing(const SG(work) * w, int k) {
    const sg_contact *contact = &sg_contacts[k];
    return contact->normal < 0 || w->mu[k] > SG_C(0.0) ? contact->components : 0;
}

/* Bilateral rows of a slot push if they take part. */
static void sg_bilateral_kinds(SG(work) * w, const sg_problem *pr, int slot) {
    int c;
    for (c = 0; c < SG_NORMAL; ++c) {
        w->kind[slot * SG_NC + c] = sg_takes_part(pr, slot, c) ? SG_ROW_FREE : SG_ROW_ZERO;
    }
}

/* Move the unknowns to the percussions in w->dlambda, in the linearised problem. Returns 0 if they
   are not finite there. */
static int sg_path_arrive(SG(work) * w, const sg_problem *pr) {
    const int n = pr->n_slots * SG_NC;
    real *lambda = &w->lambda[pr->lambda];
    int a, i;
    for (a = 0; a < n; ++a) {
        const real step = w->dlambda[a] - lambda[a];
        lambda[a] = w->dlambda[a];
        for (i = 0; i < pr->n_x; ++i) {
            w->dx[i] -= w->Z[a * pr->n_border + i] * step;
        }
    }
    for (i = 0; i < pr->n_x; ++i) {
        w->x[pr->x + sg_table[pr->K.order + i]] += w->dx[i];
    }
    return sg_all_finite(pr->n_x, &w->x[pr->x]) && sg_all_finite(n, lambda);
}

/* Start of the path: contacts open, friction elements slipping; w->ratio receives d. */
static void sg_path_start(SG(work) * w, const sg_problem *pr, int turn) {
    const int n = pr->n_slots * SG_NC;
    int slot, c, k;
    for (c = 0; c < n; ++c) {
        w->kind[c] = SG_ROW_ZERO;
        w->slip[c] = SG_C(0.0);
        w->ratio[c] = SG_C(0.0);
    }
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * SG_NC;
        sg_bilateral_kinds(w, pr, slot);
        for (k = 0; k < SG_NK; ++k) {
            const sg_contact *contact = &sg_contacts[k];
            const int f = SG_SLIP + contact->friction;
            if (sg_joins(w, pr, k)) {
                /* Irregular multiples, so that symmetric contacts close one after the other. */
                const int row = contact->normal >= 0 ? SG_NORMAL + contact->normal : f;
                const int part = (37 * (slot * SG_NK + k + 1) * (turn + 1)) % 64;
                const real push = SG_FABS(w->S[(base + row) * (n + 1)]) * w->percussion_scale[row];
                w->ratio[base + row] = sg_max(push, SG_FABS(w->phi[base + row])) *
                                       (SG_C(1.0) + (real)part * SG_C(0.015625));
                if (contact->components == 2 && turn > 0) {
                    /* Once there is a point to go by, it tells the direction of slip. */
                    const real rate = sg_norm(2, &w->y[base + f]);
                    if (rate > SG_C(0.0)) {
                        w->slip[base + f] = w->y[base + f] / rate;
                        w->slip[base + f + 1] = w->y[base + f + 1] / rate;
                    }
                }
                if (contact->normal < 0 && contact->components > 0) {
                    w->kind[base + f] = SG_ROW_SLIP;
                    w->slip[base + f] = SG_C(1.0);
                    w->slip[base + f + contact->components - 1] =
                        contact->components == 1 ? SG_C(1.0) : SG_C(0.0);
                    w->kind[base + f + contact->components - 1] = SG_ROW_SLIP;
                }
            }
        }
    }
}

/* Compliance of a row: where rows are dependent their percussions grow until one gives way. */
static real sg_softness(const SG(work) * w, int n, int row) {
    return SG_GIVE * SG_FABS(w->S[row * (n + 1)]);
}

/* Matrix of the present contact states in w->cell, factorised: rows and columns of all percussions
   that are neither zero nor tied to a normal percussion by slip. Returns their number, -1 if the
   matrix is singular. */
static int sg_path_factor(SG(work) * w, const sg_problem *pr) {
    const int n = pr->n_slots * SG_NC;
    int m = 0;
    int a, b, c, d, k;
    for (c = 0; c < n; ++c) {
        if (w->kind[c] == SG_ROW_FREE) {
            w->reduced[m] = c;
            ++m;
        }
    }
    for (a = 0; a < m; ++a) {
        const int row = w->reduced[a];
        for (b = 0; b < m; ++b) {
            w->cell[a * m + b] = w->S[w->reduced[b] * n + row];
        }
        w->cell[a * m + a] += sg_softness(w, n, row);
        /* gaps and velocities in one unit, so that a change of units changes no pivot */
        w->root_scale[a] = w->r_auto[row] / sg_root_mass(w, row);
    }
    for (b = 0; b < m; ++b) {
        const int row = w->reduced[b];
        const int base = row - row % SG_ROWS;
        for (k = 0; k < SG_NK; ++k) {
            const int f = base + SG_SLIP + sg_contacts[k].friction;
            if (sg_contacts[k].normal < 0 || row != base + SG_NORMAL + sg_contacts[k].normal) {
                continue;
            }
            for (d = 0; d < sg_contacts[k].components; ++d) {
                for (a = 0; a < m && w->kind[f + d] == SG_ROW_SLIP; ++a) {
                    w->cell[a * m + b] -=
                        w->mu[k] * w->slip[f + d] * w->S[(f + d) * n + w->reduced[a]];
                }
            }
        }
    }
    return m == 0 || sg_lu_factor(m, w->cell, w->root_scale, w->perm) ? m : -1;
}

/* Solve for percussions `lambda` whose rows are -`row`; friction of slipping contacts follows. */
static void sg_path_solve(SG(work) * w, const sg_problem *pr, int m, const real *row,
                          real *lambda) {
    int a, d, k, slot;
    for (a = 0; a < m; ++a) {
        w->rhs[a] = -row[w->reduced[a]];
    }
    if (m > 0) {
        sg_lu_solve(m, w->cell, w->perm, w->rhs);
    }
    for (a = 0; a < m; ++a) {
        lambda[w->reduced[a]] = w->rhs[a];
    }
    for (slot = 0; slot < pr->n_slots; ++slot) {
        for (k = 0; k < SG_NK; ++k) {
            const sg_contact *contact = &sg_contacts[k];
            const int f = slot * SG_NC + SG_SLIP + contact->friction;
            for (d = 0; d < contact->components && contact->normal >= 0; ++d) {
                if (w->kind[f + d] == SG_ROW_SLIP) {
                    lambda[f + d] = -w->mu[k] * w->slip[f + d] *
                                    lambda[slot * SG_NC + SG_NORMAL + contact->normal];
                }
            }
        }
    }
}

/* Kinematic rows y = constant + S lambda, with their compliance. */
static void sg_path_rows(const SG(work) * w, int n, const real *lambda, real *y) {
    int a, b;
    for (a = 0; a < n; ++a) {
        y[a] += sg_softness(w, n, a) * lambda[a];
        for (b = 0; b < n; ++b) {
            y[a] += w->S[b * n + a] * lambda[b];
        }
    }
}

/* Percussions and rows where the path begins: only bilateral rows and slipping friction elements
   push, and they do so whatever tau is. Returns tau where the first contact closes, -1 on failure.
 */
static real sg_path_begin(SG(work) * w, const sg_problem *pr) {
    const int n = pr->n_slots * SG_NC;
    const int m = sg_path_factor(w, pr);
    real tau = SG_C(0.0);
    int a, d, k, slot;
    if (m < 0) {
        return SG_C(-1.0);
    }
    sg_fill(n, SG_C(0.0), w->dlambda);
    for (slot = 0; slot < pr->n_slots; ++slot) {
        for (k = 0; k < SG_NK; ++k) {
            const int f = slot * SG_NC + SG_SLIP + sg_contacts[k].friction;
            for (d = 0; d < sg_contacts[k].components && sg_contacts[k].normal < 0; ++d) {
                if (w->kind[f + d] == SG_ROW_SLIP) {
                    w->dlambda[f + d] =
                        -sg_max(w->radius[slot * SG_NB + sg_contacts[k].bound], SG_C(0.0)) *
                        w->slip[f + d];
                }
            }
        }
    }
    sg_copy(n, w->phi, w->tau);
    sg_path_rows(w, n, w->dlambda, w->tau);
    sg_path_solve(w, pr, m, w->tau, w->dlambda);
    sg_copy(n, w->phi, w->tau);
    sg_path_rows(w, n, w->dlambda, w->tau);
    for (a = 0; a < n; ++a) {
        if (w->ratio[a] > SG_C(0.0) && -w->tau[a] > tau * w->ratio[a]) {
            tau = -w->tau[a] / w->ratio[a];
        }
    }
    for (a = 0; a < n; ++a) {
        w->tau[a] += tau * w->ratio[a];
    }
    return tau;
}

/* Rates of percussions and rows with tau in the present contact states: lambda_best, tau_z. */
static int sg_path_rates(SG(work) * w, const sg_problem *pr) {
    const int n = pr->n_slots * SG_NC;
    const int m = sg_path_factor(w, pr);
    if (m < 0) {
        return 0;
    }
    sg_fill(n, SG_C(0.0), w->lambda_best);
    sg_path_solve(w, pr, m, w->ratio, w->lambda_best);
    sg_copy(n, w->ratio, w->tau_z);
    sg_path_rows(w, n, w->lambda_best, w->tau_z);
    return sg_all_finite(n, w->tau_z) && sg_all_finite(n, w->lambda_best);
}

/* Smallest t > 0 at which value + rate t falls to zero; SG_HUGE if it does not. */
static real sg_path_zero(real value, real rate) {
    return rate < SG_C(0.0) ? sg_max(value, SG_C(0.0)) / -rate : SG_HUGE;
}

/* Margin of a sticking contact to its cone: (mu lambda_N)^2 - |lambda_F|^2 = c + b t + a t^2 along
   the path; returns the first zero beyond t = 0. `entering`: c is zero, the margin grows. */
static real sg_path_cone(real a, real b, real c, int entering) {
    real root, q;
    if (entering) {
        return b > SG_C(0.0) && a < SG_C(0.0) ? -b / a : SG_HUGE;
    }
    if (!(c > SG_C(0.0))) {
        return b < SG_C(0.0) || a < SG_C(0.0) ? SG_C(0.0) : SG_HUGE;
    }
    root = b * b - SG_C(4.0) * a * c;
    if (root < SG_C(0.0)) {
        return SG_HUGE;
    }
    /* Of the stable pair of roots q / a and c / q the smallest positive one. */
    q = b > SG_C(0.0) ? -(b + SG_SQRT(root)) / SG_C(2.0) : -(b - SG_SQRT(root)) / SG_C(2.0);
    {
        const real one = a != SG_C(0.0) ? q / a : SG_HUGE;
        const real two = q != SG_C(0.0) ? c / q : SG_HUGE;
        const real first = one > SG_C(0.0) ? one : SG_HUGE;
        const real second = two > SG_C(0.0) ? two : SG_HUGE;
        return first < second ? first : second;
    }
}

enum { SG_OPENS, SG_CLOSES, SG_STICKS, SG_SLIPS };

/* A change of contact state on the path. */
typedef struct {
    int slot, contact, what;
    real at;
} sg_event;

/* Radius of the friction ball and its rate with tau. */
static void sg_path_radius(const SG(work) * w, int slot, int k, real *radius, real *rate) {
    if (sg_contacts[k].normal >= 0) {
        const int n = slot * SG_NC + SG_NORMAL + sg_contacts[k].normal;
        *radius = w->mu[k] * w->dlambda[n];
        *rate = w->mu[k] * w->lambda_best[n];
    } else {
        *radius = sg_max(w->radius[slot * SG_NB + sg_contacts[k].bound], SG_C(0.0));
        *rate = SG_C(0.0);
    }
}

/* The next change of state when tau moves in the given direction. `last` is the change that led
   here: its own quantity is zero and grows. */
static void sg_path_next(const SG(work) * w, const sg_problem *pr, real way, const sg_event *last,
                         sg_event *next) {
    int slot, k, d;
    next->at = SG_HUGE;
    next->slot = 0;
    next->contact = 0;
    next->what = SG_OPENS;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * SG_NC;
        for (k = 0; k < SG_NK; ++k) {
            const sg_contact *contact = &sg_contacts[k];
            const int f = base + SG_SLIP + contact->friction;
            const int n = base + SG_NORMAL + contact->normal;
            const int components = sg_rubbing(w, k);
            const int was = last->slot == slot && last->contact == k ? last->what : -1;
            real when[2] = {SG_HUGE, SG_HUGE};
            int what[2] = {SG_OPENS, SG_STICKS};
            if (!sg_joins(w, pr, k)) {
                continue;
            }
            if (contact->normal >= 0 && w->kind[n] == SG_ROW_ZERO) {
                what[0] = SG_CLOSES;
                if (was != SG_OPENS) {
                    when[0] = sg_path_zero(w->tau[n], way * w->tau_z[n]);
                }
            } else {
                if (contact->normal >= 0 && was != SG_CLOSES) {
                    when[0] = sg_path_zero(w->dlambda[n], way * w->lambda_best[n]);
                }
                if (components > 0 && w->kind[f] == SG_ROW_SLIP) {
                    real value = SG_C(0.0);
                    real rate = SG_C(0.0);
                    for (d = 0; d < components; ++d) {
                        value += w->slip[f + d] * w->tau[f + d];
                        rate += w->slip[f + d] * w->tau_z[f + d];
                    }
                    if (was != SG_SLIPS) {
                        when[1] = sg_path_zero(value, way * rate);
                    }
                } else if (components > 0) {
                    real radius, rate, a, b, c;
                    sg_path_radius(w, slot, k, &radius, &rate);
                    a = rate * rate;
                    b = SG_C(2.0) * way * radius * rate;
                    c = radius * radius;
                    for (d = 0; d < components; ++d) {
                        const real force = w->dlambda[f + d];
                        a -= w->lambda_best[f + d] * w->lambda_best[f + d];
                        b -= SG_C(2.0) * way * force * w->lambda_best[f + d];
                        c -= force * force;
                    }
                    what[1] = SG_SLIPS;
                    when[1] = sg_path_cone(a, b, c, was == SG_STICKS);
                    if (was == SG_STICKS && !(radius > SG_C(0.0)) && a < SG_C(0.0)) {
                        when[1] = SG_C(0.0); /* from the apex friction would leave the cone */
                    }
                }
            }
            for (d = 0; d < 2; ++d) {
                if (when[d] < next->at) {
                    next->slot = slot;
                    next->contact = k;
                    next->what = what[d];
                    next->at = when[d];
                }
            }
        }
    }
}

/* Carry out a change of state. */
static void sg_path_change(SG(work) * w, const sg_event *event, real way) {
    const sg_contact *contact = &sg_contacts[event->contact];
    const int base = event->slot * SG_NC;
    const int components = sg_rubbing(w, event->contact);
    const int f = base + SG_SLIP + contact->friction;
    real direction[2] = {SG_C(1.0), SG_C(0.0)};
    real size;
    int known, d;
    if (event->what == SG_OPENS || event->what == SG_CLOSES) {
        w->kind[base + SG_NORMAL + contact->normal] =
            event->what == SG_OPENS ? SG_ROW_ZERO : SG_ROW_FREE;
    }
    for (d = 0; d < components; ++d) {
        /* Slips where it moves; from sticking against its friction. */
        direction[d] = event->what == SG_CLOSES ? w->tau[f + d] : -w->dlambda[f + d];
        w->kind[f + d] = event->what == SG_OPENS    ? SG_ROW_ZERO
                         : event->what == SG_STICKS ? SG_ROW_FREE
                                                    : SG_ROW_SLIP;
    }
    size = components > 0 ? sg_norm(components, direction) : SG_C(0.0);
    if (event->what == SG_SLIPS && !(size > SG_C(0.0))) {
        for (d = 0; d < components; ++d) {
            direction[d] = -way * w->lambda_best[f + d];
        }
        size = sg_norm(components, direction);
    }
    known = components == 2 && (w->slip[f] != SG_C(0.0) || w->slip[f + 1] != SG_C(0.0));
    for (d = 0; d < components; ++d) {
        if ((event->what == SG_CLOSES && !known) || event->what == SG_SLIPS) {
            w->slip[f + d] =
                size > SG_C(0.0) ? direction[d] / size : (d == 0 ? SG_C(1.0) : SG_C(0.0));
        }
    }
}

/* Direction of tau, +1 or -1, in which the quantity of the last change grows; 0: none. */
static real sg_path_way(const SG(work) * w, const sg_event *last) {
    const sg_contact *contact = &sg_contacts[last->contact];
    const int n = last->slot * SG_NC + SG_NORMAL + contact->normal;
    const int f = last->slot * SG_NC + SG_SLIP + contact->friction;
    real rate = SG_C(0.0);
    real radius;
    int d;
    if (last->what == SG_OPENS) {
        rate = w->tau_z[n];
    } else if (last->what == SG_CLOSES) {
        rate = w->lambda_best[n];
    } else if (last->what == SG_SLIPS) {
        for (d = 0; d < contact->components; ++d) {
            rate += w->slip[f + d] * w->tau_z[f + d];
        }
    } else {
        sg_path_radius(w, last->slot, last->contact, &radius, &rate);
        if (!(radius > SG_C(0.0)) && contact->normal >= 0) {
            /* closed without any slip: still at the apex of its cone */
            return rate > SG_C(0.0) ? SG_C(1.0) : rate < SG_C(0.0) ? SG_C(-1.0) : SG_C(0.0);
        }
        rate *= radius;
        for (d = 0; d < contact->components; ++d) {
            rate -= w->dlambda[f + d] * w->lambda_best[f + d];
        }
    }
    return rate > SG_C(0.0) ? SG_C(1.0) : rate < SG_C(0.0) ? SG_C(-1.0) : SG_C(0.0);
}

/* Follow the path; on success the unknowns are those of the linearised problem. */
static int sg_path(SG(work) * w, const SG(params) * par, const SG(options) * opt, int problem,
                   int turn) {
    const sg_problem *pr = &sg_problems[problem];
    const int n = pr->n_slots * SG_NC;
    const int limit = 8 * pr->n_slots * SG_NK + 16;
    real way = SG_C(-1.0);
    sg_event event = {0, -1, SG_OPENS, SG_C(0.0)};
    real tau;
    int change, a, i;
    if (!sg_linearise(w, par, opt, problem)) {
        return 0;
    }
    sg_path_start(w, pr, turn);
    tau = sg_path_begin(w, pr);
    if (tau < SG_C(0.0)) {
        return 0;
    }
    for (change = 0; change < limit; ++change) {
        sg_event next;
        int arrived;
        if (!sg_path_rates(w, pr)) {
            return 0;
        }
        if (change > 0) {
            way = sg_path_way(w, &event);
        }
        sg_path_next(w, pr, way, &event, &next);
        arrived = way < SG_C(0.0) && next.at >= tau;
        if (!arrived && (!(next.at < SG_HUGE) || way == SG_C(0.0))) {
            return 0;
        }
        next.at = arrived ? tau : next.at;
        tau += way * next.at;
        for (a = 0; a < n; ++a) {
            w->dlambda[a] += way * next.at * w->lambda_best[a];
            w->tau[a] += way * next.at * w->tau_z[a];
        }
        if (arrived) {
            return sg_path_arrive(w, pr);
        }
        sg_path_change(w, &next, way);
        if (next.what == SG_OPENS) {
            const int base = next.slot * SG_NC;
            const sg_contact *contact = &sg_contacts[next.contact];
            w->dlambda[base + SG_NORMAL + contact->normal] = SG_C(0.0);
            for (i = 0; i < contact->components; ++i) {
                w->dlambda[base + SG_SLIP + contact->friction + i] = SG_C(0.0);
            }
        }
        event = next;
    }
    return 0;
}

/* Rows with every contact in the state it is in; in space the direction of slip is that of the
   prox argument. */
static void sg_held_rows(SG(work) * w, const sg_problem *pr) {
    const int n = pr->n_slots * SG_NC;
    const real *lambda = &w->lambda[pr->lambda];
    int slot, c, d, k;
    for (c = 0; c < n; ++c) {
        w->phi[c] = w->kind[c] == SG_ROW_FREE ? w->prox_r[c] * w->y[c] : lambda[c];
        w->ratio[c] = SG_C(0.0);
    }
    for (slot = 0; slot < pr->n_slots; ++slot) {
        for (k = 0; k < SG_NK; ++k) {
            const sg_contact *contact = &sg_contacts[k];
            const int f = slot * SG_NC + SG_SLIP + contact->friction;
            const int n_k = slot * SG_NC + SG_NORMAL + contact->normal;
            const int slips = contact->components > 0 && w->kind[f] == SG_ROW_SLIP;
            const real radius = contact->normal >= 0
                                    ? w->mu[k] * sg_max(lambda[n_k], SG_C(0.0))
                                    : sg_max(w->radius[slot * SG_NB + contact->bound], SG_C(0.0));
            real z[2] = {SG_C(0.0), SG_C(0.0)};
            real size;
            for (d = 0; d < contact->components && slips && contact->components == 2; ++d) {
                z[d] = w->prox_r[f + d] * w->y[f + d] - lambda[f + d];
            }
            size = sg_norm(2, z);
            for (d = 0; d < contact->components && slips; ++d) {
                if (size > SG_C(0.0)) {
                    w->slip[f + d] = z[d] / size;
                    w->ratio[f + d] = sg_max(SG_C(0.0), radius / size);
                }
                w->phi[f + d] = lambda[f + d] + w->slip[f + d] * radius;
            }
        }
    }
}

/* Newton iterations in which every contact keeps the state that the path found, while they get
   nearer. */
static void sg_settle(SG(work) * w, const SG(params) * par, const SG(options) * opt, int problem,
                      int limit, int *iterations) {
    const sg_problem *pr = &sg_problems[problem];
    real past = SG_HUGE;
    int round;
    for (round = 0; round < limit; ++round) {
        real measure;
        SG(values)(w, par, problem);
        sg_row_scales(w, opt, problem);
        sg_held_rows(w, pr);
        measure = sg_residual(w, opt, problem);
        if (!(measure > SG_C(1.0)) || (round > 1 && !(measure < SG_C(0.5) * past))) {
            return;
        }
        past = measure;
        SG(derivatives)(w, par, problem);
        ++*iterations;
        if (sg_newton_direction(w, opt, problem, 0) < 0) {
            return;
        }
        sg_advance(w, problem);
    }
}
