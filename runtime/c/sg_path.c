#pragma once
#include "sg_linear.c"

/* Contact percussions of the problem linearised at the current point, found along a path. At its
   start all contacts are far apart: the gap rows are y + tau d with large tau. Then tau falls to
   zero; between two changes of a contact state the percussions are affine in tau, and where the
   path folds back tau rises for a while. In the plane this is the path of Lemke's method; in space
   a contact keeps the direction in which it began to slip. */

/* Start of the path: contacts open, friction elements slipping; w->path.d receives d. */
static void sg_path_start(SG(work) * w, const sg_problem *pr, int turn) {
    const int n = pr->n_slots * sg_n_R(w);
    int slot, c, k;
    w->path.first = pr->R;
    for (c = 0; c < n; ++c) {
        w->rows.kind[c] = SG_ROW_ZERO;
        w->rows.slip[c] = SG_C(0.0);
        w->path.d[c] = SG_C(0.0);
    }
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * sg_n_R(w);
        sg_bilateral_kinds(w, pr, slot);
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const sg_contact *contact = sg_contact_at(w, k);
            const int f = sg_slip_of(w, 0, k);
            const int opens = contact->normal >= 0 || contact->presser < 0;
            if (sg_joins(w, pr, k) && contact->components > 1 && turn > 0) {
                /* once there is a point to go by, it tells the direction of slip */
                (void)sg_friction_slip(w, k, &w->y[base + f], &w->rows.slip[base + f]);
            }
            if (sg_joins(w, pr, k) && opens) {
                /* irregular multiples, so that symmetric contacts close one after the other */
                const int row = contact->normal >= 0 ? sg_first_normal(w) + contact->normal : f;
                const real push =
                    SG_FABS(w->system.S[(base + row) * (n + 1)]) * w->scales.percussion_scale[row];
                w->path.d[base + row] =
                    sg_max(push, SG_FABS(w->linear.y_0[base + row])) *
                    sg_irregular((slot * sg_n_contacts(w) + k + 1) * (turn + 1));
                if (contact->normal < 0 && contact->components > 0) {
                    w->rows.kind[base + f] = SG_ROW_SLIP;
                    w->rows.slip[base + f] = SG_C(1.0);
                    w->rows.slip[base + f + contact->components - 1] =
                        contact->components == 1 ? SG_C(1.0) : SG_C(0.0);
                    w->rows.kind[base + f + contact->components - 1] = SG_ROW_SLIP;
                }
            }
        }
    }
}

/* Matrix of the present contact states in w->system.LU, factorised: rows and columns of all
   percussions that are neither zero nor tied to a normal percussion by slip. Returns their number,
   -1 if the matrix is singular. */
static int sg_path_factor(SG(work) * w, const sg_problem *pr) {
    const int n = pr->n_slots * sg_n_R(w);
    int m = 0;
    int a, b, c, d, k;
    for (c = 0; c < n; ++c) {
        if (w->rows.kind[c] == SG_ROW_FREE) {
            w->system.reduced[m] = c;
            ++m;
        }
    }
    for (a = 0; a < m; ++a) {
        const int row = w->system.reduced[a];
        for (b = 0; b < m; ++b) {
            w->system.LU[a * m + b] = w->system.S[w->system.reduced[b] * n + row];
        }
        w->system.LU[a * m + a] += sg_softness(w, n, row);
        /* gaps and velocities in one unit, so that a change of units changes no pivot */
        w->path.row_scale[a] = w->scales.r_auto[row] / sg_root_mass(w, row);
    }
    for (b = 0; b < m; ++b) {
        const int row = w->system.reduced[b];
        const int base = row - row % sg_rows_of_slot(w);
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const int f = base + sg_first_slip(w) + sg_contact_at(w, k)->friction;
            if (sg_contact_at(w, k)->pressing < 0 ||
                row != base + sg_first_normal(w) + sg_contact_at(w, k)->pressing) {
                continue;
            }
            for (d = 0; d < sg_contact_at(w, k)->components; ++d) {
                for (a = 0; a < m && w->rows.kind[f + d] == SG_ROW_SLIP; ++a) {
                    w->system.LU[a * m + b] -= sg_coefficient(w, base, k) * w->rows.slip[f + d] *
                                               w->system.S[(f + d) * n + w->system.reduced[a]];
                }
            }
        }
    }
    return m == 0 || sg_lu_factor(m, w->system.LU, w->path.row_scale, w->system.perm) ? m : -1;
}

