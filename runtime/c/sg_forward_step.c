#pragma once
#include "sg_forward_map.c"

/* A step that is differentiated, and the adjoint of a step and of a run. */

static int sg_is_differentiable(const SG(work) * w, const SG(directions) * d,
                                const SG(options) * opt) {
    return w != NULL && opt != NULL && d != NULL && d->count >= 0 && d->count < SG_N_WAYS;
}

int SG(step_forward)(SG(state) * s, SG(work) * w, SG(info) * info, const SG(params) * par,
                     const SG(options) * opt, const real u[], real h, SG(directions) * d) {
    int status, j;
    if (!sg_is_differentiable(w, d, opt)) {
        if (info != NULL) {
            sg_reset_info(info);
            info->status = SG_K(BAD_ARGUMENT);
        }
        return SG_K(BAD_ARGUMENT);
    }
    w->directions = *d;
    w->directions.moves = 1;
    w->directions.begins = 1;
    for (j = 0; j < SG_N_CONTACTS; ++j) {
        w->directions.jumps[j] = 0;
    }
    for (j = 0; j < d->count; ++j) {
        w->directions.grid[j] += d->h[j];
    }
    /* the last direction is the size of a segment alone */
    sg_fill(SG_N_U, SG_C(0.0), &w->directions.u[d->count * SG_N_U]);
    sg_fill(SG_N_PAR, SG_C(0.0), &w->directions.par[d->count * SG_N_PAR]);
    status = sg_take_step(s, w, info, par, opt, u, h);
    if (status <= SG_K(OK_SUBSTEPPED)) {
#if SG_LOCATED
        if (info->captured) {
            sg_lose(w, SG_CAPTURED_STEP, -1);
        }
        if (opt->events == SG_K(EVENTS_CAPTURED)) {
            sg_lose(w, SG_OF_MAP, -1);
        }
#endif
        *d = w->directions;
    }
    return status;
}
