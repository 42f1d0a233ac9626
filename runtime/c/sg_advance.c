#pragma once
#include "sg_simulate.c"

/* Steps whose sizes follow from a tolerance. Each is taken as a whole, and once more with every
   segment between its events in two. With an error of C h^(p+1) in a segment of size h, p = 2s - 2,
   what both differ by is 2^p - 1 times the error of the halves, which are what is kept. What is
   captured has p = 1. */

/* How the size of a step follows the estimate: a margin, bounds of one change, the smallest size as
   a share of the span, attempts in a row. */
#define SG_MARGIN SG_C(0.9)
#define SG_SHRINK SG_C(0.2)
#define SG_GROW SG_C(4.0)
#define SG_LEAST_STEP SG_C(9.5367431640625e-07) /* 2^-20 */
#define SG_FIRST_STEPS SG_C(32.0)
#define SG_SHORTEST SG_C(9.3132257461547852e-10) /* 2^-30: segments that are none, of the step */
enum { SG_MOST_ATTEMPTS = 64 };

static int sg_is_control(const SG(control) * c) {
    int j;
    for (j = 0; j < SG_N_Q; ++j) {
        if (!(c->scale[j] > SG_C(0.0)) || !sg_finite(c->scale[j])) {
            return 0;
        }
    }
    return c->error > SG_C(0.0) && sg_finite(c->error) && c->span > SG_C(0.0) &&
           sg_finite(c->span) && c->h >= SG_C(0.0) && sg_finite(c->h);
}

/* 2^(2s - 2). */
static real sg_gain(void) {
    real gain = SG_C(1.0);
    int k;
    for (k = 0; k < 2 * SG_N_STAGES - 2; ++k) {
        gain *= SG_C(2.0);
    }
    return gain;
}

/* The larger of what q is apart by, in units of its scale, and of what v makes of it in the span.
 */
static real sg_apart(const SG(control) * c, const real q[], const real v[], const real q_2[],
                     const real v_2[]) {
    real worst = SG_C(0.0);
    int j;
    for (j = 0; j < SG_N_Q; ++j) {
        const real places = SG_FABS(q[j] - q_2[j]);
        const real rates = c->span * SG_FABS(v[j] - v_2[j]);
        worst = sg_max(worst, sg_max(places, rates) / c->scale[j]);
    }
    return worst;
}

/* What rounding alone leaves of it. */
static real sg_apart_rounded(const SG(control) * c, const SG(state) * s) {
    real worst = SG_C(0.0);
    int j;
    for (j = 0; j < SG_N_Q; ++j) {
        const real size = sg_max(SG_FABS(s->q[j]), c->span * SG_FABS(s->v[j]));
        worst = sg_max(worst, size / c->scale[j]);
    }
    return SG_C(16.0) * SG_EPS * worst;
}

/* The size of the next step: what is wished, or half or all of what is left if that is less than
   two or one of them. */
static real sg_next_step(const SG(control) * c, real left) {
    const real wish = c->h > SG_C(0.0) ? c->h : c->span / SG_FIRST_STEPS;
    return left <= wish ? left : left <= SG_C(2.0) * wish ? SG_C(0.5) * left : wish;
}

/* base^(1 / p), p = 2s - 2. */
static real sg_root_of_order(real base) {
    const int order = 2 * SG_N_STAGES - 2;
    return SG_POW(base, SG_C(1.0) / (real)order);
}

/* Add what a part of a step reports to what the parts before it did. */
static void sg_add_info(SG(info) * sum, const SG(info) * part) {
    int k;
    sum->status = part->status > sum->status ? part->status : sum->status;
    sum->iterations += part->iterations;
    sum->substeps += part->substeps;
    sum->rescues |= part->rescues;
    sum->percussions = part->percussions > sum->percussions ? part->percussions : sum->percussions;
    sum->lost_impacts += part->lost_impacts;
    sum->residual = sg_max(sum->residual, part->residual);
    sum->smallest_gap = sg_min(sum->smallest_gap, part->smallest_gap);
    for (k = 0; k < SG_N_R; ++k) {
        sum->P[k] += part->P[k];
    }
    for (k = 0; k < SG_N_CONTACTS; ++k) {
        sum->contact[k] = part->contact[k];
        sum->impacts[k] += part->impacts[k];
    }
#if SG_LOCATED
    if (part->captured > 0 && sum->captured == 0) {
        sum->t_captured = part->t_captured;
    }
    sum->captured = part->captured > sum->captured ? part->captured : sum->captured;
    for (k = 0; k < part->n_events && k < SG_N_EVENTS; ++k) {
        if (sum->n_events < SG_N_EVENTS) {
            sum->events[sum->n_events] = part->events[k];
        }
        ++sum->n_events;
    }
#endif
}

