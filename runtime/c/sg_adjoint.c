#pragma once
#include "sg_forward_step.c"

/* Gradients carried back over steps: each is differentiated along everything that it depends on. */

/* One direction for each number that a step depends on: q, v, how late the state is, its time, the
   size of the step, parameters, inputs. */
static void sg_seed(SG(directions) * d) {
    int j = 0;
    int i;
    d->count = SG_N_WAYS - 1;
    sg_fill(SG_N_WAYS, SG_C(0.0), d->grid);
    sg_fill(SG_N_WAYS, SG_C(0.0), d->t);
    sg_fill(SG_N_WAYS, SG_C(0.0), d->h);
    sg_fill(SG_N_WAYS * SG_N_Q, SG_C(0.0), d->q);
    sg_fill(SG_N_WAYS * SG_N_Q, SG_C(0.0), d->v);
    sg_fill(SG_N_WAYS * SG_N_U, SG_C(0.0), d->u);
    sg_fill(SG_N_WAYS * SG_N_PAR, SG_C(0.0), d->par);
    for (i = 0; i < SG_N_Q; ++i, ++j) {
        d->q[j * SG_N_Q + i] = SG_C(1.0);
    }
    for (i = 0; i < SG_N_Q; ++i, ++j) {
        d->v[j * SG_N_Q + i] = SG_C(1.0);
    }
    d->t[j] = SG_C(1.0);
    ++j;
    d->t[j] = SG_C(1.0);
    d->grid[j] = SG_C(1.0);
    ++j;
    d->h[j] = SG_C(1.0);
    ++j;
    for (i = 0; i < SG_N_PAR; ++i, ++j) {
        d->par[j * SG_N_PAR + i] = SG_C(1.0);
    }
    for (i = 0; i < SG_N_U; ++i, ++j) {
        d->u[j * SG_N_U + i] = SG_C(1.0);
    }
}

/* What the number behind the step changes by along direction j. */
static real sg_pull(const SG(directions) * d, const SG(adjoint) * a, int j) {
    real sum = a->late * (d->t[j] - d->grid[j]) + a->t * d->grid[j];
    int i;
    for (i = 0; i < SG_N_Q; ++i) {
        sum += a->q[i] * d->q[j * SG_N_Q + i] + a->v[i] * d->v[j * SG_N_Q + i];
    }
    return sum;
}

int SG(step_adjoint)(SG(state) * s, SG(work) * w, SG(info) * info, const SG(params) * par,
                     const SG(options) * opt, const real u[], real h, SG(directions) * d,
                     SG(adjoint) * a) {
    SG(adjoint) back;
    int j = 0;
    int i, status;
    if (d == NULL || a == NULL) {
        if (info != NULL) {
            sg_reset_info(info);
            info->status = SG_K(BAD_ARGUMENT);
        }
        return SG_K(BAD_ARGUMENT);
    }
    sg_seed(d);
    status = SG(step_forward)(s, w, info, par, opt, u, h, d);
    if (status > SG_K(OK_SUBSTEPPED)) {
        return status;
    }
    back = *a;
    for (i = 0; i < SG_N_Q; ++i, ++j) {
        back.q[i] = sg_pull(d, a, j);
    }
    for (i = 0; i < SG_N_Q; ++i, ++j) {
        back.v[i] = sg_pull(d, a, j);
    }
    back.late = sg_pull(d, a, j);
    ++j;
    back.t = sg_pull(d, a, j);
    ++j;
    back.h = a->h + sg_pull(d, a, j);
    ++j;
    for (i = 0; i < SG_N_PAR; ++i, ++j) {
        back.par[i] = a->par[i] + sg_pull(d, a, j);
    }
    for (i = 0; i < SG_N_U; ++i, ++j) {
        back.u[i] = sg_pull(d, a, j);
    }
    *a = back;
    return status;
}

/* Add what is asked of the state number k. Returns whether that is something. */
static int sg_ask_row(SG(adjoint) * a, const real q_bar[], const real v_bar[], int k) {
    int asked = 0;
    int i;
    for (i = 0; i < SG_N_Q; ++i) {
        if (q_bar != NULL) {
            a->q[i] += q_bar[k * SG_N_Q + i];
            asked = asked || q_bar[k * SG_N_Q + i] != SG_C(0.0);
        }
        if (v_bar != NULL) {
            a->v[i] += v_bar[k * SG_N_Q + i];
            asked = asked || v_bar[k * SG_N_Q + i] != SG_C(0.0);
        }
    }
    return asked;
}

