/* A controller in the loop: Raibert's hopper, inputs computed from the state before every step.
 *
 *     signorini generate hopper --out hopper_c
 *     make controller && ./controller
 */
#include "hopper.h"

#include <math.h>
#include <stdio.h>

enum { Y = 1, PHI = 2, PSI = 3, LENGTH = 4 }; /* coordinates, in the order of hopper.h */
enum { THRUST = 0, HIP = 1 };                 /* inputs */

static hopper_work work;

/* Keeps the hopping height and a forward speed of 0.5 m/s, as models/hopper.py does. */
static void control(const hopper_state *s, hopper_real u[]) {
    const hopper_real stance = 0.15; /* duration of a stance [s] */
    const hopper_real speed = 0.5;
    const hopper_real foot = s->q[Y] - s->q[LENGTH] * cos(s->q[PSI]);
    if (foot < 2e-3) {
        u[THRUST] = s->v[LENGTH] > 0.0 ? 30.0 : 0.0;
        u[HIP] = 60.0 * s->q[PHI] + 10.0 * s->v[PHI];
    } else {
        const hopper_real forward = s->v[0] * stance / 2.0 + 0.1 * (s->v[0] - speed);
        const hopper_real ratio = fmax(-0.5, fmin(0.5, forward / s->q[LENGTH]));
        u[THRUST] = 0.0;
        u[HIP] = -20.0 * (s->q[PSI] - asin(ratio)) - s->v[PSI];
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
        control(&state, u);
        status = hopper_step(&state, &work, &info, &par, &opt, u, 1e-3);
        if (step % 500 == 0) {
            printf("t %.3f x %.17g y %.17g\n", state.t, state.q[0], state.q[Y]);
        }
    }
    if (status > HOPPER_OK_SUBSTEPPED) {
        fprintf(stderr, "%s\n", hopper_status_text(status));
        return 1;
    }
    return 0;
}
