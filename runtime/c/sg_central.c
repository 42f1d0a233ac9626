/* Contact percussions of the problem linearised at the current point, found along its central path:
   every law is smoothed by a share e of the row's percussion scale, percussions times gaps are e^2
   instead of zero, friction turns with the slip instead of leaping, and gaps are wider by e. For
   large e contacts are far apart and hardly push; as e falls to zero the laws become exact. Where
   the path folds back e rises for a while. In space, too, the direction of slip turns on the way.
   w->dlambda: the point on the path, w->lambda_best: its tangent, w->lambda_old: the next point. */

/* Scales of all rows in w->tau_z, one energy for all contacts; in w->ratio how much wider gaps are:
   equally at first, then by irregular multiples. Returns 0 if nothing moves. */
static int sg_central_scales(SG(work) * w, const sg_problem *pr, int turn) {
    real common = SG_C(0.0);
    int c, k, slot;
    for (c = 0; c < SG_NC; ++c) {
        common = sg_max(common, w->percussion_scale[c] / sg_root_mass(w, c));
    }
    for (slot = 0; slot < pr->n_slots; ++slot) {
        for (c = 0; c < SG_NC; ++c) {
            w->tau_z[slot * SG_NC + c] = common * sg_root_mass(w, c);
        }
        for (k = 0; k < SG_NK; ++k) {
            const int part = (37 * (slot * SG_NK + k + 1) * turn) % 64;
            if (sg_contacts[k].normal >= 0) {
                w->ratio[slot * SG_NC + SG_NORMAL + sg_contacts[k].normal] =
                    SG_WIDER * (SG_C(1.0) + (real)part * SG_C(0.015625));
            }
        }
    }
    return common > SG_C(0.0);
}

/* Row `to` of the Jacobian gains weight times the change of kinematic row `from`. */
static void sg_central_add(SG(work) * w, int n, int to, int from, real weight) {
    int b;
    for (b = 0; b < n; ++b) {
        w->cell[to * n + b] += weight * w->S[b * n + from];
    }
    w->cell[to * n + from] += weight * sg_softness(w, n, from);
}

/* Rows of the friction of contact k in a slot with first row `base`: -lambda_F is the radius times
   slip / sqrt(slip^2 + e^2), slips as percussions. */
static void sg_central_friction(SG(work) * w, int n, const real *lambda, real e, int base, int k) {
    const sg_contact *contact = &sg_contacts[k];
    const int f = base + SG_SLIP + contact->friction;
    const int normal = base + SG_NORMAL + contact->normal;
    const real scale = w->tau_z[f];
    const real soft = e * scale;
    real slip[2] = {SG_C(0.0), SG_C(0.0)};
    real size, radius;
    int d, j;
    for (d = 0; d < contact->components; ++d) {
        slip[d] = w->r_auto[f + d] * w->tau[f + d];
    }
    size = SG_SQRT(slip[0] * slip[0] + slip[1] * slip[1] + soft * soft);
    radius = contact->normal >= 0
                 ? w->mu[k] * lambda[normal]
                 : sg_max(w->radius[base / SG_ROWS * SG_NB + contact->bound], SG_C(0.0));
    for (d = 0; d < contact->components; ++d) {
        const int row = f + d;
        w->rhs[row] += radius * slip[d] / size;
        w->solution[row] = -radius * slip[d] / size * (soft / size) * (scale / size);
        if (contact->normal >= 0) {
            w->cell[row * n + normal] += w->mu[k] * slip[d] / size;
        }
        for (j = 0; j < contact->components; ++j) {
            const real turn = (d == j ? SG_C(1.0) : SG_C(0.0)) - slip[d] / size * (slip[j] / size);
            sg_central_add(w, n, row, f + j, radius / size * turn * w->r_auto[f + j]);
        }
    }
}

/* Smoothed rows at (lambda, e) in w->rhs, their derivatives by e in w->solution, by lambda in
   w->cell. */
static void sg_central_rows(SG(work) * w, const sg_problem *pr, const real *lambda, real e) {
    const int n = pr->n_slots * SG_NC;
    int slot, c, k;
    sg_copy(n, w->phi, w->tau);
    sg_path_rows(w, n, lambda, w->tau);
    sg_fill(n * n, SG_C(0.0), w->cell);
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * SG_NC;
        for (c = base; c < base + SG_NC; ++c) {
            w->solution[c] = SG_C(0.0);
            if (c < base + SG_NORMAL && sg_takes_part(pr, slot, c - base)) {
                w->rhs[c] = w->r_auto[c] * w->tau[c];
                sg_central_add(w, n, c, c, w->r_auto[c]);
            } else {
                w->rhs[c] = lambda[c];
                w->cell[c * n + c] = SG_C(1.0);
            }
        }
        for (k = 0; k < SG_NK; ++k) {
            const int joins = sg_joins(w, pr, k);
            const int normal = base + SG_NORMAL + sg_contacts[k].normal;
            if (joins && sg_contacts[k].normal >= 0) {
                const real scale = w->tau_z[normal];
                const real soft = e * scale;
                const real gap = w->r_auto[normal] * w->tau[normal] + w->ratio[normal] * soft;
                const real z = lambda[normal] - gap;
                const real size = SG_SQRT(z * z + SG_C(4.0) * soft * soft);
                const real share = SG_C(0.5) * (SG_C(1.0) + z / size);
                w->rhs[normal] -= SG_C(0.5) * (z + size);
                w->solution[normal] = scale * (w->ratio[normal] * share - SG_C(2.0) * soft / size);
                w->cell[normal * n + normal] -= share;
                sg_central_add(w, n, normal, normal, share * w->r_auto[normal]);
            }
            if (joins && sg_rubbing(w, k) > 0) {
                sg_central_friction(w, n, lambda, e, base, k);
            }
        }
    }
}

