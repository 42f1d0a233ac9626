#pragma once
#include "sg_law_coulomb.c"

/* The percussion rows of a problem, contact by contact. What a row says is its law's affair. */

/* Row of the normal percussion of contact k in a slot with first row `base`; for contacts only. */
static inline int sg_normal_of(const SG(work) * w, int base, int k) {
    return base + sg_first_normal(w) + sg_contact_at(w, k)->normal;
}

/* First slip row of contact k in a slot with first row `base`. */
static inline int sg_slip_of(const SG(work) * w, int base, int k) {
    return base + sg_first_slip(w) + sg_contact_at(w, k)->friction;
}

/* 1 if contact k takes part in the problem. */
static inline int sg_joins(const SG(work) * w, const sg_problem *pr, int k) {
    return w->found.exists[k] &&
           (!pr->follows || w->found.active[k] || sg_contact_at(w, k)->presser < 0);
}

/* 1 if friction of contact k in a slot with first row `base` is pressed, or has a given bound. */
static inline int sg_is_pressed(const SG(work) * w, int base, int k) {
    const int pressing = sg_contact_at(w, k)->pressing;
    return pressing < 0 || w->rows.kind[base + sg_first_normal(w) + pressing] == SG_ROW_FREE ||
           sg_back(w, pressing) > SG_C(0.0);
}

/* Slip components of contact k that friction acts on. */
static inline int sg_rubbing(const SG(work) * w, int k) {
    const sg_contact *contact = sg_contact_at(w, k);
    return contact->bound >= 0 || w->mu[k] > SG_C(0.0) ? contact->components : 0;
}

/* Root of the effective mass of percussion row k relative to the first inertia. */
static inline real sg_root_mass(const SG(work) * w, int k) {
    return SG_SQRT(w->masses.m_eff[k % sg_rows_of_slot(w)] / w->masses.inertia[0]);
}

/* Bilateral rows of a slot push if they take part. */
static void sg_bilateral_kinds(SG(work) * w, const sg_problem *pr, int slot) {
    int c;
    for (c = 0; c < sg_first_normal(w); ++c) {
        w->rows.kind[slot * sg_n_R(w) + c] = sg_takes_part(pr, slot, c) ? SG_ROW_FREE : SG_ROW_ZERO;
    }
}

/* Contact state and residual phi of every percussion row, in units of percussion. */
static void sg_contact_rows(SG(work) * w, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const real *R = &w->R[pr->R];
    int slot, c, k;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * sg_n_R(w);
        for (c = 0; c < sg_first_normal(w); ++c) {
            const int part = sg_takes_part(pr, slot, c);
            w->rows.kind[base + c] = part ? SG_ROW_FREE : SG_ROW_ZERO;
            w->rows.phi[base + c] = part ? sg_kinematic_residual(w, base + c) : R[base + c];
        }
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const sg_contact *contact = sg_contact_at(w, k);
            const int f = sg_slip_of(w, base, k);
            const int joins = sg_joins(w, pr, k);
            if (contact->normal >= 0) {
                const int n = sg_normal_of(w, base, k);
                sg_signorini_row(w, n, R[n], joins && sg_signorini_closes(w, n, R[n]));
            }
            if (!joins || !sg_is_pressed(w, base, k) || sg_rubbing(w, k) == 0) {
                sg_friction_off(w, k, f, R);
            } else {
                sg_friction_rows(w, k, f, R, sg_max(sg_radius(w, base, k, R), SG_C(0.0)));
            }
        }
    }
}

/* Residual phi of every row with each contact in the state that it is in. */
static void sg_held_rows(SG(work) * w, const sg_problem *pr) {
    const int n = pr->n_slots * sg_n_R(w);
    const real *R = &w->R[pr->R];
    int slot, c, k;
    for (c = 0; c < n; ++c) {
        w->rows.phi[c] = w->rows.kind[c] == SG_ROW_FREE ? w->scales.prox_r[c] * w->y[c] : R[c];
        w->rows.ratio[c] = SG_C(0.0);
    }
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * sg_n_R(w);
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const real radius = sg_radius(w, base, k, R);
            sg_friction_held(w, k, sg_slip_of(w, base, k), R,
                             sg_is_followed(w) ? radius : sg_max(radius, SG_C(0.0)));
        }
    }
}

