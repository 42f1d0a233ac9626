#pragma once
#include "sg_forward_place.c"

/* Derivatives of a located step along directions, exact: of its segments and impacts, chained over
   events whose times change, too. */

/* The solved segment once more: its unknowns in the problem, with rows as the modes say. */
static void sg_stand_in(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                        int problem) {
    sg_prox_parameters(w, opt, problem);
    sg_say_modes(w, problem);
    w->segment.held = 1;
    sg_evaluate(w, par, opt, problem);
    w->segment.held = 0;
    SG(derivatives)(w, par, problem);
}

/* Changes of the end of a segment of one problem, with its size as it is, and by its size; of its
   positions, where velocities at the end are another problem: then its rows are asked, too. */
static void sg_forward_stages(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                              int problem, int end) {
    SG(directions) *d = &w->directions;
    SG(forward) *f = &w->forward;
    const sg_problem *pr = sg_problem_at(w, end);
    const real part = w->segment.span / w->segment.h;
    int j;
    sg_stand_in(w, par, opt, problem);
    if (end != problem) {
        SG(values)(w, par, end);
    }
    for (j = 0; j <= d->count; ++j) {
        const real longer = j == d->count ? SG_C(1.0) : SG_C(0.0);
        sg_turn_to(w, par, j, longer);
        sg_change_given(w, j, part, longer / w->segment.h, 1);
        sg_solve_forward(w, par, opt, problem, j);
        if (end == problem) {
            SG(places_forward)(w);
            SG(finish_segment_forward)(w);
            sg_copy(sg_n_q(w), f->v_end, &d->v_end[j * sg_n_q(w)]);
        } else {
            SG(values_forward)(w, par, problem); /* of all that follows from the unknowns */
            sg_ask_forward(w, par, end);
            sg_copy(pr->n_x, f->r, &d->r[j * SG_N_X]);
            sg_copy(pr->n_slots * sg_n_R(w), f->y, &d->y[j * SG_N_ROWS]);
            SG(finish_forward)(w);
        }
        sg_copy(sg_n_q(w), f->q_end, &d->q_end[j * sg_n_q(w)]);
    }
}

/* Changes of the end of the segment at hand. */
static void sg_forward_end(SG(work) * w, const SG(params) * par, const SG(options) * opt) {
    SG(directions) *d = &w->directions;
    const int last = SG_N_CHAIN - 1;
    const sg_problem *pr = sg_problem_at(w, last);
    int j;
    if (w->segment.rubs) {
        sg_forward_stages(w, par, opt, SG_SEGMENT, SG_SEGMENT);
        return;
    }
    sg_forward_stages(w, par, opt, 0, last);
    sg_stand_in(w, par, opt, last);
    for (j = 0; j <= d->count; ++j) {
        sg_copy(pr->n_x, &d->r[j * SG_N_X], w->forward.r);
        sg_copy(pr->n_slots * sg_n_R(w), &d->y[j * SG_N_ROWS], w->forward.y);
        sg_answer_forward(w, opt, last, j);
        sg_copy(sg_n_q(w), &w->forward.x[pr->x], &d->v_end[j * sg_n_q(w)]);
    }
}

/* Direction j moves to the end of the segment, with its size as it is; the last goes along it. */
static void sg_move_to_end(SG(work) * w) {
    SG(directions) *d = &w->directions;
    d->t[d->count] = SG_C(1.0);
    sg_copy((d->count + 1) * sg_n_q(w), d->q_end, d->q);
    sg_copy((d->count + 1) * sg_n_q(w), d->v_end, d->v);
}

/* The segment has no length, because a step ended where its event is: the state and its changes
   stay, time would go on as it did. */
static void sg_stay(SG(work) * w) {
    SG(directions) *d = &w->directions;
    int i;
    d->t[d->count] = SG_C(1.0);
    for (i = 0; i < sg_n_q(w); ++i) {
        d->q[d->count * sg_n_q(w) + i] = w->segment.v[i];
        d->v[d->count * sg_n_q(w) + i] = w->segment.acceleration[i] / w->segment.h;
    }
    sg_copy(sg_n_q(w), w->segment.q, w->q_end);
    sg_copy(sg_n_q(w), w->segment.v, w->v_end);
    if (!w->segment.known) {
        sg_lose(w, SG_TOGETHER, -1);
    }
}