/* Newton's direction at (lambda, e) in w->rhs, and in w->solution how the path moves with the
   logarithm of e. Returns 0 if the Jacobian is singular or no directions are left. */
static int sg_central_directions(SG(work) * w, const sg_problem *pr, const real *lambda, real e) {
    const int n = pr->n_slots * SG_NC;
    int c;
    if (w->directions == 0) {
        return 0;
    }
    --w->directions;
    sg_central_rows(w, pr, lambda, e);
    for (c = 0; c < n; ++c) {
        w->rhs[c] = -w->rhs[c];
        w->solution[c] *= -e;
        w->root_scale[c] = SG_C(1.0) / w->tau_z[c];
    }
    if (!sg_lu_factor(n, w->cell, w->root_scale, w->perm)) {
        return 0;
    }
    sg_lu_solve(n, w->cell, w->perm, w->rhs);
    sg_lu_solve(n, w->cell, w->perm, w->solution);
    return sg_all_finite(n, w->rhs) && sg_all_finite(n, w->solution);
}

/* Inner product of two changes of the percussions, in units of their scales or of the largest. */
static real sg_central_dot(const SG(work) * w, int n, real unit, const real *a, const real *b) {
    real sum = SG_C(0.0);
    int c;
    for (c = 0; c < n; ++c) {
        const real scale = unit * w->tau_z[c];
        sum += a[c] / scale * (b[c] / scale);
    }
    return sum;
}

/* 1 or the largest percussion in units of its scale. */
static real sg_central_unit(const SG(work) * w, int n, const real *lambda) {
    real unit = SG_C(1.0);
    int c;
    for (c = 0; c < n; ++c) {
        unit = sg_max(unit, SG_FABS(lambda[c]) / w->tau_z[c]);
    }
    return unit;
}

/* Where the path begins, in w->dlambda. */
static int sg_central_begin(SG(work) * w, const sg_problem *pr, real e) {
    const int n = pr->n_slots * SG_NC;
    int round, c, k, slot;
    sg_fill(n, SG_C(0.0), w->dlambda);
    for (slot = 0; slot < pr->n_slots; ++slot) {
        for (k = 0; k < SG_NK; ++k) {
            const int normal = slot * SG_NC + SG_NORMAL + sg_contacts[k].normal;
            if (sg_joins(w, pr, k) && sg_contacts[k].normal >= 0) {
                w->dlambda[normal] = e / w->ratio[normal] * w->tau_z[normal];
            }
        }
    }
    for (round = 0; round < SG_CENTRAL_BEGIN; ++round) {
        real size;
        if (!sg_central_directions(w, pr, w->dlambda, e)) {
            return 0;
        }
        size = sg_central_dot(w, n, sg_central_unit(w, n, w->dlambda), w->rhs, w->rhs);
        for (c = 0; c < n; ++c) {
            w->dlambda[c] += w->rhs[c];
        }
        if (size < SG_C(1.0e-6)) {
            return 1;
        }
    }
    return 0;
}

/* Back to the path from the point in w->lambda_old, *e, at a right angle to the tangent. Returns
   the number of corrections, 0 if it is not found. */
static int sg_central_correct(SG(work) * w, const sg_problem *pr, real unit, real along, real *e) {
    const int n = pr->n_slots * SG_NC;
    int round, c;
    for (round = 1; round <= SG_CENTRAL_CORRECT; ++round) {
        real turn, size, near;
        if (w->directions <= 2 || !sg_central_directions(w, pr, w->lambda_old, *e)) {
            return 0;
        }
        turn = sg_central_dot(w, n, unit, w->lambda_best, w->solution) + along;
        turn = turn != SG_C(0.0) ? -sg_central_dot(w, n, unit, w->lambda_best, w->rhs) / turn
                                 : SG_HUGE;
        if (!(SG_FABS(turn) < SG_C(0.5))) {
            return 0;
        }
        for (c = 0; c < n; ++c) {
            w->rhs[c] += turn * w->solution[c];
            w->lambda_old[c] += w->rhs[c];
        }
        *e *= SG_C(1.0) + turn;
        size = sg_central_dot(w, n, unit, w->rhs, w->rhs) + turn * turn;
        near = *e < SG_C(1.0) ? *e : SG_C(1.0);
        if (size < SG_C(1.0e-6) * near * near + SG_FLOOR * SG_FLOOR) {
            return round;
        }
        if (!(size < SG_C(1.0e6))) {
            return 0;
        }
    }
    return 0;
}

