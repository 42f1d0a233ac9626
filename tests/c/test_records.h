/* Unit tests of what a run reports: rows of a record, the stable step, percussions chosen where
   rows depend on each other. Part of test_model.c. */

enum { TAKEN = 60, EVERY = 7, BEGUN = 3, NOTED = 5 };

/* A run with a record that differs in what it holds ends where the run of `done` steps does. */
static void check_end(const m_state *start, const double inputs[], double h, int done,
                      const m_record *record) {
    m_state s = *start;
    int alone;
    m_simulate(&s, &work, &info, &par, &opt, inputs, h, TAKEN, EVERY, record, &alone);
    ENSURE(alone == done && s.t == state.t);
    ENSURE(memcmp(s.q, state.q, sizeof s.q) == 0);
}

/* Rows of a record are sums, extremes and last values of the steps they stand for. */
static void test_records(void) {
    static double t[TAKEN], q[TAKEN * SG_N_Q], v[TAKEN * SG_N_Q], P[TAKEN * SG_N_R + 1];
    static double residual[TAKEN], gap[TAKEN], energy[2 * TAKEN], inputs[TAKEN * INPUTS];
    static double stage_t[TAKEN * SG_N_STAGES], stage_q[TAKEN * SG_N_STAGES * SG_N_Q];
    static double stage_v[TAKEN * SG_N_STAGES * SG_N_Q], stage_R[TAKEN * SG_N_STAGES * SG_N_R + 1];
    static int counts[SG_COUNTS * TAKEN], contact[TAKEN * (SG_N_CONTACTS > 0 ? SG_N_CONTACTS : 1)];
    static m_event events[NOTED];
    int done, alone, run, n_events;
    for (run = 0; run < 4; ++run) {
        const double h = run % 2 == 0 ? 1e-2 : 5e-2;
        m_record all = {t,      q,       v,       P,       residual,  gap,
                        energy, counts,  contact, events,  &n_events, NOTED,
                        BEGUN,  stage_t, stage_q, stage_v, stage_R};
        m_record nothing;
        m_state start;
        double sum[SG_N_R + 1] = {0}, low = 0.0, high = 0.0;
        int row = 0, iterations = 0, changes = 0, impacts = 0, k, n;
        memset(&nothing, 0, sizeof nothing);
        draw_start();
        start = state;
        for (n = 0; n < TAKEN * INPUTS; ++n) {
            inputs[n] = uniform();
        }
        n_events = 0;
        /* row 0 goes on with what an earlier call left: nothing, here */
        sg_fill(SG_N_R, 0.0, P);
        memset(counts, 0, SG_COUNTS * sizeof counts[0]);
        energy[0] = SG_HUGE;
        energy[1] = -SG_HUGE;
        m_simulate(&state, &work, &info, &par, &opt, inputs, h, TAKEN, EVERY, &all, &done);
        /* the same alone, step by step */
        other = work;
        {
            m_state s = start;
            for (n = 0; n < done; ++n) {
                int before[SG_N_CONTACTS > 0 ? SG_N_CONTACTS : 1] = {0};
                const double begins = sg_energy_at(s.t, s.q, s.v, &par);
                double ends;
                const int first = n == 0 || (n + BEGUN) % EVERY == 0;
                for (k = 0; k < SG_N_CONTACTS; ++k) {
                    before[k] = s.contact[k];
                }
                ENSURE(m_step(&s, &other, &info, &par, &opt, &inputs[n * INPUTS], h) <=
                       M_OK_SUBSTEPPED);
                ends = sg_energy_at(s.t, s.q, s.v, &par);
                low = first ? ends : fmin(low, ends);
                high = first ? ends : fmax(high, ends);
                iterations = first ? info.iterations : iterations + info.iterations;
                for (k = 0; k < SG_N_R; ++k) {
                    sum[k] = first ? info.P[k] : sum[k] + info.P[k];
                }
                for (k = 0; k < SG_N_CONTACTS; ++k) {
                    const int changed = before[k] != info.contact[k] && before[k] != M_UNKNOWN;
                    if ((info.impacts[k] > 0 || changed) && changes < NOTED) {
                        const m_event *e = &events[changes];
                        ENSURE(e->contact == k && e->t == s.t);
                        ENSURE((e->kind == M_EVENT_IMPACT) == (info.impacts[k] > 0));
                        ENSURE(e->energy == (info.impacts[k] > 0 ? ends - begins : 0.0));
                    }
                    changes += info.impacts[k] > 0 || changed;
                    impacts = (first && k == 0 ? 0 : impacts) + info.impacts[k];
                }
                row = (n + BEGUN) / EVERY;
                if ((n + 1 + BEGUN) % EVERY == 0 || n + 1 == done) {
                    ENSURE(t[row] == s.t && counts[SG_COUNTS * row + 1] == iterations);
                    ENSURE(SG_N_CONTACTS == 0 || counts[SG_COUNTS * row + 6] == impacts);
                    ENSURE(energy[2 * row] == low && energy[2 * row + 1] == high);
                    for (k = 0; k < SG_N_R; ++k) {
                        ENSURE(P[row * SG_N_R + k] == sum[k]);
                    }
                    for (k = 0; k < SG_N_Q; ++k) {
                        ENSURE(q[row * SG_N_Q + k] == s.q[k] && v[row * SG_N_Q + k] == s.v[k]);
                    }
                    ENSURE((stage_t[row * SG_N_STAGES] != stage_t[row * SG_N_STAGES]) ==
                           (info.substeps > 0));
                }
            }
            ENSURE(n_events == changes);
            ENSURE(done == 0 || s.t == state.t);
        }
        /* pointers left out change nothing, one by one or all */
        check_end(&start, inputs, h, done, &nothing);
        check_end(&start, inputs, h, done, NULL);
        for (n = 0; n < 13; ++n) {
            m_record some = all;
            some.t = n == 0 ? NULL : some.t;
            some.q = n == 1 ? NULL : some.q;
            some.v = n == 2 ? NULL : some.v;
            some.P = n == 3 ? NULL : some.P;
            some.residual = n == 4 ? NULL : some.residual;
            some.smallest_gap = n == 5 ? NULL : some.smallest_gap;
            some.energy = n == 6 ? NULL : some.energy;
            some.counts = n == 7 ? NULL : some.counts;
            some.contact = n == 8 ? NULL : some.contact;
            some.n_events = n == 9 ? NULL : some.n_events;
            some.stage_t = n == 10 ? NULL : some.stage_t;
            some.stage_v = n == 11 ? NULL : some.stage_v;
            some.stage_R = n == 12 ? NULL : some.stage_R;
            check_end(&start, inputs, h, done, &some);
        }
        all.events = NULL;
        all.stage_q = NULL;
        check_end(&start, inputs, h, done, &all);
        all.begun = EVERY;
        ENSURE(m_simulate(&state, &work, &info, &par, &opt, inputs, h, 1, EVERY, &all, &alone) ==
               M_BAD_ARGUMENT);
        all.begun = -1;
        ENSURE(m_simulate(&state, &work, &info, &par, &opt, inputs, h, 1, EVERY, &all, &alone) ==
               M_BAD_ARGUMENT);
    }
}

