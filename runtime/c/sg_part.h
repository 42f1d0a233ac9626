#pragma once
#include "sg_work.h"

/* The part of the model that is being stepped: sizes, contacts and problems of its kind. In a model
   that is a single part all of this is known when it is compiled. */

#if SG_N_PARTS > 1
/* Coordinates, contacts and percussions of a part, or of a coupling, among those of the model. */
static inline const int *sg_coordinates_of(int element) {
    return &sg_members[sg_parts[element].first];
}

static inline const int *sg_contacts_of(int element) {
    return sg_coordinates_of(element) + sg_kinds[sg_parts[element].kind].n_q;
}

static inline const int *sg_rows_of(int element) {
    return sg_contacts_of(element) + sg_kinds[sg_parts[element].kind].n_contacts;
}
#endif

#if SG_JOINS
/* An island that is put together, or one part (sg_assemble.c). */
static inline const sg_kind *sg_kind_of(const SG(work) * w) { return (const sg_kind *)w->island; }
#else
static inline int sg_kind_number(const SG(work) * w) {
#if SG_N_PARTS > 1
    return w->kind;
#else
    (void)w;
    return 0;
#endif
}

#if SG_N_KEY > 0 || SG_LOCATED
static inline int sg_part_number(const SG(work) * w) {
#if SG_N_PARTS > 1
    return w->number;
#else
    (void)w;
    return 0;
#endif
}
#endif

static inline const sg_kind *sg_kind_of(const SG(work) * w) { return &sg_kinds[sg_kind_number(w)]; }
#endif

/* Coordinates. */
static inline int sg_n_q(const SG(work) * w) { return sg_kind_of(w)->n_q; }

/* Percussion rows of a slot. */
static inline int sg_n_R(const SG(work) * w) { return sg_kind_of(w)->n_R; }

/* Rows of g. */
static inline int sg_n_g(const SG(work) * w) { return sg_kind_of(w)->n_g; }

/* Rows of gamma. */
static inline int sg_n_gamma(const SG(work) * w) { return sg_kind_of(w)->n_gamma; }

/* Normal rows. */
static inline int sg_n_N(const SG(work) * w) { return sg_kind_of(w)->n_N; }

#if SG_LOCATED
/* Slip rows. */
static inline int sg_n_F(const SG(work) * w) { return sg_kind_of(w)->n_F; }
#endif

/* Contacts and friction elements. */
static inline int sg_n_contacts(const SG(work) * w) { return sg_kind_of(w)->n_contacts; }

/* Given bounds and coefficients of a slot. */
static inline int sg_n_bounds(const SG(work) * w) { return sg_kind_of(w)->n_bounds; }

/* 1 if friction of the part has several components. */
static inline int sg_is_spatial(const SG(work) * w) {
#if SG_SPATIAL
    return sg_kind_of(w)->spatial;
#else
    (void)w;
    return 0;
#endif
}

/* Percussion rows of a slot, at least one, for divisions. */
static inline int sg_rows_of_slot(const SG(work) * w) { return sg_n_R(w) > 0 ? sg_n_R(w) : 1; }

/* First normal row and first slip row of a slot. */
static inline int sg_first_normal(const SG(work) * w) { return sg_n_g(w) + sg_n_gamma(w); }

static inline int sg_first_slip(const SG(work) * w) { return sg_first_normal(w) + sg_n_N(w); }

/* Contact k, slip row f, problem number `problem`. */
static inline const sg_contact *sg_contact_at(const SG(work) * w, int k) {
    return &sg_kind_of(w)->contacts[k];
}

static inline const sg_slip *sg_slip_at(const SG(work) * w, int f) {
    return &sg_kind_of(w)->slips[f];
}

static inline const sg_problem *sg_problem_at(const SG(work) * w, int problem) {
    return &sg_kind_of(w)->problems[problem];
}

/* 1 if normal row n is a gap, 0 if it is a velocity that goes one way. */
static inline int sg_is_place(const SG(work) * w, int n) {
#if SG_N_ONE_WAY > 0
    return !sg_kind_of(w)->one_way[n];
#else
    (void)w;
    (void)n;
    return 1;
#endif
}

/* 1 if percussion row c of a slot stands for a gap (g, g_N), 0 for a velocity. */
static inline int sg_is_gap(const SG(work) * w, const sg_problem *pr, int slot, int c) {
    const int n = c - sg_first_normal(w);
    return slot < pr->gap_slots &&
           (c < sg_n_g(w) || (n >= 0 && n < sg_n_N(w) && sg_is_place(w, n)));
}

/* 1 if bilateral row c of a slot takes part. */
static inline int sg_takes_part(const sg_problem *pr, int slot, int c) {
    return slot + 1 < pr->n_slots || c < pr->last_rows;
}

/* 1 if percussion row c of a slot yields to its percussion. */
static inline int sg_yields(const SG(work) * w, int c) {
#if SG_N_COMPLIANCE > 0
    return sg_kind_of(w)->yielding[c];
#else
    (void)w;
    (void)c;
    return 0;
#endif
}

/* How row k of the rows of all problems yields to its own percussion, besides the bodies. */
static inline real sg_compliance(const SG(work) * w, int k) {
#if SG_N_COMPLIANCE > 0
    return sg_kind_of(w)->n_compliance > 0 ? w->compliance[k] : SG_C(0.0);
#else
    (void)w;
    (void)k;
    return SG_C(0.0);
#endif
}

#if SG_LOCATED && SG_JOINS
/* Energy of the island at hand (sg_assemble.c). */
static real sg_energy(const SG(work) * w, real t, const real q[], const real v[],
                      const SG(params) * par);
#elif SG_LOCATED
/* Energy of the part at hand. */
static inline real sg_energy(const SG(work) * w, real t, const real q[], const real v[],
                             const SG(params) * par) {
    real E[1];
    SG(part_energy)(sg_part_number(w), t, q, v, par, E);
    return E[0];
}
#endif
