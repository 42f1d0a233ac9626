#pragma once
#include "sg_linear.c"

#if SG_SPATIAL
/* Contact percussions of the problem linearised at the current point, found along its central path:
   every law is smoothed by a share e of the row's percussion scale, percussions times gaps are e^2
   instead of zero, friction turns with the slip instead of leaping, and gaps are wider by e. For
   large e contacts are far apart and hardly push; as e falls to zero the laws become exact. Where
   the path folds back e rises for a while. In space, too, the direction of slip turns on the way.
 */

/* Scales of all rows in w->central.scale, one energy for all contacts; in w->central.wider how much
   wider gaps are: equally at first, then by irregular multiples. Returns 0 if nothing moves. */
static int sg_central_scales(SG(work) * w, const sg_problem *pr, int turn) {
    real common = SG_C(0.0);
    int c, k, slot;
    for (c = 0; c < sg_n_R(w); ++c) {
        common = sg_max(common, w->scales.percussion_scale[c] / sg_root_mass(w, c));
    }
    for (slot = 0; slot < pr->n_slots; ++slot) {
        for (c = 0; c < sg_n_R(w); ++c) {
            w->central.scale[slot * sg_n_R(w) + c] = common * sg_root_mass(w, c);
        }
        for (k = 0; k < sg_n_contacts(w); ++k) {
            if (sg_contact_at(w, k)->normal >= 0) {
                w->central.wider[sg_normal_of(w, slot * sg_n_R(w), k)] =
                    SG_WIDER * sg_irregular((slot * sg_n_contacts(w) + k + 1) * turn);
            }
        }
    }
    return common > SG_C(0.0);
}

/* Row `to` of the Jacobian gains weight times the change of kinematic row `from`. */
static void sg_central_add(SG(work) * w, int n, int to, int from, real weight) {
    int b;
    for (b = 0; b < n; ++b) {
        w->system.LU[to * n + b] += weight * w->system.S[b * n + from];
    }
    w->system.LU[to * n + from] += weight * sg_softness(w, n, from);
}

/* Rows of the friction of contact k in a slot with first row `base`. */
static void sg_central_friction(SG(work) * w, int n, const real *R, real e, int base, int k) {
    const sg_contact *contact = sg_contact_at(w, k);
    const int f = sg_slip_of(w, base, k);
    const real radius = sg_radius(w, base, k, R);
    sg_smoothed s;
    int d, j;
    sg_friction_smooth(w, k, f, e, &s);
    for (d = 0; d < contact->components; ++d) {
        const int row = f + d;
        w->central.rows[row] += radius * s.slip[d] / s.size;
        w->central.rates[row] =
            -radius * s.slip[d] / s.size * (s.soft / s.size) * (s.scale / s.size);
        for (j = contact->load; j < contact->load + contact->loads; ++j) {
            w->system.LU[row * n + base + j] +=
                w->mu[k] * sg_load_share(w, base, k, j, R) * s.slip[d] / s.size;
        }
        if (contact->pressing >= 0) {
            w->system.LU[row * n + base + sg_first_normal(w) + contact->pressing] +=
                sg_coefficient(w, base, k) * s.slip[d] / s.size;
        }
        for (j = 0; j < contact->components; ++j) {
            const real turn =
                (d == j ? SG_C(1.0) : SG_C(0.0)) - s.slip[d] / s.size * (s.along[j] / s.size);
            sg_central_add(w, n, row, f + j, radius / s.size * turn * w->scales.r_auto[f + j]);
        }
    }
}

/* Smoothed rows at (R, e) in w->central.rows, their derivatives by e in w->central.rates, by R in
   w->system.LU. */
static void sg_central_rows(SG(work) * w, const sg_problem *pr, const real *R, real e) {
    const int n = pr->n_slots * sg_n_R(w);
    int slot, c, k;
    sg_copy(n, w->linear.y_0, w->central.y);
    sg_linear_rows(w, n, R, w->central.y);
    sg_fill(n * n, SG_C(0.0), w->system.LU);
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * sg_n_R(w);
        for (c = base; c < base + sg_n_R(w); ++c) {
            w->central.rates[c] = SG_C(0.0);
            if (c < base + sg_first_normal(w) && sg_takes_part(pr, slot, c - base)) {
                w->central.rows[c] = w->scales.r_auto[c] * w->central.y[c];
                sg_central_add(w, n, c, c, w->scales.r_auto[c]);
            } else {
                w->central.rows[c] = R[c];
                w->system.LU[c * n + c] = SG_C(1.0);
            }
        }
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const int joins = sg_joins(w, pr, k);
            const int normal = sg_normal_of(w, base, k);
            if (joins && sg_contact_at(w, k)->normal >= 0) {
                real share, rate;
                w->central.rows[normal] -=
                    sg_signorini_smooth(w, normal, R[normal], e, &share, &rate);
                w->central.rates[normal] = rate;
                w->system.LU[normal * n + normal] -= share;
                sg_central_add(w, n, normal, normal, share * w->scales.r_auto[normal]);
            }
            if (joins && sg_rubbing(w, k) > 0) {
                sg_central_friction(w, n, R, e, base, k);
            }
        }
    }
}

