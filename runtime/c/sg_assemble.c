#pragma once
#include "sg_island.c"

/* What the elements of an island, its parts and couplings, are given, and what they say: each is
   evaluated by itself, and residual and Jacobian of the island are sums. */

/* Numbers of the coordinates, block by block. */
static void sg_bring(const SG(work) * w, int m, int blocks, const real *from, real *to) {
    const int n = sg_member_kind(w, m)->n_q;
    int b, j;
    for (b = 0; b < blocks; ++b) {
        for (j = 0; j < n; ++j) {
            to[b * n + j] = from[b * sg_n_q(w) + sg_place_of(w, m, j)];
        }
    }
}

static void sg_send(const SG(work) * w, int m, int blocks, const real *from, real *to) {
    const int n = sg_member_kind(w, m)->n_q;
    int b, j;
    for (b = 0; b < blocks; ++b) {
        for (j = 0; j < n; ++j) {
            to[b * sg_n_q(w) + sg_place_of(w, m, j)] = from[b * n + j];
        }
    }
}

/* Numbers of the percussion rows, slot by slot. */
static void sg_bring_rows(const SG(work) * w, int m, int slots, const real *from, real *to) {
    const int n = sg_member_kind(w, m)->n_R;
    int c, slot;
    for (c = 0; c < n; ++c) {
        const int row = sg_row_of(w, m, c);
        for (slot = 0; slot < slots; ++slot) {
            to[slot * n + c] = from[slot * sg_n_R(w) + row];
        }
    }
}

static void sg_send_rows(const SG(work) * w, int m, int slots, const real *from, real *to) {
    const int n = sg_member_kind(w, m)->n_R;
    int c, slot;
    for (c = 0; c < n; ++c) {
        const int row = sg_row_of(w, m, c);
        for (slot = 0; slot < slots; ++slot) {
            to[slot * sg_n_R(w) + row] = from[slot * n + c];
        }
    }
}

/* What every evaluation of an element reads. */
static void sg_bring_start(SG(work) * w, int m) {
    SG(element) *e = &w->element[m];
#if SG_N_OWN > 0
    e->own = &sg_own[sg_parts[w->members[m]].own];
#endif
    e->t = w->t;
    e->h = w->h;
    sg_copy(SG_N_U, w->u, e->u);
    sg_bring(w, m, 1, w->q, e->q);
    sg_bring(w, m, 1, w->v, e->v);
}

/* Unknowns of one problem, and the coefficients of its laws. */
static void sg_bring_unknowns(SG(work) * w, int m, int problem) {
    SG(element) *e = &w->element[m];
    const sg_kind *kind = sg_member_kind(w, m);
    const sg_problem *own = &kind->problems[problem];
    const sg_problem *pr = sg_problem_at(w, problem);
    const int first = sg_first_of(w, m, SG_FIRST_CONTACT);
    sg_bring_start(w, m);
    sg_bring(w, m, own->n_x / kind->n_q, &w->x[pr->x], &e->x[own->x]);
    sg_bring_rows(w, m, own->n_slots, &w->R[pr->R], &e->R[own->R]);
    sg_copy(kind->n_contacts, &w->mu[first], e->mu);
    sg_copy(kind->n_contacts, &w->e_N[first], e->e_N);
    sg_copy(kind->n_contacts, &w->e_F[first], e->e_F);
#if SG_LOCATED
    sg_copy(kind->n_F, &w->share[sg_first_of(w, m, SG_FIRST_F)], e->share);
    sg_copy(kind->n_gamma, &w->given[sg_first_of(w, m, SG_FIRST_GAMMA)], e->given);
    sg_copy(kind->n_F, &w->given[sg_n_gamma(w) + sg_first_of(w, m, SG_FIRST_F)],
            &e->given[kind->n_gamma]);
    e->look_t = w->look_t;
    sg_bring(w, m, 1, w->look_q, e->look_q);
    sg_bring(w, m, 1, w->look_v, e->look_v);
#endif
}

/* Entries of rows of a matrix of one element, where they stand in that of the island. */
static void sg_send_matrix(const SG(work) * w, int m, int what, int rows, const sg_rows *from,
                           const real *values, const sg_rows *to, real *out) {
    int i;
    for (i = 0; i < rows; ++i) {
        const int row = sg_table_row(w, m, what, i);
        sg_copy(from->start[i + 1] - from->start[i], &values[from->start[i]], &out[to->start[row]]);
    }
}

