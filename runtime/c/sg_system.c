#pragma once
#include "sg_contact.c"
#include "sg_linalg.c"
#include "sg_smooth.c"

/* The system reduced to the percussions: velocities are eliminated, and with them what needs no
   pivoting. */

/* Normal percussion that presses slip row k, -1 for other rows. */
static inline int sg_pressing(const SG(work) * w, int k) {
    const int c = k % sg_rows_of_slot(w) - sg_first_slip(w);
    const int pressing = c < 0 ? -1 : sg_contact_at(w, sg_slip_at(w, c)->contact)->pressing;
    return pressing < 0 ? -1 : k / sg_rows_of_slot(w) * sg_n_R(w) + sg_first_normal(w) + pressing;
}

/* Change of phi in row `row` of the reduced system for given changes of the kinematic rows, the
   change of the radius and the change of the percussion `column` (-1: none). */
static inline real sg_phi_change(const SG(work) * w, const sg_problem *pr, int row, const real *dy,
                                 real d_radius, int column) {
    const int c = row % sg_rows_of_slot(w) - sg_first_slip(w);
    if (c < 0 || w->rows.kind[row] == SG_ROW_FREE) {
        return w->scales.prox_r[row] * dy[row];
    } else {
        const int k = sg_slip_at(w, c)->contact;
        const int pressed = column >= 0 && column == sg_pressing(w, row) &&
                            (w->R[pr->R + column] >= SG_C(0.0) || sg_is_followed(w));
        const int base = row - row % sg_rows_of_slot(w);
        real change = d_radius + (pressed ? sg_coefficient(w, base, k) : SG_C(0.0));
        if (sg_contact_at(w, k)->loads > 0 && column >= 0 &&
            column / sg_rows_of_slot(w) == row / sg_rows_of_slot(w)) {
            change =
                w->mu[k] * sg_load_share(w, base, k, column % sg_rows_of_slot(w), &w->R[pr->R]);
        }
        return sg_friction_change(w, row, dy, change, column);
    }
}

/* 1 if the kinematics of row a of the reduced system are to vanish. */
static inline int sg_is_free(const SG(work) * w, int a) {
    const int row = w->system.reduced[a];
    return row % sg_rows_of_slot(w) < sg_first_slip(w) || w->rows.kind[row] == SG_ROW_FREE;
}

/* Right-hand side of row a of the reduced system. */
static inline void sg_right_side(SG(work) * w, const sg_problem *pr, int a) {
    const int row = w->system.reduced[a];
    const real *z = w->smooth.dx;
    real change;
    int e;
    if (sg_is_free(w, a)) {
        change = w->scales.prox_r[row] * sg_row_dot(&pr->C, w->C, row, z);
    } else {
        const sg_slip *slip = sg_slip_at(w, row % sg_rows_of_slot(w) - sg_first_slip(w));
        const int first = row - slip->component;
        for (e = 0; e < sg_contact_at(w, slip->contact)->components; ++e) {
            w->system.dy[first + e] = sg_row_dot(&pr->C, w->C, first + e, z);
        }
        change = sg_phi_change(w, pr, row, w->system.dy, sg_bound_change(w, pr, row, z), -1);
    }
    w->system.rhs[a] = -(w->rows.phi[row] + change) * w->system.inverse_scale[a];
}

/* Row a of the reduced system where its kinematics are to vanish. */
static inline void sg_free_row(SG(work) * w, const sg_problem *pr, int n, int a) {
    const int row = w->system.reduced[a];
    const real weight = w->scales.prox_r[row] * w->system.inverse_scale[a];
    int b;
    for (b = 0; b < n; ++b) {
        const real dy = sg_row_dot(&pr->C, w->C, row, &w->system.Z[b * pr->n_border]);
        w->system.S[b * n + a] = -(weight * w->system.root_scale[b]) * dy;
    }
    w->system.S[a * n + a] += weight * w->system.root_scale[a] * sg_compliance(w, pr->R + row);
}

