/* Runs the model 'slider_crank' from its initial state and prints the trajectory as a table. */
#include "slider_crank.h"

#include <stdio.h>

static slider_crank_work work; /* large: kept off the stack */

int main(void) {
    const slider_crank_params par = slider_crank_default_params();
    slider_crank_options opt = slider_crank_default_options();
    const slider_crank_real u[1] = {0.0};
    const slider_crank_real h = 0.0001;
    slider_crank_state state;
    slider_crank_info info;
    slider_crank_real t0[1], q0[SLIDER_CRANK_N_Q], v0[SLIDER_CRANK_N_Q];
    int step, k, status;

    opt.max_halvings = 4; /* a step that is not solved whole may be halved */
    slider_crank_initial_state(&par, t0, q0, v0);
    status = slider_crank_init(&state, &par, &opt, t0[0], q0, v0);
    printf("%s\n", "t x_1 y_1 phi_1 x_2 y_2 phi_2 x_3 y_3 phi_3");
    for (step = 0; status <= SLIDER_CRANK_OK_SUBSTEPPED && step < 1000; ++step) {
        status = slider_crank_step(&state, &work, &info, &par, &opt, u, h);
        if (step % 10 != 9) {
            continue;
        }
        printf("%.6g", (double)state.t);
        for (k = 0; k < SLIDER_CRANK_N_Q; ++k) {
            printf(" %.9g", (double)state.q[k]);
        }
        printf("\n");
    }
    if (status > SLIDER_CRANK_OK_SUBSTEPPED) {
        fprintf(stderr, "%s\n", slider_crank_status_text(status));
        return 1;
    }
    return 0;
}
