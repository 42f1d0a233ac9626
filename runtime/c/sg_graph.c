#pragma once
#include "sg_member.c"

/* The graph of the unknowns of an island: their order in the factors of K, and the pattern of
 * these.
 */

/* Sets of unknowns, SG_BITS of them in each number: row u of w->graph. */
enum { SG_BITS = 30 };

static inline int sg_words(int n) { return n / SG_BITS + 1; }

static inline void sg_insert(int *set, int u) { set[u / SG_BITS] |= 1 << (u % SG_BITS); }

static inline void sg_remove(int *set, int u) { set[u / SG_BITS] &= ~(1 << (u % SG_BITS)); }

static int sg_count_of(int words, const int *set) {
    int count = 0;
    int k;
    for (k = 0; k < words; ++k) {
        /* pairs of bits, fours, eights, all added up */
        unsigned long bits = (unsigned long)set[k];
        bits -= (bits >> 1) & 0x55555555UL;
        bits = (bits & 0x33333333UL) + ((bits >> 2) & 0x33333333UL);
        bits = (bits + (bits >> 4)) & 0x0f0f0f0fUL;
        count += (int)(((bits * 0x01010101UL) & 0xffffffffUL) >> 24);
    }
    return count;
}

/* Members of a set; returns how many. */
static int sg_list(int words, const int *set, int *members) {
    int count = 0;
    int k, u, rest;
    for (k = 0; k < words; ++k) {
        u = k * SG_BITS;
        for (rest = set[k]; rest != 0; rest >>= 1) {
            if (rest & 1) {
                members[count] = u;
                ++count;
            }
            ++u;
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

/* Every two unknowns of member m stand in each other's equations: set by set, not one by one. */
static void sg_draw_whole(SG(work) * w, int n, int words) {
    int *all = w->degree; /* not counted yet */
    int i, k;
    for (k = 0; k < words; ++k) {
        all[k] = 0;
    }
    for (i = 0; i < n; ++i) {
        sg_insert(all, w->spot[i]);
    }
    for (i = 0; i < n; ++i) {
        int *set = &w->graph[w->spot[i] * words];
        for (k = 0; k < words; ++k) {
            set[k] |= all[k];
        }
    }
}

/* Unknowns that stand in each other's equations once the percussions of a member are eliminated. */
static void sg_draw_rows(SG(work) * w, const sg_kind *kind, const sg_problem *own, int words) {
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
        if (w->large.drawn && own->n_x <= SG_DRAWN_WHOLE) {
            sg_draw_whole(w, own->n_x, words);
        } else if (w->large.drawn) {
            sg_draw_rows(w, sg_member_kind(w, m), own, words);
        }
        for (i = 0; i < own->n_border; ++i) {
            for (k = own->K.start[i]; k < own->K.start[i + 1]; ++k) {
                sg_insert(&w->graph[w->spot[i] * words], w->spot[own->K.index[k]]);
            }
        }
    }
    for (i = 0; i < n; ++i) {
        sg_remove(&w->graph[i * words], i);
        w->degree[i] = sg_count_of(words, &w->graph[i * words]);
    }
}

/* Order of least fill by minimum degree, the n_first velocities before all percussions: of each
   unknown what is left in its row of the graph comes behind it. Unknowns that have the same
   neighbours, as those of one body, follow each other at once. */
static void sg_order_unknowns(SG(work) * w, int n_first, int n, int *order, int *position) {
    const int words = sg_words(n);
    int *near = w->large.near;
    int at = 0;
    int i, k, u;
    for (u = 0; u < n; ++u) {
        position[u] = -1;
    }
    while (at < n) {
        const int begin = at < n_first ? 0 : n_first;
        const int end = at < n_first ? n_first : n;
        const int *around;
        int best = -1;
        int count, last;
        for (u = begin; u < end; ++u) {
            if (position[u] < 0 && (best < 0 || w->degree[u] < w->degree[best])) {
                best = u;
            }
        }
        order[at] = best;
        position[best] = at;
        last = at + 1;
        around = &w->graph[best * words];
        count = sg_list(words, around, near);
        for (i = 0; i < count; ++i) {
            int *own = &w->graph[near[i] * words];
            for (k = 0; k < words; ++k) {
                own[k] |= around[k];
            }
            sg_remove(own, near[i]);
            sg_remove(own, best);
            w->degree[near[i]] = sg_count_of(words, own);
            if (w->degree[near[i]] == count - 1 && near[i] < end) {
                order[last] = near[i];
                position[near[i]] = last;
                ++last;
            }
        }
        for (i = 0; i < count; ++i) {
            int *own = &w->graph[near[i] * words];
            int before = position[near[i]] < 0 ? last : position[near[i]];
            for (k = at + 1; k < before; ++k) {
                sg_remove(own, order[k]);
            }
            w->degree[near[i]] -= before - at - 1;
        }
        at = last;
    }
}

/* Positions of the members of a set, in order; returns how many. */
static int sg_later(int words, const int *set, const int *position, int *near) {
    int count = sg_list(words, set, near);
    int i, j;
    for (i = 0; i < count; ++i) {
        const int own = position[near[i]];
        for (j = i; j > 0 && near[j - 1] > own; --j) {
            near[j] = near[j - 1];
        }
        near[j] = own;
    }
    return count;
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
    int *near = w->large.near;
    int i, j;
    sg_draw_graph(w, problem, n);
    sg_order_unknowns(w, pr->n_x, n, order, position);
    for (i = 0; i <= n; ++i) {
        start[i] = 0;
    }
    for (i = 0; i < n; ++i) {
        const int count = sg_list(words, &w->graph[order[i] * words], near);
        start[i + 1] += 1 + count;
        for (j = 0; j < count; ++j) {
            ++start[position[near[j]] + 1];
        }
    }
    for (i = 0; i < n; ++i) {
        start[i + 1] += start[i];
        w->degree[i] = start[i]; /* where the next entry of row i goes */
    }
    for (i = 0; i < n; ++i) {
        const int count = sg_later(words, &w->graph[order[i] * words], position, near);
        diagonal[i] = w->degree[i];
        index[w->degree[i]] = i;
        ++w->degree[i];
        for (j = 0; j < count; ++j) {
            index[w->degree[i]] = near[j];
            ++w->degree[i];
            index[w->degree[near[j]]] = i;
            ++w->degree[near[j]];
        }
    }
    to->used += start[n];
    pr->K.order = order;
    pr->K.start = start;
    pr->K.index = index;
    pr->K.diagonal = diagonal;
}
