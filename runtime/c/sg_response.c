#pragma once
#include "sg_part.h"

/* Velocity of a slot over its gap where one percussion changes both; 0 where there are no gaps.
   Where gaps are closed to their round-off, velocities of the stages are determined no better than
   this rate times that. */
static inline real sg_slot_rate(const SG(work) * w, const sg_problem *pr, int slot) {
    const real *response = sg_response[pr->response + slot];
    return slot < pr->gap_slots ? response[1] / (w->h * response[0]) : SG_C(0.0);
}

/* The same for row c of a slot that is no gap: at the end of a step what yields follows its gap. */
static inline real sg_row_rate(const SG(work) * w, const sg_problem *pr, int slot, int c) {
    return slot >= pr->gap_slots && sg_yields(w, c) ? SG_C(2.0) / w->h : sg_slot_rate(w, pr, slot);
}
