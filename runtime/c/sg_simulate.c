#pragma once
#include "sg_notes.c"
#include "sg_islands.c"
#include "sg_step.c"

/* Start, many steps, and the evaluation of one problem at given unknowns. */

/* 1 if |value| is small against the terms of its row. The constant covers terms that only
   parameters make up. */
static int sg_is_consistent(real value, real size) {
    return SG_FABS(value) <= SG_STAGNATION * size + SG_C(64.0) * SG_EPS;
}

/* Position constraints and gaps of existing contacts of a part at the start. */
static int sg_check_places(const sg_kind *kind, const SG(consistency) * at) {
    int c, k;
    for (c = 0; c < kind->n_g; ++c) {
        if (!sg_finite(at->value[c])) {
            return SG_K(NONFINITE);
        }
        if (!sg_is_consistent(at->value[c], at->size[c])) {
            return SG_K(INCONSISTENT_START);
        }
    }
    for (k = 0; k < kind->n_contacts; ++k) {
        const sg_contact *contact = &kind->contacts[k];
        const int n = kind->n_g + kind->n_gamma + contact->normal;
        if (!sg_finite(at->guard[k])) {
            return SG_K(NONFINITE);
        }
        if (contact->normal >= 0 && !(contact->guarded && at->guard[k] < SG_C(0.0))) {
            if (!sg_finite(at->value[n])) {
                return SG_K(NONFINITE);
            }
            if (at->value[n] < SG_C(0.0) && !sg_is_consistent(at->value[n], at->size[n])) {
                return SG_K(INCONSISTENT_START);
            }
        }
    }
    return SG_K(OK);
}

/* Velocity constraints and the velocities of position constraints at the start. */
static int sg_check_rates(const sg_kind *kind, const SG(consistency) * at) {
    int c;
    for (c = 0; c < kind->n_g + kind->n_gamma; ++c) {
        if (!sg_finite(at->value[c])) {
            return SG_K(NONFINITE);
        }
        if (!sg_is_consistent(at->value[c], at->size[c])) {
            return SG_K(INCONSISTENT_START);
        }
    }
    return SG_K(OK);
}

/* Whether a run may start with a part at (t, q, v). */
static int sg_check_start(int part, const SG(params) * par, real t, const real q[],
                          const real v[]) {
    SG(consistency) at;
    int status;
#if SG_N_PARTS > 1
    const sg_kind *kind = &sg_kinds[sg_parts[part].kind];
#else
    const sg_kind *kind = &sg_kinds[0];
#endif
    SG(part_places)(part, t, q, par, &at);
    status = sg_check_places(kind, &at);
    if (status == SG_K(OK)) {
        SG(part_rates)(part, t, q, v, par, &at);
        status = sg_check_rates(kind, &at);
    }
    return status;
}

int SG(init)(SG(state) * s, const SG(params) * par, const SG(options) * opt, real t0,
             const real q0[], const real v0[]) {
    int status = SG_K(OK);
#if SG_N_PARTS > 1
    real q[SG_MOST_Q], v[SG_MOST_Q];
    int j, part;
#endif
    if (s == NULL || par == NULL || opt == NULL || q0 == NULL || v0 == NULL || !sg_finite(t0) ||
        !sg_all_finite(SG_N_Q, q0) || !sg_all_finite(SG_N_Q, v0) || !sg_are_options(opt)) {
        return SG_K(BAD_ARGUMENT);
    }
#if SG_N_PARTS > 1
    for (part = 0; part < SG_N_ELEMENTS && status == SG_K(OK); ++part) {
        const int *at = sg_coordinates_of(part);
        for (j = 0; j < sg_kinds[sg_parts[part].kind].n_q; ++j) {
            q[j] = q0[at[j]];
            v[j] = v0[at[j]];
        }
        status = sg_check_start(part, par, t0, q, v);
    }
#else
    status = sg_check_start(0, par, t0, q0, v0);
#endif
    return status == SG_K(OK) ? SG(set_state)(s, t0, q0, v0) : status;
}

