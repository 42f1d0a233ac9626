/* State saved, restored and forked: hopper_state is plain data and all that the next step needs.
 *
 *     signorini generate hopper --out hopper_c
 *     make save_restore_fork && ./save_restore_fork
 */
#include "hopper.h"

#include <stdio.h>
#include <string.h>

static hopper_work work;

/* Steps without input; returns the status of the last. */
static int run(hopper_state *s, const hopper_params *par, int steps) {
    const hopper_options opt = hopper_default_options();
    const hopper_real u[HOPPER_N_U] = {0.0, 0.0};
    hopper_info info;
    int status = HOPPER_OK;
    int step;
    for (step = 0; status <= HOPPER_OK_SUBSTEPPED && step < steps; ++step) {
        status = hopper_step(s, &work, &info, par, &opt, u, 1e-3);
    }
    return status;
}

int main(void) {
    const hopper_params par = hopper_default_params();
    const hopper_options opt = hopper_default_options();
    hopper_params soft = par;
    hopper_real t0[1], q0[HOPPER_N_Q], v0[HOPPER_N_Q];
    hopper_state state, fork;
    unsigned char saved[sizeof(hopper_state)];

    hopper_initial_state(&par, t0, q0, v0);
    if (hopper_init(&state, &par, &opt, t0[0], q0, v0) != HOPPER_OK ||
        run(&state, &par, 200) > HOPPER_OK_SUBSTEPPED) {
        return 1;
    }
    memcpy(saved, &state, sizeof state); /* to flash, to a file, over a line: bytes are enough */
    fork = state;                        /* a second future from here */
    if (run(&state, &par, 300) > HOPPER_OK_SUBSTEPPED) {
        return 1;
    }
    printf("went on   y %.17g\n", state.q[HOPPER_Q_Y]);

    memcpy(&state, saved, sizeof state);
    memset(&work, 0xff, sizeof work); /* scratch: its contents do not matter */
    if (run(&state, &par, 300) > HOPPER_OK_SUBSTEPPED) {
        return 1;
    }
    printf("restored  y %.17g\n", state.q[HOPPER_Q_Y]);

    soft.k = 0.5 * par.k;
    if (run(&fork, &soft, 300) > HOPPER_OK_SUBSTEPPED) {
        return 1;
    }
    printf("forked    y %.17g with half the stiffness\n", fork.q[HOPPER_Q_Y]);
    return 0;
}
