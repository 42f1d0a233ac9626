#pragma once
#include "sg_step.c"

/* Parts of a model that nothing couples take their steps one by one: each with its own iterations,
   rescues and substeps, bit for bit as if it were alone. */

/* 1 if the stages in the work struct are those of the whole step. */
static int sg_has_stages(const SG(part) * s, const SG(report) * info) {
#if SG_LOCATED
    return info->substeps == 0 &&
           (!s->located || info->captured == 2 || (s->segment == 1 && info->n_events == 0));
#else
    (void)s;
    return info->substeps == 0;
#endif
}

#if SG_N_PARTS > 1
static void sg_reset_info(SG(info) * info) {
    int k;
    for (k = 0; k < SG_N_CONTACTS; ++k) {
        info->contact[k] = SG_K(UNKNOWN);
        info->impacts[k] = 0;
    }
    info->status = SG_K(OK);
    info->iterations = 0;
    info->substeps = 0;
    info->rescues = 0;
    info->percussions = SG_UNIQUE;
    info->lost_impacts = 0;
    info->residual = SG_C(0.0);
    info->smallest_gap = SG_HUGE;
    sg_fill(SG_N_R, SG_C(0.0), info->P);
#if SG_LOCATED
    info->captured = 0;
    info->t_captured = SG_C(0.0);
    info->n_events = 0;
#endif
    info->islands = 0;
    info->largest = 0;
    info->rescued = -1;
    info->failed = -1;
}

/* Add the numbers that the step of a part or island reports to those of the step. */
static void sg_add_report(SG(info) * info, const SG(report) * own) {
    info->iterations += own->iterations;
    info->substeps += own->substeps;
    info->rescues |= own->rescues;
    info->percussions = own->percussions > info->percussions ? own->percussions : info->percussions;
    info->lost_impacts += own->lost_impacts;
    info->residual = sg_max(info->residual, own->residual);
    info->smallest_gap = sg_min(info->smallest_gap, own->smallest_gap);
#if SG_LOCATED
    if (own->captured > 0) {
        info->t_captured =
            info->captured == 0 ? own->t_captured : sg_min(info->t_captured, own->t_captured);
    }
    info->captured = own->captured > info->captured ? own->captured : info->captured;
#endif
}

#if !SG_JOINS
/* Take up a part: *own, what it goes on from, at the time, place and velocity of the model. */
static void sg_enter_part(SG(work) * w, const SG(state) * s, SG(part) * own, int part) {
    const int *at = sg_coordinates_of(part);
    int j;
    w->number = part;
    w->kind = sg_parts[part].kind;
#if SG_N_OWN > 0
    w->own = &sg_own[sg_parts[part].own];
#endif
    own->t = s->t;
    for (j = 0; j < sg_n_q(w); ++j) {
        own->q[j] = s->q[at[j]];
        own->v[j] = s->v[at[j]];
    }
}

#if SG_LOCATED
/* Events of a part among those of the step, by their times. */
static void sg_merge_events(SG(info) * info, const SG(report) * own, const int *contacts) {
    int i, k;
    for (i = 0; i < own->n_events && i < SG_MOST_EVENTS; ++i) {
        SG(event) event = own->events[i];
        event.contact = contacts[event.contact];
        for (k = info->n_events; k > 0 && info->events[k - 1].t > event.t; --k) {
            info->events[k] = info->events[k - 1];
        }
        info->events[k] = event;
        ++info->n_events;
    }
}
#endif

/* Add what the step of a part reports to what the others do. */
static void sg_gather(SG(work) * w, SG(info) * info, int part) {
    const SG(report) *own = &w->report;
    const int *contacts = sg_contacts_of(part);
    const int *rows = sg_rows_of(part);
    int k;
    sg_add_report(info, own);
    for (k = 0; k < sg_n_R(w); ++k) {
        info->P[rows[k]] = own->P[k];
    }
    for (k = 0; k < sg_n_contacts(w); ++k) {
        info->contact[contacts[k]] = own->contact[k];
        info->impacts[contacts[k]] = own->impacts[k];
        w->exists[contacts[k]] = w->found.exists[k];
    }
#if SG_LOCATED
    sg_merge_events(info, own, contacts);
#endif
    ++info->islands;
    info->largest = 1;
    if (info->rescued < 0 && (own->rescues > 0 || own->substeps > 0)) {
        info->rescued = part;
    }
}

