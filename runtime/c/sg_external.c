#pragma once

/* A step as a function that CasADi calls: (q, v, u, par, t, h) -> (q_next, v_next), and all blocks
   of its derivative. Memory is what the caller lends. */

enum { SG_EXTERNAL_INPUTS = 6, SG_EXTERNAL_RESULTS = 2 };

/* What a call works in. */
typedef struct {
    SG(work) work;
    SG(info) info;
    SG(state) state;
    SG(directions) directions;
    SG(params) par;
    double u[SG_N_U + 1];
} sg_external;

static double sg_entry(const double *values, int i) { return values == NULL ? 0.0 : values[i]; }

/* One change of one for each number of the arguments, in their order. */
static void sg_external_seeds(SG(directions) * d) {
    const int count[SG_EXTERNAL_INPUTS] = {SG_N_Q, SG_N_Q, SG_N_U, SG_N_PAR, 1, 1};
    double *seeds[SG_EXTERNAL_INPUTS];
    int j = 0;
    int block, i;
    seeds[0] = d->q;
    seeds[1] = d->v;
    seeds[2] = d->u;
    seeds[3] = d->par;
    seeds[4] = d->t;
    seeds[5] = d->h;
    for (block = 0; block < SG_EXTERNAL_INPUTS; ++block) {
        for (i = 0; i < count[block]; ++i, ++j) {
            seeds[block][j * count[block] + i] = 1.0;
        }
    }
    d->grid[2 * SG_N_Q + SG_N_U + SG_N_PAR] = 1.0;
    d->count = j;
}

/* Take the step from the arguments; 0 if that could be done. */
static int sg_external_step(const double **arg, sg_external *e, int differentiate) {
    SG(options) opt = SG(default_options)();
    double par[SG_N_PAR + 1];
    double q[SG_N_Q];
    double v[SG_N_Q];
    int status, i;
    memset(e, 0, sizeof *e);
    for (i = 0; i < SG_N_Q; ++i) {
        q[i] = sg_entry(arg[0], i);
        v[i] = sg_entry(arg[1], i);
    }
    for (i = 0; i < SG_N_U; ++i) {
        e->u[i] = sg_entry(arg[2], i);
    }
    for (i = 0; i < SG_N_PAR; ++i) {
        par[i] = sg_entry(arg[3], i);
    }
    sg_external_parameters(par, &e->par);
    sg_external_options(&opt);
    if (SG(set_state)(&e->state, sg_entry(arg[4], 0), q, v) != SG_K(OK)) {
        return 1;
    }
    if (differentiate) {
        sg_external_seeds(&e->directions);
        status = SG(step_forward)(&e->state, &e->work, &e->info, &e->par, &opt, e->u,
                                  sg_entry(arg[5], 0), &e->directions);
    } else {
        status = SG(step)(&e->state, &e->work, &e->info, &e->par, &opt, e->u, sg_entry(arg[5], 0));
    }
    return status > SG_K(OK_SUBSTEPPED);
}

/* Entries of one block of the derivative, column by column; no numbers where there are none. */
static void sg_external_block(const SG(directions) * d, const double *changes, int first,
                              const casadi_int *pattern, double *to) {
    const casadi_int columns = pattern[1];
    const casadi_int *start = &pattern[2];
    const casadi_int *row = &start[columns + 1];
    const int lost = d->lost != 0;
    casadi_int c, k;
    for (c = 0; c < columns; ++c) {
        const int j = first + (int)c;
        const int known = !lost && d->t[j] == d->grid[j];
        for (k = start[c]; k < start[c + 1]; ++k) {
            to[k] = known ? changes[j * SG_N_Q + (int)row[k]] : (double)NAN;
        }
    }
}

int SG(casadi)(const double **arg, double **res, casadi_int *iw, double *w, int mem) {
    sg_external *e = (sg_external *)(void *)w;
    (void)iw;
    (void)mem;
    if (sg_external_step(arg, e, 0) != 0) {
        return 1;
    }
    if (res[0] != NULL) {
        memcpy(res[0], e->state.q, sizeof e->state.q);
    }
    if (res[1] != NULL) {
        memcpy(res[1], e->state.v, sizeof e->state.v);
    }
    return 0;
}

