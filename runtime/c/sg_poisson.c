#pragma once
#include "sg_solve.c"

/* Poisson's impact law. What the impact equations give without restitution is the compression, with
   percussions C. In the expansion a contact gives back at least e_N C_N and parts or stays,
   0 <= gamma_N, P_N >= (1 + e_N) C_N, one of them an equality; its friction is that of the
   compression and more of at most mu times what presses it now. Both are one problem: unknown are
   the percussions beyond what is given, P_N - (1 + e_N) C_N and P_F - C_F. */

#if SG_N_EXPANDED > 0
/* 1 if contact k gives back what it was compressed by. */
static int sg_rebounds(const SG(work) * w, const sg_problem *pr, int k) {
    const int base = (pr->n_slots - 1) * sg_n_R(w);
    return sg_kind_of(w)->poisson[k] && w->found.active[k] && w->e_N[k] > SG_C(0.0) &&
           w->R[pr->R + base + sg_first_normal(w) + sg_contact_at(w, k)->normal] > SG_C(0.0);
}

/* 1 if a contact that takes part was approaching: then there is an impact, and not the rest of
   bodies that press each other. */
static int sg_is_impact(const SG(work) * w) {
    int k;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const int n = sg_first_normal(w) + sg_contact_at(w, k)->normal;
        if (sg_contact_at(w, k)->normal >= 0 && w->found.active[k] && !sg_yields(w, n) &&
            w->drift[n] + sg_row_dot(&sg_kind_of(w)->direction, w->direction, n, w->v) <
                -SG_CHECK * w->scales.speed[n]) {
            return 1;
        }
    }
    return 0;
}

/* What the compression leaves to the expansion; returns 0 if that is nothing. */
static int sg_give_back(SG(work) * w, const SG(params) * par, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int base = (pr->n_slots - 1) * sg_n_R(w);
    int given = 0;
    int d, i, k;
    sg_fill(sg_n_R(w), SG_C(0.0), w->expansion.given);
    sg_fill(sg_n_N(w), SG_C(0.0), w->expansion.back);
    for (k = 0; k < sg_n_contacts(w) && sg_is_impact(w); ++k) {
        const sg_contact *contact = sg_contact_at(w, k);
        if (sg_rebounds(w, pr, k)) {
            const real C = w->R[pr->R + base + sg_first_normal(w) + contact->normal];
            w->expansion.back[contact->normal] = w->e_N[k] * C;
            w->expansion.given[sg_first_normal(w) + contact->normal] = C + w->e_N[k] * C;
            for (d = 0; d < contact->components; ++d) {
                w->expansion.given[sg_first_slip(w) + contact->friction + d] =
                    w->R[pr->R + base + sg_first_slip(w) + contact->friction + d];
            }
            given = 1;
        }
    }
    if (given) {
        SG(derivatives)(w, par, problem);
        sg_fill(pr->n_x, SG_C(0.0), w->smooth.dx);
        for (i = 0; i < sg_n_R(w); ++i) {
            sg_add_row(&pr->B, w->B, base + i, w->expansion.given[i], w->smooth.dx);
        }
        for (i = 0; i < pr->n_x; ++i) {
            w->expansion.momentum[pr->K.order[i]] = w->smooth.dx[i];
        }
    }
    return given;
}

/* The expansion of the impact whose compression was just solved. */
static int sg_expand_impact(SG(work) * w, const SG(part) * s, const SG(params) * par,
                            const SG(options) * opt, SG(report) * info, int problem, int effort,
                            int end) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int base = (pr->n_slots - 1) * sg_n_R(w);
    int status, i;
    if (!sg_give_back(w, par, problem)) {
        return SG_K(OK);
    }
    w->expansion.expands = 1;
    status = sg_solve(w, s, par, opt, info, problem, 0, effort, end);
    w->expansion.expands = 0;
    sg_fill(sg_n_N(w), SG_C(0.0), w->expansion.back);
    for (i = 0; i < sg_n_R(w); ++i) {
        w->R[pr->R + base + i] += w->expansion.given[i];
    }
    return status;
}
#endif
