#pragma once
#include "sg_newton.c"

/* Newton iterations in which every contact keeps the state that the path found, while they get
   nearer. */
static void sg_settle(SG(work) * w, const SG(params) * par, const SG(options) * opt, int problem,
                      int limit, int *iterations) {
    const sg_problem *pr = sg_problem_at(w, problem);
    real past = SG_HUGE;
    int round;
    for (round = 0; round < limit; ++round) {
        real measure;
        sg_rows_at(w, par, problem);
        sg_row_scales(w, opt, problem);
        sg_held_rows(w, pr);
        measure = sg_residual(w, opt, problem);
        if (!(measure > SG_C(1.0)) || (round > 1 && !(measure < SG_C(0.5) * past))) {
            return;
        }
        past = measure;
        SG(derivatives)(w, par, problem);
        ++*iterations;
        if (sg_newton_direction(w, opt, problem, 0) < 0) {
            return;
        }
        sg_advance(w, problem);
    }
}
