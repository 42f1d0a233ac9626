#pragma once
#include "sg_smooth.c"

/* An island that is put together in the step, of parts and of couplings that may act between them:
   its sizes and tables. A part that nothing joins is its own island, with the tables of its kind.
 */

/* What stands in w->first for each element. */
enum {
    SG_FIRST_G,
    SG_FIRST_GAMMA,
    SG_FIRST_N,
    SG_FIRST_F,
    SG_FIRST_CONTACT,
    SG_FIRST_BOUND,
    SG_FIRSTS
};

enum { SG_TABLES = 7 };

/* Tables of an island; those of integers stand in w->table. */
typedef struct {
    sg_kind kind;
    sg_problem problems[SG_N_PROBLEMS];
    sg_contact contacts[SG_MOST_CONTACTS];
    sg_slip slips[SG_ISLAND_SLIPS];
    int one_way[SG_ISLAND_GAPS];
    int used; /* of w->table */
} sg_island;

/* The kind of member m of the island. */
static inline const sg_kind *sg_member_kind(const SG(work) * w, int m) {
    return &sg_kinds[sg_parts[w->members[m]].kind];
}

/* First of the rows of member m that `what` says. */
static inline int sg_first_of(const SG(work) * w, int m, int what) {
    return w->first[SG_FIRSTS * m + what];
}

/* Where coordinate j of member m stands in the island. */
static inline int sg_place_of(const SG(work) * w, int m, int j) {
    return w->places[w->first_place[m] + j];
}

/* Where row c of a slot of member m stands in a slot of the island. */
static inline int sg_row_of(const SG(work) * w, int m, int c) {
    return w->slots[w->first_slot[m] + c];
}

/* Unknown u of member m in a problem, a velocity or behind these a percussion, in the island. */
static int sg_unknown_of(const SG(work) * w, int m, int problem, int u) {
    const sg_kind *own = sg_member_kind(w, m);
    const int n_x = own->problems[problem].n_x;
    if (u < n_x) {
        return u / own->n_q * sg_n_q(w) + sg_place_of(w, m, u % own->n_q);
    }
    u -= n_x;
    return sg_problem_at(w, problem)->n_x + u / own->n_R * sg_n_R(w) +
           sg_row_of(w, m, u % own->n_R);
}

/* Room for n integers. */
static int *sg_room(SG(work) * w, sg_island *to, int n) {
    int *table = &w->table[to->used];
    to->used += n;
    return table;
}

/* -1 stays. */
static inline int sg_shifted(int place, int by) { return place < 0 ? place : place + by; }

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

/* Sets of unknowns, SG_BITS of them in each number: row u of w->graph. */
enum { SG_BITS = 30 };

static inline int sg_words(int n) { return n / SG_BITS + 1; }

static inline int sg_has(const int *set, int u) { return set[u / SG_BITS] >> (u % SG_BITS) & 1; }

static inline void sg_insert(int *set, int u) { set[u / SG_BITS] |= 1 << (u % SG_BITS); }

static inline void sg_remove(int *set, int u) { set[u / SG_BITS] &= ~(1 << (u % SG_BITS)); }

static int sg_count_of(int words, const int *set) {
    int count = 0;
    int k, rest;
    for (k = 0; k < words; ++k) {
        for (rest = set[k]; rest != 0; rest &= rest - 1) {
            ++count;
        }
    }
    return count;
}

/* What a percussion follows: its own kinematic row or those of its contact's slip, and the row that
   presses it. */
enum { SG_TERMS = SG_N_SLIP + 1 };

/* Row `term` that row i of a kind, of the rows of all its slots, depends on; -1: none. */
static int sg_term_of(const sg_kind *kind, int i, int term) {
    const int c = i % kind->n_R - (kind->n_R - kind->n_F);
    const int base = i - i % kind->n_R;
    const sg_contact *contact;
    if (c < 0) {
        return term == 0 ? i : -1;
    }
    contact = &kind->contacts[kind->slips[c].contact];
    if (term < SG_N_SLIP) {
        return term < contact->components ? i - kind->slips[c].component + term : -1;
    }
    return contact->pressing < 0 ? -1 : base + kind->n_g + kind->n_gamma + contact->pressing;
}

