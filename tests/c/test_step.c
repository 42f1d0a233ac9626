/* Unit tests of the step: solver parts and checker on a generated stepper, included as it is so
   that its static functions can be called. The model is a ball on a plane, s = 3: one contact with
   one slip component, per slot R_N, R_F. */
#include "ball.c"

#include "ensure.h"

enum { R_N1 = 0, R_F1 = 1, R_N2 = 2, R_F2 = 3, P_N = 4, P_F = 5, V_END = 9 };

static ball_work work;

/* A solved step of size 0.01 from the given state, ready to be spoiled. */
static ball_work *solved(double y, double v_x, double v_y, double omega) {
    const ball_params par = ball_default_params();
    const ball_options opt = ball_default_options();
    const double q[3] = {0.3, y, 0.2};
    const double v[3] = {v_x, v_y, omega};
    ball_info info;
    ENSURE(ball_init(&work.trial, &par, &opt, 0.0, q, v) == BALL_OK);
    sg_reset_info(&info);
    ENSURE(sg_attempt(&work, &par, &opt, &info, 0.0, 0.01, 1, 200) == BALL_OK);
    return &work;
}

static int accepted(ball_work *w) {
    const ball_params par = ball_default_params();
    const ball_options opt = ball_default_options();
    int problem;
    ball_finish(w);
    for (problem = 0; problem < SG_N_PROBLEMS; ++problem) {
        ball_values(w, &par, problem);
        sg_keep_rows(w, problem);
        if (!sg_check_problem(w, &opt, problem)) {
            return 0;
        }
        if (problem + 1 < SG_N_PROBLEMS && sg_problems[problem + 1].follows &&
            !sg_check_active(w, &opt, problem)) {
            return 0;
        }
    }
    return sg_all_finite(SG_N_Q, w->q_end) && sg_all_finite(SG_N_Q, w->v_end);
}

static void test_checker_on_wrong_steps(void) {
    ball_work *w;
    /* sliding on the plane */
    ENSURE(accepted(solved(0.1, 1.0, 0.0, 0.0)));
    w = solved(0.1, 1.0, 0.0, 0.0);
    ENSURE(w->found.active[0] && w->R[P_N] > 0.0 && w->R[P_F] < 0.0);
    w->R[P_F] = -w->R[P_F]; /* friction along the slip, velocities to match */
    w->x[V_END] += 2.0 * w->R[P_F];
    w->x[V_END + 2] += 2.0 * w->R[P_F] * 0.1 / 0.004;
    ENSURE(!accepted(w));
    w = solved(0.1, 1.0, 0.0, 0.0);
    w->R[R_F1] = -w->R[R_F1];
    ENSURE(!accepted(w));
    w = solved(0.1, 1.0, 0.0, 0.0);
    w->x[V_END] += 0.5 * w->R[P_F]; /* cone violation, velocities to match */
    w->x[V_END + 2] += 0.5 * w->R[P_F] * 0.1 / 0.004;
    w->R[P_F] *= 1.5;
    ENSURE(!accepted(w));
    w = solved(0.1, 1.0, 0.0, 0.0);
    w->R[P_N] = -w->R[P_N]; /* negative percussion */
    ENSURE(!accepted(w));
    w = solved(0.1, 1.0, 0.0, 0.0);
    w->R[R_N2] -= 1.0;
    ENSURE(!accepted(w));
    w = solved(0.1, 1.0, 0.0, 0.0);
    w->x[V_END + 1] -= 1e-3; /* velocity into the plane, momentum wrong */
    ENSURE(!accepted(w));

    /* impact in the step */
    w = solved(0.12, 0.0, -4.0, 0.0);
    ENSURE(w->found.active[0] && w->R[P_N] > 4.0 && accepted(w));
    w = solved(0.12, 0.0, -4.0, 0.0);
    w->found.active[0] = 0; /* a skipped impact: the velocity goes on downwards */
    w->x[V_END + 1] -= w->R[P_N];
    w->x[V_END] -= w->R[P_F];
    w->x[V_END + 2] -= w->R[P_F] * 0.1 / 0.004;
    w->R[P_N] = w->R[P_F] = 0.0;
    ENSURE(!accepted(w));

    /* flight */
    w = solved(1.0, 0.0, -1.0, 3.0);
    ENSURE(!w->found.active[0] && accepted(w));
    w = solved(1.0, 0.0, -1.0, 3.0);
    w->R[R_N1] = 0.01; /* a push without touching */
    ENSURE(!accepted(w));
    w = solved(1.0, 0.0, -1.0, 3.0);
    w->found.active[0] = 1; /* an impact without touching */
    ENSURE(!accepted(w));
    w = solved(1.0, 0.0, -1.0, 3.0);
    w->R[P_N] = 1e-3; /* percussion of an open contact */
    ENSURE(!accepted(w));
    w = solved(1.0, 0.0, -1.0, 3.0);
    w->R[P_F] = 1e-3;
    ENSURE(!accepted(w));
    w = solved(1.0, 0.0, -1.0, 3.0);
    w->x[4] += 1e-5; /* a stage velocity off */
    ENSURE(!accepted(w));
    w = solved(1.0, 0.0, -1.0, 3.0);
    w->x[0] = NAN;
    ENSURE(!accepted(w));
    w = solved(1.0, 0.0, -1.0, 3.0);
    w->R[R_F2] = NAN;
    ENSURE(!accepted(w));
}

