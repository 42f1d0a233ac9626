/* Scales of one step: what each row is measured by, and the prox parameters. All scales are
   formed from quantities of the same unit or from ratios of squares, so that a change of units by
   powers of two changes no bit of the result. */

/* inertia of every coordinate: |M_jj|, or what the row's largest entry says if that is zero. */
static void sg_inertia(SG(work) * w) {
    int j, k;
    for (j = 0; j < SG_NQ; ++j) {
        real own = SG_FABS(w->mass[sg_table[sg_mass.diagonal + j]]);
        if (!(own > SG_C(0.0))) {
            const int last = sg_table[sg_mass.start + j + 1];
            for (k = sg_table[sg_mass.start + j]; k < last; ++k) {
                const real d =
                    SG_FABS(w->mass[sg_table[sg_mass.diagonal + sg_table[sg_mass.index + k]]]);
                const real m = SG_FABS(w->mass[k]);
                own = sg_max(own, d > SG_C(0.0) ? m * m / d : m);
            }
        }
        w->inertia[sg_table[sg_mass.order + j]] = own;
    }
}

/* Factorise the mass matrix. Returns 0 if it is singular or not finite. */
static int sg_factor_mass(SG(work) * w) {
    int k;
    for (k = 0; k < SG_NQ; ++k) {
        w->pivot_scale[k] = w->inertia[sg_table[sg_mass.order + k]];
    }
    w->exchanged = !sg_sparse_factor(0, SG_NQ, &sg_mass, w->pivot_scale, SG_SMALL, w->mass,
                                     w->factors, w->scratch);
    if (w->exchanged) {
        for (k = 0; k < SG_NQ; ++k) {
            w->pivot_scale[k] = SG_C(1.0) / w->root_inertia[sg_table[sg_mass.order + k]];
        }
        sg_expand(SG_NQ, &sg_mass, w->mass, w->full);
        return sg_lu_factor(SG_NQ, w->full, w->pivot_scale, w->pivot);
    }
    return 1;
}

/* 1 unless the mass matrix has a negative entry on its diagonal. */
static int sg_is_positive(const SG(work) * w) {
    int j;
    for (j = 0; j < SG_NQ; ++j) {
        if (w->mass[sg_table[sg_mass.diagonal + j]] < SG_C(0.0)) {
            return 0;
        }
    }
    return 1;
}

/* 1 if the generated code found the mobilities with pivots that are large enough. */
static int sg_has_mobility(const SG(work) * w) {
    int k;
    for (k = 0; k < SG_NQ && SG_MOBILITY; ++k) {
        if (!(w->mass_pivot[k] > SG_SMALL * w->inertia[sg_table[sg_mass.order + k]]) ||
            !sg_finite(w->mass_pivot[k])) {
            return 0;
        }
    }
    return SG_MOBILITY;
}

/* m_eff = 1 / (w^T M^-1 w) of direction c, with the factors of M. */
static real sg_effective_mass(SG(work) * w, int c) {
    real *solved = w->dx;
    real *row = w->scratch;
    const int last = sg_table[sg_direction.start + c + 1];
    real loose = SG_C(0.0);
    real mobility = SG_C(0.0);
    int k;
    sg_fill(SG_NQ, SG_C(0.0), row);
    for (k = sg_table[sg_direction.start + c]; k < last; ++k) {
        row[sg_table[sg_direction.index + k]] = w->direction[k];
        loose += w->direction[k] * w->direction[k] / w->inertia[sg_table[sg_direction.index + k]];
    }
    for (k = 0; k < SG_NQ; ++k) {
        solved[k] = row[sg_table[sg_mass.order + k]];
    }
    if (w->exchanged) {
        sg_lu_solve(SG_NQ, w->full, w->pivot, solved);
    } else {
        sg_sparse_solve(SG_NQ, &sg_mass, w->factors, 0, solved);
    }
    for (k = 0; k < SG_NQ; ++k) {
        mobility += solved[k] * row[sg_table[sg_mass.order + k]];
    }
    /* An indefinite mass matrix may have directions without mobility of their own. */
    mobility = sg_max(SG_FABS(mobility), SG_C(0.0009765625) * loose);
    return mobility > SG_C(0.0) ? SG_C(1.0) / mobility : SG_C(0.0);
}

