/* Many runs of one stepper on threads. Part of the library that Python loads, not of a generated
   folder: compiled with the generated header included and SIGNORINI_PREFIX set to its prefix. */
#include "pool.h"

/* Inputs of a batch, run by run, and where its rows go. Row 0 of every run belongs to its start. */
typedef struct {
    int n_runs, n_steps, every, n_u_rows; /* n_u_rows: rows of inputs of a run, 0: all share them */
    int n_q, n_R, n_u, n_contacts;
    SG(real) h;
    const SG(real) * t0, *q0, *v0, *u;
    const SG(params) * params;
    const SG(options) * options;
    SG(real) * t, *q, *v, *P, *residual, *smallest_gap, *energy;
    int *counts, *contact, *status, *done;
    const volatile int *stop; /* the caller sets it to end the batch */
#if SIGNORINI_ADAPTIVE
    const SG(control) * control; /* how exact steps are to be, or NULL: they have the size h */
    SG(real) * estimate;
    int *missed;
#endif
} SG(batch);

/* What a thread works with. */
typedef struct {
    SG(work) work;
#if SIGNORINI_ADAPTIVE
    SG(control) control;
#endif
} worker;

/* Steps of a run, of one size or such as a tolerance wants. */
static int take(const SG(batch) * b, int k, worker *m, SG(state) * s, SG(info) * info,
                const SG(real) * u, int n_steps, const SG(record) * record, int *taken) {
#if SIGNORINI_ADAPTIVE
    if (b->control != NULL) {
        const long rows = (b->n_steps + b->every - 1L) / b->every + 1;
        const long row = (long)k * rows + 1 + b->done[k] / b->every;
        int status;
        m->control.estimates = &b->estimate[row];
        status = SG(simulate_within)(s, &m->work, info, &b->params[k], b->options, u, b->h, n_steps,
                                     b->every, record, taken, &m->control);
        b->missed[k] = m->control.missed;
        return status;
    }
#endif
    return SG(simulate)(s, &m->work, info, &b->params[k], b->options, u, b->h, n_steps, b->every,
                        record, taken);
}

enum { SG_STRIDE = 256 }; /* steps between two looks at the caller's wish to stop */

static void run_one(const void *job, int k, void *memory) {
    const SG(batch) *b = job;
    worker *m = memory;
    const long rows = (b->n_steps + b->every - 1L) / b->every + 1;
    const long first = (long)k * rows + 1;
    SG(state) state;
    SG(info) info;
    SG(record) record;
    record.t = &b->t[first];
    record.q = &b->q[first * b->n_q];
    record.v = &b->v[first * b->n_q];
    record.P = b->n_R > 0 ? &b->P[first * b->n_R] : NULL;
    record.residual = &b->residual[first];
    record.smallest_gap = &b->smallest_gap[first];
    record.energy = &b->energy[first * 2];
    record.counts = &b->counts[first * 10];
    record.contact = b->n_contacts > 0 ? &b->contact[first * b->n_contacts] : NULL;
    record.events = NULL;
    record.n_events = NULL;
    record.max_events = record.begun = 0;
    record.stage_t = record.stage_q = record.stage_v = record.stage_R = NULL;
    b->done[k] = 0;
    b->status[k] = SG(init)(&state, &b->params[k], b->options, b->t0[k], &b->q0[(long)k * b->n_q],
                            &b->v0[(long)k * b->n_q]);
#if SIGNORINI_ADAPTIVE
    if (b->control != NULL) {
        m->control = *b->control;
        m->control.t_start = b->t0[k];
        m->control.span = (SG(real))b->n_steps * b->h;
    }
#endif
    if (b->status[k] == 0) {
        const SG(real) *u = b->n_u > 0 ? &b->u[(long)k * b->n_u_rows * b->n_u] : NULL;
        SG(record) at = record;
        while (b->done[k] < b->n_steps && b->status[k] == 0 && !*b->stop) {
            const int left = b->n_steps - b->done[k];
            const int row = b->done[k] / b->every;
            int taken = 0;
            at.t = &record.t[row];
            at.q = &record.q[(long)row * b->n_q];
            at.v = &record.v[(long)row * b->n_q];
            at.P = record.P != NULL ? &record.P[(long)row * b->n_R] : NULL;
            at.residual = &record.residual[row];
            at.smallest_gap = &record.smallest_gap[row];
            at.energy = &record.energy[2L * row];
            at.counts = &record.counts[10L * row];
            at.contact = record.contact != NULL ? &record.contact[(long)row * b->n_contacts] : NULL;
            at.begun = b->done[k] % b->every;
            b->status[k] = take(b, k, m, &state, &info,
                                u != NULL && b->n_u_rows > 0 ? &u[(long)b->done[k] * b->n_u]
                                : u != NULL                  ? &b->u[(long)b->done[k] * b->n_u]
                                                             : NULL,
                                left < SG_STRIDE ? left : SG_STRIDE, &at, &taken);
            b->done[k] += taken;
        }
    }
}

/* The size of the struct and where its members begin, in their order: the caller, who lays it out
   anew, compares. Returns how many numbers that are; `out` may be NULL. */
int SG(batch_layout)(int out[]) {
#define AT(member) (int)offsetof(SG(batch), member)
    static const int layout[] = {
        (int)sizeof(SG(batch)),
        AT(n_runs),
        AT(n_steps),
        AT(every),
        AT(n_u_rows),
        AT(n_q),
        AT(n_R),
        AT(n_u),
        AT(n_contacts),
        AT(h),
        AT(t0),
        AT(q0),
        AT(v0),
        AT(u),
        AT(params),
        AT(options),
        AT(t),
        AT(q),
        AT(v),
        AT(P),
        AT(residual),
        AT(smallest_gap),
        AT(energy),
        AT(counts),
        AT(contact),
        AT(status),
        AT(done),
        AT(stop),
#if SIGNORINI_ADAPTIVE
        AT(control),
        AT(estimate),
        AT(missed),
#endif
    };
    const int n = (int)(sizeof layout / sizeof layout[0]);
    int k;
    for (k = 0; k < n && out != NULL; ++k) {
        out[k] = layout[k];
    }
    return n;
}

/* Run the batch on up to `n_threads` threads. Returns the number of runs that were taken up: less
   than n_runs only if memory is short. */
int SG(run_batch)(const SG(batch) * batch, int n_threads) {
    task of;
    of.run = run_one;
    of.job = batch;
    of.memory = sizeof(worker);
    of.n_runs = batch->n_runs;
    of.stop = batch->stop;
    return work_on(&of, n_threads);
}
