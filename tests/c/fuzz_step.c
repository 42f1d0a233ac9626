/* Fuzz target for one stepper: bytes become state, parameters, options, inputs and step size. Any
   input must end with a status of the list, leave the state as it was unless the step was solved,
   keep solved states finite, and stay within the iterations allowed. The stepper's file is included
   as it is: compile with -DSTEPPER='"m.c"', prefix m. */
#include STEPPER

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ENSURE(condition)                                      \
    do {                                                       \
        if (!(condition)) {                                    \
            fprintf(stderr, "%s does not hold\n", #condition); \
            abort();                                           \
        }                                                      \
    } while (0)

static const uint8_t *bytes;
static size_t left;

static uint8_t byte(void) {
    uint8_t b = 0;
    if (left > 0) {
        b = *bytes++;
        --left;
    }
    return b;
}

/* Mostly numbers of ordinary size, now and then any bit pattern. */
static double number(double size) {
    const uint8_t how = byte();
    uint64_t pattern = 0;
    double value;
    int k;
    if (how < 200) {
        const int mantissa = (int)byte() * 256 + (int)byte();
        return size * ((double)mantissa / 32768.0 - 1.0);
    }
    if (how < 215) {
        return 0.0;
    }
    for (k = 0; k < 8; ++k) {
        pattern = pattern << 8 | byte();
    }
    memcpy(&value, &pattern, sizeof value);
    return value;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static m_work work;
    m_state state, before;
    m_info info;
    m_params par = m_default_params();
    m_options opt = m_default_options();
    double q[SG_N_Q], v[SG_N_Q], u[SG_N_U + 1];
    double t, h;
    int j, step, status, wild;
    bytes = data;
    left = size;
    wild = byte() % 4 == 0;
    m_initial_state(&par, &t, q, v);
    for (j = 0; j < SG_N_Q; ++j) {
        q[j] += number(1.0);
        v[j] += number(4.0);
    }
    for (j = 0; j < SG_N_U + 1; ++j) {
        u[j] = number(10.0);
    }
    h = byte() % 8 == 0 ? number(1e3) : 1e-3 * (double)(1 + byte());
    opt.max_halvings = byte() % 8 == 0 ? (int)byte() - 8 : (int)(byte() % 5);
    opt.active_set = (int)(byte() % 2);
    if (wild) {
        for (j = 0; j < (int)(sizeof par / sizeof(double)); ++j) {
            double value;
            memcpy(&value, (char *)&par + (size_t)j * sizeof value, sizeof value);
            value = byte() % 4 ? value : number(10.0);
            memcpy((char *)&par + (size_t)j * sizeof value, &value, sizeof value);
        }
        opt.tol = number(1e-6);
        opt.r = number(10.0);
        opt.max_iterations = (int)byte() - 4;
        opt.scaling = (int)(byte() % 4) - 1;
    }
    status = byte() % 2 ? m_init(&state, &par, &opt, t, q, v) : m_set_state(&state, t, q, v);
    ENSURE(status >= M_OK && status <= M_INCONSISTENT_START);
    if (status != M_OK) {
        return 0;
    }
    for (step = 0; step < 6; ++step) {
        memset(&work, 0xFF, sizeof work);
        before = state;
        if (byte() % 16 == 0) {
            /* a guess out of nowhere */
            for (j = 0; j < (int)(sizeof state.x / sizeof state.x[0]); ++j) {
                state.x[j] = number(10.0);
            }
            before = state;
        }
        status = m_step(&state, &work, &info, &par, &opt, u, h);
        ENSURE(status == info.status);
        ENSURE(status >= M_OK && status <= M_INCONSISTENT_START);
        if (status > M_OK_SUBSTEPPED) {
            ENSURE(!memcmp(&state, &before, sizeof state));
            return 0;
        }
        ENSURE(info.iterations <= opt.max_iterations);
        for (j = 0; j < SG_N_Q; ++j) {
            ENSURE(state.q[j] - state.q[j] == 0.0 && state.v[j] - state.v[j] == 0.0);
        }
    }
    return 0;
}
