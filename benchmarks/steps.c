/* Times every step of a run of the stepper in HEADER, prefix PRE, and one evaluation of all its
   model functions (functions.h). Prints a line for every step: median time over REPEATS runs in
   nanoseconds, iterations, substeps, which contacts pushed, and events; first one with the clock's
   own time, the evaluation's, and the stages. The start is read from standard input: t, q, v,
   parameters. */
#define _POSIX_C_SOURCE 200809L

#include HEADER

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#define JOIN_(a, b) a##_##b
#define JOIN(a, b) JOIN_(a, b)
#define P(name) JOIN(PRE, name)

enum { PARTS = 64, FACTS = 4 };

#if LOCATED
#define EVENTS(info) (info).n_events
#else
#define EVENTS(info) 0
#endif

#if DERIVATIVES
static P(directions) directions;
static P(adjoint) adjoint;
#endif
static P(work) work;
static volatile P(real) sink;

#include "functions.h"

/* One step; where it is differentiated, along all coordinates and velocities, or back from a number
   that all of them enter. */
static int step(P(state) * state, P(info) * info, const P(params) * par, const P(options) * opt,
                const P(real) u[]) {
#if DERIVATIVES == 2
    int k;
    for (k = 0; k < N_Q; ++k) {
        adjoint.q[k] = adjoint.v[k] = 1;
    }
    return P(step_adjoint)(state, &work, info, par, opt, u, (P(real))H, &directions, &adjoint);
#elif DERIVATIVES == 1
    int k;
    directions.count = 2 * N_Q;
    for (k = 0; k < 2 * N_Q * N_Q; ++k) {
        directions.q[k] = k < N_Q * N_Q && k % (N_Q + 1) == 0;
        directions.v[k] = k >= N_Q * N_Q && (k - N_Q * N_Q) % (N_Q + 1) == 0;
    }
    for (k = 0; k < 2 * N_Q; ++k) {
        directions.t[k] = directions.grid[k] = 0;
    }
    return P(step_forward)(state, &work, info, par, opt, u, (P(real))H, &directions);
#else
    return P(step)(state, &work, info, par, opt, u, (P(real))H);
#endif
}

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e9 + (double)t.tv_nsec;
}

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a;
    const double y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *x, int n) {
    qsort(x, (size_t)n, sizeof *x, compare);
    return x[n / 2];
}

static double clock_time(void) {
    double sample[1001];
    int k;
    for (k = 0; k < 1001; ++k) {
        const double start = now();
        sample[k] = now() - start;
    }
    return median(sample, 1001);
}

/* One evaluation of all model functions, from blocks long enough for the clock. */
static double evaluation_time(const P(params) * par, const P(real) q[], const P(real) v[]) {
    double sample[101];
    int i, k;
    for (k = 0; k < 101; ++k) {
        const double start = now();
        for (i = 0; i < PARTS; ++i) {
            evaluate_all(par, q, v);
        }
        sample[k] = (now() - start) / PARTS;
    }
    return median(sample, 101);
}

int main(void) {
    P(params) par = P(default_params)();
    P(options) opt = P(default_options)();
    P(real) q[N_Q], v[N_Q], t;
    const P(real) u[N_U + 1] = {0};
    double *time_of = malloc(sizeof(double) * STEPS * REPEATS);
    int *facts = malloc(sizeof(int) * FACTS * STEPS);
    double parameter, value, overhead;
    int k, r;

    if (time_of == NULL || facts == NULL || scanf("%lf", &value) != 1) {
        return 1;
    }
    t = (P(real))value;
    for (k = 0; k < 2 * N_Q; ++k) {
        if (scanf("%lf", &value) != 1) {
            return 1;
        }
        (k < N_Q ? q : v)[k % N_Q] = (P(real))value;
    }
    for (k = 0; k < N_PAR; ++k) {
        if (scanf("%lf", &parameter) != 1) {
            return 1;
        }
        ((P(real) *)&par)[k] = (P(real))parameter;
    }
    opt.max_halvings = 4;
#if LOCATED
    opt.events = M_EVENTS_LOCATED;
#endif
    overhead = clock_time();
    printf("%.9g %.9g %d\n", overhead, evaluation_time(&par, q, v), P(meta)().stages);
    for (r = 0; r < REPEATS; ++r) {
        P(state) state;
        P(info) info;
        if (P(init)(&state, &par, &opt, t, q, v) > 2) {
            fprintf(stderr, "start: %s\n", P(status_text)(P(init)(&state, &par, &opt, t, q, v)));
            return 1;
        }
        for (k = 0; k < STEPS; ++k) {
            const double start = now();
            const int status = step(&state, &info, &par, &opt, u);
            const double end = now();
            unsigned pushed = 0;
            int c;
            if (status > 2) {
                fprintf(stderr, "step %d: %s\n", k, P(status_text)(status));
                return 1;
            }
            for (c = 0; c < N_N; ++c) {
                pushed |= info.P[FIRST_N + c] > 0 ? 1U << (c % 31) : 0U;
            }
            time_of[k * REPEATS + r] = end - start - overhead;
            facts[FACTS * k] = info.iterations;
            facts[FACTS * k + 1] = info.substeps;
            facts[FACTS * k + 2] = (int)pushed;
            facts[FACTS * k + 3] = EVENTS(info);
        }
    }
    for (k = 0; k < STEPS; ++k) {
        printf("%.9g %d %d %d %d\n", median(&time_of[k * REPEATS], REPEATS), facts[FACTS * k],
               facts[FACTS * k + 1], facts[FACTS * k + 2], facts[FACTS * k + 3]);
    }
    free(time_of);
    free(facts);
    return 0;
}