/* What the events of a step need from before it. */
typedef struct {
    real energy;
    int contact[SG_N_CONTACTS > 0 ? SG_N_CONTACTS : 1];
} sg_before;

/* Add the events of a step. */
static void sg_note(const SG(record) * to, const sg_before *before, real t, real energy,
                    const SG(work) * w, const SG(info) * info) {
    int d, k;
    for (k = 0; k < SG_N_CONTACTS; ++k) {
        const sg_contact *contact = &sg_contacts[k];
        const int kind =
            sg_event_kind(before->contact[k], info->contact[k], info->impacts[k], sg_exists(w, k));
        if (kind < 0) {
            continue;
        }
        if (*to->n_events < to->max_events) {
            SG(event) *event = &to->events[*to->n_events];
            event->t = t;
            event->contact = k;
            event->kind = kind;
            event->P_N = contact->normal < 0 ? SG_C(0.0) : info->P[SG_NORMAL + contact->normal];
            for (d = 0; d < SG_N_SLIP; ++d) {
                event->P_F[d] =
                    d < contact->components ? info->P[SG_SLIP + contact->friction + d] : SG_C(0.0);
            }
            event->energy = kind == SG_K(EVENT_IMPACT) ? energy - before->energy : SG_C(0.0);
        }
        ++*to->n_events;
    }
}

#if SG_LOCATED
/* Add those of a located step, which lists them itself. */
static void sg_note_located(const SG(record) * to, const SG(info) * info) {
    int k;
    for (k = 0; k < info->n_events && k < SG_N_EVENTS; ++k) {
        if (*to->n_events < to->max_events) {
            to->events[*to->n_events] = info->events[k];
        }
        ++*to->n_events;
    }
}
#endif

/* Counts of a step, added to those of its row. */
static void sg_count(int *counts, int first, const SG(info) * info) {
    int k;
    for (k = 0; k < SG_COUNTS && first; ++k) {
        counts[k] = 0;
    }
    counts[0] = info->status > counts[0] ? info->status : counts[0];
    counts[1] += info->iterations;
    counts[2] += info->substeps;
    counts[3] |= info->rescues;
    counts[4] = info->percussions > counts[4] ? info->percussions : counts[4];
    counts[5] += info->lost_impacts;
    for (k = 0; k < SG_N_CONTACTS; ++k) {
        counts[6] += info->impacts[k];
    }
#if SG_LOCATED
    counts[7] |= info->captured > 0;
#endif
#if SG_N_PARTS > 1
    counts[8] = first || info->islands < counts[8] ? info->islands : counts[8];
    counts[9] = info->largest > counts[9] ? info->largest : counts[9];
#else
    counts[8] = counts[9] = 1;
#endif
}