/* Solve for percussions `R` whose rows are -`row`; friction of slipping contacts follows. */
static void sg_path_solve(SG(work) * w, const sg_problem *pr, int m, const real *row, real *R) {
    int a, d, k, slot;
    for (a = 0; a < m; ++a) {
        w->system.rhs[a] = -row[w->system.reduced[a]];
    }
    if (m > 0) {
        sg_lu_solve(m, w->system.LU, w->system.perm, w->system.rhs);
    }
    for (a = 0; a < m; ++a) {
        R[w->system.reduced[a]] = w->system.rhs[a];
    }
    for (slot = 0; slot < pr->n_slots; ++slot) {
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const sg_contact *contact = sg_contact_at(w, k);
            const int f = slot * sg_n_R(w) + sg_first_slip(w) + contact->friction;
            for (d = 0; d < contact->components && contact->pressing >= 0; ++d) {
                if (w->rows.kind[f + d] == SG_ROW_SLIP) {
                    R[f + d] = -sg_coefficient(w, slot * sg_n_R(w), k) * w->rows.slip[f + d] *
                               R[slot * sg_n_R(w) + sg_first_normal(w) + contact->pressing];
                }
            }
        }
    }
}

/* Percussions and rows where the path begins: only bilateral rows and slipping friction elements
   push, and they do so whatever tau is. Returns tau where the first contact closes, -1 on failure.
 */
static real sg_path_begin(SG(work) * w, const sg_problem *pr) {
    const int n = pr->n_slots * sg_n_R(w);
    const int m = sg_path_factor(w, pr);
    real tau = SG_C(0.0);
    int a, d, k, slot;
    if (m < 0) {
        return SG_C(-1.0);
    }
    sg_fill(n, SG_C(0.0), w->path.R);
    for (slot = 0; slot < pr->n_slots; ++slot) {
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const int f = slot * sg_n_R(w) + sg_first_slip(w) + sg_contact_at(w, k)->friction;
            for (d = 0; d < sg_contact_at(w, k)->components && sg_contact_at(w, k)->pressing < 0;
                 ++d) {
                if (w->rows.kind[f + d] == SG_ROW_SLIP) {
                    w->path.R[f + d] =
                        -sg_path_radius(w, slot * sg_n_R(w), k) * w->rows.slip[f + d];
                }
            }
        }
    }
    sg_copy(n, w->linear.y_0, w->path.y);
    sg_linear_rows(w, n, w->path.R, w->path.y);
    sg_path_solve(w, pr, m, w->path.y, w->path.R);
    sg_copy(n, w->linear.y_0, w->path.y);
    sg_linear_rows(w, n, w->path.R, w->path.y);
    for (a = 0; a < n; ++a) {
        if (w->path.d[a] > SG_C(0.0) && -w->path.y[a] > tau * w->path.d[a]) {
            tau = -w->path.y[a] / w->path.d[a];
        }
    }
    for (a = 0; a < n; ++a) {
        w->path.y[a] += tau * w->path.d[a];
    }
    return tau;
}

/* Rates of percussions and rows with tau in the present contact states. */
static int sg_path_rates(SG(work) * w, const sg_problem *pr) {
    const int n = pr->n_slots * sg_n_R(w);
    const int m = sg_path_factor(w, pr);
    if (m < 0) {
        return 0;
    }
    sg_fill(n, SG_C(0.0), w->path.R_rate);
    sg_path_solve(w, pr, m, w->path.d, w->path.R_rate);
    sg_copy(n, w->path.d, w->path.y_rate);
    sg_linear_rows(w, n, w->path.R_rate, w->path.y_rate);
    return sg_all_finite(n, w->path.y_rate) && sg_all_finite(n, w->path.R_rate);
}

/* A change of contact state on the path. */
typedef struct {
    int slot, contact, what;
    real at;
} sg_event;

