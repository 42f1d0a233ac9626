/* Many steps in one call: inputs for every step in an array, a row recorded for every ten steps.
 *
 *     signorini generate hopper --out hopper_c
 *     make inputs && ./inputs
 */
#include "hopper.h"

#include <stdio.h>

enum { STEPS = 600, EVERY = 10, ROWS = STEPS / EVERY };

static hopper_work work;
static hopper_real u[STEPS * HOPPER_N_U];
static hopper_real t[ROWS], q[ROWS * HOPPER_N_Q], P[ROWS * HOPPER_N_R];

int main(void) {
    const hopper_params par = hopper_default_params();
    const hopper_options opt = hopper_default_options();
    hopper_record record = {0};
    hopper_real t0[1], q0[HOPPER_N_Q], v0[HOPPER_N_Q];
    hopper_state state;
    hopper_info info;
    int row, step, status;
    int done = 0;

    for (step = 0; step < STEPS; ++step) {
        u[step * HOPPER_N_U] = step < 300 ? 0.0 : 30.0; /* thrust; the hip stays free */
    }
    record.t = t; /* buffers that are not wanted stay NULL */
    record.q = q;
    record.P = P;
    hopper_initial_state(&par, t0, q0, v0);
    status = hopper_init(&state, &par, &opt, t0[0], q0, v0);
    if (status <= HOPPER_OK_SUBSTEPPED) {
        status = hopper_simulate(&state, &work, &info, &par, &opt, u, 1e-3, STEPS, EVERY, &record,
                                 &done);
    }
    for (row = 0; row < done / EVERY; ++row) {
        printf("t %.3f y %.17g P_N %.17g\n", t[row], q[row * HOPPER_N_Q + HOPPER_Q_Y],
               P[row * HOPPER_N_R + HOPPER_P_GROUND_N]);
    }
    if (status > HOPPER_OK_SUBSTEPPED) {
        fprintf(stderr, "%s after %d steps\n", hopper_status_text(status), done);
        return 1;
    }
    return 0;
}