/* Inertia, effective masses and the constant part of the momentum scales at the start of the step,
   from work.p, work.force_size, work.mass, work.direction. Returns 0 if the mass matrix is singular
   or anything is not finite. */
static int sg_masses(SG(work) * w) {
    real reference = SG_C(0.0);
    int c, j, k, known;
    w->formed = 0;
    sg_inertia(w);
    known = sg_has_mobility(w);
    for (j = 0; j < SG_NQ; ++j) {
        w->root_inertia[j] = SG_SQRT(w->inertia[j] / w->inertia[0]);
        w->momentum[j] = sg_max(SG_FABS(w->p[j]), w->h * w->force_size[j]);
    }
    if (!sg_is_positive(w) || !sg_all_finite(SG_NQ, w->root_inertia) ||
        !sg_all_finite(SG_NQ, w->momentum) || (!known && !sg_factor_mass(w))) {
        return 0;
    }
    for (c = 0; c < SG_NC; ++c) {
        const int last = sg_table[sg_direction.start + c + 1];
        w->reach[c] = SG_C(0.0);
        for (k = sg_table[sg_direction.start + c]; k < last; ++k) {
            w->reach[c] += SG_FABS(w->direction[k] * w->q[sg_table[sg_direction.index + k]]);
        }
        if (known) {
            w->m_eff[c] = w->mobility[c] > SG_C(0.0) ? SG_C(1.0) / w->mobility[c] : SG_C(0.0);
        } else {
            w->m_eff[c] = sg_effective_mass(w, c);
        }
        if (!sg_finite(w->m_eff[c])) {
            return 0;
        }
        if (!(reference > SG_C(0.0))) {
            reference = w->m_eff[c];
        }
    }
    for (c = 0; c < SG_NC; ++c) {
        /* A direction that vanishes at the start borrows a mass: it cannot push there anyway. */
        if (!(w->m_eff[c] > SG_C(0.0))) {
            w->m_eff[c] = reference > SG_C(0.0) ? reference : w->inertia[0];
        }
    }
    for (k = 0; k < SG_NK; ++k) {
        /* One effective mass for both components of a slip velocity: the law is isotropic. */
        if (sg_contacts[k].components == 2) {
            real *m = &w->m_eff[SG_SLIP + sg_contacts[k].friction];
            m[0] = sg_max(m[0], m[1]);
            m[1] = m[0];
        }
    }
    return 1;
}

/* Root of the effective mass of percussion row k relative to the first inertia. */
static real sg_root_mass(const SG(work) * w, int k) {
    return SG_SQRT(w->m_eff[k % SG_ROWS] / w->inertia[0]);
}

/* Velocity of a slot over its gap where one percussion changes both; 0 where there are no gaps.
   Where gaps are closed to their round-off, velocities of the stages are determined no better than
   this rate times that. */
static inline real sg_slot_rate(const SG(work) * w, const sg_problem *pr, int slot) {
    const real *response = sg_response[pr->response + slot];
    return slot < pr->gap_slots ? response[1] / (w->h * response[0]) : SG_C(0.0);
}

/* Largest velocity of every coordinate in the step. Returns 1 if all are within a factor of two of
   those that the scales were formed with. */
static int sg_keeps_pace(SG(work) * w, int problem) {
    const sg_problem *pr = &sg_problems[problem];
    int keeps = w->formed;
    int i, j;
    for (j = 0; j < SG_NQ; ++j) {
        w->scratch[j] = SG_FABS(w->v[j]);
    }
    for (i = pr->x; i < pr->x + pr->n_x; i += SG_NQ) {
        for (j = 0; j < SG_NQ; ++j) {
            w->scratch[j] = sg_max(w->scratch[j], SG_FABS(w->x[i + j]));
        }
    }
    for (j = 0; j < SG_NQ; ++j) {
        keeps &= w->scratch[j] <= SG_C(2.0) * w->fastest[j] &&
                 w->fastest[j] <= SG_C(2.0) * w->scratch[j];
    }
    return keeps;
}