/* Contact states at the end of the path, and the unknowns there. */
static int sg_central_arrive(SG(work) * w, const sg_problem *pr, real e) {
    int slot, c, d, k;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * SG_NC;
        sg_bilateral_kinds(w, pr, slot);
        for (c = base; c < base + SG_NORMAL; ++c) {
            w->dlambda[c] = w->kind[c] == SG_ROW_FREE ? w->dlambda[c] : SG_C(0.0);
        }
        for (k = 0; k < SG_NK; ++k) {
            const sg_contact *contact = &sg_contacts[k];
            const int normal = base + SG_NORMAL + contact->normal;
            const int f = base + SG_SLIP + contact->friction;
            const real soft = contact->components > 0 ? SG_C(8.0) * e * w->tau_z[f] : SG_C(0.0);
            int closed = sg_joins(w, pr, k);
            real size = SG_C(0.0);
            if (contact->normal >= 0) {
                closed = closed && w->dlambda[normal] > w->r_auto[normal] * w->tau[normal];
                w->kind[normal] = closed ? SG_ROW_FREE : SG_ROW_ZERO;
                w->dlambda[normal] = closed ? w->dlambda[normal] : SG_C(0.0);
            }
            size = contact->components > 0 ? sg_norm(contact->components, &w->tau[f]) : SG_C(0.0);
            for (d = 0; d < contact->components; ++d) {
                const int rubs = closed && sg_rubbing(w, k) > 0;
                const int slips = size * w->r_auto[f + d] > soft;
                w->kind[f + d] = !rubs ? SG_ROW_ZERO : slips ? SG_ROW_SLIP : SG_ROW_FREE;
                w->slip[f + d] = size > SG_C(0.0) ? w->tau[f + d] / size : SG_C(0.0);
                w->dlambda[f + d] = rubs ? w->dlambda[f + d] : SG_C(0.0);
            }
        }
    }
    return sg_path_arrive(w, pr);
}

/* One stride along the tangent and back to the path; the stride is halved until that succeeds.
   Returns 0 if it never does. */
static int sg_central_stride(SG(work) * w, const sg_problem *pr, real unit, real along,
                             real *stride, real *e) {
    const int n = pr->n_slots * SG_NC;
    int rounds = 0;
    real next = *e;
    int c;
    while (rounds == 0) {
        /* e falls to a tenth at most, and no more than doubles */
        if (*stride * along < SG_C(-0.9)) {
            *stride = SG_C(-0.9) / along;
        } else if (*stride * along > SG_C(1.0)) {
            *stride = SG_C(1.0) / along;
        }
        /* the last directions are for the point where the path may end */
        if (*stride < SG_CENTRAL_SHORT || w->directions <= 2) {
            return 0;
        }
        next = *e * (SG_C(1.0) + *stride * along);
        for (c = 0; c < n; ++c) {
            w->lambda_old[c] = w->dlambda[c] + *stride * w->lambda_best[c];
        }
        rounds = sg_central_correct(w, pr, unit, along, &next);
        *stride *= rounds == 0 ? SG_C(0.5) : rounds < 3 ? SG_C(2.0) : SG_C(1.0);
    }
    sg_copy(n, w->lambda_old, w->dlambda);
    *e = next;
    return 1;
}

/* Follow the central path; on success the unknowns are those of the linearised problem. */
static int sg_central(SG(work) * w, const SG(params) * par, const SG(options) * opt, int problem,
                      int turn) {
    const sg_problem *pr = &sg_problems[problem];
    const int n = pr->n_slots * SG_NC;
    real e = SG_CENTRAL_START;
    real stride = SG_C(0.5);
    real along = SG_C(-1.0); /* rate of the logarithm of e */
    real end = SG_CENTRAL_END;
    w->directions = SG_DIRECTIONS;
    if (!sg_linearise(w, par, opt, problem) || !sg_central_scales(w, pr, turn) ||
        !sg_central_begin(w, pr, e)) {
        return 0;
    }
    sg_fill(n, SG_C(0.0), w->lambda_best);
    for (;;) {
        const real unit = sg_central_unit(w, n, w->dlambda);
        real length, agree;
        int c;
        if (!sg_central_directions(w, pr, w->dlambda, e)) {
            return 0;
        }
        if (e < end) {
            return sg_central_arrive(w, pr, e);
        }
        if (end > SG_CENTRAL_END || e > SG_CENTRAL_FAR || unit > SG_CENTRAL_FAR) {
            return 0;
        }
        length = SG_SQRT(SG_C(1.0) + sg_central_dot(w, n, unit, w->solution, w->solution));
        agree = sg_central_dot(w, n, unit, w->lambda_best, w->solution) + along;
        along = (agree < SG_C(0.0) ? SG_C(-1.0) : SG_C(1.0)) / length;
        for (c = 0; c < n; ++c) {
            w->lambda_best[c] = along * w->solution[c];
        }
        if (!sg_central_stride(w, pr, unit, along, &stride, &e)) {
            end = SG_CENTRAL_NEAR; /* back to this point, which may do */
        }
    }
}
