#pragma once
#include "sg_mass.c"
#include "sg_response.c"

/* Scales of one step: what each row is measured by, and the prox parameters. All scales are
   formed from quantities of the same unit or from ratios of squares, so that a change of units by
   powers of two changes no bit of the result. */

/* Largest velocity of every coordinate in the step. Returns 1 if all are within a factor of two of
   those that the scales were formed with. */
static int sg_keeps_pace(SG(work) * w, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    int keeps = w->scales.formed;
    int i, j;
    for (j = 0; j < sg_n_q(w); ++j) {
        w->scales.now[j] = SG_FABS(w->v[j]);
    }
    for (i = pr->x; i < pr->x + pr->n_x; i += sg_n_q(w)) {
        for (j = 0; j < sg_n_q(w); ++j) {
            w->scales.now[j] = sg_max(w->scales.now[j], SG_FABS(w->x[i + j]));
        }
    }
    for (j = 0; j < sg_n_q(w); ++j) {
        keeps &= w->scales.now[j] <= SG_C(2.0) * w->scales.fastest[j] &&
                 w->scales.fastest[j] <= SG_C(2.0) * w->scales.now[j];
    }
    return keeps;
}

/* Momenta of the rows at the present pace, and the pace that they stand for. */
static void sg_momentum_scales(SG(work) * w) {
    real energetic = SG_C(0.0);
    int i, j, k;
    for (i = 0; i < sg_n_q(w); ++i) {
        const int last = sg_kind_of(w)->mass.start[i + 1];
        real inertial = SG_C(0.0);
        j = sg_kind_of(w)->mass.order[i];
        for (k = sg_kind_of(w)->mass.start[i]; k < last; ++k) {
            inertial += SG_FABS(w->mass[k]) *
                        w->scales.pace[sg_kind_of(w)->mass.order[sg_kind_of(w)->mass.index[k]]];
        }
        w->scales.momentum_scale[j] = sg_max(w->masses.momentum[j], inertial);
        energetic = sg_max(energetic, w->scales.momentum_scale[j] / w->masses.root_inertia[j]);
    }
    for (j = 0; j < sg_n_q(w); ++j) {
        w->scales.momentum_scale[j] = sg_max(
            w->scales.momentum_scale[j], SG_LEAST_SHARE * energetic * w->masses.root_inertia[j]);
        /* bounded, so that a row without any scale is solved by 0 alone */
        w->scales.momentum_inverse[j] = w->scales.momentum_scale[j] > SG_TINY
                                            ? SG_C(1.0) / w->scales.momentum_scale[j]
                                            : SG_HUGE;
        w->scales.pace[j] =
            sg_max(w->scales.pace[j], w->scales.momentum_scale[j] / w->masses.inertia[j]);
    }
}

/* Scales of a step, from its start and the velocities of the current iterate (a step may start from
   rest): momenta, speeds and percussions. Formed anew only where these velocities change by more
   than a factor of two. */
static void sg_scales(SG(work) * w, int problem) {
    int c, k;
    if (sg_keeps_pace(w, problem)) {
        return;
    }
    w->scales.formed = 1;
    w->scales.floored = 0;
    sg_copy(sg_n_q(w), w->scales.now, w->scales.fastest);
    sg_copy(sg_n_q(w), w->scales.now, w->scales.pace);
    sg_momentum_scales(w);
    for (c = 0; c < sg_n_R(w); ++c) {
        const int last = sg_kind_of(w)->direction.start[c + 1];
        real speed = SG_FABS(w->drift[c]);
        for (k = sg_kind_of(w)->direction.start[c]; k < last; ++k) {
            speed += SG_FABS(w->direction[k]) * w->scales.pace[sg_kind_of(w)->direction.index[k]];
        }
        w->scales.speed[c] = speed;
        w->scales.gap_floor[c] = SG_FLOOR * (w->masses.reach[c] + w->h * speed);
        w->scales.percussion_scale[c] = sg_max(w->masses.m_eff[c] * speed, w->masses.preload[c]);
    }
}

/* Percussion of row n that moves it as far as that of a rigid row would: what yields pushes less.
 */
static inline real sg_row_percussion(const SG(work) * w, const sg_problem *pr, int n) {
    const real rigid = w->scales.percussion_scale[n % sg_rows_of_slot(w)];
    return rigid * sg_max(SG_C(1.0) - w->scales.r_auto[n] * sg_compliance(w, pr->R + n), SG_SMALL);
}

/* Scales and rounding floors of the percussion rows of one problem. */
static void sg_row_scales(SG(work) * w, const SG(options) * opt, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const real tol = sg_max(opt->tol, SG_C(16.0) * SG_EPS);
    int c, slot;
    sg_scales(w, problem);
    if (w->scales.floored == problem + 1) {
        return;
    }
    w->scales.floored = problem + 1;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        for (c = 0; c < sg_n_R(w); ++c) {
            const real rate = sg_row_rate(w, pr, slot, c);
            const int n = slot * sg_n_R(w) + c;
            const int gap = sg_is_gap(w, pr, slot, c);
            const real own = SG_FLOOR * w->scales.percussion_scale[c];
            const real below =
                own + w->scales.r_auto[n] * w->scales.gap_floor[c] * (gap ? SG_C(1.0) : rate);
            const real floor = gap || sg_yields(w, c) ? below : own;
            real tolerance;
            w->scales.rounding[n] = below;
            w->scales.phi_floor[n] = floor;
            /* bounded, so that a row without any scale is solved by 0 alone */
            tolerance = floor + tol * (sg_row_percussion(w, pr, n) + floor);
            w->scales.phi_inverse[n] = tolerance > SG_TINY ? SG_C(1.0) / tolerance : SG_HUGE;
        }
    }
}

/* Prox parameters of one problem: the inverse response of each row to its own percussion. */
static void sg_prox_parameters(SG(work) * w, const SG(options) * opt, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    int slot, c;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const real *response = sg_response[pr->response + slot];
        const real gap = SG_C(1.0) / (w->h * response[0]);
        const real velocity = SG_C(1.0) / response[1];
        for (c = 0; c < sg_n_R(w); ++c) {
            const int k = slot * sg_n_R(w) + c;
            w->scales.r_auto[k] = w->masses.m_eff[c] * (sg_is_gap(w, pr, slot, c) ? gap : velocity);
            w->scales.r_auto[k] /= SG_C(1.0) + w->scales.r_auto[k] * sg_compliance(w, pr->R + k);
            w->scales.prox_r[k] = w->scales.r_auto[k];
            if (opt->r > SG_C(0.0) && c >= sg_first_normal(w)) {
                /* the user's, with the shape of the set of friction */
                const int axis = c - sg_first_slip(w);
                w->scales.prox_r[k] =
                    axis < 0 ? opt->r : sg_times_axis(w, axis, sg_times_axis(w, axis, opt->r));
            }
        }
    }
}