/* Change of an event function of gaps, slips and guards along the direction at hand. */
static real sg_event_forward(const SG(work) * w, const sg_happening *event) {
    const SG(forward) *f = &w->forward;
    const sg_contact *contact = sg_contact_at(w, event->contact);
    real along = SG_C(0.0);
    int e;
    if (event->what == SG_GAP_CLOSES) {
        return f->gap[contact->normal];
    }
    if (event->what == SG_GUARD_TURNS) {
        return f->guard_there[event->contact];
    }
    for (e = 0; e < contact->components; ++e) {
        along += f->slip_rate[contact->friction + e] * w->segment.direction[contact->friction + e];
    }
    return along;
}

/* The same of forces: the normal percussion, or what is left of the radius. */
static real sg_force_forward(const SG(work) * w, const sg_happening *event, int j) {
    const SG(directions) *d = &w->directions;
    const sg_contact *contact = sg_contact_at(w, event->contact);
    const real *force = &d->force[j * sg_n_R(w)];
    const int n = sg_first_normal(w) + contact->pressing;
    const int f = sg_first_slip(w) + contact->friction;
    const real *F = &w->segment.force[f];
    const real size = sg_norm(contact->components, F);
    real change;
    int e;
    if (event->what == SG_FORCE_ENDS) {
        return force[n];
    }
    change = contact->pressing >= 0 ? w->segment.mu[event->contact] * force[n] +
                                          w->forward.mu[event->contact] * w->segment.force[n]
                                    : d->bound[j * sg_n_bounds(w) + contact->bound];
    for (e = 0; e < contact->components; ++e) {
        change -= F[e] / size * force[f + e];
    }
    return change;
}

/* Changes of the event function at the end of the segment. */
static void sg_forward_event(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                             SG(report) * info, const sg_happening *event) {
    SG(directions) *d = &w->directions;
    const int forces = event->what == SG_FORCE_ENDS || event->what == SG_SLIP_BEGINS;
    const real t = w->segment.t + w->segment.span;
    int j;
    if (forces) {
        if (sg_visit(w, par, opt, info, t, w->q_end, w->v_end) != SG_K(OK)) {
            sg_lose(w, SG_IS_SINGULAR, event->contact);
        }
        sg_forward_forces(w, par, opt, d->count);
    } else {
        sg_look(w, par, t, w->q_end, w->v_end);
    }
    for (j = 0; j <= d->count; ++j) {
        if (forces) {
            sg_turn_to(w, par, j, SG_C(0.0));
            d->event[j] = sg_force_forward(w, event, j);
        } else {
            w->forward.t = d->t[j];
            sg_copy(sg_n_q(w), &d->q[j * sg_n_q(w)], w->forward.q);
            sg_copy(sg_n_q(w), &d->v[j * sg_n_q(w)], w->forward.v);
            SG(change_parameters)(w, &d->par[j * SG_N_PAR]);
            sg_look_forward(w, par);
            d->event[j] = sg_event_forward(w, event);
        }
    }
}

/* How the end of the segment just accepted changes: events move in time, the step's end by what is
   said of it. */
static void sg_forward_segment(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                               SG(report) * info, const sg_happening *event) {
    SG(directions) *d = &w->directions;
    const int last = d->count;
    int i, j;
    if (sg_return(w, par) != SG_K(OK)) {
        sg_lose(w, SG_IS_SINGULAR, -1);
        return;
    }
    if (w->segment.span > SG_C(0.0)) {
        if (d->near > 0 && d->near_at < event->at) {
            sg_lose(w, SG_GRAZES, d->near - 1);
        }
        if (event->what != SG_NOTHING && w->segment.span < SG_TOUCH * w->segment.h) {
            sg_lose(w, SG_TOGETHER, event->contact);
        }
        sg_measure_motion(w, w->segment.span);
        sg_say_given(w, w->segment.span);
        d->t[last] = SG_C(0.0);
        sg_fill(sg_n_q(w), SG_C(0.0), &d->q[last * sg_n_q(w)]);
        sg_fill(sg_n_q(w), SG_C(0.0), &d->v[last * sg_n_q(w)]);
        sg_forward_end(w, par, opt);
        sg_move_to_end(w);
    } else {
        sg_stay(w);
    }
    if (event->what != SG_NOTHING) {
        sg_forward_event(w, par, opt, info, event);
        if (!(SG_FABS(d->event[last]) > SG_TINY)) {
            sg_lose(w, SG_GRAZES, event->contact);
        }
    }
    for (j = 0; j < last; ++j) {
        const real longer =
            event->what == SG_NOTHING ? d->grid[j] - d->t[j] : -(d->event[j] / d->event[last]);
        d->t[j] += longer;
        for (i = 0; i < sg_n_q(w); ++i) {
            d->q[j * sg_n_q(w) + i] += longer * d->q[last * sg_n_q(w) + i];
            d->v[j * sg_n_q(w) + i] += longer * d->v[last * sg_n_q(w) + i];
        }
    }
}