/* Terms of (t_n, q_n) of an element, if something changed since they were found. */
static void sg_recall_element(SG(work) * w, const SG(params) * par, int m) {
#if SG_N_KEY > 0
    SG(element) *e = &w->element[m];
    const int part = w->members[m];
    int k;
    SG(part_key)(part, e->t, e->q, par, e->key);
    for (k = 0; k < sg_kinds[sg_parts[part].kind].n_key; ++k) {
        e->trial.has_terms = e->trial.has_terms && e->trial.key[k] == e->key[k];
    }
    if (!e->trial.has_terms) {
        SG(part_terms)(part, e->t, e->q, par, e->trial.terms);
        sg_copy(sg_kinds[sg_parts[part].kind].n_key, e->key, e->trial.key);
        e->trial.has_terms = 1;
    }
#else
    (void)w;
    (void)par;
    (void)m;
#endif
}

/* Keep the terms of the end of the step, and what they belong to (sg_cover.c). */
static void sg_retain(SG(work) * w, const SG(params) * par) {
#if SG_N_KEY > 0
    int m;
    for (m = 0; m < w->n_members; ++m) {
        SG(element) *e = &w->element[m];
        const int part = w->members[m];
        const int n = sg_kinds[sg_parts[part].kind].n_terms;
        sg_bring(w, m, 1, w->q_end, e->q_end);
        SG(part_key)(part, w->t + w->h, e->q_end, par, e->trial.key);
        sg_copy(n, &e->terms[(SG_N_STAGES - 2) * n], e->trial.terms);
        e->trial.has_terms = 1;
    }
#else
    (void)w;
    (void)par;
#endif
}

/* The mass matrix and the directions of one element. */
static void sg_send_masses(SG(work) * w, int m, int entries) {
    const SG(element) *e = &w->element[m];
    const sg_kind *own = sg_member_kind(w, m);
    int c;
    if (m < w->n_bodies) {
        sg_copy(own->mass.start[own->n_q], e->mass, &w->mass[entries]);
    }
    for (c = 0; c < own->n_R; ++c) {
        sg_copy(own->direction.start[c + 1] - own->direction.start[c],
                &e->direction[own->direction.start[c]],
                &w->direction[sg_kind_of(w)->direction.start[sg_row_of(w, m, c)]]);
    }
}

static void SG(start)(SG(work) * w, const SG(params) * par) {
    int entries = 0;
    int m;
    sg_fill(sg_n_R(w), SG_C(0.0), w->no_R);
    for (m = 0; m < w->n_members; ++m) {
        SG(element) *e = &w->element[m];
        const sg_kind *own = sg_member_kind(w, m);
        const int first = sg_first_of(w, m, SG_FIRST_CONTACT);
        sg_bring_start(w, m);
        sg_recall_element(w, par, m);
        SG(part_start)(sg_parts[w->members[m]].kind, e, par);
        if (m < w->n_bodies) {
            sg_send(w, m, 1, e->p, w->p);
            sg_send(w, m, 1, e->force_size, w->force_size);
        }
        if (w->n_members == 1) {
            sg_copy(own->n_q, e->mass_pivot, w->mass_pivot);
            sg_copy(own->n_R, e->mobility, w->mobility);
        }
        sg_send_masses(w, m, entries);
        entries += own->mass.start[own->n_q];
        sg_send_rows(w, m, 1, e->drift, w->drift);
        sg_copy(own->n_contacts, e->mu, &w->mu[first]);
        sg_copy(own->n_contacts, e->e_N, &w->e_N[first]);
        sg_copy(own->n_contacts, e->e_F, &w->e_F[first]);
        sg_copy(own->n_contacts, e->guard, &w->guard[first]);
    }
}

static void SG(values)(SG(work) * w, const SG(params) * par, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    int b, i, j, m, slot;
    sg_fill(pr->n_x, SG_C(0.0), w->r);
    for (m = 0; m < w->n_members; ++m) {
        SG(element) *e = &w->element[m];
        const sg_kind *own = sg_member_kind(w, m);
        const int first = sg_first_of(w, m, SG_FIRST_BOUND);
        sg_bring_unknowns(w, m, problem);
        SG(part_values)(sg_parts[w->members[m]].kind, e, par, problem);
        for (b = 0; b < own->problems[problem].n_x / own->n_q; ++b) {
            for (j = 0; j < own->n_q; ++j) {
                w->r[b * sg_n_q(w) + sg_place_of(w, m, j)] += e->r[b * own->n_q + j];
            }
        }
        sg_send_rows(w, m, pr->n_slots, e->y, w->y);
        for (slot = 0; slot < pr->n_slots; ++slot) {
            for (i = 0; i < own->n_bounds; ++i) {
                w->radius[slot * sg_n_bounds(w) + first + i] = e->radius[slot * own->n_bounds + i];
            }
        }
        if (m < w->n_bodies) {
            sg_send(w, m, SG_N_STAGES, e->Q, w->Q);
        }
    }
}

