/* Unit tests of steps whose sizes a tolerance chooses, on the stepper with prefix f. */

/* What is wanted of a run over `span`. */
static f_control wanted(double error, double span) {
    f_control c;
    int j;
    memset(&c, 0, sizeof c);
    c.error = error;
    c.span = span;
    for (j = 0; j < SG_N_Q; ++j) {
        c.scale[j] = 1.0;
    }
    return c;
}

/* Sizes, places of the parts, distances. */
static void test_sizes(void) {
    f_control c = wanted(1e-6, 0.2);
    double q[SG_N_Q] = {0.0}, v[SG_N_Q] = {0.0}, q_2[SG_N_Q] = {0.0}, v_2[SG_N_Q] = {0.0};
    f_state s;
    ENSURE(sg_next_step(&c, 0.2) == 0.2 / 32.0);
    c.h = 0.05;
    ENSURE(sg_next_step(&c, 0.2) == 0.05);
    ENSURE(sg_next_step(&c, 0.08) == 0.04);
    ENSURE(sg_next_step(&c, 0.03) == 0.03);
    sg_divide(&c, 1.0, 0.5, &info);
    ENSURE(c.n_parts == 2 && c.parts[0] == 0.25 && c.parts[1] == 0.5);
    q_2[0] = 3e-3;
    v_2[SG_N_Q - 1] = 1e-2;
    ENSURE(sg_apart(&c, q, v, q_2, v_2) == 3e-3);
    c.scale[SG_N_Q - 1] = 0.5;
    ENSURE(fabs(sg_apart(&c, q, v, q_2, v_2) - 0.2 * 1e-2 / 0.5) < 1e-15);
    memset(&s, 0, sizeof s);
    s.v[SG_N_Q - 1] = -4.0;
    ENSURE(sg_apart_rounded(&c, &s) == 16.0 * SG_EPS * (0.2 * 4.0 / 0.5));
    ENSURE(sg_gain() == 16.0 && fabs(sg_root_of_order(16.0) - 2.0) < 1e-15); /* s = 3 */
}

/* Numbers that say nothing. */
static void test_wants(void) {
    static const double wrong[3] = {-1.0, NAN, INFINITY};
    f_control c = wanted(1e-6, 0.2);
    int k;
    ENSURE(sg_is_control(&c));
    for (k = 0; k < 3; ++k) {
        c = wanted(wrong[k], 0.2);
        ENSURE(!sg_is_control(&c));
        c = wanted(1e-6, wrong[k]);
        ENSURE(!sg_is_control(&c));
        c = wanted(1e-6, 0.2);
        c.h = wrong[k];
        ENSURE(!sg_is_control(&c));
        c.h = 0.0;
        c.scale[0] = wrong[k];
        ENSURE(!sg_is_control(&c));
    }
}

/* Reports of parts, added up. */
static void test_sums(void) {
    f_info sum, part;
    int k;
    sg_reset_info(&sum);
    sg_reset_info(&part);
    part.status = F_OK_SUBSTEPPED;
    part.percussions = SG_AS_FOUND;
    part.iterations = 3;
    part.residual = 0.5;
    part.smallest_gap = -1.0;
    for (k = 0; k < SG_N_R; ++k) {
        part.P[k] = 1.0 + k;
    }
    sg_add_info(&sum, &part);
    part.status = F_OK;
    part.percussions = SG_UNIQUE;
    sg_add_info(&sum, &part);
    ENSURE(sum.status == F_OK_SUBSTEPPED && sum.percussions == SG_AS_FOUND && sum.iterations == 6);
    ENSURE(sum.residual == 0.5 && sum.smallest_gap == -1.0 && sum.P[0] == 2.0);
    ENSURE(sg_has_room(&sum) && !sg_is_captured(&sum) && sg_is_smooth(&opt));
}