static void test_laws(void) {
    const ball_options opt = ball_default_options();
    const sg_limit limit = sg_limits(&opt);
    const double forward = 1.0;
    const double rest = 0.0;
    double force = -0.5;
    ENSURE(sg_check_normal(0.0, 1.0, 0.0, 2.0, 1.0, 0.0, &limit));
    ENSURE(sg_check_normal(2.0, 1.0, 0.0, 0.0, 1.0, 0.0, &limit));
    ENSURE(!sg_check_normal(2.0, 1.0, 0.0, 2.0, 1.0, 0.0, &limit));
    ENSURE(!sg_check_normal(-1e-3, 1.0, 0.0, 2.0, 1.0, 0.0, &limit));
    ENSURE(!sg_check_normal(0.0, 1.0, 0.0, -1e-3, 1.0, 0.0, &limit));
    /* a percussion below zero by the round-off of the gap that it closes, and by more */
    ENSURE(sg_check_normal(0.0, 1.0, 0.0, -1e-12, 1e-9, 1e-12, &limit));
    ENSURE(!sg_check_normal(0.0, 1.0, 0.0, -1e-9, 1e-9, 1e-12, &limit));
    ENSURE(!sg_check_normal(NAN, 1.0, 0.0, 1.0, 1.0, 0.0, &limit));
    ENSURE(sg_check_friction(1, &forward, 1.0, &force, 0.5, 1.0, 0.0, 0.0, &limit));
    ENSURE(!sg_check_friction(1, &forward, 1.0, &force, 0.4, 1.0, 0.0, 0.0,
                              &limit)); /* outside the ball */
    ENSURE(!sg_check_friction(1, &forward, 1.0, &force, 0.6, 1.0, 0.0, 0.0,
                              &limit)); /* slips inside it */
    ENSURE(sg_check_friction(1, &rest, 1.0, &force, 0.6, 1.0, 0.0, 0.0, &limit));
    force = 0.5;
    ENSURE(!sg_check_friction(1, &forward, 1.0, &force, 0.5, 1.0, 0.0, 0.0,
                              &limit)); /* along the slip */
    force = NAN;
    ENSURE(!sg_check_friction(1, &forward, 1.0, &force, 0.5, 1.0, 0.0, 0.0, &limit));
    {
        const double slip[2] = {3.0, 4.0};
        const double against[2] = {-0.6, -0.8};
        const double across[2] = {-0.8, 0.6};
        ENSURE(sg_check_friction(2, slip, 5.0, against, 1.0, 1.0, 0.0, 0.0, &limit));
        ENSURE(!sg_check_friction(2, slip, 5.0, across, 1.0, 1.0, 0.0, 0.0, &limit));
    }
}

static void test_contact_rows(void) {
    const ball_params par = ball_default_params();
    const ball_options opt = ball_default_options();
    ball_work *w = solved(0.1, 1.0, 0.0, 0.0);
    int iterations = 0;
    double measure = 0.0;
    /* a negative percussion has the radius 0: the friction row asks for no friction */
    sg_prox_parameters(w, &opt, 0);
    w->x[1] = w->x[4] = w->x[7] = -1.0; /* into the plane, so that the contact counts as closed */
    w->R[R_N1] = -1.0;
    w->R[R_F1] = 0.3;
    sg_evaluate(w, &par, &opt, 0);
    ENSURE(w->rows.kind[R_N1] == SG_ROW_FREE);
    ENSURE(w->rows.kind[R_F1] == SG_ROW_SLIP && w->rows.phi[R_F1] == 0.3);
    /* percussions of a wrong guess vanish in flight, in the first iterations */
    w = solved(1.0, 0.0, -1.0, 3.0);
    sg_prox_parameters(w, &opt, 0);
    w->R[R_N1] = 0.5;
    w->R[R_F2] = -0.2;
    ENSURE(sg_newton(w, &par, &opt, 0, 3, 0, &iterations, &measure) == BALL_OK);
    ENSURE(w->R[R_N1] == 0.0 && w->R[R_F2] == 0.0 && iterations <= 2);
}

