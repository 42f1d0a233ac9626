/* Unit tests of what is refused: wrong arguments, inconsistent starts. Part of test_model.c. */

static void test_arguments(void) {
    m_options bad;
    m_state before;
    m_record record;
    double t, q[SG_N_Q], v[SG_N_Q], inputs[4 * INPUTS];
    double kept[4 * SG_N_STAGES * (SG_N_Q + SG_ROWS_OF_SLOT)];
    double x[SG_N_X_TOTAL], R[ROWS];
    int counts[4 * SG_COUNTS];
    int done = 0;
    int k;
    memset(&record, 0, sizeof record);
    memset(inputs, 0, sizeof inputs);
    m_initial_state(&par, &t, q, v);
    ENSURE(m_init(NULL, &par, &opt, t, q, v) == M_BAD_ARGUMENT);
    ENSURE(m_init(&state, NULL, &opt, t, q, v) == M_BAD_ARGUMENT);
    ENSURE(m_init(&state, &par, NULL, t, q, v) == M_BAD_ARGUMENT);
    ENSURE(m_init(&state, &par, &opt, t, NULL, v) == M_BAD_ARGUMENT);
    ENSURE(m_init(&state, &par, &opt, t, q, NULL) == M_BAD_ARGUMENT);
    ENSURE(m_init(&state, &par, &opt, INFINITY, q, v) == M_BAD_ARGUMENT);
    q[0] = NAN;
    ENSURE(m_init(&state, &par, &opt, t, q, v) == M_BAD_ARGUMENT);
    m_initial_state(&par, &t, q, v);
    v[0] = NAN;
    ENSURE(m_init(&state, &par, &opt, t, q, v) == M_BAD_ARGUMENT);
    m_initial_state(&par, &t, q, v);
    for (k = 0; k < 10; ++k) {
        bad = opt;
        switch (k) {
            case 0:
                bad.tol = -1.0;
                break;
            case 1:
                bad.tol = INFINITY;
                break;
            case 2:
                bad.r = -1.0;
                break;
            case 3:
                bad.r = INFINITY;
                break;
            case 4:
                bad.max_iterations = 0;
                break;
            case 5:
                bad.max_halvings = -1;
                break;
            case 6:
                bad.max_halvings = 11;
                break;
            case 7:
                bad.active_set = 2;
                break;
            case 8:
                bad.scaling = 2;
                break;
            default:
                bad.scaling = M_SCALING_NONE;
                bad.tol = 0.0;
                break;
        }
        ENSURE(m_init(&state, &par, &bad, t, q, v) == M_BAD_ARGUMENT);
    }
    ENSURE(m_init(&state, &par, &opt, t, q, v) == M_OK);
    before = state;
    ENSURE(m_step(NULL, &work, &info, &par, &opt, inputs, 0.01) == M_BAD_ARGUMENT);
    ENSURE(m_step(&state, NULL, &info, &par, &opt, inputs, 0.01) == M_BAD_ARGUMENT);
    ENSURE(m_step(&state, &work, NULL, &par, &opt, inputs, 0.01) == M_BAD_ARGUMENT);
    ENSURE(m_step(&state, &work, &info, NULL, &opt, inputs, 0.01) == M_BAD_ARGUMENT);
    ENSURE(m_step(&state, &work, &info, &par, NULL, inputs, 0.01) == M_BAD_ARGUMENT);
    ENSURE(m_step(&state, &work, &info, &par, &opt, inputs, INFINITY) == M_BAD_ARGUMENT);
    if (SG_N_U > 0) {
        ENSURE(m_step(&state, &work, &info, &par, &opt, NULL, 0.01) == M_BAD_ARGUMENT);
        ENSURE(m_simulate(&state, &work, &info, &par, &opt, NULL, 0.01, 1, 1, NULL, &done) ==
               M_BAD_ARGUMENT);
        inputs[0] = NAN;
        ENSURE(m_step(&state, &work, &info, &par, &opt, inputs, 0.01) == M_NONFINITE);
        inputs[0] = 0.0;
    }
    for (k = 0; k < 3; ++k) {
        m_state spoiled = state;
        *(k == 0 ? &spoiled.q[0] : k == 1 ? &spoiled.v[SG_N_Q - 1] : &spoiled.t) = NAN;
        ENSURE(m_step(&spoiled, &work, &info, &par, &opt, inputs, 0.01) == M_NONFINITE);
    }
    ENSURE(!memcmp(&before, &state, sizeof state));
    ENSURE(m_simulate(&state, &work, &info, &par, &opt, inputs, 0.01, 4, 1, NULL, NULL) ==
           M_BAD_ARGUMENT);
    ENSURE(m_simulate(&state, &work, &info, &par, &opt, inputs, 0.01, 4, 0, NULL, &done) ==
           M_BAD_ARGUMENT);
    ENSURE(m_simulate(&state, &work, &info, &par, &opt, inputs, -0.01, 4, 1, NULL, &done) ==
               M_BAD_ARGUMENT &&
           done == 0);
    ENSURE(m_simulate(&state, &work, &info, &par, &opt, inputs, 0.01, -1, 1, NULL, &done) ==
           M_BAD_ARGUMENT);
    /* every array of the record, one at a time, every second step */
    for (k = 0; k < 11; ++k) {
        static double stage_t[4 * SG_N_STAGES], stage_q[4 * SG_N_STAGES * SG_N_Q];
        static double stage_v[4 * SG_N_STAGES * SG_N_Q], stage_R[4 * SG_N_STAGES * SG_ROWS_OF_SLOT];
        memset(&record, 0, sizeof record);
        record.t = k == 0 ? kept : NULL;
        record.q = k == 1 ? kept : NULL;
        record.v = k == 2 ? kept : NULL;
        record.P = k == 3 ? kept : NULL;
        record.residual = k == 4 ? kept : NULL;
        record.smallest_gap = k == 5 ? kept : NULL;
        record.counts = k == 6 ? counts : NULL;
        record.stage_t = k >= 7 ? stage_t : NULL; /* all four or none */
        record.stage_q = k == 7 || k > 8 ? stage_q : NULL;
        record.stage_v = k == 7 || k > 9 ? stage_v : NULL;
        record.stage_R = k == 7 ? stage_R : NULL;
        state = before;
        ENSURE(m_simulate(&state, &work, &info, &par, &opt, inputs, 0.01, 4, 2, &record, &done) ==
                   M_OK &&
               done == 4);
        if (k == 0) {
            ENSURE(kept[0] == t + 2 * 0.01 && kept[1] == t + 4 * 0.01);
        } else if (k == 1 || k == 2) {
            ENSURE(!memcmp(&kept[SG_N_Q], k == 1 ? state.q : state.v, sizeof state.q));
        } else if (k == 6) {
            /* a row holds the sums of its steps */
            int single[4 * SG_COUNTS];
            record.counts = single;
            state = before;
            ENSURE(m_simulate(&state, &work, &info, &par, &opt, inputs, 0.01, 4, 1, &record,
                              &done) == M_OK);
            ENSURE(single[3 * SG_COUNTS] == info.status &&
                   single[3 * SG_COUNTS + 1] == info.iterations);
            ENSURE(counts[1] == single[1] + single[SG_COUNTS + 1] &&
                   counts[SG_COUNTS + 1] == single[2 * SG_COUNTS + 1] + single[3 * SG_COUNTS + 1]);
            ENSURE(counts[6] == single[6] + single[SG_COUNTS + 6]);
        } else if (k == 7) {
            ENSURE(fabs(stage_t[2 * SG_N_STAGES - 1] - state.t) <= 1e-15 * (1.0 + fabs(state.t)));
        }
    }
    /* residuals at given unknowns */
    memset(x, 0, sizeof x);
    memset(R, 0, sizeof R);
    ENSURE(m_problem(NULL, &work, &par, &opt, inputs, 0.01, 0, x, R) == M_BAD_ARGUMENT);
    ENSURE(m_problem(&state, NULL, &par, &opt, inputs, 0.01, 0, x, R) == M_BAD_ARGUMENT);
    ENSURE(m_problem(&state, &work, NULL, &opt, inputs, 0.01, 0, x, R) == M_BAD_ARGUMENT);
    ENSURE(m_problem(&state, &work, &par, NULL, inputs, 0.01, 0, x, R) == M_BAD_ARGUMENT);
    ENSURE(m_problem(&state, &work, &par, &opt, inputs, 0.01, 0, NULL, R) == M_BAD_ARGUMENT);
    ENSURE(m_problem(&state, &work, &par, &opt, inputs, 0.01, 0, x, NULL) == M_BAD_ARGUMENT);
    ENSURE(m_problem(&state, &work, &par, &opt, inputs, 0.01, -1, x, R) == M_BAD_ARGUMENT);
    ENSURE(m_problem(&state, &work, &par, &opt, inputs, 0.01, 2, x, R) == M_BAD_ARGUMENT);
    ENSURE(m_problem(&state, &work, &par, &opt, inputs, 0.0, 0, x, R) == M_BAD_ARGUMENT);
    if (SG_N_U > 0) {
        ENSURE(m_problem(&state, &work, &par, &opt, NULL, 0.01, 0, x, R) == M_BAD_ARGUMENT);
    }
    ENSURE(m_problem(&state, &work, &par, &opt, inputs, 0.01, SG_N_PROBLEMS - 1, x, R) == M_OK);
    if (M_MASSES) {
        m_params none;
        memset(&none, 0, sizeof none);
        ENSURE(m_problem(&state, &work, &none, &opt, inputs, 0.01, 0, x, R) == M_SINGULAR);
    }
    for (k = -1; k <= M_INCONSISTENT_START + 1; ++k) {
        ENSURE(m_status_text(k)[0] != '\0');
    }
}