/* Arguments that are none leave the state. */
static void test_refused_steps(double t) {
    f_control c = wanted(1e-6, 0.2);
    int done;
    ENSURE(f_step_within(NULL, &work, &info, &par, &opt, NULL, t + 0.2, &c) == F_BAD_ARGUMENT);
    ENSURE(f_step_within(&state, NULL, &info, &par, &opt, NULL, t + 0.2, &c) == F_BAD_ARGUMENT);
    ENSURE(f_step_within(&state, &work, NULL, &par, &opt, NULL, t + 0.2, &c) == F_BAD_ARGUMENT);
    ENSURE(f_step_within(&state, &work, &info, NULL, &opt, NULL, t + 0.2, &c) == F_BAD_ARGUMENT);
    ENSURE(f_step_within(&state, &work, &info, &par, NULL, NULL, t + 0.2, &c) == F_BAD_ARGUMENT);
    ENSURE(f_step_within(&state, &work, &info, &par, &opt, NULL, t + 0.2, NULL) == F_BAD_ARGUMENT);
    ENSURE(f_step_within(&state, &work, &info, &par, &opt, NULL, t, &c) == F_BAD_ARGUMENT);
    ENSURE(f_step_within(&state, &work, &info, &par, &opt, NULL, NAN, &c) == F_BAD_ARGUMENT);
    c.error = 0.0;
    ENSURE(f_advance_to(&state, &work, &info, &par, &opt, NULL, t + 0.2, &c) == F_BAD_ARGUMENT);
    ENSURE(info.status == F_BAD_ARGUMENT && state.t == t);
#define WITHIN(s, w, i, p, h, n, every, to, c) \
    f_simulate_within(s, w, i, p, &opt, NULL, h, n, every, NULL, to, c)
    c = wanted(1e-6, 0.2);
    ENSURE(WITHIN(&state, &work, &info, &par, 0.1, 1, 1, NULL, &c) == F_BAD_ARGUMENT);
    ENSURE(WITHIN(&state, &work, &info, &par, 0.1, -1, 1, &done, &c) == F_BAD_ARGUMENT);
    ENSURE(WITHIN(&state, &work, &info, &par, 0.1, 1, 0, &done, &c) == F_BAD_ARGUMENT);
    ENSURE(WITHIN(NULL, &work, &info, &par, 0.1, 1, 1, &done, &c) == F_BAD_ARGUMENT);
    ENSURE(WITHIN(&state, NULL, &info, &par, 0.1, 1, 1, &done, &c) == F_BAD_ARGUMENT);
    ENSURE(WITHIN(&state, &work, NULL, &par, 0.1, 1, 1, &done, &c) == F_BAD_ARGUMENT);
    ENSURE(WITHIN(&state, &work, &info, NULL, 0.1, 1, 1, &done, &c) == F_BAD_ARGUMENT);
    ENSURE(WITHIN(&state, &work, &info, &par, 0.1, 1, 1, &done, NULL) == F_BAD_ARGUMENT);
    ENSURE(WITHIN(&state, &work, &info, &par, -0.1, 1, 1, &done, &c) == F_BAD_ARGUMENT);
    ENSURE(WITHIN(&state, &work, &info, &par, INFINITY, 1, 1, &done, &c) == F_BAD_ARGUMENT);
    ENSURE(WITHIN(&state, &work, &info, &par, 0.1, 0, 1, &done, &c) == F_OK && done == 0);
}

/* To a time, as exact as is asked for; too large a first step is taken back. */
static void test_exact_ends(double t, const double q[], const double v[]) {
    static const double errors[2] = {1e-6, 1e-10};
    double ends[2][SG_N_Q];
    int k, j;
    for (k = 0; k < 2; ++k) {
        f_control c = wanted(errors[k], 0.2);
        c.h = 0.2;
        ENSURE(f_set_state(&state, t, q, v) == F_OK);
        ENSURE(f_advance_to(&state, &work, &info, &par, &opt, NULL, t + 0.2, &c) <=
               F_OK_SUBSTEPPED);
        ENSURE(state.t == t + 0.2 && c.estimate <= errors[k] && c.missed == 0);
        ENSURE(k == 0 || (c.rejected > 0 && c.steps > 1));
        for (j = 0; j < SG_N_Q; ++j) {
            ends[k][j] = state.q[j];
        }
    }
    for (j = 0; j < SG_N_Q; ++j) {
        ENSURE(fabs(ends[0][j] - ends[1][j]) <= 1e-6);
    }
}

