#pragma once
#include "sg_impact.c"
#include "sg_step.c"

/* A step that is cut at its events: impacts and changes of modes happen at one place and time, what
   lies between is smooth. Where that cannot be decided, the rest of the step or all of it is taken
   as if nothing had been looked for. */

#if SG_DERIVATIVES
/* How the end of a segment changes along directions (sg_forward.c). */
static void sg_forward_segment(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                               SG(report) * info, const sg_happening *event);
#endif

/* Contact k opens, and all friction that it presses with it. */
static void sg_impose_open(SG(work) * w, int k) {
    int i;
    for (i = k; i >= 0; i = sg_contact_at(w, i)->next) {
        w->segment.mode[i] = SG_K(OPEN);
    }
}

/* What an event does to its contact before modes are chosen; -1 if they are to be sought. */
static int sg_impose(SG(work) * w, const sg_happening *event) {
    const int k = event->contact;
    const sg_contact *contact = sg_contact_at(w, k);
    int d, i;
    switch (event->what) {
        case SG_FORCE_ENDS:
            sg_impose_open(w, k);
            return k;
        case SG_SLIP_BEGINS:
            for (d = 0; d < contact->components; ++d) {
                w->segment.direction[contact->friction + d] =
                    -w->segment.force[sg_first_slip(w) + contact->friction + d];
            }
            (void)sg_friction_slip(w, k, &w->segment.direction[contact->friction],
                                   &w->segment.direction[contact->friction]);
            w->segment.mode[k] =
                contact->components == 1 && w->segment.direction[contact->friction] < SG_C(0.0)
                    ? SG_K(SLIP_BACK)
                    : SG_K(SLIP);
            return k;
        case SG_GUARD_TURNS:
            sg_impose_open(w, k);
            for (i = k; i >= 0; i = sg_contact_at(w, i)->next) {
                w->segment.turned[i] = w->segment.exists[i] ? SG_TURNED_OFF : SG_TURNED_ON;
            }
            return -1;
        default:
            return -1;
    }
}

/* Value of an event function at the end of the segment just solved. */
static int sg_value_at_end(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                           SG(report) * info, const sg_happening *event, real *value, real *rate) {
    const real t = w->segment.t + w->segment.span;
    int status = SG_K(OK);
    if (event->what == SG_FORCE_ENDS || event->what == SG_SLIP_BEGINS) {
        status = sg_visit(w, par, opt, info, t, w->q_end, w->v_end);
        *value = sg_force_value(w, event->what, event->contact);
        *rate = SG_C(0.0);
    } else {
        sg_look(w, par, t, w->q_end, w->v_end);
        *value = sg_event_value(w, event->what, event->contact, rate);
    }
    return status;
}

/* The next size to try for an event: Newton's or the secant's, within the bracket; its middle where
   that leads out of it, or where the function is not smooth. */
static real sg_next_size(real tau, real value, real slope, real low, real high, int bisect) {
    const real next = slope < SG_C(0.0) ? tau - value / slope : high;
    return bisect || !(next > low && next < high) ? SG_C(0.5) * (low + high) : next;
}

/* Locate an event that the dense output shows: solve the segment up to it, until its function
   vanishes at the end. The segment just solved has the size `rest`. An event that does not exist,
   because the function stays positive, becomes none. */