/* Stages of a part among those of the model. */
static void sg_keep_stages(SG(work) * w, int part) {
    const int *at = sg_coordinates_of(part);
    const int *rows = sg_rows_of(part);
    int i, j;
    w->staged = w->staged && sg_has_stages(&w->trial, &w->report);
    if (w->staged) {
        SG(part_stages)(w->kind, w, w->stage_t, w->part_q, w->part_v, w->part_R);
        for (i = 0; i < SG_N_STAGES; ++i) {
            for (j = 0; j < sg_n_q(w); ++j) {
                w->stage_q[i * SG_N_Q + at[j]] = w->part_q[i * sg_n_q(w) + j];
                w->stage_v[i * SG_N_Q + at[j]] = w->part_v[i * sg_n_q(w) + j];
            }
            for (j = 0; j < sg_n_R(w); ++j) {
                w->stage_R[i * SG_N_R + rows[j]] = w->part_R[i * sg_n_R(w) + j];
            }
        }
    }
}

/* What the parts are behind the step is what the model is. */
static void sg_follow_parts(SG(state) * s, const SG(work) * w) {
    int j, part;
    for (part = 0; part < SG_N_PARTS; ++part) {
        const sg_kind *kind = &sg_kinds[sg_parts[part].kind];
        const int *at = sg_coordinates_of(part);
        const int *contacts = sg_contacts_of(part);
        s->part[part] = w->next[part];
        for (j = 0; j < kind->n_q; ++j) {
            s->q[at[j]] = w->next[part].q[j];
            s->v[at[j]] = w->next[part].v[j];
        }
        for (j = 0; j < kind->n_contacts; ++j) {
            s->contact[contacts[j]] = w->next[part].contact[j];
        }
    }
}

static int sg_step_islands(SG(state) * s, SG(work) * w, SG(info) * info, const SG(params) * par,
                           const SG(options) * opt, real h) {
    int part;
    w->staged = 1;
    for (part = 0; part < SG_N_PARTS; ++part) {
        int status;
        w->trial = s->part[part];
        sg_enter_part(w, s, &w->trial, part);
        w->next[part] = w->trial;
        sg_reset_report(&w->report, sg_n_contacts(w), sg_n_R(w));
        status = sg_step_part(&w->next[part], w, &w->report, par, opt, h);
        if (status != SG_K(OK)) {
            const int used = info->iterations + w->report.iterations;
            sg_reset_info(info);
            info->iterations = used;
            info->failed = part;
            return status;
        }
        sg_gather(w, info, part);
        sg_keep_stages(w, part);
        w->next[part] = w->trial;
    }
    sg_follow_parts(s, w);
    return SG_K(OK);
}

#endif

/* The energy of the model. */
static real sg_energy_at(real t, const real q[], const real v[], const SG(params) * par) {
    real own_q[SG_MOST_Q], own_v[SG_MOST_Q];
    real sum = SG_C(0.0);
    int j, part;
    for (part = 0; part < SG_N_PARTS; ++part) {
        const int *at = sg_coordinates_of(part);
        real E[1];
        for (j = 0; j < sg_kinds[sg_parts[part].kind].n_q; ++j) {
            own_q[j] = q[at[j]];
            own_v[j] = v[at[j]];
        }
        SG(part_energy)(part, t, own_q, own_v, par, E);
        sum += E[0];
    }
    return sum;
}

/* 1 if contact k of the model existed in the step. */
static inline int sg_exists(const SG(work) * w, int k) { return w->exists[k]; }

/* The stages of a step; 0 if the step was not solved as a whole. */
static int sg_give_stages(const SG(state) * s, const SG(work) * w, const SG(info) * info,
                          real stage_t[], real stage_q[], real stage_v[], real stage_R[]) {
    (void)s;
    (void)info;
    sg_copy(SG_N_STAGES, w->stage_t, stage_t);
    sg_copy(SG_N_STAGES * SG_N_Q, w->stage_q, stage_q);
    sg_copy(SG_N_STAGES * SG_N_Q, w->stage_v, stage_v);
    sg_copy(SG_N_STAGES * SG_N_R, w->stage_R, stage_R);
    return w->staged;
}
#else
/* The energy of the model. */
static real sg_energy_at(real t, const real q[], const real v[], const SG(params) * par) {
    real E[1];
    SG(part_energy)(0, t, q, v, par, E);
    return E[0];
}

/* 1 if contact k existed in the step. */
static inline int sg_exists(const SG(work) * w, int k) { return w->found.exists[k]; }

/* The stages of a step; 0 if the step was not solved as a whole. */
static int sg_give_stages(const SG(state) * s, const SG(work) * w, const SG(info) * info,
                          real stage_t[], real stage_q[], real stage_v[], real stage_R[]) {
    SG(part_stages)(0, w, stage_t, stage_q, stage_v, stage_R);
    return sg_has_stages(s, info);
}
#endif