/* The fastest oscillation is no slower than that of any direction: a Rayleigh quotient. */
static void test_stable_step(void) {
    static double scratch[SG_STABLE], M[SG_N_Q * SG_N_Q], K[SG_N_Q * SG_N_Q], f_q[SG_N_Q * SG_N_Q];
    int run;
    for (run = 0; run < 20; ++run) {
        double x[SG_N_Q], force[SG_N_R + 1], h, top, stiff = 0.0, heavy = 0.0, bad[SG_N_Q];
        int i, j;
        draw_start();
        for (i = 0; i < SG_N_R; ++i) {
            force[i] = uniform();
        }
        h = m_stable_step(&par, state.t, state.q, state.v, u, run % 2 == 0 ? NULL : force, scratch);
        ENSURE(h > 0.0);
        if (run % 2 == 0 && SG_N_G + SG_N_GAMMA == 0) {
            m_p_v(state.t, state.q, state.v, &par, M);
            m_L_q_q(state.t, state.q, state.v, &par, K);
            m_f_q(state.t, state.q, state.v, u, &par, f_q);
            for (i = 0; i < SG_N_Q; ++i) {
                x[i] = uniform();
            }
            for (i = 0; i < SG_N_Q; ++i) {
                for (j = 0; j < SG_N_Q; ++j) {
                    stiff -= x[i] * (K[i * SG_N_Q + j] + f_q[i * SG_N_Q + j]) * x[j];
                    heavy += x[i] * M[i * SG_N_Q + j] * x[j];
                }
            }
            top = h >= SG_HUGE ? 0.0 : (SG_STABLE_PHASE / h) * (SG_STABLE_PHASE / h);
            /* power iteration comes from below, within its last change */
            ENSURE(stiff / heavy <= 1.01 * top + 1e-9);
        }
        sg_fill(SG_N_Q, NAN, bad);
        ENSURE(m_stable_step(&par, state.t, bad, state.v, u, NULL, scratch) > 0.0);
    }
    /* directions: the second depends on the first, the third is what is left */
    {
        double Q[9] = {3.0, 0.0, 0.0, 6.0, 0.0, 0.0, 1.0, 2.0, 0.0}, y[3] = {1.0, 1.0, 4.0};
        double L[4] = {4.0, 0.0, 2.0, 5.0}, z[2] = {2.0, 5.0};
        double none[4] = {1.0, 0.0, 2.0, 1.0};
        double S[4] = {-5.0, 0.0, 0.0, 2.0}, a[2], b[2];
        sg_orthonormal(3, 3, Q);
        ENSURE(Q[0] == 1.0 && Q[3] == 0.0 && Q[6] == 0.0 && fabs(Q[7] - 1.0) < 1e-15);
        ENSURE(sg_admissible(3, 3, Q, y) == 1 && y[2] == 1.0 && y[0] == 0.0);
        ENSURE(sg_admissible(3, 3, Q, Q) == 0);
        ENSURE(sg_cholesky(2, L) == 1 && L[0] == 2.0 && L[2] == 1.0 && L[3] == 2.0);
        sg_forward(2, L, 1, z);
        ENSURE(z[0] == 1.0 && z[1] == 2.0);
        ENSURE(sg_cholesky(2, none) == 0);
        ENSURE(fabs(sg_extreme(2, 0, S, Q, 5.0, a, b) - 2.0) < 0.1);
    }
}