/* The next change of state when tau moves in the given direction. `last` is the change that led
   here. */
static void sg_path_next(const SG(work) * w, const sg_problem *pr, real way, const sg_event *last,
                         sg_event *next) {
    int slot, k, d;
    next->at = SG_HUGE;
    next->slot = 0;
    next->contact = 0;
    next->what = SG_OPENS;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * sg_n_R(w);
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const sg_contact *contact = sg_contact_at(w, k);
            const int n = sg_normal_of(w, base, k);
            const int was = last->slot == slot && last->contact == k ? last->what : -1;
            real when[2] = {SG_HUGE, SG_HUGE};
            int what[2] = {SG_OPENS, SG_STICKS};
            if (!sg_joins(w, pr, k)) {
                continue;
            }
            if (contact->normal >= 0) {
                when[0] = sg_signorini_event(w, n, way, was, &what[0]);
            }
            if (sg_rubbing(w, k) > 0 && sg_is_pressed(w, base, k)) {
                when[1] = sg_friction_event(w, base, k, way, was, &what[1]);
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

/* What a change of state does to the friction of contact k. */
static void sg_path_friction(SG(work) * w, int base, int k, int what, real way) {
    const int f = sg_slip_of(w, base, k);
    const int components = sg_rubbing(w, k);
    int d;
    for (d = 0; d < components; ++d) {
        w->rows.kind[f + d] = what == SG_OPENS    ? SG_ROW_ZERO
                              : what == SG_STICKS ? SG_ROW_FREE
                                                  : SG_ROW_SLIP;
    }
    if (components > 0 && (what == SG_CLOSES || what == SG_SLIPS)) {
        sg_friction_slips(w, base, k, what, way);
    }
    for (d = 0; d < sg_contact_at(w, k)->components && what == SG_OPENS; ++d) {
        w->path.R[f + d] = SG_C(0.0);
    }
}

/* Carry out a change of state. A contact that opens or closes takes all friction along that it
   presses. */
static void sg_path_change(SG(work) * w, const sg_event *event, real way) {
    const int base = event->slot * sg_n_R(w);
    int k = event->contact;
    if (event->what == SG_STICKS || event->what == SG_SLIPS) {
        sg_path_friction(w, base, k, event->what, way);
        return;
    }
    w->rows.kind[sg_normal_of(w, base, k)] = event->what == SG_OPENS ? SG_ROW_ZERO : SG_ROW_FREE;
    if (event->what == SG_OPENS) {
        w->path.R[sg_normal_of(w, base, k)] = SG_C(0.0);
    }
    for (; k >= 0; k = sg_contact_at(w, k)->next) {
        sg_path_friction(w, base, k, event->what, way);
    }
}

/* Direction of tau, +1 or -1, in which the quantity of the last change grows; 0: none. */
static real sg_path_way(const SG(work) * w, const sg_event *last) {
    const int base = last->slot * sg_n_R(w);
    const int n = sg_normal_of(w, base, last->contact);
    const real rate = last->what == SG_OPENS ? w->path.y_rate[n]
                      : last->what == SG_CLOSES
                          ? w->path.R_rate[n]
                          : sg_friction_growth(w, base, last->contact, last->what);
    return rate > SG_C(0.0) ? SG_C(1.0) : rate < SG_C(0.0) ? SG_C(-1.0) : SG_C(0.0);
}

/* Follow the path; on success the unknowns are those of the linearised problem. */
static int sg_path(SG(work) * w, const SG(params) * par, const SG(options) * opt, int problem,
                   int turn) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int n = pr->n_slots * sg_n_R(w);
    const int limit = 8 * pr->n_slots * sg_n_contacts(w) + 16;
    real way = SG_C(-1.0);
    sg_event event = {0, -1, SG_OPENS, SG_C(0.0)};
    real tau;
    int change, a;
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
            w->path.R[a] += way * next.at * w->path.R_rate[a];
            w->path.y[a] += way * next.at * w->path.y_rate[a];
        }
        if (arrived) {
            return sg_arrive(w, pr, w->path.R);
        }
        sg_path_change(w, &next, way);
        event = next;
    }
    return 0;
}
