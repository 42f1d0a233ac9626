/* Threads that work off the runs of a job. Part of the library that Python loads, not of a
   generated folder. */
#pragma once
#include <pthread.h>
#include <stddef.h>
#include <stdlib.h>

#define SIGNORINI_PASTE(a, b) a##_##b
#define SIGNORINI_JOIN(a, b) SIGNORINI_PASTE(a, b)
#define SG(name) SIGNORINI_JOIN(SIGNORINI_PREFIX, name)

typedef struct {
    void (*run)(const void *job, int k, void *memory); /* run number k of the job */
    const void *job;
    size_t memory; /* bytes that each thread needs for its runs */
    int n_runs;
    const volatile int *stop; /* the caller sets it to end the job */
} task;

typedef struct {
    const task *of;
    pthread_mutex_t lock;
    int next;
} pool;

static void *work_off(void *argument) {
    pool *p = argument;
    void *memory = malloc(p->of->memory);
    for (;;) {
        int k;
        pthread_mutex_lock(&p->lock);
        k = memory != NULL && !*p->of->stop ? p->next++ : p->of->n_runs;
        pthread_mutex_unlock(&p->lock);
        if (k >= p->of->n_runs) {
            break;
        }
        p->of->run(p->of->job, k, memory);
    }
    free(memory);
    return NULL;
}

/* Work off a task on up to `n_threads` threads. Returns the number of runs that were taken up: less
   than n_runs only if it was stopped or memory is short. */
static int work_on(const task *of, int n_threads) {
    pool p;
    pthread_t *threads = malloc((size_t)n_threads * sizeof *threads);
    int started = 0;
    p.of = of;
    p.next = 0;
    if (threads == NULL || pthread_mutex_init(&p.lock, NULL) != 0) {
        free(threads);
        return 0;
    }
    /* the calling thread works, too */
    while (started < n_threads - 1 && pthread_create(&threads[started], NULL, work_off, &p) == 0) {
        ++started;
    }
    (void)work_off(&p);
    while (started > 0) {
        pthread_join(threads[--started], NULL);
    }
    pthread_mutex_destroy(&p.lock);
    free(threads);
    return p.next < of->n_runs ? p.next : of->n_runs;
}
