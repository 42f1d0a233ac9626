#pragma once
#include "sg_forward_map.c"

/* A step that is differentiated, and the adjoint of a step and of a run. */

static int sg_is_differentiable(const SG(work) * w, const SG(directions) * d,
                                const SG(options) * opt) {
    return w != NULL && opt != NULL && d != NULL && d->count >= 0 && d->count < SG_N_WAYS;
}

/* 1 if direction j of the caller stays as it is, because nothing depends on what it changes. */
static int sg_is_idle(const SG(directions) * d, int j) {
    int idle = d->t[j] == SG_C(0.0) && d->h[j] == SG_C(0.0) && d->grid[j] == SG_C(0.0);
    int i;
    for (i = 0; i < SG_N_Q; ++i) {
        idle = idle && d->v[j * SG_N_Q + i] == SG_C(0.0) &&
               (!sg_is_read[i] || d->q[j * SG_N_Q + i] == SG_C(0.0));
    }
    for (i = 0; i < SG_N_U; ++i) {
        idle = idle && d->u[j * SG_N_U + i] == SG_C(0.0);
    }
    for (i = 0; i < SG_N_PAR; ++i) {
        idle = idle && d->par[j * SG_N_PAR + i] == SG_C(0.0);
    }
    return idle;
}

/* Directions of the caller but for those that stay; the last of the scratch is the size of a
   segment. */
static void sg_take_directions(SG(work) * w, SG(directions) * d) {
    SG(directions) *own = &w->directions;
    int n = 0;
    int j;
    for (j = 0; j < d->count; ++j) {
        d->idle[j] = sg_is_idle(d, j);
        if (!d->idle[j]) {
            own->leaves[n] = d->leaves[j];
            own->grid[n] = d->grid[j];
            own->t[n] = d->t[j];
            own->h[n] = d->h[j];
            sg_copy(SG_N_Q, &d->q[j * SG_N_Q], &own->q[n * SG_N_Q]);
            sg_copy(SG_N_Q, &d->v[j * SG_N_Q], &own->v[n * SG_N_Q]);
            sg_copy(SG_N_U, &d->u[j * SG_N_U], &own->u[n * SG_N_U]);
            sg_copy(SG_N_PAR, &d->par[j * SG_N_PAR], &own->par[n * SG_N_PAR]);
            ++n;
        }
    }
    own->count = n;
    own->fresh = d->fresh;
    own->lost = d->lost;
    own->contact = d->contact;
    own->at = d->at;
    own->near = 0;
}

/* What has become of them. */
static void sg_give_directions(const SG(work) * w, SG(directions) * d) {
    const SG(directions) *own = &w->directions;
    int n = 0;
    int j;
    for (j = 0; j < d->count; ++j) {
        if (!d->idle[j]) {
            d->leaves[j] = own->leaves[n];
            d->grid[j] = own->grid[n];
            d->t[j] = own->t[n];
            sg_copy(SG_N_Q, &own->q[n * SG_N_Q], &d->q[j * SG_N_Q]);
            sg_copy(SG_N_Q, &own->v[n * SG_N_Q], &d->v[j * SG_N_Q]);
            ++n;
        }
    }
    d->fresh = own->fresh;
    d->lost = own->lost;
    d->contact = own->contact;
    d->at = own->at;
}

int SG(step_forward)(SG(state) * s, SG(work) * w, SG(info) * info, const SG(params) * par,
                     const SG(options) * opt, const real u[], real h, SG(directions) * d) {
    int status, last, j;
    if (!sg_is_differentiable(w, d, opt)) {
        if (info != NULL) {
            sg_reset_info(info);
            info->status = SG_K(BAD_ARGUMENT);
        }
        return SG_K(BAD_ARGUMENT);
    }
    sg_take_directions(w, d);
    w->directions.moves = 1;
    w->directions.begins = 1;
    for (j = 0; j < SG_N_CONTACTS; ++j) {
        w->directions.jumps[j] = 0;
    }
    last = w->directions.count;
    for (j = 0; j < last; ++j) {
        w->directions.grid[j] += w->directions.h[j];
    }
    /* the last direction is the size of a segment alone */
    sg_fill(SG_N_U, SG_C(0.0), &w->directions.u[last * SG_N_U]);
    sg_fill(SG_N_PAR, SG_C(0.0), &w->directions.par[last * SG_N_PAR]);
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
        sg_give_directions(w, d);
    }
    return status;
}
