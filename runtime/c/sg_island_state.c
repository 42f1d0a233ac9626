#pragma once
#include "sg_assemble.c"
#include "sg_step.c"

/* What an island goes on from, put together of what its parts and couplings kept, and divided among
   them behind the step. */

/* The members as a number. */
static int sg_print_of(const SG(work) * w) {
    unsigned long print = 0;
    int m;
    for (m = 0; m < w->n_members; ++m) {
        print = (31UL * print + (unsigned long)w->members[m] + 1UL) & 0x3fffffffUL;
    }
    return (int)print;
}

/* The link of a coupling in the step before, NULL if it did not join its parts. */
static const SG(link) * sg_link_of(const SG(state) * s, int coupling) {
    int low = 0;
    int high = s->n_links - 1;
    while (low <= high) {
        const int middle = (low + high) / 2;
        if (s->link[middle].coupling == coupling) {
            return &s->link[middle];
        }
        if (s->link[middle].coupling < coupling) {
            low = middle + 1;
        } else {
            high = middle - 1;
        }
    }
    return NULL;
}

/* What part m of the island had. */
static void sg_take_part(SG(work) * w, const SG(state) * s, SG(part) * to, int m) {
    const SG(kept) *own = &s->part[w->members[m]];
    const int first = sg_first_of(w, m, SG_FIRST_CONTACT);
    int k;
    sg_send(w, m, SG_BLOCKS_KEPT, own->x, to->x);
    sg_send(w, m, SG_BLOCKS_KEPT, own->x_1, to->x_1);
    sg_send(w, m, SG_BLOCKS_KEPT, own->x_2, to->x_2);
    sg_send_rows(w, m, SG_SLOTS_KEPT, own->R, to->R);
    sg_send_rows(w, m, SG_SLOTS_KEPT, own->R_1, to->R_1);
    sg_send_rows(w, m, SG_SLOTS_KEPT, own->R_2, to->R_2);
    for (k = 0; k < sg_member_kind(w, m)->n_contacts; ++k) {
        to->closed[first + k] = own->closed[k];
        to->contact[first + k] = own->contact[k];
#if SG_LOCATED
        to->t_impact[first + k] = own->t_impact[k];
#endif
    }
#if SG_N_KEY > 0
    w->element[m].trial.has_terms = own->has_terms;
    sg_copy(sg_member_kind(w, m)->n_key, own->key, w->element[m].trial.key);
    sg_copy(sg_member_kind(w, m)->n_terms, own->terms, w->element[m].trial.terms);
#endif
}

/* What coupling m of the island had; nothing pushed that was left out. */
static void sg_take_coupling(SG(work) * w, const SG(state) * s, SG(part) * to, int m) {
    const SG(link) *own = sg_link_of(s, w->members[m] - SG_N_PARTS);
    const int *contacts = sg_contacts_of(w->members[m]);
    const int first = sg_first_of(w, m, SG_FIRST_CONTACT);
    const int n_R = sg_member_kind(w, m)->n_R;
    int c, k, slot;
    for (c = 0; c < n_R; ++c) {
        const int row = sg_row_of(w, m, c);
        for (slot = 0; slot < SG_SLOTS_KEPT; ++slot) {
            const int at = slot * sg_n_R(w) + row;
            to->R[at] = own != NULL ? own->R[slot * n_R + c] : SG_C(0.0);
            to->R_1[at] = own != NULL ? own->R_1[slot * n_R + c] : SG_C(0.0);
            to->R_2[at] = own != NULL ? own->R_2[slot * n_R + c] : SG_C(0.0);
        }
    }
    for (k = 0; k < sg_member_kind(w, m)->n_contacts; ++k) {
        to->closed[first + k] = own != NULL ? own->closed[k] : 0;
        to->contact[first + k] = s->contact[contacts[k]];
#if SG_LOCATED
        to->t_impact[first + k] = own != NULL ? own->t_impact[k] : -SG_HUGE;
#endif
    }
#if SG_N_KEY > 0
    w->element[m].trial.has_terms = 0;
#endif
}

/* Take up an island: *to, what it goes on from, at the time, place and velocity of the model. Its
   prediction is as good as the worst of its parts'; a choice of percussions holds for an island of
   the same members alone. */