static int sg_pin(SG(work) * w, const SG(params) * par, const SG(options) * opt, SG(report) * info,
                  sg_happening *event, real rest) {
    const real noise = SG_C(4.0) * SG_EPS * (SG_FABS(w->segment.t) + w->segment.h);
    real tau = event->at * rest;
    real slope = event->slope / rest;
    real before = SG_C(0.0);
    real last = rest; /* size for which the unknowns stand */
    real low = SG_C(0.0);
    real high = rest;
    int falls = 0; /* whether the function was seen to be negative */
    int round;
    if (!(tau > SG_C(0.0))) {
        /* at the start itself, where forces are at the boundary to round-off */
        const int status = sg_return(w, par);
        w->segment.span = SG_C(0.0);
        return status;
    }
    for (round = 0; round < SG_LOCATE_ROUNDS && tau > SG_C(0.0) && !sg_spent(w, opt, info);
         ++round) {
        real value, rate, next;
        int status = sg_return(w, par);
        if (status == SG_K(OK)) {
            status = sg_solve_segment(w, par, opt, info, tau, last);
        }
        if (status == SG_K(OK)) {
            status = sg_value_at_end(w, par, opt, info, event, &value, &rate);
        }
        if (status != SG_K(OK)) {
            return status;
        }
        if (rate < SG_C(0.0)) {
            slope = rate;
        } else if (round > 0 && (value - before) / (tau - last) < SG_C(0.0)) {
            slope = (value - before) / (tau - last);
        }
        if (value > SG_C(0.0)) {
            low = tau;
        } else {
            high = tau;
            falls = 1;
        }
        next = sg_next_size(tau, value, slope, low, high, round >= SG_SECANT_ROUNDS);
        if (SG_FABS(value) <= sg_event_floor(w, event->what, event->contact) ||
            (falls && (SG_FABS(next - tau) <= noise || high - low <= noise))) {
            return SG_K(OK);
        }
        if (!falls && rest - tau <= noise + SG_TOUCH * rest) {
            event->what = SG_NOTHING;
            return SG_K(OK);
        }
        before = value;
        last = tau;
        tau = next;
    }
    return SG_K(NOT_CONVERGED);
}

/* Unknowns of the segment that the next step starts from. */
static sg_range sg_range_of(const SG(work) * w) {
    const sg_problem *first = sg_problem_at(w, w->segment.rubs ? SG_SEGMENT : 0);
    const sg_problem *last = sg_problem_at(w, w->segment.rubs ? SG_SEGMENT : SG_N_CHAIN - 1);
    sg_range of;
    of.x = first->x;
    of.x_end = last->x + last->n_x;
    of.R = first->R;
    of.R_end = last->R + last->n_slots * sg_n_R(w);
    return of;
}

/* 1 if contacts end the segment in the states in which the step before ended. */
static int sg_goes_on(const SG(work) * w) {
    int k;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        if (w->trial.contact[k] != w->segment.mode[k]) {
            return 0;
        }
    }
    return 1;
}

/* Take over the end of the segment just solved. `whole`: it is all of the step. */
static void sg_take_segment(SG(work) * w, const SG(params) * par, SG(report) * info, int whole) {
    SG(part) *s = &w->trial;
    const sg_range of = sg_range_of(w);
    int k;
    for (k = 0; k < sg_n_R(w); ++k) {
        w->segment.P[k] += w->P[k];
    }
    /* forces may have been looked for elsewhere since */
    sg_copy(sg_n_q(w), w->segment.q, w->q);
    sg_copy(sg_n_q(w), w->segment.v, w->v);
    w->t = w->segment.t;
    w->h = w->segment.span;
    if (whole) {
        s->warm = s->segment == 1 + w->segment.rubs ? s->warm : 0;
        sg_remember(s, w, sg_goes_on(w), &of);
        s->h_guess = w->h;
        s->segment = 1 + w->segment.rubs;
    } else {
        s->warm = 0;
        s->order = 0;
        s->segment = 0;
    }
    sg_smallest_gap(w, info, w->segment.rubs ? SG_SEGMENT : 0);
    sg_copy(sg_n_q(w), w->q_end, s->q);
    sg_copy(sg_n_q(w), w->v_end, s->v);
    sg_retain(w, par);
}

/* Solve the segment up to the end of the step, and look for the first event in it. */
static int sg_seek_end(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                       SG(report) * info, real rest, sg_happening *event) {
    sg_happening force;
    int status;
    *event = sg_no_event();
    status = sg_solve_segment(w, par, opt, info, rest, SG_C(0.0));
    if (status != SG_K(OK)) {
        return status;
    }
    if (!sg_detect_motion(w, par, opt, event)) {
        return SG_K(REJECTED);
    }
    if (!sg_press_clearly(w)) {
        status = sg_detect_forces(w, par, opt, info, sg_min(event->at, SG_C(1.0)), &force);
        if (status != SG_K(OK)) {
            return status;
        }
        if (force.what != SG_NOTHING) {
            *event = force;
        }
        status = sg_return(w, par);
    }
    return status;
}