/* Row `row` of the record after a step; `first`: it is the first step of the row. */
static void sg_record(const SG(record) * to, long row, int first, const SG(state) * s,
                      const SG(work) * w, const SG(info) * info) {
    int k;
    if (to->t != NULL) {
        to->t[row] = s->t;
    }
    if (to->q != NULL) {
        sg_copy(SG_N_Q, s->q, &to->q[row * SG_N_Q]);
    }
    if (to->v != NULL) {
        sg_copy(SG_N_Q, s->v, &to->v[row * SG_N_Q]);
    }
    for (k = 0; k < SG_N_R && to->P != NULL; ++k) {
        to->P[row * SG_N_R + k] = first ? info->P[k] : to->P[row * SG_N_R + k] + info->P[k];
    }
    if (to->residual != NULL) {
        to->residual[row] = first ? info->residual : sg_max(to->residual[row], info->residual);
    }
    if (to->smallest_gap != NULL) {
        to->smallest_gap[row] =
            first ? info->smallest_gap : sg_min(to->smallest_gap[row], info->smallest_gap);
    }
    if (to->counts != NULL) {
        sg_count(&to->counts[row * SG_COUNTS], first, info);
    }
    for (k = 0; k < SG_N_CONTACTS && to->contact != NULL; ++k) {
        to->contact[row * SG_N_CONTACTS + k] = info->contact[k];
    }
    if (to->stage_t != NULL && to->stage_q != NULL && to->stage_v != NULL && to->stage_R != NULL) {
        real *stage_t = &to->stage_t[row * SG_N_STAGES];
        real *stage_q = &to->stage_q[row * SG_N_STAGES * SG_N_Q];
        real *stage_v = &to->stage_v[row * SG_N_STAGES * SG_N_Q];
        real *stage_R = &to->stage_R[row * SG_N_STAGES * SG_N_R];
        if (!sg_give_stages(s, w, info, stage_t, stage_q, stage_v, stage_R)) {
            /* those of the last part are not those of the step */
            sg_fill(SG_N_STAGES, SG_NAN, stage_t);
            sg_fill(SG_N_STAGES * SG_N_Q, SG_NAN, stage_q);
            sg_fill(SG_N_STAGES * SG_N_Q, SG_NAN, stage_v);
            sg_fill(SG_N_STAGES * SG_N_R, SG_NAN, stage_R);
        }
    }
}

/* 1 if events, 2 if energies are to be recorded; their sum. */
static int sg_wanted(const SG(record) * to) {
    const int notes = to != NULL && to->events != NULL && to->n_events != NULL;
    return notes + (to != NULL && to->energy != NULL ? 2 : 0);
}

/* What the record of a step needs from before it. */
static void sg_remember_before(sg_before *before, const SG(record) * to, const SG(state) * s,
                               const SG(params) * par) {
    int k;
    for (k = 0; k < SG_N_CONTACTS; ++k) {
        before->contact[k] = s->contact[k];
    }
    before->energy = sg_wanted(to) ? sg_energy_at(s->t, s->q, s->v, par) : SG_C(0.0);
}

/* A step that was taken goes into row `row` of the record. */
static void sg_record_step(const SG(record) * to, long row, int first, const sg_before *before,
                           const SG(state) * s, const SG(work) * w, const SG(info) * info,
                           const SG(params) * par, const SG(options) * opt) {
    const int wanted = sg_wanted(to);
    sg_record(to, row, first, s, w, info);
    if (wanted) {
        const real energy = sg_energy_at(s->t, s->q, s->v, par);
        if (to->energy != NULL) {
            real *range = &to->energy[2 * row];
            range[0] = first ? energy : sg_min(range[0], energy);
            range[1] = first ? energy : sg_max(range[1], energy);
        }
#if SG_LOCATED
        if (wanted % 2 == 1 && opt->events == SG_K(EVENTS_LOCATED)) {
            sg_note_located(to, info);
            return;
        }
#endif
        if (wanted % 2 == 1) {
            sg_note(to, before, s->t, energy, w, info);
        }
    }
    (void)opt;
}

int SG(simulate)(SG(state) * s, SG(work) * w, SG(info) * info, const SG(params) * par,
                 const SG(options) * opt, const real u[], real h, int n_steps, int every,
                 const SG(record) * record, int *done) {
    const int begun = record != NULL ? record->begun : 0;
    int step;
    if (done == NULL || n_steps < 0 || every < 1 || begun < 0 || begun >= every || s == NULL ||
        w == NULL || info == NULL || par == NULL || (SG_N_U > 0 && u == NULL)) {
        return SG_K(BAD_ARGUMENT);
    }
    for (*done = 0, step = 0; step < n_steps; ++step) {
        const long row = step / every + (step % every + begun) / every;
        const int first = (step % every + begun) % every == 0;
        sg_before before;
        int status;
        sg_remember_before(&before, record, s, par);
        status = SG(step)(s, w, info, par, opt, SG_N_U > 0 ? &u[step * SG_N_U] : u, h);
        if (status > SG_K(OK_SUBSTEPPED)) {
            return status;
        }
        ++*done;
        if (record != NULL) {
            sg_record_step(record, row, first, &before, s, w, info, par, opt);
        }
    }
    return SG_K(OK);
}