static void sg_take_up(SG(work) * w, const SG(state) * s, SG(part) * to) {
    const SG(kept) *first = &s->part[w->members[0]];
    const int print = sg_print_of(w);
    int same = 1;
    int j, m, p;
    to->t = s->t;
    to->warm = first->warm;
    to->order = first->order;
    to->h_guess = first->h_guess;
#if SG_LOCATED
    to->located = first->located;
    to->segment = first->segment;
#endif
    for (m = 0; m < w->n_bodies; ++m) {
        const SG(kept) *own = &s->part[w->members[m]];
        const int *at = sg_coordinates_of(w->members[m]);
        for (j = 0; j < sg_member_kind(w, m)->n_q; ++j) {
            to->q[sg_place_of(w, m, j)] = s->q[at[j]];
            to->v[sg_place_of(w, m, j)] = s->v[at[j]];
        }
        same = same && own->island == print;
        to->warm = own->h_guess != to->h_guess ? 0 : own->warm < to->warm ? own->warm : to->warm;
        to->order = own->order < to->order ? own->order : to->order;
#if SG_LOCATED
        to->located = to->located && own->located;
        to->warm = own->segment == to->segment ? to->warm : 0;
#endif
        sg_take_part(w, s, to, m);
    }
    for (; m < w->n_members; ++m) {
        sg_take_coupling(w, s, to, m);
    }
    for (p = 0; p < SG_N_PROBLEMS; ++p) {
        to->states[p] = same || w->n_members == 1 ? first->states[p] : -1;
        to->choice[p] = same || w->n_members == 1 ? first->choice[p] : SG_UNIQUE;
    }
}

/* What part m of the island goes on from. */
static void sg_keep_part(SG(work) * w, int m, int print) {
    const SG(part) *from = &w->trial;
    SG(kept) *to = &w->next[w->members[m]];
    const int first = sg_first_of(w, m, SG_FIRST_CONTACT);
    int k;
    sg_bring(w, m, 1, from->q, to->q);
    sg_bring(w, m, 1, from->v, to->v);
    sg_bring(w, m, SG_BLOCKS_KEPT, from->x, to->x);
    sg_bring(w, m, SG_BLOCKS_KEPT, from->x_1, to->x_1);
    sg_bring(w, m, SG_BLOCKS_KEPT, from->x_2, to->x_2);
    sg_bring_rows(w, m, SG_SLOTS_KEPT, from->R, to->R);
    sg_bring_rows(w, m, SG_SLOTS_KEPT, from->R_1, to->R_1);
    sg_bring_rows(w, m, SG_SLOTS_KEPT, from->R_2, to->R_2);
    to->warm = from->warm;
    to->order = from->order;
    to->h_guess = from->h_guess;
    to->island = print;
#if SG_LOCATED
    to->located = from->located;
    to->segment = from->segment;
#endif
    for (k = 0; k < sg_member_kind(w, m)->n_contacts; ++k) {
        to->closed[k] = from->closed[first + k];
        to->contact[k] = from->contact[first + k];
#if SG_LOCATED
        to->t_impact[k] = from->t_impact[first + k];
#endif
    }
    for (k = 0; k < SG_N_PROBLEMS; ++k) {
        to->states[k] = from->states[k];
        to->choice[k] = from->choice[k];
    }
#if SG_N_KEY > 0
    to->has_terms = w->element[m].trial.has_terms;
    sg_copy(sg_member_kind(w, m)->n_key, w->element[m].trial.key, to->key);
    sg_copy(sg_member_kind(w, m)->n_terms, w->element[m].trial.terms, to->terms);
#endif
}

/* What coupling m of the island goes on from, among the links by their numbers. */
static void sg_keep_coupling(SG(work) * w, int m) {
    const SG(part) *from = &w->trial;
    const int coupling = w->members[m] - SG_N_PARTS;
    const int first = sg_first_of(w, m, SG_FIRST_CONTACT);
    SG(link) * to;
    int k;
    for (k = w->n_links; k > 0 && w->link[k - 1].coupling > coupling; --k) {
        w->link[k] = w->link[k - 1];
    }
    ++w->n_links;
    to = &w->link[k];
    to->coupling = coupling;
    sg_bring_rows(w, m, SG_SLOTS_KEPT, from->R, to->R);
    sg_bring_rows(w, m, SG_SLOTS_KEPT, from->R_1, to->R_1);
    sg_bring_rows(w, m, SG_SLOTS_KEPT, from->R_2, to->R_2);
    for (k = 0; k < sg_member_kind(w, m)->n_contacts; ++k) {
        to->closed[k] = from->closed[first + k];
        to->contact[k] = from->contact[first + k];
#if SG_LOCATED
        to->t_impact[k] = from->t_impact[first + k];
#endif
    }
}
