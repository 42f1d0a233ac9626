/* Scales of one step: what each row is measured by, and the prox parameters. All scales are
   formed from quantities of the same unit or from ratios of squares, so that a change of units by
   powers of two changes no bit of the result. */

/* inertia[j] of every coordinate: |M_jj|, or what the row's largest entry says if that is zero. */
static void sg_inertia(const real *M, real *inertia) {
    int j, k;
    for (j = 0; j < SG_NQ; ++j) {
        inertia[j] = SG_FABS(M[j * SG_NQ + j]);
        if (!(inertia[j] > SG_C(0.0))) {
            for (k = 0; k < SG_NQ; ++k) {
                const real d = SG_FABS(M[k * SG_NQ + k]);
                const real m = SG_FABS(M[j * SG_NQ + k]);
                inertia[j] = sg_max(inertia[j], d > SG_C(0.0) ? m * m / d : m);
            }
        }
    }
}

/* m_eff = 1 / (w^T M^-1 w) of one direction; `solved` receives M^-1 w. */
static real sg_effective_mass(const real *lu, const int *pivot, const real *inertia, const real *w,
                              real *solved) {
    real loose = SG_C(0.0);
    real mobility;
    int j;
    sg_copy(SG_NQ, w, solved);
    sg_lu_solve(SG_NQ, lu, pivot, solved);
    mobility = SG_FABS(sg_dot(SG_NQ, w, solved));
    for (j = 0; j < SG_NQ; ++j) {
        loose += w[j] * w[j] / inertia[j];
    }
    /* An indefinite mass matrix may have directions without mobility of their own. */
    mobility = sg_max(mobility, SG_C(0.0009765625) * loose);
    return mobility > SG_C(0.0) ? SG_C(1.0) / mobility : SG_C(0.0);
}

/* Inertia, effective masses and the constant part of the momentum scales at the start of the step,
   from work.p, work.force_size, work.mass, work.direction. Returns 0 if the mass matrix is singular
   or anything is not finite. */
static int sg_masses(SG(work) * w) {
    real reference = SG_C(0.0);
    int c, j, k;
    sg_copy(SG_NQ * SG_NQ, w->mass, w->mass_lu);
    sg_inertia(w->mass, w->inertia);
    for (j = 0; j < SG_NQ; ++j) {
        w->root_inertia[j] = SG_SQRT(w->inertia[j] / w->inertia[0]);
        w->pivot_scale[j] = w->root_inertia[j];
        w->momentum[j] = sg_max(SG_FABS(w->p[j]), w->h * w->force_size[j]);
    }
    if (!sg_all_finite(SG_NQ, w->root_inertia) || !sg_all_finite(SG_NQ, w->momentum) ||
        !sg_lu_factor(SG_NQ, w->mass_lu, w->pivot_scale, w->mass_pivot)) {
        return 0;
    }
    for (c = 0; c < SG_NC; ++c) {
        w->m_eff[c] = sg_effective_mass(w->mass_lu, w->mass_pivot, w->inertia,
                                        &w->direction[c * SG_NQ], w->scratch);
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
            m[0] = m[1] = sg_max(m[0], m[1]);
        }
    }
    for (c = 0; c < SG_NC; ++c) {
        w->root_mass[c] = SG_SQRT(w->m_eff[c] / w->m_eff[0]);
    }
    return 1;
}

/* Round-off of a velocity row of a stage: where gaps are closed to their round-off, velocities of
   the stages are determined no better. */
static real sg_velocity_floor(const SG(work) * w, const sg_problem *pr, int slot, int c) {
    const real *response = sg_response[pr->response + slot];
    return slot < pr->gap_slots ? w->gap_floor[c] * response[1] / (w->h * response[0]) : SG_C(0.0);
}

/* Scales of the rows of one problem, from the start of the step and the velocities of the current
   iterate (a step may start from rest): momenta, speeds and percussions, rounding floors. */
static void sg_row_scales(SG(work) * w, int problem) {
    const sg_problem *pr = &sg_problems[problem];
    real energetic = SG_C(0.0);
    int c, i, j, k, slot;
    for (j = 0; j < SG_NQ; ++j) {
        w->pace[j] = SG_FABS(w->v[j]);
    }
    for (i = 0; i < pr->n_x; ++i) {
        w->pace[i % SG_NQ] = sg_max(w->pace[i % SG_NQ], SG_FABS(w->x[pr->x + i]));
    }
    for (j = 0; j < SG_NQ; ++j) {
        real inertial = SG_C(0.0);
        for (k = 0; k < SG_NQ; ++k) {
            inertial += SG_FABS(w->mass[j * SG_NQ + k]) * w->pace[k];
        }
        w->momentum_scale[j] = sg_max(w->momentum[j], inertial);
        energetic = sg_max(energetic, w->momentum_scale[j] / w->root_inertia[j]);
    }
    for (j = 0; j < SG_NQ; ++j) {
        w->momentum_scale[j] =
            sg_max(w->momentum_scale[j], SG_C(0.0009765625) * energetic * w->root_inertia[j]);
        w->pace[j] = sg_max(w->pace[j], w->momentum_scale[j] / w->inertia[j]);
    }
    for (c = 0; c < SG_NC; ++c) {
        const real *row = &w->direction[c * SG_NQ];
        real speed = SG_FABS(w->drift[c]);
        real size = SG_C(0.0);
        for (j = 0; j < SG_NQ; ++j) {
            speed += SG_FABS(row[j]) * w->pace[j];
            size += SG_FABS(row[j] * w->q[j]);
        }
        w->speed[c] = speed;
        w->gap_floor[c] = SG_FLOOR * (size + w->h * speed);
        w->percussion_scale[c] = w->m_eff[c] * speed;
    }
    for (slot = 0; slot < pr->n_slots; ++slot) {
        for (c = 0; c < SG_NC; ++c) {
            const int n = slot * SG_NC + c;
            w->phi_floor[n] = w->rounding[n] = SG_FLOOR * w->percussion_scale[c];
            if (sg_is_gap(pr, slot, c)) {
                w->phi_floor[n] += w->r_auto[n] * w->gap_floor[c];
                w->rounding[n] = w->phi_floor[n];
            } else {
                w->rounding[n] += w->r_auto[n] * sg_velocity_floor(w, pr, slot, c);
            }
        }
    }
}

/* Prox parameters of one problem: the inverse response of each row to its own percussion. */
static void sg_prox_parameters(SG(work) * w, const SG(options) * opt, int problem) {
    const sg_problem *pr = &sg_problems[problem];
    int slot, c;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const real *response = sg_response[pr->response + slot];
        for (c = 0; c < SG_NC; ++c) {
            const int k = slot * SG_NC + c;
            const int gap = sg_is_gap(pr, slot, c);
            w->r_auto[k] = gap ? w->m_eff[c] / (w->h * response[0]) : w->m_eff[c] / response[1];
            w->prox_r[k] = opt->r > SG_C(0.0) && c >= SG_NORMAL ? opt->r : w->r_auto[k];
        }
    }
}