/* Rows of a grid, thinned and begun, and rows that are the steps. */
static void test_rows(double t, const double q[], const double v[]) {
    f_control c = wanted(1e-8, 0.2);
    double times[64], estimates[64], energy[128];
    f_record record;
    int done = -1;
    memset(&record, 0, sizeof record);
    record.t = times;
    record.energy = energy;
    record.begun = 1;
    c.t_start = t;
    c.estimates = estimates;
    ENSURE(f_set_state(&state, t, q, v) == F_OK);
    ENSURE(f_simulate_within(&state, &work, &info, &par, &opt, NULL, 0.05, 3, 2, &record, &done,
                             &c) == F_OK);
    ENSURE(done == 3 && times[0] == t + 0.05 && times[1] == t + 3.0 * 0.05);
    ENSURE(estimates[1] > estimates[0] && estimates[0] > 0.0 && energy[0] <= energy[1]);
    record.begun = 2;
    ENSURE(f_simulate_within(&state, &work, &info, &par, &opt, NULL, 0.05, 3, 2, &record, &done,
                             &c) == F_BAD_ARGUMENT);
    record.begun = -1;
    ENSURE(f_simulate_within(&state, &work, &info, &par, &opt, NULL, 0.05, 3, 2, &record, &done,
                             &c) == F_BAD_ARGUMENT);
    c = wanted(1e-8, 0.2);
    c.t_end = t + 0.2;
    ENSURE(f_set_state(&state, t, q, v) == F_OK);
    ENSURE(WITHIN(&state, &work, &info, &par, 0.0, 1000, 1, &done, &c) == F_OK);
    ENSURE(done == c.steps && state.t == t + 0.2);
}

/* What cannot be had is counted, what cannot be solved is a status and leaves the state. */
static void test_limits(double t, const double q[], const double v[]) {
    f_control c = wanted(1e-14, 1e7); /* no step is smaller than what is left */
    int done;
    ENSURE(f_set_state(&state, t, q, v) == F_OK);
    c.h = 1.0;
    ENSURE(f_step_within(&state, &work, &info, &par, &opt, NULL, t + 0.2, &c) <= F_OK_SUBSTEPPED);
    ENSURE(c.missed == 1 && c.t_missed == t + 0.2 && c.estimate > 1e-14);
    ENSURE(f_step_within(&state, &work, &info, &par, &opt, NULL, t + 0.4, &c) <= F_OK_SUBSTEPPED);
    ENSURE(c.missed == 2 && c.t_missed == t + 0.2);
    c = wanted(1e-6, 0.2);
    c.t_start = t;
    ENSURE(f_set_state(&state, t, q, v) == F_OK);
    state.v[0] = 1e200;
    ENSURE(f_advance_to(&state, &work, &info, &par, &opt, NULL, t + 0.2, &c) > F_OK_SUBSTEPPED);
    ENSURE(c.rejected > 10 && state.t == t && state.v[0] == 1e200);
    c = wanted(1e-6, 0.2);
    c.t_start = t;
    ENSURE(WITHIN(&state, &work, &info, &par, 0.1, 2, 1, &done, &c) > F_OK_SUBSTEPPED && done == 0);
}

static void test_advance(double t, const double q[], const double v[]) {
    test_sizes();
    test_wants();
    test_sums();
    ENSURE(f_set_state(&state, t, q, v) == F_OK);
    test_refused_steps(t);
    test_exact_ends(t, q, v);
    test_rows(t, q, v);
    test_limits(t, q, v);
}
