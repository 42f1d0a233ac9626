/* Steps of a model (prefix m) as text: status, q, v in full precision after every step. STEPS and H
   come from the command line of the compiler. Real inputs are held at U. */
#include "m.h"

#include <stdio.h>

static m_work work;

int main(void) {
    const m_params par = m_default_params();
    m_options opt = m_default_options();
    m_real u[M_N_U > 0 ? M_N_U : 1];
    m_real t0[1], q0[M_N_Q], v0[M_N_Q];
    m_state state;
    m_info info;
    int step, k;
    int status;
    for (k = 0; k < (M_N_U > 0 ? M_N_U : 1); ++k) {
        u[k] = (m_real)0.1;
    }
    opt.max_halvings = 4;
    m_initial_state(&par, t0, q0, v0);
    status = m_init(&state, &par, &opt, t0[0], q0, v0);
    for (step = 0; step < STEPS && status <= M_OK_SUBSTEPPED; ++step) {
        status = m_step(&state, &work, &info, &par, &opt, u, (m_real)H);
        printf("%d %d", status, info.iterations);
        for (k = 0; k < M_N_Q; ++k) {
            printf(" %.17g %.17g", (double)state.q[k], (double)state.v[k]);
        }
        printf("\n");
    }
    printf("end\n");
    return status <= M_OK_SUBSTEPPED ? 42 : 1;
}
