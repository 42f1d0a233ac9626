/* A hopper in real time: a thread that wakes every millisecond, takes one step, and says how late
 * it woke and how long the step took.
 *
 *     signorini generate hopper --out hopper_c
 *     make real_time && ./real_time 5
 *
 * The number is the time to run [s]. What the step may cost is fixed before: at most MOST
 * iterations, no halvings, impacts captured. A step that is not solved within that leaves the state
 * as it was; the program says so, and takes the step that was missed together with the next one.
 */
#define _POSIX_C_SOURCE 200809L
#include "hopper.h"

#include <math.h>
#include <pthread.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <time.h>

enum { PERIOD = 1000000 /* [ns] */, MOST = 20 /* iterations of a step */ };

/* Nothing of a step is on the stack but what the README of the folder says, nothing on the heap. */
static hopper_work work;
static hopper_state state;
static hopper_params par;
static hopper_options opt;

static double since(const struct timespec *from, const struct timespec *to) {
    return 1e6 * (double)(to->tv_sec - from->tv_sec) + 1e-3 * (double)(to->tv_nsec - from->tv_nsec);
}

/* What the loop has seen [us], of every cycle. */
typedef struct {
    int n_cycles, missed, late_steps;
    double *late, *took;
} measured;

static void *loop(void *argument) {
    measured *m = argument;
    const hopper_real u[HOPPER_N_U] = {0.0};
    hopper_info info;
    struct timespec due, woke, done;
    double owed = 1.0; /* steps */
    int k;
    clock_gettime(CLOCK_MONOTONIC, &due);
    for (k = 0; k < m->n_cycles; ++k) {
        int status;
        due.tv_nsec += PERIOD;
        if (due.tv_nsec >= 1000000000) {
            due.tv_nsec -= 1000000000;
            ++due.tv_sec;
        }
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL) != 0) {
        }
        clock_gettime(CLOCK_MONOTONIC, &woke);
        status = hopper_step(&state, &work, &info, &par, &opt, u, owed * 1e-9 * PERIOD);
        clock_gettime(CLOCK_MONOTONIC, &done);
        owed = status <= HOPPER_OK_SUBSTEPPED ? 1.0 : owed + 1.0;
        m->missed += status > HOPPER_OK_SUBSTEPPED;
        m->late[k] = since(&due, &woke);
        m->took[k] = since(&woke, &done);
        m->late_steps += m->late[k] + m->took[k] > 1e-3 * PERIOD;
    }
    return NULL;
}

static int before(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void say(const char *what, double *x, int n) {
    qsort(x, (size_t)n, sizeof *x, before);
    printf("%-14s %8.2f %8.2f %8.2f %8.2f\n", what, x[n / 2], x[(int)(0.99 * n)],
           x[(int)(0.999 * n)], x[n - 1]);
}

int main(int n_arguments, char **arguments) {
    const double seconds = n_arguments > 1 ? strtod(arguments[1], NULL) : 5.0;
    struct sched_param priority = {0};
    pthread_attr_t attributes;
    pthread_t thread;
    hopper_real t0[1], q0[HOPPER_N_Q], v0[HOPPER_N_Q];
    measured m = {0};
    int locked, in_time, status;

    if (!(seconds > 0.0 && seconds <= 3600.0)) {
        fprintf(stderr, "give the time to run in seconds, up to 3600\n");
        return 2;
    }
    m.n_cycles = (int)ceil(seconds * 1e9 / PERIOD);
    m.late = calloc((size_t)m.n_cycles, sizeof *m.late);
    m.took = calloc((size_t)m.n_cycles, sizeof *m.took);
    if (m.late == NULL || m.took == NULL) {
        return 2;
    }
    par = hopper_default_params();
    opt = hopper_default_options();
    opt.max_iterations = MOST;
    opt.max_halvings = 0;
    hopper_initial_state(&par, t0, q0, v0);
    status = hopper_init(&state, &par, &opt, t0[0], q0, v0);
    if (status > HOPPER_OK_SUBSTEPPED) {
        fprintf(stderr, "%s\n", hopper_status_text(status));
        return 2;
    }

    /* No page of memory is fetched while the loop runs, and nobody else runs before it. */
    locked = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
    priority.sched_priority = 80;
    pthread_attr_init(&attributes);
    pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
    pthread_attr_setschedpolicy(&attributes, SCHED_FIFO);
    pthread_attr_setschedparam(&attributes, &priority);
    in_time = pthread_create(&thread, &attributes, loop, &m) == 0;
    if (!in_time && pthread_create(&thread, NULL, loop, &m) != 0) {
        return 2;
    }
    pthread_join(thread, NULL);

    printf("memory locked: %s, real-time priority: %s\n", locked ? "yes" : "no (not allowed)",
           in_time ? "yes" : "no (not allowed)");
    printf("%-14s %8s %8s %8s %8s\n", "[us]", "median", "99 %", "99.9 %", "worst");
    say("woke late by", m.late, m.n_cycles);
    say("step took", m.took, m.n_cycles);
    printf("cycles: %d, steps not solved in time: %d, cycles that were too long: %d\n", m.n_cycles,
           m.missed, m.late_steps);
    printf("the hopper is at t = %.3f s\n", (double)state.t);
    free(m.late);
    free(m.took);
    return 0;
}
