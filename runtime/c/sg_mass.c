#pragma once
#include "sg_law_elliptic.c"
#include "sg_linalg.c"

/* Inertia of the coordinates and of the directions of constraints and contacts at the start of a
   step. */

/* Inertia of every coordinate: |M_jj|, or what the row's largest entry says if that is zero. */
static void sg_inertia(SG(work) * w) {
    int j, k;
    for (j = 0; j < sg_n_q(w); ++j) {
        real own = SG_FABS(w->mass[sg_kind_of(w)->mass.diagonal[j]]);
        if (!(own > SG_C(0.0))) {
            const int last = sg_kind_of(w)->mass.start[j + 1];
            for (k = sg_kind_of(w)->mass.start[j]; k < last; ++k) {
                const real d =
                    SG_FABS(w->mass[sg_kind_of(w)->mass.diagonal[sg_kind_of(w)->mass.index[k]]]);
                const real m = SG_FABS(w->mass[k]);
                own = sg_max(own, d > SG_C(0.0) ? m * m / d : m);
            }
        }
        w->masses.inertia[sg_kind_of(w)->mass.order[j]] = own;
    }
}

/* Factorise the mass matrix. Returns 0 if it is singular or not finite. */
static int sg_factor_mass(SG(work) * w) {
    int k;
    for (k = 0; k < sg_n_q(w); ++k) {
        w->smooth.pivot_scale[k] = w->masses.inertia[sg_kind_of(w)->mass.order[k]];
    }
    w->smooth.exchanged =
        !sg_sparse_factor(0, sg_n_q(w), &sg_kind_of(w)->mass, w->smooth.pivot_scale, SG_SMALL,
                          w->mass, w->smooth.factors, w->smooth.row);
    if (w->smooth.exchanged) {
        for (k = 0; k < sg_n_q(w); ++k) {
            w->smooth.pivot_scale[k] =
                SG_C(1.0) / w->masses.root_inertia[sg_kind_of(w)->mass.order[k]];
        }
        sg_expand(sg_n_q(w), &sg_kind_of(w)->mass, w->mass, w->smooth.full);
        return sg_lu_factor(sg_n_q(w), w->smooth.full, w->smooth.pivot_scale, w->smooth.perm);
    }
    return 1;
}

/* 1 unless the mass matrix has a negative entry on its diagonal. */
static int sg_is_positive(const SG(work) * w) {
    int j;
    for (j = 0; j < sg_n_q(w); ++j) {
        if (w->mass[sg_kind_of(w)->mass.diagonal[j]] < SG_C(0.0)) {
            return 0;
        }
    }
    return 1;
}

/* 1 if the generated code found the mobilities with pivots that are large enough. */
static int sg_has_mobility(const SG(work) * w) {
    int k;
    for (k = 0; k < sg_n_q(w) && sg_kind_of(w)->mobility; ++k) {
        if (!(w->mass_pivot[k] > SG_SMALL * w->masses.inertia[sg_kind_of(w)->mass.order[k]]) ||
            !sg_finite(w->mass_pivot[k])) {
            return 0;
        }
    }
    return sg_kind_of(w)->mobility;
}

/* m_eff = 1 / (w^T M^-1 w) of direction c, with the factors of M. */
static real sg_effective_mass(SG(work) * w, int c) {
    real *solved = w->masses.solved;
    real *row = w->masses.row;
    const int last = sg_kind_of(w)->direction.start[c + 1];
    real loose = SG_C(0.0);
    real mobility = SG_C(0.0);
    int k;
    sg_fill(sg_n_q(w), SG_C(0.0), row);
    for (k = sg_kind_of(w)->direction.start[c]; k < last; ++k) {
        row[sg_kind_of(w)->direction.index[k]] = w->direction[k];
        loose += w->direction[k] * w->direction[k] /
                 w->masses.inertia[sg_kind_of(w)->direction.index[k]];
    }
    for (k = 0; k < sg_n_q(w); ++k) {
        solved[k] = row[sg_kind_of(w)->mass.order[k]];
    }
    if (w->smooth.exchanged) {
        sg_lu_solve(sg_n_q(w), w->smooth.full, w->smooth.perm, solved);
    } else {
        sg_sparse_solve(sg_n_q(w), &sg_kind_of(w)->mass, w->smooth.factors, 0, solved);
    }
    for (k = 0; k < sg_n_q(w); ++k) {
        mobility += solved[k] * row[sg_kind_of(w)->mass.order[k]];
    }
    /* An indefinite mass matrix may have directions without mobility of their own. */
    mobility = sg_max(SG_FABS(mobility), SG_LEAST_SHARE * loose);
    return mobility > SG_C(0.0) ? SG_C(1.0) / mobility : SG_C(0.0);
}