/* 1 if a gradient is none: nothing depends on the state. */
static int sg_is_nothing(const SG(adjoint) * a) {
    int i;
    for (i = 0; i < SG_N_Q; ++i) {
        if (a->q[i] != SG_C(0.0) || a->v[i] != SG_C(0.0)) {
            return 0;
        }
    }
    return a->late == SG_C(0.0) && a->t == SG_C(0.0);
}

/* The state before step k in the last of the kept, from the nearest before it; where there is room
   states on the way are kept, too, at equal distances. Places up to *top are in use. */
static int sg_go_to(SG(checkpoint) kept[], int n_kept, int *top, SG(work) * w, SG(info) * info,
                    const SG(params) * par, const SG(options) * opt, const real u[], real h,
                    int k) {
    SG(checkpoint) *now = &kept[n_kept - 1];
    int status = SG_K(OK);
    while (kept[*top].step > k) {
        --*top;
    }
    *now = kept[*top];
    while (now->step < k && status <= SG_K(OK_SUBSTEPPED)) {
        const int room = n_kept - 2 - *top;
        const int far = now->step + (k - now->step + room) / (room + 1);
        while (now->step < far && status <= SG_K(OK_SUBSTEPPED)) {
            status = SG(step)(&now->state, w, info, par, opt, &u[now->step * SG_N_U], h);
            ++now->step;
        }
        if (now->step < k) {
            ++*top;
            kept[*top] = *now;
        }
    }
    return status;
}

/* 1 if the state at hand is at an event, whose time moves: it has no derivative at a given time. */
static int sg_is_late(const SG(directions) * d) {
    int j;
    for (j = 0; j < d->count; ++j) {
        if (d->t[j] != d->grid[j]) {
            return 1;
        }
    }
    return 0;
}

int SG(run_adjoint)(const SG(state) * s, SG(checkpoint) kept[], int n_kept, SG(work) * w,
                    SG(info) * info, const SG(params) * par, const SG(options) * opt,
                    const real u[], real h, int n_steps, const real q_bar[], const real v_bar[],
                    SG(directions) * d, SG(adjoint) * a, real u_bar[]) {
    static const real none[1] = {SG_C(0.0)};
    const real *inputs = u == NULL ? none : u;
    int status = SG_K(OK);
    int top = 0;
    int k;
    if (s == NULL || kept == NULL || n_kept < 2 || n_steps < 0 || (SG_N_U > 0 && u == NULL) ||
        a == NULL || d == NULL || info == NULL) {
        if (info != NULL) {
            sg_reset_info(info);
            info->status = SG_K(BAD_ARGUMENT);
        }
        return SG_K(BAD_ARGUMENT);
    }
    kept[0].state = *s;
    kept[0].step = 0;
    d->lost = SG_KNOWN;
    d->fresh = 0;
    for (k = n_steps - 1; k >= 0; --k) {
        const int asked = sg_ask_row(a, q_bar, v_bar, k + 1) || k == n_steps - 1;
        sg_fill(SG_N_U, SG_C(0.0), a->u);
        if (!sg_is_nothing(a)) {
            status = sg_go_to(kept, n_kept, &top, w, info, par, opt, inputs, h, k);
            if (status > SG_K(OK_SUBSTEPPED)) {
                return status;
            }
            d->fresh = k == 0;
            status = SG(step_adjoint)(&kept[n_kept - 1].state, w, info, par, opt,
                                      &inputs[k * SG_N_U], h, d, a);
            if (status > SG_K(OK_SUBSTEPPED)) {
                return status;
            }
            if (asked && d->lost == SG_KNOWN && sg_is_late(d)) {
                d->lost = SG_TOGETHER;
                d->contact = -1;
                d->at = kept[n_kept - 1].state.t;
            }
            if (d->lost != SG_KNOWN && d->lost != SG_OF_MAP) {
                return status;
            }
        }
        if (u_bar != NULL) {
            sg_copy(SG_N_U, a->u, &u_bar[k * SG_N_U]);
        }
    }
    (void)sg_ask_row(a, q_bar, v_bar, 0);
    return status;
}