/* Entry (i, j) of K of the island. */
static int sg_entry_of(const sg_factors *K, int i, int j) {
    int low = K->start[i];
    int high = K->start[i + 1] - 1;
    while (low < high) {
        const int middle = (low + high) / 2;
        if (K->index[middle] < j) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}

/* Add K of one element. */
static void sg_add_K(SG(work) * w, int m, int problem) {
    const SG(element) *e = &w->element[m];
    const sg_problem *own = &sg_member_kind(w, m)->problems[problem];
    const sg_problem *pr = sg_problem_at(w, problem);
    const int *position = &w->position[problem * SG_N_BORDER];
    int i, k;
    for (i = 0; i < own->n_border; ++i) {
        w->spot[i] = position[sg_unknown_of(w, m, problem, own->K.order[i])];
    }
    for (i = 0; i < own->n_border; ++i) {
        for (k = own->K.start[i]; k < own->K.start[i + 1]; ++k) {
            if (e->K[k] != SG_C(0.0)) {
                w->K[sg_entry_of(&pr->K, w->spot[i], w->spot[own->K.index[k]])] += e->K[k];
            }
        }
    }
}

static void SG(derivatives)(SG(work) * w, const SG(params) * par, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    int m;
    if (w->n_members > 1) {
        sg_fill(pr->K.start[pr->n_border], SG_C(0.0), w->K);
    }
    for (m = 0; m < w->n_members; ++m) {
        SG(element) *e = &w->element[m];
        const sg_kind *kind = sg_member_kind(w, m);
        const sg_problem *own = &kind->problems[problem];
        SG(part_derivatives)(sg_parts[w->members[m]].kind, e, par, problem);
        if (w->n_members > 1) {
            sg_add_K(w, m, problem);
        } else {
            sg_copy(own->K.start[own->n_border], e->K, w->K);
        }
        sg_send_matrix(w, m, 0, pr->n_slots * kind->n_R, &own->B, e->B, &pr->B, w->B);
        sg_send_matrix(w, m, 1, pr->n_slots * kind->n_R, &own->C, e->C, &pr->C, w->C);
        sg_send_matrix(w, m, 2, pr->n_slots * kind->n_bounds, &own->C_radius, e->C_radius,
                       &pr->C_radius, w->C_radius);
    }
}

/* The end of the step as the elements say it. */
static void sg_send_end(SG(work) * w, int m) {
    const SG(element) *e = &w->element[m];
    if (m < w->n_bodies) {
        sg_send(w, m, 1, e->q_end, w->q_end);
        sg_send(w, m, 1, e->v_end, w->v_end);
    }
    sg_send_rows(w, m, 1, e->P, w->P);
    sg_send_rows(w, m, SG_N_STAGES, e->R_stage, w->R_stage);
}

static void SG(finish)(SG(work) * w) {
    int m, p;
    for (m = 0; m < w->n_members; ++m) {
        for (p = 0; p < SG_N_CHAIN; ++p) {
            sg_bring_unknowns(w, m, p);
        }
        SG(part_finish)(sg_parts[w->members[m]].kind, &w->element[m]);
        sg_send_end(w, m);
    }
}

static int SG(eliminate)(SG(work) * w, int problem, int border) {
    const sg_problem *pr = sg_problem_at(w, problem);
    if (w->n_members == 1) {
        return SG(part_eliminate)(w, problem, border);
    }
    return sg_sparse_factor(border ? pr->n_x : 0, border ? pr->n_border : pr->n_x, &pr->K,
                            w->smooth.pivot_scale, SG_SMALL, w->K, w->smooth.factors,
                            w->smooth.row);
}

static void SG(substitute)(const SG(work) * w, int problem, int first, real b[]) {
    const sg_problem *pr = sg_problem_at(w, problem);
    if (w->n_members == 1) {
        SG(part_substitute)(w, problem, first, b);
    } else {
        sg_sparse_solve(pr->n_border, &pr->K, w->smooth.factors, first, b);
    }
}
