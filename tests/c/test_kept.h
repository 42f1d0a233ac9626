/* Unit tests of what a state keeps from step to step, and of steps taken in parts. Part of
   test_model.c. */

#if SG_N_KEY > 0
/* 1 if a step from the state takes over terms that the state has, here wrong ones; 0 if it finds
   the right ones and ends as a step from a state without any. */
static int takes_over(m_state spoiled, const m_params *own) {
    m_state fresh = spoiled;
    double terms[SG_N_TERMS];
    int wrong, right, i;
    fresh.has_terms = 0;
    for (i = 0; i < SG_N_TERMS; ++i) {
        spoiled.terms[i] = 2.0 * spoiled.terms[i] + 1.0;
    }
    work.trial = spoiled;
    sg_begin(&work, own, spoiled.t, 0.01);
    if (memcmp(work.trial.terms, spoiled.terms, sizeof terms) == 0) {
        return 1;
    }
    m_evaluate_terms(spoiled.t, spoiled.q, own, terms);
    ENSURE(memcmp(work.trial.terms, terms, sizeof terms) == 0);
    wrong = m_step(&spoiled, &work, &info, own, &opt, u, 0.01);
    right = m_step(&fresh, &work, &info, own, &opt, u, 0.01);
    ENSURE(wrong == right && memcmp(spoiled.q, fresh.q, sizeof fresh.q) == 0 &&
           memcmp(spoiled.v, fresh.v, sizeof fresh.v) == 0);
    return 0;
}

/* Whatever changes a term changes the key; then the terms in the state are not used. */
static void check_change(const m_state *moved, const m_params *own) {
    double key[2][SG_N_KEY], terms[2][SG_N_TERMS];
    m_key(state.t, state.q, &par, key[0]);
    m_key(moved->t, moved->q, own, key[1]);
    m_evaluate_terms(state.t, state.q, &par, terms[0]);
    m_evaluate_terms(moved->t, moved->q, own, terms[1]);
    if (memcmp(key[0], key[1], sizeof key[0]) == 0) {
        ENSURE(memcmp(terms[0], terms[1], sizeof terms[0]) == 0);
    } else {
        ENSURE(!takes_over(*moved, own));
        ++counted[10];
    }
}

/* Terms of a place are taken from the step before where nothing changed, and only there. */
static void test_terms(void) {
    double key[SG_N_KEY], terms[SG_N_TERMS];
    int trial, step, j;
    for (trial = 0; trial < 5; ++trial) {
        draw_start();
        for (step = 0; step < 3; ++step) {
            m_state moved;
            m_params own;
            if (m_step(&state, &work, &info, &par, &opt, u, 0.01) > M_OK_SUBSTEPPED) {
                break;
            }
            ENSURE(state.has_terms);
            m_key(state.t, state.q, &par, key);
            if (memcmp(key, state.key, sizeof key) == 0) { /* times may differ by a rounding */
                m_evaluate_terms(state.t, state.q, &par, terms);
                ENSURE(memcmp(terms, state.terms, sizeof terms) == 0);
                ENSURE(takes_over(state, &par));
                ++counted[9];
            }
            for (j = -1; j < SG_N_Q; ++j) {
                moved = state;
                *(j < 0 ? &moved.t : &moved.q[j]) += 1e-9;
                check_change(&moved, &par);
            }
            for (j = 0; j < (int)(sizeof own / sizeof(double)); ++j) {
                own = par;
                ((double *)&own)[j] += 1e-9;
                check_change(&state, &own);
            }
            moved = state;
            ENSURE(m_set_state(&moved, state.t, state.q, state.v) == M_OK && !moved.has_terms);
        }
    }
    ENSURE(counted[9] > 0 && counted[10] > 10);
}
#endif

/* Any value of any parameter: a step is solved or the state stays; a start is refused or not. */
static void test_parameters(void) {
    static const double values[] = {-3.0, 7.0, 0.0, 1e-3, 1e300, -1e300, INFINITY, NAN};
    double t, q[SG_N_Q], v[SG_N_Q];
    int j, k;
    m_initial_state(&par, &t, q, v);
    for (j = 0; j < (int)(sizeof par / sizeof(double)); ++j) {
        for (k = 0; k < 8; ++k) {
            m_params bad = par;
            m_state before;
            int status;
            memcpy((char *)&bad + (size_t)j * sizeof(double), &values[k], sizeof(double));
            draw_start();
            before = state;
            status = m_step(&state, &work, &info, &bad, &opt, u, 0.01);
            if (status > M_OK_SUBSTEPPED) {
                ENSURE(!memcmp(&state, &before, sizeof state));
            } else {
                ENSURE(sg_all_finite(SG_N_Q, state.q) && sg_all_finite(SG_N_Q, state.v));
            }
            status = m_init(&state, &bad, &opt, t, q, v);
            ENSURE(status == M_OK || status == M_NONFINITE || status == M_INCONSISTENT_START);
            memcpy((char *)&bad + (size_t)j * sizeof(double), &values[7], sizeof(double));
        }
    }
}

/* Small budgets on large steps: halved where the whole step is not solved, and lost impacts are
   counted under the rule that looks at the end alone. */
static void test_substeps(void) {
    int trial, step;
    int substeps = 0;
    for (trial = 0; trial < 24; ++trial) {
        m_options few = opt;
        few.max_iterations = 8 + 4 * (trial % 12);
        few.max_halvings = 1 + trial % 8;
        few.active_set = trial % 2 ? M_ACTIVE_END : M_ACTIVE_ANY_STAGE;
        few.tol = trial % 3 ? opt.tol : 0.0;
        draw_start();
        for (step = 0; step < 30; ++step) {
            const m_state before = state;
            const double h = trial % 2 ? 0.8 : 8.0;
            if (m_step(&state, &work, &info, &par, &few, u, h) > M_OK_SUBSTEPPED) {
                ENSURE(!memcmp(&state, &before, sizeof state));
                break;
            }
            ENSURE(info.substeps <= 1 << few.max_halvings);
            ENSURE(fabs(state.t - before.t - h) <= 1e-13 * (1.0 + state.t));
            substeps += info.substeps;
            counted[7] += info.lost_impacts;
        }
    }
    counted[8] += substeps;
}
