/* Steps from many states at once, each from its own start, for frameworks that differentiate and
   batch by themselves. Part of the library that Python loads, not of a generated folder: compiled
   with the generated header included and SIGNORINI_PREFIX set to its prefix. */
#include "pool.h"

#include <math.h>
#include <string.h>

/* What all have in common. */
typedef struct {
    int steps; /* taken with the same inputs */
    int n_q, n_u, n_par;
    SG(real) t0, h;
    const SG(options) * options;
} SG(map);

typedef struct {
    SG(work) work;
    SG(info) info;
    SG(state) state;
    SG(directions) directions;
} mapper;

/* A change of one along q, v, u and the parameters, in turn. */
static void seed(const SG(map) * of, SG(directions) * d) {
    const int count[4] = {of->n_q, of->n_q, of->n_u, of->n_par};
    SG(real) *const seeds[4] = {d->q, d->v, d->u, d->par};
    int j = 0;
    int block, i;
    for (block = 0; block < 4; ++block) {
        for (i = 0; i < count[block]; ++i, ++j) {
            seeds[block][j * count[block] + i] = 1;
        }
    }
    d->count = j;
}

static int take(const SG(map) * of, mapper *m, const SG(real) * u, const SG(params) * par,
                int differentiate) {
    int lost = 0;
    int k;
    for (k = 0; k < of->steps; ++k) {
        const int status =
            differentiate ? SG(step_forward)(&m->state, &m->work, &m->info, par, of->options, u,
                                             of->h, &m->directions)
                          : SG(step)(&m->state, &m->work, &m->info, par, of->options, u, of->h);
        if (status > 2) {
            return -1;
        }
        lost = lost || (differentiate && m->directions.lost != 0);
    }
    return lost;
}

/* The ends of n runs from rows of q, v, u and parameters, and, unless NULL, their derivatives: of
   each run 2 n_q rows of 2 n_q + n_u + n_par, no numbers where there is none. Returns 0, or 1 + the
   number of a run that cannot be taken, or -1 if memory is short. */
int SG(map_steps)(const SG(map) * of, int n, const SG(real) * q, const SG(real) * v,
                  const SG(real) * u, const SG(real) * par, SG(real) * q_end, SG(real) * v_end,
                  SG(real) * slopes) {
    const int columns = 2 * of->n_q + of->n_u + of->n_par;
    mapper *m = calloc(1, sizeof *m);
    int failed = m == NULL ? -1 : 0;
    int k, i, j;
    for (k = 0; k < n && failed == 0; ++k) {
        SG(params) own;
        int lost = -1;
        for (i = 0; i < of->n_par; ++i) {
            ((SG(real) *)&own)[i] = par[(long)k * of->n_par + i];
        }
        memset(&m->directions, 0, sizeof m->directions);
        seed(of, &m->directions);
        if (SG(set_state)(&m->state, of->t0, &q[(long)k * of->n_q], &v[(long)k * of->n_q]) == 0) {
            lost = take(of, m, of->n_u > 0 ? &u[(long)k * of->n_u] : NULL, &own, slopes != NULL);
        }
        if (lost < 0) {
            failed = k + 1;
            break;
        }
        for (i = 0; i < of->n_q; ++i) {
            SG(real) *to = slopes == NULL ? NULL : &slopes[((long)k * 2 * of->n_q + i) * columns];
            q_end[(long)k * of->n_q + i] = m->state.q[i];
            v_end[(long)k * of->n_q + i] = m->state.v[i];
            for (j = 0; j < columns && to != NULL; ++j) {
                const SG(directions) *d = &m->directions;
                const int known = !lost && d->t[j] == d->grid[j];
                to[j] = known ? d->q[j * of->n_q + i] : (SG(real))NAN;
                to[of->n_q * columns + j] = known ? d->v[j * of->n_q + i] : (SG(real))NAN;
            }
        }
    }
    free(m);
    return failed;
}

/* The size of the struct and where its members begin, in their order: the caller, who lays it out
   anew, compares. Returns how many numbers that are; `out` may be NULL. */
int SG(map_layout)(int out[]) {
#define AT(member) (int)offsetof(SG(map), member)
    static const int layout[] = {
        (int)sizeof(SG(map)), AT(steps), AT(n_q), AT(n_u), AT(n_par), AT(t0), AT(h), AT(options)};
    const int n = (int)(sizeof layout / sizeof layout[0]);
    int k;
    for (k = 0; k < n && out != NULL; ++k) {
        out[k] = layout[k];
    }
    return n;
}
