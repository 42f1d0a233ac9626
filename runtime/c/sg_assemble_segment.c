#pragma once
#include "sg_assemble.c"
#include "sg_modes.c"

/* What the elements of an island say of a segment, and where the step looks. */

static void SG(finish_segment)(SG(work) * w) {
    int m;
    for (m = 0; m < w->n_members; ++m) {
        sg_bring_unknowns(w, m, SG_SEGMENT);
        SG(part_finish_segment)(sg_parts[w->members[m]].kind, &w->element[m]);
        sg_send_end(w, m);
    }
}

static void SG(watch)(SG(work) * w, const SG(params) * par) {
    int m;
    for (m = 0; m < w->n_members; ++m) {
        SG(element) *e = &w->element[m];
        const sg_kind *own = sg_member_kind(w, m);
        sg_bring_start(w, m);
        e->look_t = w->look_t;
        sg_bring(w, m, 1, w->look_q, e->look_q);
        sg_bring(w, m, 1, w->look_v, e->look_v);
        SG(part_watch)(sg_parts[w->members[m]].kind, e, par);
        sg_copy(own->n_N, e->gap, &w->gap[sg_first_of(w, m, SG_FIRST_N)]);
        sg_copy(own->n_N, e->gap_rate, &w->gap_rate[sg_first_of(w, m, SG_FIRST_N)]);
        sg_copy(own->n_F, e->slip_rate, &w->slip_rate[sg_first_of(w, m, SG_FIRST_F)]);
        sg_copy(own->n_contacts, e->guard_there,
                &w->guard_there[sg_first_of(w, m, SG_FIRST_CONTACT)]);
    }
}

/* Energy of the island at hand. */
static real sg_energy(const SG(work) * w, real t, const real q[], const real v[],
                      const SG(params) * par) {
    real own_q[SG_OWN_Q], own_v[SG_OWN_Q];
    real sum = SG_C(0.0);
    int m;
    for (m = 0; m < w->n_bodies; ++m) {
        real E[1];
        sg_bring(w, m, 1, q, own_q);
        sg_bring(w, m, 1, v, own_v);
        SG(part_energy)(w->members[m], t, own_q, own_v, par, E);
        sum += E[0];
    }
    return sum;
}
