#pragma once
#include "sg_linear.c"

#if SG_SPATIAL
/* Contact percussions of the problem linearised at the current point, found by relaxation: contact
   after contact is given the percussions that its own law asks for while all others stay, over and
   over (the nonlinear Gauss-Seidel method of Moreau and Jean). Bilateral percussions are eliminated
   before. */

/* Scales of the percussions, one energy for all contacts. Returns 0 if nothing moves. */
static int sg_relax_scales(SG(work) * w, const sg_problem *pr) {
    real common = SG_C(0.0);
    int c, slot;
    for (c = 0; c < sg_n_R(w); ++c) {
        common = sg_max(common, w->scales.percussion_scale[c] / sg_root_mass(w, c));
    }
    for (slot = 0; slot < pr->n_slots; ++slot) {
        for (c = 0; c < sg_n_R(w); ++c) {
            w->relax.scale[slot * sg_n_R(w) + c] = common * sg_root_mass(w, c);
        }
    }
    return common > SG_C(0.0);
}

/* Eliminate bilateral percussions: columns of contacts in w->system.S become what a percussion does
   while they hold, in the bilateral rows what they answer; w->linear.y_0 likewise. Returns 0 if
   they are dependent. */
static int sg_relax_reduce(SG(work) * w, const sg_problem *pr) {
    const int n = pr->n_slots * sg_n_R(w);
    int m = 0;
    int a, b, c;
    for (c = 0; c < n; ++c) {
        if (c % sg_rows_of_slot(w) < sg_first_normal(w) && w->rows.kind[c] == SG_ROW_FREE) {
            w->system.reduced[m] = c;
            w->path.row_scale[m] = w->scales.r_auto[c] / sg_root_mass(w, c);
            ++m;
        }
    }
    if (m == 0) {
        return 1;
    }
    for (a = 0; a < m; ++a) {
        const int row = w->system.reduced[a];
        for (b = 0; b < m; ++b) {
            w->system.LU[a * m + b] = w->system.S[w->system.reduced[b] * n + row];
        }
        w->system.LU[a * m + a] += sg_softness(w, n, row);
    }
    if (!sg_lu_factor(m, w->system.LU, w->path.row_scale, w->system.perm)) {
        return 0;
    }
    for (b = -1; b < n; ++b) {
        real *column = b < 0 ? w->linear.y_0 : &w->system.S[b * n];
        if (b >= 0 && b % sg_rows_of_slot(w) < sg_first_normal(w)) {
            continue;
        }
        for (a = 0; a < m; ++a) {
            w->system.rhs[a] = -column[w->system.reduced[a]];
        }
        sg_lu_solve(m, w->system.LU, w->system.perm, w->system.rhs);
        for (a = 0; a < m; ++a) {
            const real *held = &w->system.S[w->system.reduced[a] * n];
            for (c = 0; c < n; ++c) {
                if (c % sg_rows_of_slot(w) >= sg_first_normal(w)) {
                    column[c] += w->system.rhs[a] * held[c];
                }
            }
        }
        for (a = 0; a < m; ++a) {
            column[w->system.reduced[a]] = w->system.rhs[a];
        }
    }
    return 1;
}

/* Give percussion `row` its new value; the rows follow. Returns by how much it changed in units of
   its scale. */
static real sg_relax_set(SG(work) * w, int n, int row, real value) {
    const real change = value - w->path.R[row];
    const real *column = &w->system.S[row * n];
    int c;
    if (change == SG_C(0.0)) {
        return change;
    }
    w->path.R[row] = value;
    for (c = 0; c < n; ++c) {
        w->path.y[c] += change * column[c];
    }
    return SG_FABS(change) / w->relax.scale[row];
}

