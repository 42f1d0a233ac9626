/* Unit tests of a stepper with velocity constraints at full order (prefix f, included as it is):
   the force at the start is found in every step, rows that do not take part stay zero, the checker
   sees every number. */
#include "f.c"

#include "ensure.h"
#include "sizes.h"
#include <string.h>

static f_work work, kept;
static f_params par;
static f_options opt;
static f_state state;
static f_info info;

#include "test_advance.h"

static int accepted(void) {
    int problem;
    f_finish(&work);
    for (problem = 0; problem < SG_N_PROBLEMS; ++problem) {
        f_values(&work, &par, problem);
        sg_keep_rows(&work, problem);
        if (!sg_check_problem(&work, &opt, problem)) {
            return 0;
        }
        if (problem + 1 < SG_N_PROBLEMS && sg_problems[problem + 1].follows &&
            !sg_check_active(&work, &opt, problem)) {
            return 0;
        }
    }
    return sg_all_finite(SG_N_Q, work.q_end) && sg_all_finite(SG_N_Q, work.v_end);
}

/* Every number of the problems that were solved, spoiled in turn. */
static void spoil(int first_x, int first_lambda) {
    const sg_problem *last = &sg_problems[SG_N_PROBLEMS - 1];
    int i;
    kept = work;
    for (i = first_x; i < SG_N_X_TOTAL; ++i) {
        work.x[i] += 1e-3 * (1.0 + fabs(work.x[i]));
        ENSURE(!accepted());
        work = kept;
        work.x[i] = NAN;
        ENSURE(!accepted());
        work = kept;
    }
    for (i = first_lambda; i < SG_N_ROWS_TOTAL; ++i) {
        work.R[i] += 1e-3 * (1.0 + fabs(work.R[i]));
        ENSURE(!accepted());
        work = kept;
    }
    /* a row that does not take part has no percussion */
    ENSURE(last->last_rows == SG_N_G && !sg_takes_part(last, last->n_slots - 1, SG_N_G));
    ENSURE(sg_takes_part(last, 0, SG_N_G) && sg_is_gap(&work, last, 0, 0));
    ENSURE(!sg_is_gap(&work, last, last->n_slots - 1, 0) && !sg_is_gap(&work, last, 0, SG_N_G));
    ENSURE(work.R[last->R + (last->n_slots - 1) * SG_N_R + SG_N_G] == 0.0);
    ENSURE(accepted());
}

int main(void) {
    double t, q[SG_N_Q], v[SG_N_Q], x[SG_N_X_TOTAL], R[SG_N_ROWS_TOTAL];
    par = f_default_params();
    opt = f_default_options();
    f_initial_state(&par, &t, q, v);
    ENSURE(f_init(&state, &par, &opt, t, q, v) == F_OK);
    sg_reset_info(&info);
    work.trial = state;
    ENSURE(sg_attempt(&work, &par, &opt, &info, t, 0.02, 1, 200) == F_OK);
    spoil(0, 0);
    sg_commit(&work, &par, &info);
    state = work.trial;
    state.t += 0.02;
    sg_reset_info(&info);
    work.trial = state;
    ENSURE(sg_attempt(&work, &par, &opt, &info, state.t, 0.02, 1, 200) == F_OK);
    spoil(0, 0);
    /* a state that knows t, q, v alone finds the same force */
    kept = work;
    ENSURE(f_set_state(&work.trial, state.t, state.q, state.v) == F_OK);
    ENSURE(sg_attempt(&work, &par, &opt, &info, state.t, 0.02, 1, 200) == F_OK);
    ENSURE(fabs(work.R[SG_N_G] - kept.R[SG_N_G]) <= 1e-11 * (1.0 + fabs(kept.R[SG_N_G])));
    /* residuals at given unknowns: the force is that of the given percussions */
    memset(x, 0, sizeof x);
    memset(R, 0, sizeof R);
    R[SG_N_G] = 0.5;
    ENSURE(f_set_state(&state, t, q, v) == F_OK);
    ENSURE(f_problem(&state, &work, &par, &opt, NULL, 0.02, 1, x, R) == F_OK);
    ENSURE(work.R_stage[SG_N_G] == 0.5);
    /* a start whose accelerations are not finite ends with a status and leaves the state */
    state.v[0] = 1e200;
    ENSURE(f_step(&state, &work, &info, &par, &opt, NULL, 0.02) > F_OK_SUBSTEPPED);
    ENSURE(state.t == t && state.v[0] == 1e200);
    test_advance(t, q, v);
    printf("%d failed\n", failures);
    return failures != 0;
}