/* One segment from the place where the step stands, at most of size `rest`; *event says what ends
 * it.
 */
static int sg_pass(SG(work) * w, const SG(params) * par, const SG(options) * opt, SG(report) * info,
                   real rest, sg_happening *event) {
    int status, turn, k;
    if (w->segment.known) {
        sg_measure_motion(w, rest);
    }
    for (k = 0; k < sg_n_contacts(w); ++k) {
        w->segment.absent[k] = SG_NOTHING;
    }
    sg_keep_start(w);
    sg_keep_sight(w);
    for (turn = 0; turn < SG_ABSENT_TURNS && !sg_spent(w, opt, info); ++turn) {
        int what;
        status = sg_seek_end(w, par, opt, info, rest, event);
        what = event->what;
        if (status == SG_K(OK) && what != SG_NOTHING) {
            status = sg_pin(w, par, opt, info, event, rest);
        }
        if (status != SG_K(OK) || what == event->what) {
            return status;
        }
        /* look again, past what is not there */
        w->segment.absent[event->contact] = what;
        status = sg_return(w, par);
        if (status != SG_K(OK)) {
            return status;
        }
        if (w->segment.known) {
            sg_measure_motion(w, rest);
        }
        sg_look(w, par, w->segment.t, w->trial.q, w->trial.v);
        sg_keep_sight(w);
    }
    return SG_K(NOT_CONVERGED);
}

/* The rest of the step as if nothing were looked for; if that fails, all of it. */
static int sg_capture(SG(work) * w, const SG(part) * s, SG(report) * info, const SG(params) * par,
                      const SG(options) * opt, real h, real done) {
    int status, j, k;
    const real energy = sg_energy(w, s->t + done, w->trial.q, w->trial.v, par);
    if (done > SG_C(0.0)) {
        w->trial.warm = 0;
    }
    for (k = 0; k < sg_n_contacts(w); ++k) {
        w->segment.before[k] = done > SG_C(0.0) ? w->segment.mode[k] : s->contact[k];
        w->trial.contact[k] = w->segment.before[k];
        w->trial.closed[k] = w->segment.before[k] > SG_K(OPEN);
    }
    info->captured = done > SG_C(0.0) ? 1 : 2;
    info->t_captured = s->t + done;
    info->iterations = 0;
    status = sg_cover(w, s->t + done, info, par, opt, h - done);
    if (status != SG_K(OK) && done > SG_C(0.0)) {
#if SG_JOINS
        sg_copy_part(w, s, &w->trial);
#else
        w->trial = *s;
#endif
        info->captured = 2;
        info->t_captured = s->t;
        info->n_events = 0;
        info->iterations = 0;
        sg_fill(sg_n_R(w), SG_C(0.0), w->segment.P);
        for (k = 0; k < sg_n_contacts(w); ++k) {
            w->segment.impacts[k] = 0;
            w->segment.before[k] = s->contact[k];
        }
        status = sg_cover(w, s->t, info, par, opt, h);
    }
    if (status == SG_K(OK)) {
        const real after = sg_energy(w, s->t + h, w->trial.q, w->trial.v, par);
        for (j = 0; j < sg_n_R(w); ++j) {
            info->P[j] += w->segment.P[j];
        }
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const int kind = sg_event_kind(w->segment.before[k], info->contact[k], info->impacts[k],
                                           w->found.exists[k]);
            if (kind >= 0) {
                sg_tell(w, info, s->t + h, k, kind,
                        kind == SG_K(EVENT_IMPACT) ? after - energy : SG_C(0.0), info->P);
            }
            info->impacts[k] += w->segment.impacts[k];
        }
    }
    return status;
}

/* Report the end of a step of which nothing was captured. */
static void sg_report(SG(work) * w, SG(report) * info) {
    int k;
    sg_copy(sg_n_R(w), w->segment.P, info->P);
    for (k = 0; k < sg_n_contacts(w); ++k) {
        info->contact[k] = w->segment.mode[k];
        info->impacts[k] = w->segment.impacts[k];
        w->trial.contact[k] = w->segment.mode[k];
        w->trial.closed[k] = w->segment.mode[k] > SG_K(OPEN);
    }
}

