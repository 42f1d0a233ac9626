/* A run whose inputs a function in C gives before every step. Part of the library that Python
   loads, not of a generated folder: compiled with the generated header included and
   SIGNORINI_PREFIX set to its prefix. */
#include "pool.h"

/* Inputs u from time, coordinates and velocities; `memory` is the controller's own. */
typedef void control(SG(real) t, const SG(real) q[], const SG(real) v[], SG(real) u[],
                     SG(real) memory[]);

typedef struct {
    int n_q, n_u, n_R, n_contacts, n_stages, n_counts;
} SG(widths);

static SG(real) * behind(SG(real) * array, long entries) {
    return array == NULL ? NULL : array + entries;
}

/* The buffers from a row on. */
static SG(record) from_row(const SG(record) * all, const SG(widths) * n, int row) {
    SG(record) r = *all;
    const long stages = (long)row * n->n_stages;
    r.t = behind(all->t, row);
    r.q = behind(all->q, (long)row * n->n_q);
    r.v = behind(all->v, (long)row * n->n_q);
    r.P = behind(all->P, (long)row * n->n_R);
    r.residual = behind(all->residual, row);
    r.smallest_gap = behind(all->smallest_gap, row);
    r.energy = behind(all->energy, 2L * row);
    r.counts = all->counts == NULL ? NULL : all->counts + (long)row * n->n_counts;
    r.contact = all->contact == NULL ? NULL : all->contact + (long)row * n->n_contacts;
    r.stage_t = behind(all->stage_t, stages);
    r.stage_q = behind(all->stage_q, stages * n->n_q);
    r.stage_v = behind(all->stage_v, stages * n->n_q);
    r.stage_R = behind(all->stage_R, stages * n->n_R);
    return r;
}

/* n_steps steps behind `begun` of the first row; u receives the inputs, a row for each. Ends at the
   first step that fails, or for which the controller gives what is no number. */
int SG(simulate_controlled)(SG(state) * s, SG(work) * w, SG(info) * info, const SG(params) * par,
                            const SG(options) * opt, control *ask, SG(real) memory[], SG(real) u[],
                            SG(real) h, int n_steps, int every, const SG(record) * record,
                            const SG(widths) * n, int *done) {
    const int begun = record->begun;
    int status = 0;
    *done = 0;
    while (*done < n_steps && status <= 2) {
        SG(real) *row = &u[(long)*done * n->n_u];
        SG(record) at = from_row(record, n, (begun + *done) / every);
        int taken = 0;
        at.begun = (begun + *done) % every;
        ask(s->t, s->q, s->v, row, memory);
        status = SG(simulate)(s, w, info, par, opt, row, h, 1, every, &at, &taken);
        *done += taken;
    }
    return status;
}
