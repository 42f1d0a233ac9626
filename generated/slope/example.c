/* Runs the model 'slope' from its initial state and prints the trajectory as a table. */
#include "slope.h"

#include <stdio.h>

static slope_work work; /* large: kept off the stack */

int main(void) {
    const slope_params par = slope_default_params();
    slope_options opt = slope_default_options();
    const slope_real u[1] = {0.0};
    const slope_real h = 0.01;
    slope_state state;
    slope_info info;
    slope_real t0[1], q0[SLOPE_N_Q], v0[SLOPE_N_Q];
    int step, k, status;

    opt.max_halvings = 4; /* a step that is not solved whole may be halved */
    slope_initial_state(&par, t0, q0, v0);
    status = slope_init(&state, &par, &opt, t0[0], q0, v0);
    printf("%s\n", "t x y");
    for (step = 0; status <= SLOPE_OK_SUBSTEPPED && step < 300; ++step) {
        status = slope_step(&state, &work, &info, &par, &opt, u, h);
        if (step % 10 != 9) {
            continue;
        }
        printf("%.6g", (double)state.t);
        for (k = 0; k < SLOPE_N_Q; ++k) {
            printf(" %.9g", (double)state.q[k]);
        }
        printf("\n");
    }
    if (status > SLOPE_OK_SUBSTEPPED) {
        fprintf(stderr, "%s\n", slope_status_text(status));
        return 1;
    }
    return 0;
}
