#pragma once
#include "sg_graph.c"

/* An island that is put together in the step, of parts and of couplings that may act between them:
   its sizes and tables. A part that nothing joins is its own island, with the tables of its kind.
 */

/* Contacts of member m behind those of the members before. */
static void sg_add_contacts(const SG(work) * w, sg_island *to, int m) {
    const sg_kind *own = sg_member_kind(w, m);
    const int k_0 = sg_first_of(w, m, SG_FIRST_CONTACT);
    const int n_0 = sg_first_of(w, m, SG_FIRST_N);
    const int f_0 = sg_first_of(w, m, SG_FIRST_F);
    const int b_0 = sg_first_of(w, m, SG_FIRST_BOUND);
    int k;
    for (k = 0; k < own->n_contacts; ++k) {
        sg_contact *c = &to->contacts[k_0 + k];
        *c = own->contacts[k];
        c->normal = sg_shifted(c->normal, n_0);
        c->friction += f_0;
        c->bound = sg_shifted(c->bound, b_0);
        c->presser = sg_shifted(c->presser, k_0);
        c->pressing = sg_shifted(c->pressing, n_0);
        c->next = sg_shifted(c->next, k_0);
        c->varies = sg_shifted(c->varies, b_0);
        c->load = c->loads > 0 ? sg_row_of(w, m, c->load) : 0;
    }
    for (k = 0; k < own->n_F; ++k) {
        to->slips[f_0 + k] = own->slips[k];
        to->slips[f_0 + k].contact += k_0;
    }
    for (k = 0; k < own->n_N; ++k) {
        to->one_way[n_0 + k] = own->one_way != NULL ? own->one_way[k] : 0;
    }
}

/* Patterns of the mass matrix, part by part, and of the directions. */
static void sg_add_masses(SG(work) * w, sg_island *to) {
    const int n = to->kind.n_q;
    int *order = sg_room(w, to, n);
    int *start = sg_room(w, to, n + 1);
    int *diagonal = sg_room(w, to, n);
    int *index;
    int first = 0;
    int at = 0;
    int c, i, k, m;
    for (m = 0; m < w->n_bodies; ++m) {
        at += sg_member_kind(w, m)->mass.start[sg_member_kind(w, m)->n_q];
    }
    index = sg_room(w, to, at);
    at = 0;
    for (m = 0; m < w->n_bodies; ++m) {
        const sg_kind *own = sg_member_kind(w, m);
        for (i = 0; i < own->n_q; ++i) {
            order[first + i] = first + own->mass.order[i];
            start[first + i] = at + own->mass.start[i];
            diagonal[first + i] = at + own->mass.diagonal[i];
        }
        for (k = 0; k < own->mass.start[own->n_q]; ++k) {
            index[at + k] = first + own->mass.index[k];
        }
        at += own->mass.start[own->n_q];
        first += own->n_q;
    }
    start[n] = at;
    to->kind.mass.order = order;
    to->kind.mass.start = start;
    to->kind.mass.index = index;
    to->kind.mass.diagonal = diagonal;
    start = sg_room(w, to, to->kind.n_R + 1);
    start[0] = 0;
    for (m = 0; m < w->n_members; ++m) {
        const sg_rows *own = &sg_member_kind(w, m)->direction;
        for (c = 0; c < sg_member_kind(w, m)->n_R; ++c) {
            start[sg_row_of(w, m, c) + 1] = own->start[c + 1] - own->start[c];
        }
    }
    for (c = 0; c < to->kind.n_R; ++c) {
        start[c + 1] += start[c];
    }
    index = sg_room(w, to, start[to->kind.n_R]);
    for (m = 0; m < w->n_members; ++m) {
        const sg_rows *own = &sg_member_kind(w, m)->direction;
        for (c = 0; c < sg_member_kind(w, m)->n_R; ++c) {
            const int to_row = start[sg_row_of(w, m, c)];
            for (k = own->start[c]; k < own->start[c + 1]; ++k) {
                index[to_row + k - own->start[c]] = sg_place_of(w, m, own->index[k]);
            }
        }
    }
    to->kind.direction.start = start;
    to->kind.direction.index = index;
}

/* The table of member m that `what` says: 0 columns of B, 1 rows of C, 2 rows of the radii. */
static const sg_rows *sg_rows_table(const sg_problem *pr, int what) {
    return what == 0 ? &pr->B : what == 1 ? &pr->C : &pr->C_radius;
}

