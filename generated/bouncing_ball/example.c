/* Runs the model 'bouncing_ball' from its initial state and prints the trajectory as a table. */
#include "bouncing_ball.h"

#include <stdio.h>

static bouncing_ball_work work; /* large: kept off the stack */

int main(void) {
    const bouncing_ball_params par = bouncing_ball_default_params();
    bouncing_ball_options opt = bouncing_ball_default_options();
    const bouncing_ball_real u[1] = {0.0};
    const bouncing_ball_real h = 0.01;
    bouncing_ball_state state;
    bouncing_ball_info info;
    bouncing_ball_real t0[1], q0[BOUNCING_BALL_N_Q], v0[BOUNCING_BALL_N_Q];
    int step, k, status;

    opt.max_halvings = 4; /* a step that is not solved whole may be halved */
    bouncing_ball_initial_state(&par, t0, q0, v0);
    status = bouncing_ball_init(&state, &par, &opt, t0[0], q0, v0);
    printf("%s\n", "t x y phi");
    for (step = 0; status <= BOUNCING_BALL_OK_SUBSTEPPED && step < 200; ++step) {
        status = bouncing_ball_step(&state, &work, &info, &par, &opt, u, h);
        if (step % 10 != 9) {
            continue;
        }
        printf("%.6g", (double)state.t);
        for (k = 0; k < BOUNCING_BALL_N_Q; ++k) {
            printf(" %.9g", (double)state.q[k]);
        }
        printf("\n");
    }
    if (status > BOUNCING_BALL_OK_SUBSTEPPED) {
        fprintf(stderr, "%s\n", bouncing_ball_status_text(status));
        return 1;
    }
    return 0;
}