int SG_JAC()(const double **arg, double **res, casadi_int *iw, double *w, int mem) {
    const int count[SG_EXTERNAL_INPUTS] = {SG_N_Q, SG_N_Q, SG_N_U, SG_N_PAR, 1, 1};
    sg_external *e = (sg_external *)(void *)w;
    int out;
    (void)iw;
    (void)mem;
    if (sg_external_step(arg, e, 1) != 0) {
        return 1;
    }
    for (out = 0; out < SG_EXTERNAL_RESULTS; ++out) {
        const double *changes = out == 0 ? e->directions.q : e->directions.v;
        int first = 0;
        int in;
        for (in = 0; in < SG_EXTERNAL_INPUTS; ++in) {
            double *to = res[out * SG_EXTERNAL_INPUTS + in];
            if (to != NULL) {
                sg_external_block(&e->directions, changes, first,
                                  sg_blocks[out * SG_EXTERNAL_INPUTS + in], to);
            }
            first += count[in];
        }
    }
    return 0;
}

/* ---- what CasADi asks of both -------------------------------------------------------------- */

static int sg_external_work(casadi_int arg, casadi_int res, casadi_int *sz_arg, casadi_int *sz_res,
                            casadi_int *sz_iw, casadi_int *sz_w) {
    if (sz_arg != NULL) {
        *sz_arg = arg;
    }
    if (sz_res != NULL) {
        *sz_res = res;
    }
    if (sz_iw != NULL) {
        *sz_iw = 0;
    }
    if (sz_w != NULL) {
        *sz_w = (casadi_int)((sizeof(sg_external) + sizeof(double) - 1) / sizeof(double));
    }
    return 0;
}

static const char *sg_input_name(casadi_int i) {
    static const char *const names[] = {"q", "v", "u", "par", "t", "h", "out_q_next", "out_v_next"};
    return i >= 0 && i < SG_EXTERNAL_INPUTS + SG_EXTERNAL_RESULTS ? names[i] : NULL;
}

casadi_int SG(casadi_n_in)(void) { return SG_EXTERNAL_INPUTS; }
casadi_int SG(casadi_n_out)(void) { return SG_EXTERNAL_RESULTS; }
const char *SG(casadi_name_in)(casadi_int i) {
    return i < SG_EXTERNAL_INPUTS ? sg_input_name(i) : NULL;
}
const char *SG(casadi_name_out)(casadi_int i) {
    return i == 0 ? "q_next" : i == 1 ? "v_next" : NULL;
}
const casadi_int *SG(casadi_sparsity_in)(casadi_int i) {
    return i >= 0 && i < SG_EXTERNAL_INPUTS ? sg_columns[i] : NULL;
}
const casadi_int *SG(casadi_sparsity_out)(casadi_int i) {
    return i >= 0 && i < SG_EXTERNAL_RESULTS ? sg_columns[0] : NULL;
}
int SG(casadi_work)(casadi_int *sz_arg, casadi_int *sz_res, casadi_int *sz_iw, casadi_int *sz_w) {
    return sg_external_work(SG_EXTERNAL_INPUTS, SG_EXTERNAL_RESULTS, sz_arg, sz_res, sz_iw, sz_w);
}

casadi_int SG_JAC(_n_in)(void) { return SG_EXTERNAL_INPUTS + SG_EXTERNAL_RESULTS; }
casadi_int SG_JAC(_n_out)(void) { return SG_EXTERNAL_INPUTS * SG_EXTERNAL_RESULTS; }
const char *SG_JAC(_name_in)(casadi_int i) { return sg_input_name(i); }
const casadi_int *SG_JAC(_sparsity_in)(casadi_int i) {
    return i >= 0 && i < SG_EXTERNAL_INPUTS                         ? sg_columns[i]
           : i >= 0 && i < SG_EXTERNAL_INPUTS + SG_EXTERNAL_RESULTS ? sg_columns[0]
                                                                    : NULL;
}
const casadi_int *SG_JAC(_sparsity_out)(casadi_int i) {
    return i >= 0 && i < SG_EXTERNAL_INPUTS * SG_EXTERNAL_RESULTS ? sg_blocks[i] : NULL;
}
int SG_JAC(_work)(casadi_int *sz_arg, casadi_int *sz_res, casadi_int *sz_iw, casadi_int *sz_w) {
    return sg_external_work(SG_EXTERNAL_INPUTS + SG_EXTERNAL_RESULTS,
                            SG_EXTERNAL_INPUTS * SG_EXTERNAL_RESULTS, sz_arg, sz_res, sz_iw, sz_w);
}