/* 1 if any of a step was captured, which is of first order. */
static int sg_is_captured(const SG(info) * info) {
#if SG_LOCATED
    return info->captured > 0;
#else
    (void)info;
    return 0;
#endif
}

/* 1 if all events of a step have room in its info. */
static int sg_has_room(const SG(info) * info) {
#if SG_LOCATED
    return info->n_events <= SG_N_EVENTS;
#else
    (void)info;
    return 1;
#endif
}

/* 1 if steps have the order 2s - 2 through all that may happen in them. */
static int sg_is_smooth(const SG(options) * opt) {
#if SG_LOCATED
    return SG_N_CONTACTS == 0 || opt->events == SG_K(EVENTS_LOCATED);
#else
    (void)opt;
    return 1;
#endif
}

/* Where the parts of a step end, counted from its start: in the middles of the segments of the step
   taken as a whole, which *info reports, so that each of them is taken as two, and with the step.
 */
static void sg_divide(SG(control) * c, real t, real h, const SG(info) * info) {
    int n = 0;
    real begin = SG_C(0.0);
#if SG_LOCATED
    int k;
    for (k = 0; k <= info->n_events && k < SG_N_EVENTS; ++k) {
        const real end = (k < info->n_events ? info->events[k].t
                          : info->captured   ? info->t_captured
                                             : t) -
                         t;
        if (end - begin > SG_SHORTEST * h && h - end > SG_SHORTEST * h) {
            c->parts[n] = SG_C(0.5) * (begin + end);
            ++n;
            begin = end;
        }
    }
#else
    (void)t;
    (void)info;
#endif
    c->parts[n] = SG_C(0.5) * (begin + h);
    c->parts[n + 1] = h;
    c->n_parts = n + 2;
}

/* One attempt at a step of size h: its parts end in c->split, what they report stands in c->sum.
 *error is the estimate of their error. */
static int sg_attempt_parts(const SG(state) * s, SG(work) * w, SG(info) * info,
                            const SG(params) * par, const SG(options) * opt, const real u[], real h,
                            SG(control) * c, real *error) {
    real done = SG_C(0.0);
    int status, part;
    c->whole = *s;
    status = SG(step)(&c->whole, w, info, par, opt, u, h);
    c->iterations += info->iterations;
    c->split = *s;
    sg_divide(c, s->t, h, info);
    sg_reset_info(&c->sum);
    for (part = 0; part < c->n_parts && status <= SG_K(OK_SUBSTEPPED); ++part) {
        status = SG(step)(&c->split, w, info, par, opt, u, c->parts[part] - done);
        c->iterations += info->iterations;
        sg_add_info(&c->sum, info);
        done = c->parts[part];
    }
    *error = SG_HUGE;
    if (status <= SG_K(OK_SUBSTEPPED) && sg_has_room(&c->sum)) {
        const real apart = sg_apart(c, c->whole.q, c->whole.v, c->split.q, c->split.v);
        const real gain = sg_is_captured(&c->sum) ? SG_C(1.0) : sg_gain() - SG_C(1.0);
        *error = sg_finite(apart) ? apart / gain : SG_HUGE;
    }
    return status;
}

/* Take over an attempt that was good enough, or as small as steps may be. */
static void sg_keep_parts(SG(state) * s, SG(control) * c, real h, real t_end, int last, real error,
                          int missed) {
    *s = c->split;
    if (last) {
        s->t = t_end; /* the sum of two halves, but for rounding */
    }
    c->taken = h;
    c->estimate += error;
    ++c->steps;
    if (missed) {
        if (c->missed == 0) {
            c->t_missed = s->t;
        }
        ++c->missed;
    }
}