/* What the projection took away lies in the polar of the cone of contact k, whose normal percussion
   stands at a: no percussion in the cone has a component along it. */
static void ensure_polar(int base, int k, int a, const double before[], const double z[]) {
    double most = before[a] - z[a];
    int d, i;
    for (i = k; i >= 0; i = sg_contacts[i].next) {
        if (sg_is_sticking(&work, base, i)) {
            const int b = sg_position(&work, a, sg_slip_of(&work, base, i));
            double away[2];
            for (d = 0; d < sg_contacts[i].components; ++d) {
                away[d] = before[b + d] - z[b + d];
            }
            most += sg_slope(&work, i, a, b) * sg_norm(sg_contacts[i].components, away);
            ENSURE(sg_norm(sg_contacts[i].components, &z[b]) <=
                   sg_slope(&work, i, a, b) * z[a] + 1e-12);
        }
    }
    ENSURE(most <= 1e-12);
}

/* Nearest percussions in the cones: inside, the same when asked again, at a right angle to what was
   taken away, and that in the polar of the cone, for all kinds of rows. */
static void test_nearest_in_cones(void) {
    const sg_problem *pr = &sg_problems[0];
    int run;
    for (run = 0; run < 200; ++run) {
        double z[2 * ROWS], before[2 * ROWS], again[2 * ROWS], across = 0.0;
        int a, c, k, d, slot, n;
        for (a = 0; a < pr->n_slots * SG_N_R; ++a) {
            work.rows.kind[a] = uniform() > 0.0 ? SG_ROW_FREE : SG_ROW_ZERO;
            work.system.root_scale[a] = 1.0;
        }
        for (slot = 0; slot < pr->n_slots; ++slot) {
            for (k = 0; k < SG_N_CONTACTS; ++k) {
                const double kind = uniform();
                for (d = 0; d < sg_contacts[k].components; ++d) {
                    c = slot * SG_N_R + SG_SLIP + sg_contacts[k].friction + d;
                    work.rows.kind[c] = kind > 0.3    ? SG_ROW_FREE
                                        : kind > -0.3 ? SG_ROW_SLIP
                                                      : SG_ROW_ZERO;
                }
                work.mu[k] = 0.5 + 0.4 * uniform();
                if (sg_contacts[k].bound >= 0) {
                    work.radius[slot * SG_N_BOUNDS + sg_contacts[k].bound] = 0.6 + 0.5 * uniform();
                }
            }
        }
        for (n = 0, slot = 0; slot < pr->n_slots; ++slot) {
            const int base = slot * SG_N_R;
            for (c = 0; c < SG_NORMAL; ++c) {
                if (work.rows.kind[base + c] != SG_ROW_ZERO) {
                    work.system.reduced[n++] = base + c;
                }
            }
            for (k = 0; k < SG_N_CONTACTS; ++k) {
                if (sg_contacts[k].normal >= 0 &&
                    work.rows.kind[sg_normal_of(&work, base, k)] == SG_ROW_FREE) {
                    work.system.reduced[n++] = sg_normal_of(&work, base, k);
                }
                for (d = 0; d < sg_contacts[k].components; ++d) {
                    if (work.rows.kind[sg_slip_of(&work, base, k) + d] != SG_ROW_ZERO) {
                        work.system.reduced[n++] = sg_slip_of(&work, base, k) + d;
                    }
                }
            }
        }
        for (a = 0; a < ROWS; ++a) {
            z[a] = before[a] = 2.0 * uniform();
        }
        sg_nearest_in_cones(&work, pr, z);
        sg_copy(ROWS, z, again);
        sg_nearest_in_cones(&work, pr, again);
        for (a = 0; a < ROWS; ++a) {
            ENSURE(fabs(again[a] - z[a]) < 1e-12);
            across += (before[a] - z[a]) * z[a];
        }
        ENSURE(across > -1e-12);
        for (slot = 0; slot < pr->n_slots; ++slot) {
            for (k = 0; k < SG_N_CONTACTS; ++k) {
                const int base = slot * SG_N_R;
                if (sg_contacts[k].normal >= 0 &&
                    work.rows.kind[sg_normal_of(&work, base, k)] == SG_ROW_FREE) {
                    ensure_polar(base, k, sg_position(&work, 0, sg_normal_of(&work, base, k)),
                                 before, z);
                }
            }
        }
    }
}