/* Row a of the reduced system, slip row c of a slot, where its contact slips. */
static void sg_slipping_row(SG(work) * w, const sg_problem *pr, int n, int a, int c) {
    const int row = w->system.reduced[a];
    const sg_contact *contact = sg_contact_at(w, sg_slip_at(w, c)->contact);
    const int first = row - sg_slip_at(w, c)->component;
    real *dy = w->system.dy;
    int b, e;
    for (b = 0; b < n; ++b) {
        const real *z = &w->system.Z[b * pr->n_border];
        const int column = w->system.reduced[b];
        real change;
        for (e = 0; e < contact->components; ++e) {
            dy[first + e] = -sg_row_dot(&pr->C, w->C, first + e, z);
        }
        change = sg_phi_change(w, pr, row, dy, -sg_bound_change(w, pr, row, z), column);
        w->system.S[b * n + a] = change * w->system.root_scale[b] * w->system.inverse_scale[a];
    }
}

/* Right-hand side and matrix S of the reduced system, by columns, in scaled percussions. */
static void sg_percussion_system(SG(work) * w, const sg_problem *pr, int n) {
    int a;
    for (a = 0; a < n; ++a) {
        const int row = w->system.reduced[a];
        sg_right_side(w, pr, a);
        if (sg_is_free(w, a)) {
            sg_free_row(w, pr, n, a);
        } else {
            sg_slipping_row(w, pr, n, a, row % sg_rows_of_slot(w) - sg_first_slip(w));
        }
    }
}

/* 1 if the part of the right-hand side that dependent rows cannot reach matters. */
static int sg_is_contradictory(const SG(work) * w, const SG(options) * opt, int n, int rank) {
    real scale = SG_C(0.0);
    int a;
    for (a = 0; a < n; ++a) {
        const int c = w->system.reduced[a] % sg_rows_of_slot(w);
        scale = sg_max(scale, w->scales.percussion_scale[c] / w->system.root_scale[a]);
    }
    for (a = rank; a < n; ++a) {
        if (SG_FABS(w->system.rhs[a]) > sg_max(opt->tol, SG_FLOOR) * scale) {
            return 1;
        }
    }
    return 0;
}

/* Take percussion k into the reduced system, with what follows it. */
static void sg_take_in(SG(work) * w, int problem, int n, int k) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int f = w->system.follower[k];
    const real share = f < 0 ? SG_C(0.0) : sg_pressing_share(w, f, w->R[pr->R + k]);
    sg_answer(w, problem, k, f, share, &w->system.Z[n * pr->n_border]);
    w->system.reduced[n] = k;
    w->system.root_scale[n] = sg_root_mass(w, k);
    w->system.inverse_scale[n] = SG_C(1.0) / w->system.root_scale[n];
}

/* Set the change of percussion k to -known, for now, and add its effect to the right-hand side. */
static inline void sg_leave(SG(work) * w, const sg_problem *pr, int k, real known) {
    w->newton.dR[k] = -known;
    if (known != SG_C(0.0)) {
        sg_add_row(&pr->B, w->B, k, known, w->smooth.dx);
    }
}

/* 1 if so many percussions have room in a dense system. */
static inline int sg_have_room(int n) {
#if SG_JOINS
    return n <= SG_N_ACTING;
#else
    (void)n;
    return 1;
#endif
}

/* Percussions of a problem that are not zero. */
static int sg_acting(const SG(work) * w, const sg_problem *pr) {
    int count = 0;
    int a;
    for (a = 0; a < pr->n_slots * sg_n_R(w); ++a) {
        count += w->rows.kind[a] != SG_ROW_ZERO;
    }
    return count;
}

/* Eliminate the velocities and reduce to the percussions that are not zero. With `condensed` the
   bilateral percussions, if their rows are independent, and friction that follows a normal
   percussion are eliminated, too. Returns the number of percussions left, or -1 if the smooth block
   is singular, or if there is no room for them. */