int SG(step_within)(SG(state) * s, SG(work) * w, SG(info) * info, const SG(params) * par,
                    const SG(options) * opt, const real u[], real t_end, SG(control) * c) {
    int attempt;
    int status = SG_K(BAD_ARGUMENT);
    if (info != NULL) {
        sg_reset_info(info);
        info->status = status;
    }
    if (s == NULL || w == NULL || info == NULL || par == NULL || opt == NULL || c == NULL ||
        !sg_finite(t_end) || !(s->t < t_end) || !sg_is_control(c) || !sg_is_smooth(opt)) {
        return status;
    }
    c->iterations = 0;
    for (attempt = 0; attempt < SG_MOST_ATTEMPTS; ++attempt) {
        const real left = t_end - s->t;
        const real h = sg_next_step(c, left);
        const real least = sg_min(SG_LEAST_STEP * c->span, left);
        real allowed, error, change;
        status = sg_attempt_parts(s, w, info, par, opt, u, h, c, &error);
        if (status > SG_K(OK_SUBSTEPPED)) {
            if (h <= least) {
                return status;
            }
            c->h = SG_C(0.5) * h;
            ++c->rejected;
            continue;
        }
        allowed = sg_max(c->error * h / c->span, sg_apart_rounded(c, s));
        change = sg_min(
            sg_max(SG_MARGIN * sg_root_of_order(allowed / sg_max(error, SG_TINY)), SG_SHRINK),
            SG_GROW);
        if (error <= allowed || h <= least) {
            sg_keep_parts(s, c, h, t_end, h == left, error, !(error <= allowed));
            *info = c->sum;
            info->iterations = c->iterations;
            /* a step that was cut to the end says nothing against a larger one */
            c->h = sg_max((attempt > 0 ? sg_min(change, SG_C(1.0)) : change) * h,
                          h < c->h ? c->h : SG_C(0.0));
            return info->status;
        }
        c->h = sg_max(sg_min(change, SG_MARGIN) * h, least);
        ++c->rejected;
    }
    return SG_K(NOT_CONVERGED);
}

int SG(advance_to)(SG(state) * s, SG(work) * w, SG(info) * info, const SG(params) * par,
                   const SG(options) * opt, const real u[], real t_end, SG(control) * c) {
    int status = SG(step_within)(s, w, info, par, opt, u, t_end, c);
    while (status <= SG_K(OK_SUBSTEPPED) && s->t < t_end) {
        c->before = *info;
        status = SG(step_within)(s, w, info, par, opt, u, t_end, c);
        if (status <= SG_K(OK_SUBSTEPPED)) {
            sg_add_info(&c->before, info);
            *info = c->before;
            status = info->status;
        }
    }
    return status;
}

int SG(simulate_within)(SG(state) * s, SG(work) * w, SG(info) * info, const SG(params) * par,
                        const SG(options) * opt, const real u[], real h, int n_steps, int every,
                        const SG(record) * record, int *done, SG(control) * c) {
    const int begun = record != NULL ? record->begun : 0;
    int step;
    if (done == NULL || n_steps < 0 || every < 1 || begun < 0 || begun >= every || s == NULL ||
        w == NULL || info == NULL || par == NULL || c == NULL || (SG_N_U > 0 && u == NULL) ||
        !(h >= SG_C(0.0)) || !sg_finite(h)) {
        return SG_K(BAD_ARGUMENT);
    }
    for (*done = 0, step = 0; step < n_steps && (h > SG_C(0.0) || s->t < c->t_end); ++step) {
        const long row = step / every + (step % every + begun) / every;
        const real t_end = h > SG_C(0.0) ? c->t_start + (c->intervals + SG_C(1.0)) * h : c->t_end;
        const real *held = SG_N_U == 0 ? NULL : h > SG_C(0.0) ? &u[step * SG_N_U] : u;
        int first = (step % every + begun) % every == 0;
        do {
            sg_before before;
            int status;
            sg_remember_before(&before, record, s, par);
            status = SG(step_within)(s, w, info, par, opt, held, t_end, c);
            if (status > SG_K(OK_SUBSTEPPED)) {
                return status;
            }
            if (record != NULL) {
                sg_record_step(record, row, first, &before, s, w, info, par, opt);
            }
            first = 0;
        } while (h > SG_C(0.0) && s->t < t_end);
        if (c->estimates != NULL) {
            c->estimates[row] = c->estimate;
        }
        c->intervals += SG_C(1.0);
        ++*done;
    }
    return SG_K(OK);
}