static void test_arguments(void) {
    const ball_params par = ball_default_params();
    ball_params bad_par = par;
    ball_options opt = ball_default_options();
    const double q[3] = {0.0, 1.0, 0.0};
    const double v[3] = {0.0, 0.0, 0.0};
    const double below[3] = {0.0, 0.05, 0.0};
    const double wild[3] = {0.0, NAN, 0.0};
    ball_state s, before;
    ball_info info;
    int done = 7;
    ENSURE(ball_init(NULL, &par, &opt, 0.0, q, v) == BALL_BAD_ARGUMENT);
    ENSURE(ball_init(&s, NULL, &opt, 0.0, q, v) == BALL_BAD_ARGUMENT);
    ENSURE(ball_init(&s, &par, &opt, NAN, q, v) == BALL_BAD_ARGUMENT);
    ENSURE(ball_init(&s, &par, &opt, 0.0, wild, v) == BALL_BAD_ARGUMENT);
    ENSURE(ball_init(&s, &par, &opt, 0.0, below, v) == BALL_INCONSISTENT_START);
    ENSURE(ball_init(&s, &par, &opt, 0.0, q, v) == BALL_OK);
    before = s;
    ENSURE(ball_step(&s, &work, &info, &par, &opt, NULL, 0.0) == BALL_BAD_ARGUMENT);
    ENSURE(ball_step(&s, &work, &info, &par, &opt, NULL, -0.1) == BALL_BAD_ARGUMENT);
    ENSURE(ball_step(&s, &work, &info, &par, &opt, NULL, NAN) == BALL_BAD_ARGUMENT);
    ENSURE(ball_step(&s, &work, &info, &par, NULL, NULL, 0.1) == BALL_BAD_ARGUMENT);
    ENSURE(ball_step(&s, &work, NULL, &par, &opt, NULL, 0.1) == BALL_BAD_ARGUMENT);
    ENSURE(ball_step(&s, NULL, &info, &par, &opt, NULL, 0.1) == BALL_BAD_ARGUMENT);
    ENSURE(ball_set_state(NULL, 0.0, before.q, before.v) == BALL_BAD_ARGUMENT);
    ENSURE(ball_set_state(&s, 0.0, NULL, before.v) == BALL_BAD_ARGUMENT);
    ENSURE(ball_set_state(&s, 0.0, before.q, NULL) == BALL_BAD_ARGUMENT);
    ENSURE(ball_set_state(&s, INFINITY, before.q, before.v) == BALL_BAD_ARGUMENT);
    bad_par.mu = -1.0;
    ENSURE(ball_step(&s, &work, &info, &bad_par, &opt, NULL, 0.1) == BALL_BAD_ARGUMENT);
    bad_par = par;
    bad_par.e_N = 1.5;
    ENSURE(ball_step(&s, &work, &info, &bad_par, &opt, NULL, 0.1) == BALL_BAD_ARGUMENT);
    bad_par = par;
    bad_par.mass = NAN;
    ENSURE(ball_step(&s, &work, &info, &bad_par, &opt, NULL, 0.1) == BALL_NONFINITE);
    bad_par.mass = 0.0;
    ENSURE(ball_step(&s, &work, &info, &bad_par, &opt, NULL, 0.1) == BALL_SINGULAR);
    ENSURE(info.status == BALL_SINGULAR);
    opt.max_iterations = 0;
    ENSURE(ball_step(&s, &work, &info, &par, &opt, NULL, 0.1) == BALL_BAD_ARGUMENT);
    opt = ball_default_options();
    opt.tol = NAN;
    ENSURE(ball_step(&s, &work, &info, &par, &opt, NULL, 0.1) == BALL_BAD_ARGUMENT);
    opt = ball_default_options();
    /* every failure left the state as it was */
    ENSURE(s.t == before.t && s.q[1] == before.q[1] && s.v[1] == before.v[1] && s.warm == 0);
    /* what is refused leaves a new state as it was */
    ENSURE(ball_simulate(&s, &work, &info, &par, &opt, NULL, 0.1, -1, 1, NULL, &done) ==
           BALL_BAD_ARGUMENT);
    ENSURE(ball_simulate(&s, &work, &info, &par, &opt, NULL, 0.1, 3, 1, NULL, &done) == BALL_OK);
    ENSURE(done == 3 && s.t == 3 * 0.1);
    ENSURE(ball_status_text(BALL_OK)[0] == 's' && ball_status_text(99)[0] == 'u');
}

int main(void) {
    test_laws();
    test_checker_on_wrong_steps();
    test_contact_rows();
    test_arguments();
    printf("%d failed\n", failures);
    return failures != 0;
}