/* Row of such a table of the island for row i of that of member m. */
static int sg_table_row(const SG(work) * w, int m, int what, int i) {
    const sg_kind *own = sg_member_kind(w, m);
    if (what < 2) {
        return i / own->n_R * sg_n_R(w) + sg_row_of(w, m, i % own->n_R);
    }
    return i / own->n_bounds * sg_n_bounds(w) + sg_first_of(w, m, SG_FIRST_BOUND) +
           i % own->n_bounds;
}

/* Such a table of the island. */
static void sg_add_rows(SG(work) * w, sg_island *to, int problem, int what) {
    const sg_problem *pr = &to->problems[problem];
    const int width = what < 2 ? to->kind.n_R : to->kind.n_bounds;
    const int count = pr->n_slots * width;
    const int *position = &w->position[problem * SG_N_BORDER];
    int *start = sg_room(w, to, count + 1);
    int *index;
    int i, k, m;
    start[0] = 0;
    for (m = 0; m < w->n_members; ++m) {
        const sg_kind *kind = sg_member_kind(w, m);
        const sg_rows *own = sg_rows_table(&kind->problems[problem], what);
        for (i = 0; i < pr->n_slots * (what < 2 ? kind->n_R : kind->n_bounds); ++i) {
            start[sg_table_row(w, m, what, i) + 1] = own->start[i + 1] - own->start[i];
        }
    }
    for (i = 0; i < count; ++i) {
        start[i + 1] += start[i];
    }
    index = sg_room(w, to, start[count]);
    for (m = 0; m < w->n_members; ++m) {
        const sg_kind *kind = sg_member_kind(w, m);
        const sg_problem *mine = &kind->problems[problem];
        const sg_rows *own = sg_rows_table(mine, what);
        for (i = 0; i < pr->n_slots * (what < 2 ? kind->n_R : kind->n_bounds); ++i) {
            int *row = &index[start[sg_table_row(w, m, what, i)]];
            for (k = own->start[i]; k < own->start[i + 1]; ++k) {
                const int u = mine->K.order[own->index[k]];
                row[k - own->start[i]] = position[sg_unknown_of(w, m, problem, u)];
            }
        }
    }
    if (what == 0) {
        to->problems[problem].B.start = start;
        to->problems[problem].B.index = index;
    } else if (what == 1) {
        to->problems[problem].C.start = start;
        to->problems[problem].C.index = index;
    } else {
        to->problems[problem].C_radius.start = start;
        to->problems[problem].C_radius.index = index;
    }
}

/* Sizes of the problems of an island. */
static void sg_add_problems(SG(work) * w, sg_island *to) {
    int x = 0;
    int R = 0;
    int p, m;
    for (p = 0; p < SG_N_PROBLEMS; ++p) {
        sg_problem *pr = &to->problems[p];
        *pr = sg_member_kind(w, 0)->problems[p];
        pr->n_x = pr->n_x / sg_member_kind(w, 0)->n_q * to->kind.n_q;
        pr->n_border = pr->n_x;
        pr->last_rows = 0;
        for (m = 0; m < w->n_bodies; ++m) {
            const sg_problem *own = &sg_member_kind(w, m)->problems[p];
            pr->n_border += own->n_border - own->n_x;
            pr->last_rows += own->last_rows;
        }
        pr->x = x;
        pr->R = R;
        x += pr->n_x;
        R += pr->n_slots * to->kind.n_R;
    }
}

/* Where row c of a slot of member m stands in a slot of an island with the sizes `sum`. */
static int sg_find_row(const SG(work) * w, const sg_kind *sum, int m, int c) {
    const sg_kind *own = sg_member_kind(w, m);
    if (c < own->n_g) {
        return sg_first_of(w, m, SG_FIRST_G) + c;
    }
    c -= own->n_g;
    if (c < own->n_gamma) {
        return sum->n_g + sg_first_of(w, m, SG_FIRST_GAMMA) + c;
    }
    c -= own->n_gamma;
    if (c < own->n_N) {
        return sum->n_g + sum->n_gamma + sg_first_of(w, m, SG_FIRST_N) + c;
    }
    return sum->n_g + sum->n_gamma + sum->n_N + sg_first_of(w, m, SG_FIRST_F) + c - own->n_N;
}

