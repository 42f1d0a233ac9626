/* Located steps of any model, compiled with its generated stepper (prefix m): from many starts,
   with drawn velocities, inputs, restitution and friction. Every step is taken twice, the second
   time with another scratch, and has to be the same; it ends without penetration and at its time.
 */
#include "m.c"
#include "m_model.c"

#include "ensure.h"
#include "sizes.h"
#include <string.h>

#ifndef STARTS
#define STARTS 60
#endif
#define STEPS 80
#define SIZE(n) ((n) > 0 ? (n) : 1)

static m_work work;
static m_info info, again;
#if SG_DERIVATIVES
static m_directions ways;
#endif

/* A small deterministic generator, uniform in [-1, 1]. */
static unsigned long seed = 88172645UL;
static double uniform(void) {
    seed = (1103515245UL * seed + 12345UL) & 0x7fffffffUL;
    return 2.0 * (double)seed / 2147483647.0 - 1.0;
}

/* A start near the model's own one, with velocities where no constraint forbids them. */
static int draw_start(m_state *s, const m_params *par, const m_options *opt) {
    double t, q[SG_N_Q], v[SG_N_Q];
    const double speed = uniform() > 0.0 ? 3.0 : 0.1;
    int j;
    m_initial_state(par, &t, q, v);
    for (j = 0; j < SG_N_Q; ++j) {
        if (SG_N_G + SG_N_GAMMA == 0) {
            v[j] += speed * uniform();
            q[j] += uniform() > 0.0 ? 0.1 * uniform() : 0.0;
        }
    }
    return m_init(s, par, opt, t, q, v);
}

/* The step once more, with another scratch; with derivatives along all coordinates and velocities,
   which are numbers unless it says otherwise. */
static int take_again(m_state *s, const m_params *par, const m_options *opt, const double u[],
                      double h, int fresh) {
    int status;
    memset(&work, 0xff, sizeof work);
#if SG_DERIVATIVES
    {
        int j;
        memset(&ways, 0, sizeof ways);
        ways.count = 2 * SG_N_Q;
        ways.fresh = fresh;
        for (j = 0; j < SG_N_Q; ++j) {
            ways.q[j * (SG_N_Q + 1)] = 1.0;
            ways.v[SG_N_Q * SG_N_Q + j * (SG_N_Q + 1)] = 1.0;
        }
        status = m_step_forward(s, &work, &again, par, opt, u, h, &ways);
        ENSURE(status > M_OK_SUBSTEPPED || ways.lost ||
               (sg_all_finite(2 * SG_N_Q * SG_N_Q, ways.q) &&
                sg_all_finite(2 * SG_N_Q * SG_N_Q, ways.v)));
    }
#else
    (void)fresh;
    status = m_step(s, &work, &again, par, opt, u, h);
#endif
    return status;
}

int main(void) {
    int run, k, j;
    int counted[4] = {0}; /* steps, events, captured, unsolved */
    for (run = 0; run < STARTS; ++run) {
        const m_params par = m_default_params();
        m_options opt = m_default_options();
        const double h = 1e-3 * (1.0 + 9.0 * fabs(uniform()));
        double u[SIZE(SG_N_U)], drives;
        m_state s;
        opt.events = M_EVENTS_LOCATED;
        opt.max_halvings = 4;
        /* limits that are reached, too */
        opt.max_events = run % 8 == 7 ? run % 3 : opt.max_events;
        opt.max_iterations = run % 8 == 6 ? 1 + run % 5 : opt.max_iterations;
        drives = run % 8 == 5 ? 5e3 : 5.0;
        if (draw_start(&s, &par, &opt) != M_OK) {
            continue;
        }
        for (k = 0; k < STEPS; ++k) {
            m_state other = s;
            const double t = s.t;
            int status, second;
            for (j = 0; j < SG_N_U; ++j) {
                u[j] = drives * uniform();
            }
            memset(&work, 0x3c, sizeof work);
            if (run % 16 == 13 && k == STEPS / 2 && SG_N_U > 0) {
                u[0] = SG_NAN;
            }
            status = m_step(&s, &work, &info, &par, &opt, u, h);
            second = take_again(&other, &par, &opt, u, h, k == 0);
            ENSURE(status == second);
            if (status > M_OK_SUBSTEPPED) {
                ++counted[3];
                break;
            }
            ++counted[0];
            counted[1] += info.n_events;
            counted[2] += info.captured > 0;
            ENSURE(memcmp(s.q, other.q, sizeof s.q) == 0 && memcmp(s.v, other.v, sizeof s.v) == 0);
            ENSURE(fabs(s.t - (t + h)) <= 1e-14);
            ENSURE(info.captured || info.smallest_gap >= -1e-8);
        }
    }
    printf("steps %d, events %d, captured %d, unsolved %d\n", counted[0], counted[1], counted[2],
           counted[3]);
    printf("%d failed\n", failures);
    return failures != 0;
}
