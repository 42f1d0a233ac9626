/* Runs of one stepper that are differentiated, on threads: forward along directions, and gradients
   carried back. Part of the library that Python loads, not of a generated folder: compiled with the
   generated header included and SIGNORINI_PREFIX set to its prefix. */
#include "pool.h"

#include <math.h>
#include <stdlib.h>

/* What both need: the runs, which have been taken already. */
typedef struct {
    int n_runs, n_steps, n_u_rows; /* n_u_rows: rows of inputs of a run, 0: all share them */
    int n_q, n_u, n_ways, max_lost;
    int captured; /* whether steps are captured: changes are those of their map then */
    SG(real) h;
    const SG(real) * t0, *q0, *v0, *u;
    const SG(params) * params;
    const SG(options) * options;
    const int *steps;             /* that each run has taken */
    int *status, *n_lost;         /* worst status; how many events have no derivative */
    SG(real) * lost_t;            /* rows of max_lost: their times */
    int *lost_contact, *lost_why; /* contacts and reasons */
    const volatile int *stop;     /* the caller sets it to end all */
    const SG(real) * sizes;       /* of the steps, or NULL: they have the size h */
    const int *ends;              /* steps before the end of each row, the first is 0 */
    int n_rows;                   /* rows of a run */
    /* forward */
    const SG(directions) * seeds; /* directions at the start of each run */
    SG(real) * dq, *dv;           /* changes: rows of n_ways * n_q */
    /* back */
    int n_kept;                     /* states that a thread keeps */
    int rows;                       /* whether cotangents are given for every state, or the end */
    const SG(real) * q_bar, *v_bar; /* cotangents of each run */
    SG(adjoint) * gradient;         /* by its start */
    SG(real) * u_bar;               /* by its inputs, n_steps * n_u */
    int *leaves;                    /* directions that leave its start, n_ways */
} SG(changes);

/* Growth of a small change of the state from which on rounding decides what the derivative is: the
   square root of the precision, turned round. */
static SG(real) most_growth(void) {
    const SG(real) half = (SG(real))0.5;
    SG(real) growth = 1;
    SG(real) precision = 1;
    while ((SG(real))(1 + precision * half) > 1) {
        precision *= half;
        growth *= (SG(real))1.4142135623730951;
    }
    return growth;
}

typedef struct {
    SG(work) work;
    SG(info) info;
    SG(state) state;
    SG(directions) directions;
} walker;

static SG(real) size_of(const SG(changes) * c, int step) {
    return c->sizes != NULL ? c->sizes[step] : c->h;
}

static const SG(real) * inputs_of(const SG(changes) * c, int k, int step) {
    const long first = (long)k * c->n_u_rows + step;
    return c->n_u > 0 ? &c->u[first * c->n_u] : NULL;
}

static void note_lost(const SG(changes) * c, int k, const SG(directions) * d) {
    const long at = (long)k * c->max_lost + c->n_lost[k];
    if (c->n_lost[k] < c->max_lost) {
        c->lost_t[at] = d->at;
        c->lost_contact[at] = d->contact;
        c->lost_why[at] = d->lost;
        ++c->n_lost[k];
    }
}

/* Row of a run: what is unknown is no number. */
static void keep_row(const SG(changes) * c, int k, int row, const SG(directions) * d, int lost) {
    const long first = ((long)k * c->n_rows + row) * c->n_ways * c->n_q;
    int i, j;
    for (j = 0; j < d->count - 1; ++j) { /* the last is the probe */
        /* the start is as it is said, whatever follows */
        const int known = row == 0 || (!lost && !d->leaves[j] && d->t[j] == d->grid[j]);
        for (i = 0; i < c->n_q; ++i) {
            const int at = j * c->n_q + i;
            c->dq[first + at] = known ? d->q[at] : (SG(real))NAN;
            c->dv[first + at] = known ? d->v[at] : (SG(real))NAN;
        }
    }
}

/* A change of the whole state behind the directions that are asked for: it shows how the motion
   spreads. */