/* One visit to contact k in the slot with first row `base`. Returns the largest change. */
static real sg_relax_contact(SG(work) * w, int n, int base, int k) {
    const sg_contact *contact = sg_contact_at(w, k);
    const int f = sg_slip_of(w, base, k);
    real most = SG_C(0.0);
    real moved[SG_N_SLIP];
    real response = SG_C(0.0);
    int d;
    if (contact->normal >= 0) {
        const int row = sg_normal_of(w, base, k);
        const real own = w->system.S[row * (n + 1)];
        if (own > SG_C(0.0)) {
            const real value = sg_max(w->path.R[row] - w->path.y[row] / own, SG_C(0.0));
            most = sg_relax_set(w, n, row, value);
        }
    }
    for (d = 0; d < sg_rubbing(w, k); ++d) {
        response += sg_max(w->system.S[(f + d) * (n + 1)], SG_C(0.0));
    }
    if (response > SG_C(0.0)) {
        const real radius = sg_max(sg_radius(w, base, k, w->path.R), SG_C(0.0));
        sg_friction_relaxed(w, k, &w->path.y[f], &w->path.R[f], SG_C(1.0) / response, radius,
                            moved);
        for (d = 0; d < contact->components; ++d) {
            most = sg_max(most, sg_relax_set(w, n, f + d, moved[d]));
        }
    }
    return most;
}

/* One visit to all contacts in all slots. Returns the largest change. */
static real sg_relax_sweep(SG(work) * w, const sg_problem *pr) {
    const int n = pr->n_slots * sg_n_R(w);
    real most = SG_C(0.0);
    int slot, k;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        for (k = 0; k < sg_n_contacts(w); ++k) {
            if (sg_joins(w, pr, k)) {
                most = sg_max(most, sg_relax_contact(w, n, slot * sg_n_R(w), k));
            }
        }
    }
    return most;
}

/* How many changes w->relax.change contact k may make before its state changes. */
static real sg_relax_room(const SG(work) * w, int base, int k) {
    const sg_contact *contact = sg_contact_at(w, k);
    const int f = sg_slip_of(w, base, k);
    real room = SG_HUGE;
    if (contact->normal >= 0) {
        const int row = sg_normal_of(w, base, k);
        if (w->relax.change[row] < SG_C(0.0)) {
            room = -w->path.R[row] / w->relax.change[row];
        }
    }
    if (sg_rubbing(w, k) > 0) {
        const real radius = sg_radius(w, base, k, w->path.R);
        real grown = radius;
        real a = SG_C(0.0), b = SG_C(0.0), c = SG_C(0.0), grows;
        int d;
        if (contact->pressing >= 0 && contact->loads == 0) {
            grown += sg_coefficient(w, base, k) *
                     w->relax.change[base + sg_first_normal(w) + contact->pressing];
        }
        grows = grown - radius;
        for (d = 0; d < contact->components; ++d) {
            const real R = sg_over_axis(w, contact->friction + d, w->path.R[f + d]);
            const real D = sg_over_axis(w, contact->friction + d, w->relax.change[f + d]);
            a += D * D;
            b += R * D;
            c += R * R;
        }
        a = grows * grows - a;
        b = SG_C(2.0) * (radius * grows - b);
        c = radius * radius - c;
        if (c > SG_SMALL * radius * radius) {
            const real until = sg_friction_margin(a, b, c, 0);
            room = until < room ? until : room;
        }
    }
    return room;
}

/* Where sweeps change percussions by the same again and again, go on by as many changes as leave
   all contacts in their states: dependent rows that contradict each other a little grow until one
   gives way. */
static void sg_relax_leap(SG(work) * w, const sg_problem *pr) {
    const int n = pr->n_slots * sg_n_R(w);
    real size = SG_C(0.0);
    real apart = SG_C(0.0);
    real room = SG_HUGE;
    int slot, c, k;
    sg_copy(n, w->path.R, w->relax.change);
    (void)sg_relax_sweep(w, pr);
    for (c = 0; c < n; ++c) {
        w->relax.change[c] = w->path.R[c] - w->relax.change[c];
        w->relax.before[c] = w->path.R[c];
    }
    (void)sg_relax_sweep(w, pr);
    for (c = 0; c < n; ++c) {
        const real change = w->path.R[c] - w->relax.before[c];
        size = sg_max(size, SG_FABS(change) / w->relax.scale[c]);
        apart = sg_max(apart, SG_FABS(change - w->relax.change[c]) / w->relax.scale[c]);
        w->relax.change[c] = change;
    }
    if (!(apart < SG_RELAX_STEADY * size)) {
        return;
    }
    for (slot = 0; slot < pr->n_slots; ++slot) {
        for (k = 0; k < sg_n_contacts(w); ++k) {
            if (sg_joins(w, pr, k)) {
                const real own = sg_relax_room(w, slot * sg_n_R(w), k);
                room = own < room ? own : room;
            }
        }
    }
    for (c = 0; c < n && room < SG_HUGE; ++c) {
        if (c % sg_rows_of_slot(w) >= sg_first_normal(w)) {
            (void)sg_relax_set(w, n, c, w->path.R[c] + room * w->relax.change[c]);
        }
    }
}

