#pragma once
#include "sg_limit.c"

/* What the checker asks of a normal row. */

/* Round-off of the normal percussion of a slot: the iteration takes a contact for closed within it,
   so the checker cannot ask for more. */
static real sg_normal_floor(const SG(work) * w, const sg_problem *pr, int slot, int n) {
    const real own = SG_FLOOR * w->scales.percussion_scale[n];
    if (sg_yields(w, n) && !sg_is_gap(w, pr, slot, n)) {
        return own + w->scales.r_auto[slot * sg_n_R(w) + n] * w->scales.gap_floor[n] *
                         sg_row_rate(w, pr, slot, n);
    }
    return sg_is_gap(w, pr, slot, n) ? own + w->masses.m_eff[n] * w->scales.gap_floor[n] /
                                                 (w->h * sg_response[pr->response + slot][0])
                                     : own;
}

/* 0 <= gap, 0 <= percussion, one of them zero. `floor` is the round-off of the percussion: that of
   the gap which it closes, times the response. */
static int sg_check_normal(real gap, real gap_scale, real gap_floor, real percussion, real scale,
                           real floor, const sg_limit *limit) {
    return (gap >= SG_C(0.0) || sg_small(gap, gap_scale, gap_floor, limit)) &&
           (percussion >= SG_C(0.0) || sg_small(percussion, scale, floor, limit)) &&
           (sg_small(gap, gap_scale, gap_floor, limit) ||
            sg_small(percussion, scale, floor, limit));
}

/* Normal row of contact k in a slot, which takes part if `joins`. */
static int sg_check_normal_row(const SG(work) * w, const sg_problem *pr, const sg_solved *at, int k,
                               int joins, const sg_limit *limit) {
    const int n = sg_first_normal(w) + sg_contact_at(w, k)->normal;
    const int gap = sg_is_gap(w, pr, at->slot, n);
    if (!joins) {
        return at->R[n] == SG_C(0.0);
    }
    return sg_check_normal(
        at->y[n], gap ? w->h * w->scales.speed[n] : w->scales.speed[n],
        gap               ? w->scales.gap_floor[n]
        : sg_yields(w, n) ? w->scales.gap_floor[n] * sg_row_rate(w, pr, at->slot, n)
                          : SG_C(0.0),
        at->R[n], w->scales.percussion_scale[n], sg_normal_floor(w, pr, at->slot, n), limit);
}
