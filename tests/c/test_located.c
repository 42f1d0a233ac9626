/* Unit tests of located steps, on a generated stepper that is included as it is so that its static
   functions can be called. The model is a ball on a plane, s = 3: one contact with one slip
   component; x, y, phi. */
#include "ball.c"

#include "ensure.h"
#include <string.h>

#define NEAR(a, b) (fabs((a) - (b)) <= 1e-13 * (1.0 + fabs(b)))

static ball_work work;
static ball_info info;

/* The state of a ball at height y, and located steps. */
static ball_state placed(double y, double v_x, double v_y, double omega, ball_options *opt) {
    const ball_params par = ball_default_params();
    const double q[3] = {0.3, y, 0.2};
    const double v[3] = {v_x, v_y, omega};
    ball_state s;
    *opt = ball_default_options();
    opt->events = BALL_EVENTS_LOCATED;
    ENSURE(ball_init(&s, &par, opt, 0.0, q, v) == BALL_OK);
    return s;
}

/* A polynomial of degree s + 1 is its own dense output; velocities are its slopes. */
static void test_dense_output(void) {
    static const double c[3] = {0.0, 0.5, 1.0};
    double q[3], v[3], x;
    int i, j;
    memset(&work, 0, sizeof work);
    work.segment.span = 0.25;
    for (j = 0; j < 3; ++j) {
        for (i = 0; i < 3; ++i) {
            work.segment.Q[i * 3 + j] = 1.0 + c[i] * (2.0 + j) + pow(c[i], 4.0);
        }
        work.segment.q[j] = 1.0;
        work.segment.v[j] = (2.0 + j) / 0.25;
        work.segment.v_end[j] = (2.0 + j + 4.0) / 0.25;
    }
    for (x = 0.0; x <= 1.0; x += 0.125) {
        sg_dense(&work, x, q, v);
        for (j = 0; j < 3; ++j) {
            ENSURE(NEAR(q[j], 1.0 + x * (2.0 + j) + pow(x, 4.0)));
            ENSURE(NEAR(v[j], (2.0 + j + 4.0 * pow(x, 3.0)) / 0.25));
        }
    }
    /* where friction acts velocities are those of the stages */
    work.segment.rubs = 1;
    for (i = 0; i < 3; ++i) {
        for (j = 0; j < 3; ++j) {
            work.segment.U[i * 3 + j] = 3.0 - c[i] * c[i] * (1.0 + j);
        }
    }
    sg_dense(&work, 0.75, q, v);
    for (j = 0; j < 3; ++j) {
        ENSURE(NEAR(v[j], 3.0 - 0.5625 * (1.0 + j)));
    }
}

/* Newton's size within the bracket, its middle otherwise. */
static void test_next_size(void) {
    ENSURE(sg_next_size(0.5, 0.1, -1.0, 0.0, 1.0, 0) == 0.6);
    ENSURE(sg_next_size(0.5, 0.1, -1.0, 0.0, 1.0, 1) == 0.5);
    ENSURE(sg_next_size(0.5, 0.9, -1.0, 0.5, 1.0, 0) == 0.75);
    ENSURE(sg_next_size(0.5, 0.1, 1.0, 0.5, 1.0, 0) == 0.75);
    ENSURE(sg_next_size(0.5, -0.1, -1.0, 0.0, 0.5, 0) == 0.4);
}

/* What the separate check says of a segment: a rolling, a sliding and a flying ball, then spoiled.
 */