/* One effective mass for all components of a slip velocity, in units of the semi-axes: the set of
   friction becomes a ball in the scales that follow from it. */
static void sg_equal_masses(SG(work) * w) {
    int d, k;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const int f = sg_contact_at(w, k)->friction;
        const int count = sg_contact_at(w, k)->components;
        real *m = &w->masses.m_eff[sg_first_slip(w) + f];
        real larger = SG_C(0.0);
        for (d = 0; d < count; ++d) {
            /* sliding and drilling, a mass and an inertia, are compared in units of the axes */
            const real own =
                count > 2 ? sg_over_axis(w, f + d, sg_over_axis(w, f + d, m[d])) : m[d];
            larger = sg_max(larger, own);
        }
        for (d = 0; d < count && count > 1; ++d) {
            m[d] = sg_times_axis(w, f + d, sg_times_axis(w, f + d, larger));
        }
    }
}

/* Percussions with which rows that yield begin the step: they may cancel, so that no momentum shows
   them. */
static void sg_preloads(SG(work) * w) {
    sg_fill(sg_n_R(w), SG_C(0.0), w->masses.preload);
#if SG_N_COMPLIANCE > 0
    int c, k;
    for (c = 0; c < sg_n_R(w); ++c) {
        const int last = sg_kind_of(w)->direction.start[c + 1];
        const int stage = (SG_N_STAGES - 2) * sg_n_R(w) + c;
        if (!sg_yields(w, c)) {
            continue;
        }
        w->masses.preload[c] = w->slack[c] / (sg_compliance(w, stage) + w->h / w->masses.m_eff[c]);
        w->masses.reach[c] += w->slack[c];
        for (k = sg_kind_of(w)->direction.start[c]; k < last; ++k) {
            w->masses.momentum[sg_kind_of(w)->direction.index[k]] +=
                SG_FABS(w->direction[k]) * w->masses.preload[c];
        }
    }
#endif
}

/* Inertia, effective masses and the constant part of the momentum scales at the start of the step,
   from work.p, work.force_size, work.mass, work.direction. Returns 0 if the mass matrix is singular
   or anything is not finite. */
static int sg_masses(SG(work) * w) {
    real reference = SG_C(0.0);
    int c, j, k, known;
    w->scales.formed = 0;
    sg_inertia(w);
    known = sg_has_mobility(w);
    for (j = 0; j < sg_n_q(w); ++j) {
        w->masses.root_inertia[j] = SG_SQRT(w->masses.inertia[j] / w->masses.inertia[0]);
        w->masses.momentum[j] = sg_max(SG_FABS(w->p[j]), w->h * w->force_size[j]);
    }
    if (!sg_is_positive(w) || !sg_all_finite(sg_n_q(w), w->masses.root_inertia) ||
        !sg_all_finite(sg_n_q(w), w->masses.momentum) || (!known && !sg_factor_mass(w))) {
        return 0;
    }
    for (c = 0; c < sg_n_R(w); ++c) {
        const int last = sg_kind_of(w)->direction.start[c + 1];
        w->masses.reach[c] = SG_C(0.0);
        for (k = sg_kind_of(w)->direction.start[c]; k < last; ++k) {
            w->masses.reach[c] +=
                SG_FABS(w->direction[k] * w->q[sg_kind_of(w)->direction.index[k]]);
        }
        if (known) {
            w->masses.m_eff[c] =
                w->mobility[c] > SG_C(0.0) ? SG_C(1.0) / w->mobility[c] : SG_C(0.0);
        } else {
            w->masses.m_eff[c] = sg_effective_mass(w, c);
        }
        if (!sg_finite(w->masses.m_eff[c])) {
            return 0;
        }
        if (!(reference > SG_C(0.0))) {
            reference = w->masses.m_eff[c];
        }
    }
    for (c = 0; c < sg_n_R(w); ++c) {
        /* A direction that vanishes at the start borrows a mass: it cannot push there anyway. */
        if (!(w->masses.m_eff[c] > SG_C(0.0))) {
            w->masses.m_eff[c] = reference > SG_C(0.0) ? reference : w->masses.inertia[0];
        }
    }
    sg_equal_masses(w);
    sg_preloads(w);
    return 1;
}