/* Unknowns that stand in each other's equations once the percussions of member m are eliminated. */
static void sg_draw_rows(SG(work) * w, int m, const sg_problem *own, int words) {
    const sg_kind *kind = sg_member_kind(w, m);
    int a, i, k, term;
    for (a = 0; a < own->n_slots * kind->n_R; ++a) {
        for (term = 0; term < SG_TERMS; ++term) {
            const int other = sg_term_of(kind, a, term);
            for (i = own->B.start[a]; other >= 0 && i < own->B.start[a + 1]; ++i) {
                const int u = w->spot[own->B.index[i]];
                for (k = own->C.start[other]; k < own->C.start[other + 1]; ++k) {
                    const int v = w->spot[own->C.index[k]];
                    sg_insert(&w->graph[u * words], v);
                    sg_insert(&w->graph[v * words], u);
                }
            }
        }
    }
}

/* Which unknowns of a problem stand in each other's equations, by the patterns of the elements. */
static void sg_draw_graph(SG(work) * w, int problem, int n) {
    const int words = sg_words(n);
    int i, k, m;
    for (i = 0; i < n * words; ++i) {
        w->graph[i] = 0;
    }
    for (m = 0; m < w->n_members; ++m) {
        const sg_problem *own = &sg_member_kind(w, m)->problems[problem];
        for (i = 0; i < own->n_border; ++i) {
            w->spot[i] = sg_unknown_of(w, m, problem, own->K.order[i]);
        }
        for (i = 0; i < own->n_border; ++i) {
            for (k = own->K.start[i]; k < own->K.start[i + 1]; ++k) {
                sg_insert(&w->graph[w->spot[i] * words], w->spot[own->K.index[k]]);
            }
        }
        if (w->large.drawn) {
            sg_draw_rows(w, m, own, words);
        }
    }
    for (i = 0; i < n; ++i) {
        sg_remove(&w->graph[i * words], i);
        w->degree[i] = sg_count_of(words, &w->graph[i * words]);
    }
}

/* Order of least fill by minimum degree, the n_first velocities before all percussions: of each
   unknown what is left in its row of the graph comes behind it. */
static void sg_order_unknowns(SG(work) * w, int n_first, int n, int *order, int *position) {
    const int words = sg_words(n);
    int at, k, u;
    for (u = 0; u < n; ++u) {
        position[u] = -1;
    }
    for (at = 0; at < n; ++at) {
        const int begin = at < n_first ? 0 : n_first;
        const int end = at < n_first ? n_first : n;
        const int *around;
        int best = -1;
        for (u = begin; u < end; ++u) {
            if (position[u] < 0 && (best < 0 || w->degree[u] < w->degree[best])) {
                best = u;
            }
        }
        order[at] = best;
        position[best] = at;
        around = &w->graph[best * words];
        for (u = 0; u < n; ++u) {
            if (sg_has(around, u)) {
                int *own = &w->graph[u * words];
                for (k = 0; k < words; ++k) {
                    own[k] |= around[k];
                }
                sg_remove(own, u);
                sg_remove(own, best);
                w->degree[u] = sg_count_of(words, own);
            }
        }
    }
}

/* Pattern of K: the order of its unknowns, and the rows of its factors. */
static void sg_add_smooth(SG(work) * w, sg_island *to, int problem) {
    sg_problem *pr = &to->problems[problem];
    const int n = pr->n_border;
    const int words = sg_words(n);
    int *position = &w->position[problem * SG_N_BORDER];
    int *order = sg_room(w, to, n);
    int *start = sg_room(w, to, n + 1);
    int *diagonal = sg_room(w, to, n);
    int *index = &w->table[to->used];
    int i, j;
    sg_draw_graph(w, problem, n);
    sg_order_unknowns(w, pr->n_x, n, order, position);
    for (i = 0; i <= n; ++i) {
        start[i] = 0;
    }
    for (i = 0; i < n; ++i) {
        const int *later = &w->graph[order[i] * words];
        ++start[i + 1];
        for (j = i + 1; j < n; ++j) {
            start[i + 1] += sg_has(later, order[j]);
            start[j + 1] += sg_has(later, order[j]);
        }
    }
    for (i = 0; i < n; ++i) {
        start[i + 1] += start[i];
        w->degree[i] = start[i]; /* where the next entry of row i goes */
    }
    for (i = 0; i < n; ++i) {
        const int *later = &w->graph[order[i] * words];
        diagonal[i] = w->degree[i];
        index[w->degree[i]] = i;
        ++w->degree[i];
        for (j = i + 1; j < n; ++j) {
            if (sg_has(later, order[j])) {
                index[w->degree[i]] = j;
                ++w->degree[i];
                index[w->degree[j]] = i;
                ++w->degree[j];
            }
        }
    }
    to->used += start[n];
    pr->K.order = order;
    pr->K.start = start;
    pr->K.index = index;
    pr->K.diagonal = diagonal;
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