/* The trial state is the segment's start, wherever forces were looked for. */
static void sg_go_back(SG(work) * w) {
    if (!w->segment.prepared) {
        sg_copy(sg_n_q(w), w->segment.q, w->trial.q);
        sg_copy(sg_n_q(w), w->segment.v, w->trial.v);
        w->segment.prepared = 1;
    }
}

/* Where a located step is: time gone since its start, the contact that the last event has changed
   (-1: none), whether modes are to be sought, whether they have been at this place, how many events
   there were at it. */
typedef struct {
    real done;
    int but, sought, again, events;
} sg_way;

static sg_way sg_set_out(SG(work) * w, const SG(part) * s, real h) {
    sg_way way;
    int k;
    way.done = SG_C(0.0);
    way.but = -1;
    way.sought = !s->located;
    way.again = 0;
    way.events = 0;
    w->segment.h = h;
    w->segment.solves = 0;
    sg_fill(sg_n_R(w), SG_C(0.0), w->segment.P);
    for (k = 0; k < sg_n_contacts(w); ++k) {
        w->segment.turned[k] = 0;
        w->segment.mode[k] = s->contact[k];
        w->segment.before[k] = s->contact[k];
        w->segment.impacts[k] = 0;
    }
    return way;
}

/* One segment of the step, with what happens at its start. */
static int sg_go_on(SG(work) * w, const SG(part) * s, const SG(params) * par,
                    const SG(options) * opt, SG(report) * info, const sg_way *way,
                    sg_happening *event) {
    const int status = sg_enter(w, par, opt, info, s->t + way->done, way->but, way->sought);
    return status == SG_K(OK) ? sg_pass(w, par, opt, info, w->segment.h - way->done, event)
                              : status;
}

/* The segment is accepted: take it over, and what its event does. */
static void sg_accept(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                      SG(report) * info, sg_way *way, const sg_happening *event, int whole) {
    const real h = w->segment.h;
    const real least = SG_C(64.0) * SG_EPS * (SG_FABS(w->segment.t) + h);
    const int ends = event->what == SG_NOTHING;
    int k;
    sg_tell_changes(w, info);
#if SG_DERIVATIVES
    if (w->directions.moves) {
        sg_forward_segment(w, par, opt, info, event);
    }
#else
    (void)opt;
#endif
    if (ends || w->segment.span > SG_C(0.0)) {
        sg_take_segment(w, par, info, whole && ends);
    }
    way->done =
        ends || h - (way->done + w->segment.span) <= least ? h : way->done + w->segment.span;
    way->again = 0;
    way->events = w->segment.span > least ? 0 : way->events + 1;
    way->sought = event->what == SG_SLIP_ENDS || event->what == SG_GUARD_TURNS;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        w->segment.before[k] = w->segment.mode[k];
    }
    way->but = ends ? -1 : sg_impose(w, event);
}

static int sg_locate(SG(work) * w, const SG(part) * s, SG(report) * info, const SG(params) * par,
                     const SG(options) * opt, real h) {
    sg_way way = sg_set_out(w, s, h);
    int events;
    for (events = 0; way.done < h && events <= opt->max_events && !sg_spent(w, opt, info);
         ++events) {
        sg_happening event = sg_no_event();
        const int status = sg_go_on(w, s, par, opt, info, &way, &event);
        if (status == SG_K(OK)) {
            sg_accept(w, par, opt, info, &way, &event, events == 0);
        } else if (status == SG_K(BAD_ARGUMENT)) {
            sg_reset_report(info, sg_n_contacts(w), sg_n_R(w));
            return status;
        } else if (status == SG_K(REJECTED) && !way.again) {
            /* modes that were kept do not go on: seek them */
            sg_go_back(w);
            way.again = 1;
            way.sought = 1;
        } else {
            sg_go_back(w);
            return sg_capture(w, s, info, par, opt, h, way.done);
        }
        if (way.events > SG_EVENTS_AT_PLACE * sg_n_contacts(w)) {
            break; /* a contact opens and closes in turn, and the motion does not go on */
        }
    }
    if (way.done < h) {
        return sg_capture(w, s, info, par, opt, h, way.done);
    }
    sg_report(w, info);
    return SG_K(OK);
}