static int sg_reduce(SG(work) * w, int problem, int condensed) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const real *R = &w->R[pr->R];
    int n = 0;
    int slot, c, d, k;
    /* friction sees the percussions that press it */
    condensed = condensed && sg_kind_of(w)->n_loads == 0;
    if (!sg_have_room(sg_acting(w, pr)) || !sg_factor_smooth(w, problem, condensed)) {
        return -1;
    }
    w->system.condensed = condensed;
    sg_smooth_rows(w, pr);
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * sg_n_R(w);
        for (c = 0; c < sg_first_normal(w); ++c) {
            w->system.follower[base + c] = -1;
            w->newton.dR[base + c] = SG_C(0.0);
            if (w->rows.kind[base + c] == SG_ROW_ZERO) {
                sg_leave(w, pr, base + c, R[base + c]);
            } else if (!w->smooth.bordered) {
                sg_take_in(w, problem, n, base + c);
                ++n;
            }
        }
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const sg_contact *contact = sg_contact_at(w, k);
            const int normal = base + sg_first_normal(w) + contact->normal;
            const int f = base + sg_first_slip(w) + contact->friction;
            const int pressed = contact->normal >= 0 && w->rows.kind[normal] == SG_ROW_FREE;
            const int tied = condensed && pressed && contact->components == 1 &&
                             contact->varies < 0 && w->rows.kind[f] == SG_ROW_SLIP;
            if (pressed) {
                w->system.follower[normal] = tied ? f : -1;
                w->newton.dR[normal] = SG_C(0.0);
                sg_take_in(w, problem, n, normal);
                ++n;
            } else if (contact->normal >= 0) {
                sg_leave(w, pr, normal, R[normal]);
            }
            for (d = 0; d < contact->components; ++d) {
                if (tied || w->rows.kind[f + d] == SG_ROW_ZERO) {
                    sg_leave(w, pr, f + d, tied ? w->rows.phi[f + d] : R[f + d]);
                } else {
                    w->system.follower[f + d] = -1;
                    w->newton.dR[f + d] = SG_C(0.0);
                    sg_take_in(w, problem, n, f + d);
                    ++n;
                }
            }
        }
    }
    sg_solve_smooth(w, problem, 0, w->smooth.dx);
    sg_percussion_system(w, pr, n);
    return n;
}

/* Solution of the reduced system if its rows are clearly independent; w->system.S stays as it is.
 */
static int sg_solve_regular(SG(work) * w, int n) {
    int a, b;
    if (n == 1 && SG_FABS(w->system.S[0]) > SG_C(0.0) && sg_finite(w->system.S[0])) {
        w->system.solution[0] = w->system.rhs[0] / w->system.S[0];
        return 1;
    }
    for (a = 0; a < n; ++a) {
        w->system.weight[a] = SG_C(1.0);
        w->system.solution[a] = w->system.rhs[a];
        for (b = 0; b < n; ++b) {
            w->system.LU[a * n + b] = w->system.S[b * n + a];
        }
    }
    if (!sg_lu_factor(n, w->system.LU, w->system.weight, w->system.perm) ||
        !sg_lu_is_regular(n, w->system.LU, SG_SMALL)) {
        return 0;
    }
    sg_lu_solve(n, w->system.LU, w->system.perm, w->system.solution);
    return 1;
}

/* Take over the solution of the reduced system into w->smooth.dx, w->newton.dR. */
static void sg_expand_direction(SG(work) * w, const sg_problem *pr, int n) {
    int a, i;
    for (a = 0; a < n; ++a) {
        const real change = w->system.solution[a] * w->system.root_scale[a];
        const real *Z = &w->system.Z[a * pr->n_border];
        const int row = w->system.reduced[a];
        const int follower = w->system.follower[row];
        w->newton.dR[row] = change;
        if (follower >= 0) {
            w->newton.dR[follower] += sg_pressing_share(w, follower, w->R[pr->R + row]) * change;
        }
        for (i = 0; i < pr->n_border; ++i) {
            w->smooth.dx[i] -= Z[i] * change;
        }
    }
    for (i = pr->n_x; i < pr->n_border && w->smooth.bordered; ++i) {
        w->newton.dR[pr->K.order[i] - pr->n_x] = w->smooth.dx[i];
    }
}
