/* Instructions of every step of a model (prefix m) of at most MOST iterations, and whether it was
 * solved within them; one that was not is taken again with more, so that the run goes on. See
 * instructions.c for the timer. */
#include "m.h"

#include <stdint.h>
#include <stdio.h>

#define TIMER ((volatile uint32_t *)0x40000000u) /* CTRL, VALUE, RELOAD */

static m_work work;

int main(void) {
    const m_params par = m_default_params();
    m_options opt = m_default_options(), more = m_default_options();
    const m_real u[M_N_U > 0 ? M_N_U : 1] = {0};
    m_real t0[1], q0[M_N_Q], v0[M_N_Q];
    m_state state;
    m_info info;
    int step, status;
    opt.max_iterations = MOST;
    more.max_halvings = 10;
    TIMER[0] = 0u;
    TIMER[2] = 0xffffffffu;
    TIMER[1] = 0xffffffffu;
    TIMER[0] = 1u;
    m_initial_state(&par, t0, q0, v0);
    status = m_init(&state, &par, &opt, t0[0], q0, v0);
    for (step = 0; step < STEPS && status <= M_OK_SUBSTEPPED; ++step) {
        const uint32_t start = TIMER[1];
        uint32_t end;
        status = m_step(&state, &work, &info, &par, &opt, u, (m_real)H);
        end = TIMER[1];
        printf("%lu %d\n", (unsigned long)(start - end), status > M_OK_SUBSTEPPED);
        if (status > M_OK_SUBSTEPPED) {
            status = m_step(&state, &work, &info, &par, &more, u, (m_real)H);
        }
    }
    printf("end\n");
    return status <= M_OK_SUBSTEPPED ? 42 : 1;
}