/* Contact states where relaxation ended. */
static void sg_relax_states(SG(work) * w, const sg_problem *pr) {
    int slot, d, k;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * sg_n_R(w);
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const sg_contact *contact = sg_contact_at(w, k);
            const int f = sg_slip_of(w, base, k);
            const int rubs = sg_joins(w, pr, k) && sg_rubbing(w, k) > 0;
            int slips = 0;
            if (contact->normal >= 0) {
                const int row = sg_normal_of(w, base, k);
                w->rows.kind[row] = w->path.R[row] > SG_C(0.0) ? SG_ROW_FREE : SG_ROW_ZERO;
            }
            if (rubs && sg_is_pressed(w, base, k)) {
                const real radius = sg_max(sg_radius(w, base, k, w->path.R), SG_C(0.0));
                slips = sg_friction_leans(w, k, &w->path.R[f], radius, &w->rows.slip[f]);
            }
            for (d = 0; d < contact->components; ++d) {
                w->rows.kind[f + d] = !rubs || !sg_is_pressed(w, base, k) ? SG_ROW_ZERO
                                      : slips                             ? SG_ROW_SLIP
                                                                          : SG_ROW_FREE;
            }
        }
    }
}

/* Rows and percussions of contacts where relaxation begins: those at hand. */
static void sg_relax_begin(SG(work) * w, const sg_problem *pr) {
    const int n = pr->n_slots * sg_n_R(w);
    int slot, c, k;
    sg_copy(n, w->linear.y_0, w->path.y);
    sg_fill(n, SG_C(0.0), w->path.R);
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * sg_n_R(w);
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const sg_contact *contact = sg_contact_at(w, k);
            const int f = sg_slip_of(w, base, k);
            if (sg_joins(w, pr, k) && contact->normal >= 0) {
                const int row = sg_normal_of(w, base, k);
                (void)sg_relax_set(w, n, row, w->R[pr->R + row]);
            }
            for (c = 0; c < contact->components && sg_joins(w, pr, k); ++c) {
                (void)sg_relax_set(w, n, f + c, w->R[pr->R + f + c]);
            }
        }
    }
}

/* Relax the linearised problem from the percussions at hand. Then the unknowns are those where it
   ended. Returns 0 if there is no such point. */
static int sg_relax(SG(work) * w, const SG(params) * par, const SG(options) * opt, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int n = pr->n_slots * sg_n_R(w);
    real most = SG_HUGE;
    int sweep, slot, c;
    if (!sg_linearise(w, par, opt, problem) || !sg_relax_scales(w, pr)) {
        return 0;
    }
    for (slot = 0; slot < pr->n_slots; ++slot) {
        sg_bilateral_kinds(w, pr, slot);
    }
    if (!sg_relax_reduce(w, pr)) {
        return 0;
    }
    sg_relax_begin(w, pr);
    for (sweep = 1; sweep <= SG_RELAX_SWEEPS && most > SG_FLOOR; ++sweep) {
        most = sg_relax_sweep(w, pr);
        if (most > SG_FLOOR && sweep % SG_RELAX_LEAP == 0) {
            sg_relax_leap(w, pr);
        }
    }
    sg_relax_states(w, pr);
    for (c = 0; c < n; ++c) { /* the rows of bilateral percussions hold what they answer */
        if (c % sg_rows_of_slot(w) < sg_first_normal(w)) {
            w->path.R[c] = w->rows.kind[c] == SG_ROW_FREE ? w->path.y[c] : SG_C(0.0);
        }
    }
    return sg_arrive(w, pr, w->path.R);
}
#endif