/* Newton's direction at (R, e) in w->central.rows, and in w->central.rates how the path moves with
   the logarithm of e. Returns 0 if the Jacobian is singular or no directions are left. */
static int sg_central_directions(SG(work) * w, const sg_problem *pr, const real *R, real e) {
    const int n = pr->n_slots * sg_n_R(w);
    int c;
    if (w->central.directions == 0) {
        return 0;
    }
    --w->central.directions;
    sg_central_rows(w, pr, R, e);
    for (c = 0; c < n; ++c) {
        w->central.rows[c] = -w->central.rows[c];
        w->central.rates[c] *= -e;
        w->central.row_scale[c] = SG_C(1.0) / w->central.scale[c];
    }
    if (!sg_lu_factor(n, w->system.LU, w->central.row_scale, w->system.perm)) {
        return 0;
    }
    sg_lu_solve(n, w->system.LU, w->system.perm, w->central.rows);
    sg_lu_solve(n, w->system.LU, w->system.perm, w->central.rates);
    return sg_all_finite(n, w->central.rows) && sg_all_finite(n, w->central.rates);
}

/* Inner product of two changes of the percussions, in units of their scales or of the largest. */
static real sg_central_dot(const SG(work) * w, int n, real unit, const real *a, const real *b) {
    real sum = SG_C(0.0);
    int c;
    for (c = 0; c < n; ++c) {
        const real scale = unit * w->central.scale[c];
        sum += a[c] / scale * (b[c] / scale);
    }
    return sum;
}

/* 1 or the largest percussion in units of its scale. */
static real sg_central_unit(const SG(work) * w, int n, const real *R) {
    real unit = SG_C(1.0);
    int c;
    for (c = 0; c < n; ++c) {
        unit = sg_max(unit, SG_FABS(R[c]) / w->central.scale[c]);
    }
    return unit;
}

/* Where the path begins, in w->central.R. */
static int sg_central_begin(SG(work) * w, const sg_problem *pr, real e) {
    const int n = pr->n_slots * sg_n_R(w);
    int round, c, k, slot;
    sg_fill(n, SG_C(0.0), w->central.R);
    for (slot = 0; slot < pr->n_slots; ++slot) {
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const int normal = sg_normal_of(w, slot * sg_n_R(w), k);
            if (sg_joins(w, pr, k) && sg_contact_at(w, k)->normal >= 0) {
                w->central.R[normal] = e / w->central.wider[normal] * w->central.scale[normal];
            }
        }
    }
    for (round = 0; round < SG_CENTRAL_BEGIN; ++round) {
        real size;
        if (!sg_central_directions(w, pr, w->central.R, e)) {
            return 0;
        }
        size = sg_central_dot(w, n, sg_central_unit(w, n, w->central.R), w->central.rows,
                              w->central.rows);
        for (c = 0; c < n; ++c) {
            w->central.R[c] += w->central.rows[c];
        }
        if (size < SG_CENTRAL_CLOSE) {
            return 1;
        }
    }
    return 0;
}

/* Back to the path from the point in w->central.next, *e, at a right angle to the tangent. Returns
   the number of corrections, 0 if it is not found. */
static int sg_central_correct(SG(work) * w, const sg_problem *pr, real unit, real along, real *e) {
    const int n = pr->n_slots * sg_n_R(w);
    int round, c;
    for (round = 1; round <= SG_CENTRAL_CORRECT; ++round) {
        real turn, size, near;
        if (w->central.directions <= 2 || !sg_central_directions(w, pr, w->central.next, *e)) {
            return 0;
        }
        turn = sg_central_dot(w, n, unit, w->central.tangent, w->central.rates) + along;
        turn = turn != SG_C(0.0)
                   ? -sg_central_dot(w, n, unit, w->central.tangent, w->central.rows) / turn
                   : SG_HUGE;
        if (!(SG_FABS(turn) < SG_C(0.5))) {
            return 0;
        }
        for (c = 0; c < n; ++c) {
            w->central.rows[c] += turn * w->central.rates[c];
            w->central.next[c] += w->central.rows[c];
        }
        *e *= SG_C(1.0) + turn;
        size = sg_central_dot(w, n, unit, w->central.rows, w->central.rows) + turn * turn;
        near = *e < SG_C(1.0) ? *e : SG_C(1.0);
        if (size < SG_CENTRAL_CLOSE * near * near + SG_FLOOR * SG_FLOOR) {
            return round;
        }
        if (!(size < SG_CENTRAL_FAR)) {
            return 0;
        }
    }
    return 0;
}