/* Row c of W^T at the start of the step in the work struct. */
static void direction(int c, double row[SG_N_Q]) {
    int k;
    sg_fill(SG_N_Q, 0.0, row);
    for (k = sg_direction.start[c]; k < sg_direction.start[c + 1]; ++k) {
        row[sg_direction.index[k]] = work.direction[k];
    }
}

/* A start off the constraints, inside an obstacle, or where a constraint is not finite. A start
   that is refused leaves the state as it was. */
static void test_inconsistent_starts(void) {
    m_consistency at;
    double t, q[SG_N_Q], v[SG_N_Q], row[SG_N_Q];
    m_state before;
    int c, j, k;
    m_initial_state(&par, &t, q, v);
    m_evaluate_places(t, q, &par, &at);
    ENSURE(m_init(&state, &par, &opt, t, q, v) == M_OK);
    before = state;
    work.trial = state;
    sg_begin(&work, &par, t, 0.01);
    /* what yields may be compressed */
    for (c = 0; c < SG_N_G && SG_N_COMPLIANCE == 0; ++c) {
        /* along the gradient by 1e-3 */
        double moved[SG_N_Q];
        for (j = 0; j < SG_N_Q; ++j) {
            direction(c, row);
            moved[j] = q[j] + 1e-3 * row[j];
        }
        ENSURE(m_init(&state, &par, &opt, t, moved, v) == M_INCONSISTENT_START);
        ENSURE(memcmp(&state, &before, sizeof state) == 0);
        sg_fill(SG_N_Q, 1e300, moved);
        ENSURE(m_init(&state, &par, &opt, t, moved, v) != M_OK);
    }
    for (c = 0; c < SG_NORMAL && SG_N_COMPLIANCE == 0; ++c) {
        double moved[SG_N_Q];
        for (j = 0; j < SG_N_Q; ++j) {
            direction(c, row);
            moved[j] = v[j] + 1e-3 * row[j];
        }
        ENSURE(m_init(&state, &par, &opt, t, q, moved) == M_INCONSISTENT_START);
        sg_fill(SG_N_Q, 1e308, moved);
        ENSURE(m_init(&state, &par, &opt, t, q, moved) != M_OK);
    }
    for (k = 0; k < SG_N_CONTACTS && SG_NORMAL == 0; ++k) {
        const int n = sg_contacts[k].normal;
        if (n >= 0 && !sg_is_place(&work, n)) {
            /* what goes one way may begin backwards: it is struck */
            double moved[SG_N_Q];
            direction(n, row);
            for (j = 0; j < SG_N_Q; ++j) {
                moved[j] = v[j] - 3.0 * row[j];
            }
            ENSURE(m_init(&state, &par, &opt, t, q, moved) == M_OK);
        } else if (n >= 0) {
            double moved[SG_N_Q];
            const int there = !sg_contacts[k].guarded || at.guard[k] >= 0.0;
            double size;
            direction(n, row);
            size = sg_dot(SG_N_Q, row, row);
            for (j = 0; j < SG_N_Q; ++j) {
                moved[j] = q[j] - 1.5 * (at.value[n] + 0.1) * row[j] / size;
            }
            if (there) {
                ENSURE(m_init(&state, &par, &opt, t, moved, v) == M_INCONSISTENT_START);
            }
        }
    }
}