static void test_checker(void) {
    static const double omega[3] = {-10.0, 0.0, 0.0};
    static const double height[3] = {0.1, 0.1, 0.5};
    const ball_params par = ball_default_params();
    ball_options opt;
    int k;
    for (k = 0; k < 3; ++k) {
        ball_state s = placed(height[k], 1.0, 0.0, omega[k], &opt);
        const int problem = k < 2 ? SG_SEGMENT : 0;
        const sg_problem *pr = &sg_problems[problem];
        double kept;
        ENSURE(ball_step(&s, &work, &info, &par, &opt, NULL, 0.01) == BALL_OK);
        ENSURE(info.captured == 0 && info.n_events == 0);
        ENSURE(info.contact[0] == (k == 0 ? BALL_STICK : k == 1 ? BALL_SLIP : BALL_OPEN));
        /* the segment once more, so that the scratch is its own */
        s = placed(height[k], 1.0, 0.0, omega[k], &opt);
        work.trial = s;
        sg_reset_info(&info);
        (void)sg_set_out(&work, &s, 0.01);
        ENSURE(sg_enter(&work, &par, &opt, &info, 0.0, -1, 1) == BALL_OK);
        if (work.segment.known) {
            sg_measure_motion(&work, 0.01);
        }
        ENSURE(sg_solve_segment(&work, &par, &opt, &info, 0.01, 0.0) == BALL_OK);
        ball_values(&work, &par, problem);
        ENSURE(sg_check_segment(&work, &opt, problem));
        if (k < 2) {
            /* a gap, then a percussion that is not the law's */
            kept = work.y[1];
            work.y[0] += 1e-4;
            ENSURE(!sg_check_segment(&work, &opt, problem));
            ball_values(&work, &par, problem);
            ENSURE(kept == work.y[1]);
            work.R[pr->R + 3] += 1e-3;
            ENSURE(k == 0 || !sg_check_segment(&work, &opt, problem));
            ball_values(&work, &par, problem);
            ENSURE(!sg_check_segment(&work, &opt, problem));
        } else {
            work.R[pr->R] = 1e-9; /* an open contact does not push at all */
            ENSURE(!sg_check_segment(&work, &opt, problem));
        }
    }
}

/* An impact at its own time; a step that is not taken changes nothing. */
static void test_step(void) {
    ball_params par = ball_default_params();
    ball_options opt;
    ball_state s, before;
    par.e_N = 0.5;
    s = placed(0.1 + 0.5 * par.grav * 0.01, 0.0, 0.0, 0.0, &opt);
    ENSURE(ball_step(&s, &work, &info, &par, &opt, NULL, 0.25) == BALL_OK);
    ENSURE(info.n_events == 2 && info.captured == 0 && info.impacts[0] == 2);
    ENSURE(NEAR(info.events[0].t, 0.1) && NEAR(info.events[1].t, 0.2));
    ENSURE(NEAR(info.events[0].P_N, 1.5 * par.grav * 0.1));
    ENSURE(info.events[0].kind == BALL_EVENT_IMPACT && info.events[0].energy < 0.0);
    ENSURE(NEAR(info.P[0], info.events[0].P_N + info.events[1].P_N));
    ENSURE(NEAR(s.v[1], 0.25 * par.grav * 0.1 - par.grav * 0.05));
    opt.max_events = 1;
    s = placed(0.1 + 0.5 * par.grav * 0.01, 0.0, 0.0, 0.0, &opt);
    opt.max_events = 1;
    ENSURE(ball_step(&s, &work, &info, &par, &opt, NULL, 0.25) == BALL_OK && info.captured == 1);
    before = s;
    opt.max_events = 0;
    ENSURE(ball_step(&s, &work, &info, &par, &opt, NULL, 0.25) == BALL_BAD_ARGUMENT);
    opt.max_events = BALL_N_Q * 100;
    ENSURE(ball_step(&s, &work, &info, &par, &opt, NULL, 0.25) == BALL_BAD_ARGUMENT);
    opt = ball_default_options();
    opt.events = 2;
    ENSURE(ball_step(&s, &work, &info, &par, &opt, NULL, 0.25) == BALL_BAD_ARGUMENT);
    opt.events = BALL_EVENTS_LOCATED;
    opt.scaling = BALL_SCALING_NONE;
    ENSURE(ball_step(&s, &work, &info, &par, &opt, NULL, 0.25) == BALL_BAD_ARGUMENT);
    opt.scaling = BALL_SCALING_ROWS;
    par.mu = -1.0;
    ENSURE(ball_step(&s, &work, &info, &par, &opt, NULL, 0.25) == BALL_BAD_ARGUMENT);
    ENSURE(info.n_events == 0 && info.captured == 0);
    ENSURE(!memcmp(&s, &before, sizeof s));
}

int main(void) {
    test_dense_output();
    test_next_size();
    test_checker();
    test_step();
    printf("%d failed\n", failures);
    return failures != 0;
}
