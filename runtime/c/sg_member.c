#pragma once
#include "sg_smooth.c"

/* Where the members of an island, its parts and couplings, have their unknowns and rows. */

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