/* Contact states at the end of the path, and the unknowns there. */
static int sg_central_arrive(SG(work) * w, const sg_problem *pr, real e) {
    int slot, c, d, k;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * sg_n_R(w);
        sg_bilateral_kinds(w, pr, slot);
        for (c = base; c < base + sg_first_normal(w); ++c) {
            w->central.R[c] = w->rows.kind[c] == SG_ROW_FREE ? w->central.R[c] : SG_C(0.0);
        }
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const sg_contact *contact = sg_contact_at(w, k);
            const int normal = sg_normal_of(w, base, k);
            const int f = sg_slip_of(w, base, k);
            real slip[SG_N_SLIP];
            int closed = sg_joins(w, pr, k);
            real size = SG_C(0.0);
            real soft = SG_C(0.0);
            sg_fill(SG_N_SLIP, SG_C(0.0), slip);
            if (contact->normal >= 0) {
                closed = closed &&
                         w->central.R[normal] > w->scales.r_auto[normal] * w->central.y[normal];
                w->rows.kind[normal] = closed ? SG_ROW_FREE : SG_ROW_ZERO;
                w->central.R[normal] = closed ? w->central.R[normal] : SG_C(0.0);
            }
            closed = closed && sg_is_pressed(w, base, k);
            if (contact->components > 0) {
                size = sg_friction_slip(w, k, &w->central.y[f], slip);
                soft = SG_BLURRED * e * sg_over_axis(w, contact->friction, w->central.scale[f]);
            }
            for (d = 0; d < contact->components; ++d) {
                const int rubs = closed && sg_rubbing(w, k) > 0;
                const int own = contact->friction + d;
                const real r = sg_over_axis(w, own, sg_over_axis(w, own, w->scales.r_auto[f + d]));
                const int slips = size * r > soft;
                w->rows.kind[f + d] = !rubs ? SG_ROW_ZERO : slips ? SG_ROW_SLIP : SG_ROW_FREE;
                w->rows.slip[f + d] = slip[d];
                w->central.R[f + d] = rubs ? w->central.R[f + d] : SG_C(0.0);
            }
        }
    }
    return sg_arrive(w, pr, w->central.R);
}

/* One stride along the tangent and back to the path; the stride is halved until that succeeds.
   Returns 0 if it never does. */
static int sg_central_stride(SG(work) * w, const sg_problem *pr, real unit, real along,
                             real *stride, real *e) {
    const int n = pr->n_slots * sg_n_R(w);
    int rounds = 0;
    real next = *e;
    int c;
    while (rounds == 0) {
        /* e falls to a tenth at most, and no more than doubles */
        if (*stride * along < -SG_CENTRAL_FALL) {
            *stride = -SG_CENTRAL_FALL / along;
        } else if (*stride * along > SG_C(1.0)) {
            *stride = SG_C(1.0) / along;
        }
        /* the last directions are for the point where the path may end */
        if (*stride < SG_CENTRAL_SHORT || w->central.directions <= 2) {
            return 0;
        }
        next = *e * (SG_C(1.0) + *stride * along);
        for (c = 0; c < n; ++c) {
            w->central.next[c] = w->central.R[c] + *stride * w->central.tangent[c];
        }
        rounds = sg_central_correct(w, pr, unit, along, &next);
        *stride *= rounds == 0 ? SG_C(0.5) : rounds < 3 ? SG_C(2.0) : SG_C(1.0);
    }
    sg_copy(n, w->central.next, w->central.R);
    *e = next;
    return 1;
}

/* Follow the central path; on success the unknowns are those of the linearised problem. */
static int sg_central(SG(work) * w, const SG(params) * par, const SG(options) * opt, int problem,
                      int turn) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int n = pr->n_slots * sg_n_R(w);
    real e = SG_CENTRAL_START;
    real stride = SG_C(0.5);
    real along = SG_C(-1.0); /* rate of the logarithm of e */
    real end = SG_CENTRAL_END;
    w->central.directions = sg_kind_of(w)->directions;
    if (!sg_linearise(w, par, opt, problem) || !sg_central_scales(w, pr, turn) ||
        !sg_central_begin(w, pr, e)) {
        return 0;
    }
    sg_fill(n, SG_C(0.0), w->central.tangent);
    for (;;) {
        const real unit = sg_central_unit(w, n, w->central.R);
        real length, agree;
        int c;
        if (!sg_central_directions(w, pr, w->central.R, e)) {
            return 0;
        }
        if (e < end) {
            return sg_central_arrive(w, pr, e);
        }
        if (end > SG_CENTRAL_END || e > SG_CENTRAL_FAR || unit > SG_CENTRAL_FAR) {
            return 0;
        }
        length =
            SG_SQRT(SG_C(1.0) + sg_central_dot(w, n, unit, w->central.rates, w->central.rates));
        agree = sg_central_dot(w, n, unit, w->central.tangent, w->central.rates) + along;
        along = (agree < SG_C(0.0) ? SG_C(-1.0) : SG_C(1.0)) / length;
        for (c = 0; c < n; ++c) {
            w->central.tangent[c] = along * w->central.rates[c];
        }
        if (!sg_central_stride(w, pr, unit, along, &stride, &e)) {
            end = SG_CENTRAL_NEAR; /* back to this point, which may do */
        }
    }
}
#endif
