#pragma once
#include "sg_law_coulomb_check.c"
#include "sg_law_signorini_check.c"

/* Acceptance of a step. Reads the state before, the unknowns and what the model says there
   (r_found, y_found, radius_found); shares nothing with the iteration that found them but the
   scales of the rows. */

/* Keep what the model says at the unknowns of one problem. */
static void sg_keep_rows(SG(work) * w, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    sg_copy(pr->n_x, w->r, &w->found.r[pr->x]);
    sg_copy(pr->n_slots * sg_n_R(w), w->y, &w->found.y[pr->R]);
    sg_copy(pr->n_slots * sg_n_bounds(w), w->radius,
            &w->found.radius[pr->R / sg_rows_of_slot(w) * sg_n_bounds(w)]);
}

/* Rows of the momenta of one problem. */
static int sg_check_momenta(const SG(work) * w, const sg_problem *pr, const sg_limit *limit) {
    int i, j;
    for (i = pr->x; i < pr->x + pr->n_x; i += sg_n_q(w)) {
        for (j = 0; j < sg_n_q(w); ++j) {
            if (!sg_small(w->found.r[i + j], w->scales.momentum_scale[j], SG_C(0.0), limit)) {
                return 0;
            }
        }
    }
    return 1;
}

/* Bilateral rows of a slot. */
static int sg_check_bilateral(const SG(work) * w, const sg_problem *pr, const sg_solved *at,
                              const sg_limit *limit) {
    int c;
    for (c = 0; c < sg_first_normal(w); ++c) {
        const int gap = sg_is_gap(w, pr, at->slot, c);
        const real speed = w->scales.speed[c];
        const real floor = w->scales.gap_floor[c];
        if (!sg_takes_part(pr, at->slot, c)) {
            if (at->R[c] != SG_C(0.0)) {
                return 0;
            }
        } else if (!sg_small(at->y[c], gap ? w->h * speed : speed,
                             gap ? floor : floor * sg_row_rate(w, pr, at->slot, c), limit)) {
            return 0;
        }
    }
    return 1;
}

/* 1 if the unknowns of one problem are numbers and its momenta balance. */
static int sg_check_smooth(const SG(work) * w, const sg_problem *pr, const sg_limit *limit) {
    return sg_all_finite(pr->n_x, &w->x[pr->x]) &&
           sg_all_finite(pr->n_slots * sg_n_R(w), &w->R[pr->R]) && sg_check_momenta(w, pr, limit);
}

/* Unknowns and rows of one slot at the solution. */
static sg_solved sg_solved_slot(const SG(work) * w, const sg_problem *pr, int slot) {
    sg_solved at;
    at.slot = slot;
    at.R = &w->R[pr->R + slot * sg_n_R(w)];
    at.y = &w->found.y[pr->R + slot * sg_n_R(w)];
    return at;
}

/* Rows of one problem at the solution. */
static int sg_check_problem(const SG(work) * w, const SG(options) * opt, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const sg_limit limit = sg_limits(opt);
    int slot, k;
    if (!sg_check_smooth(w, pr, &limit)) {
        return 0;
    }
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const sg_solved at = sg_solved_slot(w, pr, slot);
        if (!sg_check_bilateral(w, pr, &at, &limit)) {
            return 0;
        }
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const sg_contact *contact = sg_contact_at(w, k);
            const int joins =
                w->found.exists[k] && (contact->presser < 0 || !pr->follows || w->found.active[k]);
            const real floor =
                contact->pressing < 0
                    ? SG_C(0.0)
                    : sg_normal_floor(w, pr, slot, sg_first_normal(w) + contact->pressing);
            if (contact->normal >= 0 && !sg_check_normal_row(w, pr, &at, k, joins, &limit)) {
                return 0;
            }
            if (contact->components > 0 &&
                !sg_check_slip_rows(w, pr, &at, k, joins, floor, &limit)) {
                return 0;
            }
        }
    }
    return 1;
}

/* Contacts that must, or must not, take part in the impact equations (67), judged from gaps and
   percussions of the position problem with the checker's tolerance. */
static int sg_check_active(const SG(work) * w, const SG(options) * opt, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const sg_limit limit = sg_limits(opt);
    int k, slot;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        int must = 0;
        int may = 0;
        const int n = sg_first_normal(w) + sg_contact_at(w, k)->normal;
        if (sg_contact_at(w, k)->normal < 0 || !w->found.exists[k] ||
            !sg_is_place(w, sg_contact_at(w, k)->normal)) {
            continue;
        }
        for (slot = 0; slot < pr->n_slots; ++slot) {
            const int row = slot * sg_n_R(w) + n;
            if (opt->active_set == SG_K(ACTIVE_END) && slot + 1 < pr->n_slots) {
                continue;
            }
            if (!sg_small(w->R[pr->R + row], w->scales.percussion_scale[n],
                          sg_normal_floor(w, pr, slot, n), &limit)) {
                must = 1;
            }
            if (sg_small(w->found.y[pr->R + row], w->h * w->scales.speed[n], w->scales.gap_floor[n],
                         &limit)) {
                may = 1;
            }
        }
        if ((must && !w->found.active[k]) || (w->found.active[k] && !may)) {
            return 0;
        }
    }
    return 1;
}