static void add_probe(const SG(changes) * c, SG(directions) * d) {
    const int j = d->count;
    int i;
    for (i = 0; i < c->n_q; ++i) {
        d->q[j * c->n_q + i] = (SG(real))(i % 3 == 1 ? -1 : 1);
        d->v[j * c->n_q + i] = (SG(real))(i % 2 == 1 ? -1 : 1);
    }
    ++d->count;
}

/* 1 if it has grown too much. */
static int has_spread(const SG(changes) * c, const SG(directions) * d, SG(real) most) {
    const int j = d->count - 1;
    int i;
    for (i = 0; i < c->n_q; ++i) {
        if (!(fabs((double)d->q[j * c->n_q + i]) < (double)most &&
              fabs((double)d->v[j * c->n_q + i]) < (double)most)) {
            return 1;
        }
    }
    return 0;
}

static void walk(const void *job, int k, void *memory) {
    const SG(changes) *c = job;
    walker *m = memory;
    SG(directions) *d = &m->directions;
    const SG(real) most = most_growth();
    const int of_map = 7;  /* a step that is captured because all are */
    const int spreads = 8; /* a motion that rounding decides */
    int lost = 0;
    int spread = 0;
    int row = 0;
    int step;
    *d = c->seeds[k];
    add_probe(c, d);
    c->n_lost[k] = 0;
    c->status[k] =
        SG(set_state)(&m->state, c->t0[k], &c->q0[(long)k * c->n_q], &c->v0[(long)k * c->n_q]);
    for (step = 0; c->status[k] == 0 && !*c->stop; ++step) {
        int status;
        row += c->ends[row] < step;
        if (d->count > 1 && (step == c->ends[row] || step == c->steps[k])) {
            keep_row(c, k, row, d, lost);
        }
        if (step == c->steps[k]) {
            break;
        }
        d->lost = 0;
        status = SG(step_forward)(&m->state, &m->work, &m->info, &c->params[k], c->options,
                                  inputs_of(c, k, step), size_of(c, step), d);
        c->status[k] = status > 2 ? status : 0;
        if (d->lost != 0 && status <= 2 && !(d->lost == of_map && c->n_lost[k] > 0)) {
            note_lost(c, k, d);
        }
        lost = lost || (d->lost != 0 && !c->captured);
        if (!spread && !lost && status <= 2 && has_spread(c, d, most)) {
            spread = 1;
            d->lost = spreads;
            d->contact = -1;
            d->at = m->state.t;
            note_lost(c, k, d);
            lost = !c->captured;
        }
    }
}

/* Run all of them once more along the directions. Returns how many runs were taken up. */
int SG(run_forward)(const SG(changes) * changes, int n_threads) {
    task of;
    of.run = walk;
    of.job = changes;
    of.memory = sizeof(walker);
    of.n_runs = changes->n_runs;
    of.stop = changes->stop;
    return work_on(&of, n_threads);
}

/* A gradient carried back over steps of different sizes; all states are kept. */
static int pull_chosen(const SG(changes) * c, int k, walker *m, SG(checkpoint) kept[],
                       const SG(real) * q_bar, const SG(real) * v_bar, SG(real) * u_bar) {
    SG(adjoint) *a = &c->gradient[k];
    SG(directions) *d = &m->directions;
    const int of_map = 7;
    int status = 0;
    int step, j;
    kept[0].state = m->state;
    for (step = 0; step < c->steps[k] && status <= 2; ++step) {
        kept[step + 1].state = kept[step].state;
        status = SG(step)(&kept[step + 1].state, &m->work, &m->info, &c->params[k], c->options,
                          inputs_of(c, k, step), size_of(c, step));
    }
    d->lost = 0;
    for (step = c->steps[k]; step >= 0 && status <= 2; --step) {
        for (j = 0; j < c->n_q && c->rows; ++j) {
            a->q[j] += q_bar[(long)step * c->n_q + j];
            a->v[j] += v_bar[(long)step * c->n_q + j];
        }
        if (step > 0) {
            for (j = 0; j < c->n_u; ++j) {
                a->u[j] = 0;
            }
            d->fresh = step == 1;
            status =
                SG(step_adjoint)(&kept[step - 1].state, &m->work, &m->info, &c->params[k],
                                 c->options, inputs_of(c, k, step - 1), size_of(c, step - 1), d, a);
            for (j = 0; j < c->n_u; ++j) {
                u_bar[(long)(step - 1) * c->n_u + j] = a->u[j];
            }
            if (d->lost != 0 && d->lost != of_map) {
                break;
            }
        }
    }
    return status;
}