/* Residual and Jacobian of a problem of the part at hand, from its state *s. */
static int sg_evaluate_problem(const SG(part) * s, SG(work) * w, const SG(params) * par,
                               const SG(options) * opt, real h, int problem, const real x[],
                               const real R[]) {
    const sg_problem *last = sg_problem_at(w, SG_N_PROBLEMS - 1);
    SG(report) info;
    int k;
    sg_reset_report(&info, sg_n_contacts(w), sg_n_R(w));
    w->newton.mode = SG_FIRST_ATTEMPT;
    w->smooth.pivoting = 0;
    sg_copy(last->x + last->n_x, x, w->x);
    sg_copy(last->R + last->n_slots * sg_n_R(w), R, w->R);
    w->trial = *s;
    sg_begin(w, par, s->t, h);
    if (!sg_elliptic_begin(w)) {
        return SG_K(BAD_ARGUMENT);
    }
    if (!sg_masses(w)) {
        return SG_K(SINGULAR);
    }
    for (k = 0; k < sg_n_contacts(w); ++k) {
        w->found.exists[k] = !sg_contact_at(w, k)->guarded || w->guard[k] >= SG_C(0.0);
        w->found.active[k] = w->found.exists[k];
    }
#if SG_LOCATED
    w->segment.held = 0;
    w->look_t = s->t;
    sg_copy(sg_n_q(w), s->q, w->look_q);
    sg_copy(sg_n_q(w), s->v, w->look_v);
#endif
    for (k = problem < SG_N_CHAIN ? 0 : problem; k <= problem; ++k) {
        sg_prox_parameters(w, opt, k);
        sg_evaluate(w, par, opt, k);
        if (k < problem && sg_problem_at(w, k + 1)->follows) {
            sg_activity(w, opt, &info, k);
        }
    }
    SG(derivatives)(w, par, problem);
    return SG_K(OK);
}

#if SG_JOINS
/* The same of all parts and some couplings between them (sg_join.c). */
static int sg_evaluate_joined(const SG(state) * s, SG(work) * w, const SG(params) * par,
                              const SG(options) * opt, real h, int share, int problem,
                              const real x[], const real R[]);
#endif

#if SG_N_PARTS > 1
int SG(problem)(const SG(state) * s, SG(work) * w, const SG(params) * par, const SG(options) * opt,
                const real u[], real h, int part, int problem, const real x[], const real R[]) {
#else
int SG(problem)(const SG(state) * s, SG(work) * w, const SG(params) * par, const SG(options) * opt,
                const real u[], real h, int problem, const real x[], const real R[]) {
#endif
    int j;
    if (s == NULL || w == NULL || par == NULL || opt == NULL || x == NULL || R == NULL ||
        problem < 0 || problem >= SG_N_PROBLEMS || !(h > SG_C(0.0)) || (SG_N_U > 0 && u == NULL)) {
        return SG_K(BAD_ARGUMENT);
    }
    for (j = 0; j < SG_N_U; ++j) {
        w->u[j] = u[j];
    }
#if SG_JOINS
    if (part < 0 || part > 1 + SG_N_COUPLINGS / SG_N_JOINED) {
        return SG_K(BAD_ARGUMENT);
    }
    return sg_evaluate_joined(s, w, par, opt, h, part, problem, x, R);
#elif SG_N_PARTS > 1
    if (part < 0 || part >= SG_N_PARTS) {
        return SG_K(BAD_ARGUMENT);
    }
    w->next[part] = s->part[part];
    sg_enter_part(w, s, &w->next[part], part);
    return sg_evaluate_problem(&w->next[part], w, par, opt, h, problem, x, R);
#else
return sg_evaluate_problem(s, w, par, opt, h, problem, x, R);
#endif
}
