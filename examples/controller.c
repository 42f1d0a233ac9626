/* A controller in the loop: Raibert's hopper, inputs computed from the state before every step.
 *
 *     signorini generate hopper --out hopper_c
 *     make controller && ./controller
 */
#include "hopper.h"

#include <math.h>
#include <stdio.h>

static hopper_work work;

/* Keeps the hopping height and a forward speed of 0.5 m/s, as models/hopper.py does. */
static void control(const hopper_real q[], const hopper_real v[], hopper_real u[]) {
    const hopper_real stance = 0.15; /* duration of a stance [s] */
    const hopper_real speed = 0.5;
    const hopper_real foot = q[HOPPER_Q_Y] - q[HOPPER_Q_LENGTH] * cos(q[HOPPER_Q_PSI]);
    if (foot < 2e-3) {
        u[HOPPER_U_THRUST] = v[HOPPER_V_LENGTH_DOT] > 0.0 ? 30.0 : 0.0;
        u[HOPPER_U_HIP] = 60.0 * q[HOPPER_Q_PHI] + 10.0 * v[HOPPER_V_PHI_DOT];
    } else {
        const hopper_real forward =
            v[HOPPER_V_X_DOT] * stance / 2.0 + 0.1 * (v[HOPPER_V_X_DOT] - speed);
        const hopper_real ratio = fmax(-0.5, fmin(0.5, forward / q[HOPPER_Q_LENGTH]));
        u[HOPPER_U_THRUST] = 0.0;
        u[HOPPER_U_HIP] = -20.0 * (q[HOPPER_Q_PSI] - asin(ratio)) - v[HOPPER_V_PSI_DOT];
    }
}

int main(void) {
    const hopper_params par = hopper_default_params();
    hopper_options opt = hopper_default_options();
    hopper_real t0[1], q0[HOPPER_N_Q], v0[HOPPER_N_Q], u[HOPPER_N_U];
    hopper_state state;
    hopper_info info;
    int step, status;

    opt.max_halvings = 4;
    hopper_initial_state(&par, t0, q0, v0);
    status = hopper_init(&state, &par, &opt, t0[0], q0, v0);
    for (step = 1; status <= HOPPER_OK_SUBSTEPPED && step <= 6000; ++step) {
        control(state.q, state.v, u);
        status = hopper_step(&state, &work, &info, &par, &opt, u, 1e-3);
        if (step % 500 == 0) {
            printf("t %.3f x %.17g y %.17g\n", state.t, state.q[HOPPER_Q_X], state.q[HOPPER_Q_Y]);
        }
    }
    if (status > HOPPER_OK_SUBSTEPPED) {
        fprintf(stderr, "%s\n", hopper_status_text(status));
        return 1;
    }
    return 0;
}