static void pull(const void *job, int k, void *memory) {
    const SG(changes) *c = job;
    walker *m = memory;
    SG(checkpoint) *kept = (SG(checkpoint) *)(m + 1);
    SG(directions) *d = &m->directions;
    SG(adjoint) *a = &c->gradient[k];
    const long rows = c->rows ? c->n_steps + 1L : 1L;
    const SG(real) *q_bar = &c->q_bar[(long)k * rows * c->n_q];
    const SG(real) *v_bar = &c->v_bar[(long)k * rows * c->n_q];
    SG(real) *u_bar = c->n_u > 0 ? &c->u_bar[(long)k * c->n_steps * c->n_u] : NULL;
    int j;
    for (j = 0; j < c->n_q && !c->rows; ++j) {
        a->q[j] = q_bar[j];
        a->v[j] = v_bar[j];
    }
    *d = c->seeds[k];
    c->n_lost[k] = 0;
    c->status[k] =
        SG(set_state)(&m->state, c->t0[k], &c->q0[(long)k * c->n_q], &c->v0[(long)k * c->n_q]);
    if (c->status[k] == 0) {
        const int status =
            c->sizes != NULL
                ? pull_chosen(c, k, m, kept, q_bar, v_bar, u_bar)
                : SG(run_adjoint)(&m->state, kept, c->n_kept, &m->work, &m->info, &c->params[k],
                                  c->options, inputs_of(c, k, 0), c->h, c->steps[k],
                                  c->rows ? q_bar : NULL, c->rows ? v_bar : NULL, d, a, u_bar);
        c->status[k] = status > 2 ? status : 0;
        if (d->lost != 0) {
            note_lost(c, k, d);
        }
    }
    for (j = 0; j < c->n_ways; ++j) {
        c->leaves[(long)k * c->n_ways + j] = d->leaves[j];
    }
}

/* Carry gradients back over all of them. Returns how many runs were taken up. */
int SG(run_back)(const SG(changes) * changes, int n_threads) {
    task of;
    of.run = pull;
    of.job = changes;
    of.memory = sizeof(walker) + (size_t)changes->n_kept * sizeof(SG(checkpoint));
    of.n_runs = changes->n_runs;
    of.stop = changes->stop;
    return work_on(&of, n_threads);
}

/* The size of the struct and where its members begin, in their order: the caller, who lays it out
   anew, compares. Returns how many numbers that are; `out` may be NULL. */
int SG(changes_layout)(int out[]) {
#define AT(member) (int)offsetof(SG(changes), member)
    static const int layout[] = {
        (int)sizeof(SG(changes)),
        AT(n_runs),
        AT(n_steps),
        AT(n_u_rows),
        AT(n_q),
        AT(n_u),
        AT(n_ways),
        AT(max_lost),
        AT(captured),
        AT(h),
        AT(t0),
        AT(q0),
        AT(v0),
        AT(u),
        AT(params),
        AT(options),
        AT(steps),
        AT(status),
        AT(n_lost),
        AT(lost_t),
        AT(lost_contact),
        AT(lost_why),
        AT(stop),
        AT(sizes),
        AT(ends),
        AT(n_rows),
        AT(seeds),
        AT(dq),
        AT(dv),
        AT(n_kept),
        AT(rows),
        AT(q_bar),
        AT(v_bar),
        AT(gradient),
        AT(u_bar),
        AT(leaves),
    };
    const int n = (int)(sizeof layout / sizeof layout[0]);
    int k;
    for (k = 0; k < n && out != NULL; ++k) {
        out[k] = layout[k];
    }
    return n;
}