/* Contacts that take no part have no percussion, exactly. */
static void sg_leave_out(SG(work) * w, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    int slot, k, d;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        real *R = &w->R[pr->R + slot * sg_n_R(w)];
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const sg_contact *contact = sg_contact_at(w, k);
            if (!sg_joins(w, pr, k)) {
                if (contact->normal >= 0) {
                    R[sg_normal_of(w, 0, k)] = SG_C(0.0);
                }
                for (d = 0; d < contact->components; ++d) {
                    R[sg_slip_of(w, 0, k) + d] = SG_C(0.0);
                }
            }
        }
    }
}

/* Contacts that take part and are closed within round-off stick, all others are open. */
static void sg_say_held(SG(work) * w, const sg_problem *pr) {
    int slot, d, k;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * sg_n_R(w);
        sg_bilateral_kinds(w, pr, slot);
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const sg_contact *contact = sg_contact_at(w, k);
            const int f = sg_slip_of(w, base, k);
            int closed = sg_joins(w, pr, k);
            if (contact->normal >= 0) {
                const int n = sg_normal_of(w, base, k);
                closed =
                    closed && !(w->scales.r_auto[n] * w->y[n] > SG_BAND * w->scales.phi_floor[n]);
                w->rows.kind[n] = closed ? SG_ROW_FREE : SG_ROW_ZERO;
            }
            closed = closed && sg_is_pressed(w, base, k);
            for (d = 0; d < contact->components; ++d) {
                w->rows.kind[f + d] = closed && d < sg_rubbing(w, k) ? SG_ROW_FREE : SG_ROW_ZERO;
            }
        }
    }
}

/* Move percussions of contacts that stick into their cones, a little beyond the boundary, each by
   as little as possible. Returns how many were outside. */
static int sg_into_cones(SG(work) * w, const sg_problem *pr) {
    int outside = 0;
    int slot, d, k;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * sg_n_R(w);
        real *R = &w->R[pr->R + base];
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const sg_contact *contact = sg_contact_at(w, k);
            const int n = sg_first_normal(w) + contact->pressing;
            const int f = sg_slip_of(w, 0, k);
            if (contact->pressing >= 0 && contact->components > 0 &&
                w->rows.kind[base + n] == SG_ROW_FREE && w->rows.kind[base + f] == SG_ROW_FREE) {
                /* a percussion of friction that weighs as much as a unit of the normal one */
                const real unit =
                    sg_over_axis(w, contact->friction, sg_root_mass(w, f)) / sg_root_mass(w, n);
                real own[SG_N_SLIP];
                for (d = 0; d < contact->components; ++d) {
                    own[d] = sg_over_axis(w, contact->friction + d, R[f + d]);
                }
                if (sg_into_cone(contact->components, w->mu[k], unit, SG_INSIDE, &R[n], own)) {
                    for (d = 0; d < contact->components; ++d) {
                        R[f + d] = sg_times_axis(w, contact->friction + d, own[d]);
                    }
                    ++outside;
                }
            }
        }
    }
    return outside;
}

/* A number that tells sets of row kinds apart, for the detection of cycles. */
static unsigned long sg_fingerprint(const SG(work) * w, int n_rows) {
    unsigned long hash = 5381UL; /* Bernstein's hash: start and factor */
    int i;
    for (i = 0; i < n_rows; ++i) {
        unsigned long code = (unsigned long)w->rows.kind[i];
        if (w->rows.kind[i] == SG_ROW_SLIP && w->rows.slip[i] < SG_C(0.0)) {
            code = 3UL;
        }
        hash = (hash * 33UL + code) & 0xffffffffUL;
    }
    return hash;
}

/* The contact state of a problem as a number that is not negative. */
static int sg_state_of(const SG(work) * w, const sg_problem *pr) {
    return (int)(sg_fingerprint(w, pr->n_slots * sg_n_R(w)) & 0x7fffffffUL);
}