/* Where the members' coordinates and rows stand; sizes of all together. */
static void sg_lay_out(SG(work) * w, sg_kind *sum) {
    int at[SG_FIRSTS] = {0, 0, 0, 0, 0, 0};
    int places = 0;
    int rows = 0;
    int j, m, what;
    *sum = *sg_member_kind(w, 0);
    sum->n_q = 0;
    sum->n_loads = 0;
    sum->spatial = 0;
    sum->mobility = 0;
    for (m = 0; m < w->n_members; ++m) {
        const sg_kind *own = sg_member_kind(w, m);
        const int counts[SG_FIRSTS] = {own->n_g, own->n_gamma,    own->n_N,
                                       own->n_F, own->n_contacts, own->n_bounds};
        for (what = 0; what < SG_FIRSTS; ++what) {
            w->first[SG_FIRSTS * m + what] = at[what];
            at[what] += counts[what];
        }
        sum->n_loads += own->n_loads;
        sum->spatial = sum->spatial || own->spatial;
        for (j = 0; j < own->n_q && m < w->n_bodies; ++j) {
            w->place[sg_coordinates_of(w->members[m])[j]] = sum->n_q + j;
        }
        sum->n_q += m < w->n_bodies ? own->n_q : 0;
    }
    sum->n_g = at[SG_FIRST_G];
    sum->n_gamma = at[SG_FIRST_GAMMA];
    sum->n_N = at[SG_FIRST_N];
    sum->n_F = at[SG_FIRST_F];
    sum->n_R = sum->n_g + sum->n_gamma + sum->n_N + sum->n_F;
    sum->n_contacts = at[SG_FIRST_CONTACT];
    sum->n_bounds = at[SG_FIRST_BOUND];
    for (m = 0; m < w->n_members; ++m) {
        const sg_kind *own = sg_member_kind(w, m);
        w->first_place[m] = places;
        w->first_slot[m] = rows;
        for (j = 0; j < own->n_q; ++j) {
            w->places[places + j] = w->place[sg_coordinates_of(w->members[m])[j]];
        }
        for (j = 0; j < own->n_R; ++j) {
            w->slots[rows + j] = sg_find_row(w, sum, m, j);
        }
        places += own->n_q;
        rows += own->n_R;
    }
}

/* Where the tables of a problem begin in w->table, for who reads its matrices. */
static void sg_tell_tables(const SG(work) * w, const sg_problem *pr, int tables[]) {
    const int *all[SG_TABLES] = {pr->K.order, pr->K.start, pr->K.index, pr->B.start,
                                 pr->B.index, pr->C.start, pr->C.index};
    int k;
    for (k = 0; k < SG_TABLES; ++k) {
        tables[k] = (int)(all[k] - w->table);
    }
}

/* 1 if an island may have so many percussions that they are eliminated row by row (sg_large.c): no
   joint presses friction, no radius of friction depends on the motion. */
static int sg_may_be_large(const SG(work) * w, const sg_island *to) {
    int most = 0;
    int m, p;
    for (p = 0; p < SG_N_PROBLEMS; ++p) {
        const int count = to->problems[p].n_slots * to->kind.n_R;
        most = count > most ? count : most;
        for (m = 0; m < w->n_members; ++m) {
            const sg_kind *kind = sg_member_kind(w, m);
            const sg_problem *own = &kind->problems[p];
            if (own->C_radius.start[own->n_slots * kind->n_bounds] > 0) {
                return 0;
            }
        }
    }
    return most > SG_LARGE && to->kind.n_loads == 0;
}

/* The island of w->members. */
static void sg_put_together(SG(work) * w, sg_island *to) {
    int m, p;
    to->used = 0;
    w->kind = sg_parts[w->members[0]].kind;
    w->large.drawn = 0;
    w->large.give = SG_C(0.0);
    sg_lay_out(w, &to->kind);
    if (w->n_members == 1) {
        w->island = &sg_kinds[w->kind];
        return;
    }
    w->island = &to->kind;
    to->kind.contacts = to->contacts;
    to->kind.slips = to->slips;
    to->kind.problems = to->problems;
    to->kind.one_way = to->one_way;
    for (m = 0; m < w->n_members; ++m) {
        sg_add_contacts(w, to, m);
    }
    sg_add_masses(w, to);
    sg_add_problems(w, to);
    w->large.drawn = sg_may_be_large(w, to);
    for (p = 0; p < SG_N_PROBLEMS; ++p) {
        sg_add_smooth(w, to, p);
        sg_add_rows(w, to, p, 0);
        sg_add_rows(w, to, p, 1);
        sg_add_rows(w, to, p, 2);
        sg_tell_tables(w, &to->problems[p], &w->tables[SG_TABLES * p]);
    }
}