/* Momenta of the rows at the present pace, and the pace that they stand for. */
static void sg_momentum_scales(SG(work) * w) {
    real energetic = SG_C(0.0);
    int i, j, k;
    for (i = 0; i < SG_NQ; ++i) {
        const int last = sg_table[sg_mass.start + i + 1];
        real inertial = SG_C(0.0);
        j = sg_table[sg_mass.order + i];
        for (k = sg_table[sg_mass.start + i]; k < last; ++k) {
            inertial += SG_FABS(w->mass[k]) *
                        w->pace[sg_table[sg_mass.order + sg_table[sg_mass.index + k]]];
        }
        w->momentum_scale[j] = sg_max(w->momentum[j], inertial);
        energetic = sg_max(energetic, w->momentum_scale[j] / w->root_inertia[j]);
    }
    for (j = 0; j < SG_NQ; ++j) {
        w->momentum_scale[j] =
            sg_max(w->momentum_scale[j], SG_C(0.0009765625) * energetic * w->root_inertia[j]);
        /* bounded, so that a row without any scale is solved by 0 alone */
        w->momentum_inverse[j] =
            w->momentum_scale[j] > SG_TINY ? SG_C(1.0) / w->momentum_scale[j] : SG_HUGE;
        w->pace[j] = sg_max(w->pace[j], w->momentum_scale[j] / w->inertia[j]);
    }
}

/* Scales of a step, from its start and the velocities of the current iterate (a step may start from
   rest): momenta, speeds and percussions. Formed anew only where these velocities change by more
   than a factor of two. */
static void sg_scales(SG(work) * w, int problem) {
    int c, k;
    if (sg_keeps_pace(w, problem)) {
        return;
    }
    w->formed = 1;
    w->floored = 0;
    sg_copy(SG_NQ, w->scratch, w->fastest);
    sg_copy(SG_NQ, w->scratch, w->pace);
    sg_momentum_scales(w);
    for (c = 0; c < SG_NC; ++c) {
        const int last = sg_table[sg_direction.start + c + 1];
        real speed = SG_FABS(w->drift[c]);
        for (k = sg_table[sg_direction.start + c]; k < last; ++k) {
            speed += SG_FABS(w->direction[k]) * w->pace[sg_table[sg_direction.index + k]];
        }
        w->speed[c] = speed;
        w->gap_floor[c] = SG_FLOOR * (w->reach[c] + w->h * speed);
        w->percussion_scale[c] = w->m_eff[c] * speed;
    }
}

/* Scales and rounding floors of the percussion rows of one problem. */
static void sg_row_scales(SG(work) * w, const SG(options) * opt, int problem) {
    const sg_problem *pr = &sg_problems[problem];
    const real tol = sg_max(opt->tol, SG_C(16.0) * SG_EPS);
    int c, slot;
    sg_scales(w, problem);
    if (w->floored == problem + 1) {
        return;
    }
    w->floored = problem + 1;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const real rate = sg_slot_rate(w, pr, slot);
        for (c = 0; c < SG_NC; ++c) {
            const int n = slot * SG_NC + c;
            const int gap = sg_is_gap(pr, slot, c);
            const real own = SG_FLOOR * w->percussion_scale[c];
            const real below = own + w->r_auto[n] * w->gap_floor[c] * (gap ? SG_C(1.0) : rate);
            const real floor = gap ? below : own;
            real tolerance;
            w->rounding[n] = below;
            w->phi_floor[n] = floor;
            /* bounded, so that a row without any scale is solved by 0 alone */
            tolerance = floor + tol * (w->percussion_scale[c] + floor);
            w->phi_inverse[n] = tolerance > SG_TINY ? SG_C(1.0) / tolerance : SG_HUGE;
        }
    }
}

/* Prox parameters of one problem: the inverse response of each row to its own percussion. */
static void sg_prox_parameters(SG(work) * w, const SG(options) * opt, int problem) {
    const sg_problem *pr = &sg_problems[problem];
    int slot, c;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const real *response = sg_response[pr->response + slot];
        const real gap = SG_C(1.0) / (w->h * response[0]);
        const real velocity = SG_C(1.0) / response[1];
        for (c = 0; c < SG_NC; ++c) {
            const int k = slot * SG_NC + c;
            w->r_auto[k] = w->m_eff[c] * (sg_is_gap(pr, slot, c) ? gap : velocity);
            w->prox_r[k] = opt->r > SG_C(0.0) && c >= SG_NORMAL ? opt->r : w->r_auto[k];
        }
    }
}
