/* Operations of steps from hard starts of any model (prefix m) against the bounds that its manifest
   states: prints the largest share of the bound for an iteration, and of that for a step. With
   LOCATED steps are cut at their events, and only the bound for a step is meant. */
#include "counted.hpp"

#include "m.c"

#include <stdio.h>
#include <stdlib.h>

unsigned long long operations;

static m_work work;
static m_state state;
static m_info info;

/* A small deterministic generator, uniform in [-1, 1]. */
static unsigned long seed = 2463534242UL;
static double uniform() {
    seed = (1103515245UL * seed + 12345UL) & 0x7fffffffUL;
    return 2.0 * (double)seed / 2147483647.0 - 1.0;
}

int main(int argc, char **argv) {
    const double iteration = argc > 1 ? atof(argv[1]) : 1.0;
    const double step = argc > 2 ? atof(argv[2]) : 1.0;
    const m_params par = m_default_params();
    m_options opt = m_default_options();
    double of_iteration = 0.0;
    double of_step = 0.0;
    int most = 0;
    int run, k, i;
    for (run = 0; run < 120; ++run) {
        const double sizes[3] = {0.02, 0.005, 0.1};
        m_real t, q[SG_N_Q], v[SG_N_Q], u[SG_N_U > 0 ? SG_N_U : 1] = {0.0};
        m_initial_state(&par, &t, q, v);
        for (i = 0; i < SG_N_Q; ++i) {
            v[i] += 3.0 * uniform();
            q[i] += run % 4 == 0 ? 0.05 * uniform() : 0.0;
        }
        opt.max_halvings = run % 2 ? 4 : 0;
#if LOCATED
        opt.events = M_EVENTS_LOCATED;
#endif
        m_set_state(&state, t, q, v);
        for (k = 0; k < 20; ++k) {
            int status;
            double count;
            operations = 0;
            status = m_step(&state, &work, &info, &par, &opt, u, sizes[run % 3]);
            /* of a start and an end of every substep as much as an iteration */
            count = (double)operations /
                    (info.iterations + (1 + info.substeps) * (SG_N_PROBLEMS + 1)) / iteration;
            of_iteration = count > of_iteration ? count : of_iteration;
            if (opt.max_halvings == 0 && (double)operations / step > of_step) {
                of_step = (double)operations / step;
            }
            most = info.iterations > most ? info.iterations : most;
            if (status > M_OK_SUBSTEPPED) {
                break;
            }
        }
    }
    printf("%.6g %.6g %d\n", of_iteration, of_step, most);
    return 0;
}
