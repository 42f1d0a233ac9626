#pragma once
#include "sg_segment.c"

/* Events of a segment: found on its dense output, then located by solving it anew up to them. */

/* What ends a segment: nothing; a gap closes, a contact or friction element loses its force,
   friction reaches the boundary of its set, a slip comes to rest, a guard changes its sign. */
enum { SG_NOTHING, SG_GAP_CLOSES, SG_FORCE_ENDS, SG_SLIP_BEGINS, SG_SLIP_ENDS, SG_GUARD_TURNS };

typedef struct {
    int what, contact;
    real at;    /* share of the segment */
    real slope; /* of the event function there, by that share */
} sg_happening;

/* No event; the share lies beyond the segment. */
static sg_happening sg_no_event(void) {
    sg_happening none;
    none.what = SG_NOTHING;
    none.contact = 0;
    none.at = SG_C(2.0);
    none.slope = SG_C(0.0);
    return none;
}

/* Guards that events have turned: their values say nothing there. */
enum { SG_TURNED_ON = 1, SG_TURNED_OFF = 2 };

/* Event functions are positive before the event. This one is of gaps, slips and guards where the
   step looks; with `*rate` the derivative by time if it is known, else 0. */
static real sg_event_value(const SG(work) * w, int what, int k, real *rate) {
    *rate = SG_C(0.0);
    if (what == SG_GAP_CLOSES) {
        *rate = w->gap_rate[sg_contact_at(w, k)->normal];
        return w->gap[sg_contact_at(w, k)->normal];
    }
    if (what == SG_SLIP_ENDS) {
        return sg_slip_along(w, k);
    }
    return w->found.exists[k] ? w->guard_there[k] : -w->guard_there[k];
}

/* The same of forces that were found there: the normal percussion, or what is left of the radius.
 */
static real sg_force_value(const SG(work) * w, int what, int k) {
    const sg_contact *contact = sg_contact_at(w, k);
    const int n = sg_first_normal(w) + contact->pressing;
    const real radius = contact->pressing >= 0 ? w->segment.mu[k] * w->segment.force[n]
                                               : w->segment.bound[contact->bound];
    if (what == SG_FORCE_ENDS) {
        return w->segment.force[n];
    }
    return radius - sg_friction_size(w, k, &w->segment.force[sg_first_slip(w) + contact->friction]);
}

/* Whether contact k can have an event of a kind in the present segment. */
static int sg_may_happen(const SG(work) * w, int what, int k) {
    const sg_contact *contact = sg_contact_at(w, k);
    const int slips = sg_slips_in(w->segment.mode[k]);
    if (w->segment.absent[k] == what) {
        return 0;
    }
    switch (what) {
        case SG_GAP_CLOSES:
            return contact->normal >= 0 && !sg_holds(w, k) && w->segment.turned[k] != SG_TURNED_OFF;
        case SG_FORCE_ENDS:
            return contact->normal >= 0 && sg_holds(w, k);
        case SG_SLIP_BEGINS:
            return sg_rubs(w, k) && !slips;
        case SG_SLIP_ENDS:
            return sg_rubs(w, k) && slips;
        default:
            /* whether one that is open exists is asked when its gap closes */
            return contact->guarded && !w->segment.turned[k] &&
                   (contact->normal < 0 ? contact->presser < 0 : sg_holds(w, k));
    }
}

/* Round-off of an event function. */
static real sg_event_floor(const SG(work) * w, int what, int k) {
    const sg_contact *contact = sg_contact_at(w, k);
    const int n = sg_first_normal(w) + contact->pressing;
    const int f = sg_first_slip(w) + contact->friction;
    switch (what) {
        case SG_GAP_CLOSES:
            return w->scales.gap_floor[n];
        case SG_FORCE_ENDS:
            return SG_FLOOR * w->scales.percussion_scale[n];
        case SG_SLIP_BEGINS:
            return SG_FLOOR *
                   (w->scales.percussion_scale[f] +
                    (contact->pressing >= 0 ? w->segment.mu[k] * w->scales.percussion_scale[n]
                                            : SG_C(0.0)));
        case SG_SLIP_ENDS:
            return SG_FLOOR * w->scales.speed[f];
        default:
            return SG_TINY;
    }
}

/* Size of an event function in the segment: a way, a velocity. */
static real sg_event_scale(const SG(work) * w, int what, int k) {
    const sg_contact *contact = sg_contact_at(w, k);
    switch (what) {
        case SG_GAP_CLOSES:
            return w->segment.span * w->scales.speed[sg_first_normal(w) + contact->normal];
        case SG_SLIP_ENDS:
            return contact->components > 0 ? w->scales.speed[sg_first_slip(w) + contact->friction]
                                           : SG_C(0.0);
        default:
            return SG_C(0.0);
    }
}

/* What a solved segment leaves of an event function that is zero: its round-off, and the tolerance
   of the iteration. */
static real sg_event_noise(const SG(work) * w, const SG(options) * opt, int what, int k) {
    const sg_contact *contact = sg_contact_at(w, k);
    const real tol = SG_BAND * sg_max(opt->tol, SG_FLOOR);
    const real floor = SG_BAND * sg_event_floor(w, what, k);
    if (what == SG_GAP_CLOSES) {
        return floor +
               tol * w->segment.span * w->scales.speed[sg_first_normal(w) + contact->normal];
    }
    return what == SG_GUARD_TURNS ? floor : floor * (tol / SG_FLOOR);
}

/* Keep what was seen where the step looked last. */
static void sg_keep_sight(SG(work) * w) {
    sg_copy(sg_n_N(w), w->gap, w->segment.gap);
    sg_copy(sg_n_N(w), w->gap_rate, w->segment.gap_rate);
    sg_copy(sg_n_F(w), w->slip_rate, w->segment.slip_rate);
    sg_copy(sg_n_contacts(w), w->guard_there, w->segment.guard);
}

/* Value of an event function where the step looked before. */
static real sg_value_before(const SG(work) * w, int what, int k, real *rate) {
    *rate = SG_C(0.0);
    if (what == SG_GAP_CLOSES) {
        *rate = w->segment.gap_rate[sg_contact_at(w, k)->normal];
        return w->segment.gap[sg_contact_at(w, k)->normal];
    }
    if (what == SG_SLIP_ENDS) {
        const int f = sg_contact_at(w, k)->friction;
        real along = SG_C(0.0);
        int d;
        for (d = 0; d < sg_contact_at(w, k)->components; ++d) {
            along += w->segment.slip_rate[f + d] * w->segment.direction[f + d];
        }
        return along;
    }
    return w->found.exists[k] ? w->segment.guard[k] : -w->segment.guard[k];
}

/* Root of an event function on the dense output between two shares, its values there of opposite
   sign: the Illinois variant of regula falsi. */
static void sg_find_root(SG(work) * w, const SG(params) * par, sg_happening *event, real from,
                         real f_from, real to, real f_to) {
    real a = from;
    real f_a = f_from;
    real b = to;
    real f_b = f_to;
    int side = 0;
    int round;
    real rate;
    event->slope = (f_b - f_a) / (b - a);
    event->at = b;
    for (round = 0; round < SG_ROOT_ROUNDS && b - a > SG_ROOT_NEAR; ++round) {
        const real x = b - f_b * ((b - a) / (f_b - f_a));
        real f;
        sg_look_along(w, par, x);
        f = sg_event_value(w, event->what, event->contact, &rate);
        event->slope = (f_b - f_a) / (b - a);
        event->at = x;
        if (f > SG_C(0.0)) {
            event->slope = x > a ? (f - f_a) / (x - a) : event->slope;
            a = x;
            f_a = f;
            f_b *= side > 0 ? SG_C(0.5) : SG_C(1.0);
            side = 1;
        } else {
            event->slope = x < b ? (f_b - f) / (b - x) : event->slope;
            b = x;
            f_b = f;
            f_a *= side < 0 ? SG_C(0.5) : SG_C(1.0);
            side = -1;
            if (!(f < SG_C(0.0))) {
                return;
            }
        }
    }
}

/* Share at which a gap that falls at `from` and rises at `to` is smallest; `*value` is the gap
   there. */
static real sg_smallest_between(SG(work) * w, const SG(params) * par, int k, real from, real to,
                                real *value) {
    const int n = sg_contact_at(w, k)->normal;
    real a = from;
    real b = to;
    real x = from;
    int round;
    *value = SG_HUGE;
    for (round = 0; round < SG_DIP_ROUNDS; ++round) {
        x = SG_C(0.5) * (a + b);
        sg_look_along(w, par, x);
        *value = w->gap[n];
        if (*value < SG_C(0.0)) {
            return x;
        }
        if (w->gap_rate[n] < SG_C(0.0)) {
            a = x;
        } else {
            b = x;
        }
    }
    return x;
}

/* A gap that falls at the share a (value f_a) and rises at b: it may close between. */
static void sg_seek_dip(SG(work) * w, const SG(params) * par, sg_happening *event, real a, real f_a,
                        real b) {
    real value;
    const real x = sg_smallest_between(w, par, event->contact, a, b, &value);
    if (value < SG_C(0.0)) {
        sg_find_root(w, par, event, a, f_a, x, value);
    }
#if SG_DERIVATIVES
    if (value >= SG_C(0.0) && value <= SG_TOUCH * sg_event_scale(w, event->what, event->contact) &&
        (w->directions.near == 0 || x < w->directions.near_at)) {
        w->directions.near = event->contact + 1;
        w->directions.near_at = x;
    }
#endif
}

/* Event function of contact k between the share `from`, looked at before, and `to`, where the step
   looks; what is found comes into *event. Returns 0 if the modes do not fit: the function is
   negative from the start. */
static int sg_between(SG(work) * w, const SG(params) * par, const SG(options) * opt, real from,
                      real to, sg_happening *event) {
    const int what = event->what;
    const int k = event->contact;
    const real floor = sg_event_noise(w, opt, what, k);
    real rate_a, rate_b;
    real f_a = sg_value_before(w, what, k, &rate_a);
    real f_b = sg_event_value(w, what, k, &rate_b);
    real a = from;
    real b = to;
    const real f_start = f_b; /* where the step looks */
    int round;
    event->at = SG_C(2.0); /* beyond the end: none */
    if (!w->segment.seen[k] && f_a > floor) {
        w->segment.seen[k] = 1;
    }
    if (what == SG_GAP_CLOSES && sg_contact_at(w, k)->guarded &&
        !(f_a > SG_C(0.0) && f_b > SG_C(0.0)) && w->guard_there[k] < SG_C(0.0)) {
        return 1; /* it does not exist there */
    }
    if (f_b < -floor && !w->segment.seen[k]) {
        /* it starts at zero: seek towards the start where it is positive */
        real x = b;
        for (round = 0; round < SG_BACK_ROUNDS && !w->segment.seen[k]; ++round) {
            x = a + SG_C(0.25) * (x - a);
            sg_look_along(w, par, x);
            f_a = sg_event_value(w, what, k, &rate_a);
            if (f_a > floor) {
                w->segment.seen[k] = 1;
                a = x;
            } else {
                b = x;
                f_b = f_a;
            }
        }
        if (!w->segment.seen[k]) {
            /* a contact that opens, or a slip that begins, as gently as the truncation error:
               judged at the end of the segment */
            return to < SG_C(1.0) && f_start > -SG_DIP * sg_event_scale(w, what, k);
        }
        sg_find_root(w, par, event, a, f_a, b, f_b);
        return 1;
    }
    if (f_b <= SG_C(0.0) && w->segment.seen[k] && f_a > SG_C(0.0)) {
        sg_find_root(w, par, event, a, f_a, b, f_b);
        return 1;
    }
    if (what == SG_GAP_CLOSES && w->segment.seen[k] && rate_a < SG_C(0.0) && rate_b > SG_C(0.0)) {
        sg_seek_dip(w, par, event, a, f_a, b);
    }
    return 1;
}

/* 1 if contact k may have an event of gaps, slips or guards within the segment, judged from its
   ends: a cubic between two values with these slopes may come close to zero. */
static int sg_is_near(const SG(work) * w, int what, int k) {
    real rate_a, rate_b;
    const real f_a = sg_value_before(w, what, k, &rate_a);
    const real f_b = sg_event_value(w, what, k, &rate_b);
    const real change = SG_FABS(f_b - f_a);
    real bend;
    if (what != SG_GAP_CLOSES) {
        return !(sg_min(f_a, f_b) > SG_C(0.5) * change);
    }
    bend = sg_max(SG_FABS(w->segment.span * rate_a - (f_b - f_a)),
                  SG_FABS(w->segment.span * rate_b - (f_b - f_a)));
    /* nor one whose slope stays about as steep as at the ends: a sharp corner */
    return !(sg_min(f_a, f_b) > SG_C(0.25) * bend + SG_C(0.0625) * change &&
             f_a + f_b > SG_C(1.25) * w->segment.span * sg_max(SG_FABS(rate_a), SG_FABS(rate_b)));
}

/* Earliest event of gaps, slips and guards up to the share `end`. Returns 0 if the modes do not
 * fit.
 */
static int sg_detect_motion(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                            sg_happening *first) {
    static const int kinds[] = {SG_GAP_CLOSES, SG_SLIP_ENDS, SG_GUARD_TURNS};
    int near = 0;
    int i, j, k;
    *first = sg_no_event();
#if SG_DERIVATIVES
    w->directions.near = 0;
#endif
    sg_look_along(w, par, SG_C(1.0));
    for (k = 0; k < sg_n_contacts(w); ++k) {
        w->segment.seen[k] = 0;
        for (i = 0; i < 3; ++i) {
            near = near || w->segment.absent[k] != SG_NOTHING ||
                   (sg_may_happen(w, kinds[i], k) && sg_is_near(w, kinds[i], k));
        }
    }
    for (j = 1; j <= SG_SAMPLES && near && first->what == SG_NOTHING; ++j) {
        const int last = j - 1;
        const real a = (real)last / (real)SG_SAMPLES;
        const real b = (real)j / (real)SG_SAMPLES;
        for (k = 0; k < sg_n_contacts(w); ++k) {
            for (i = 0; i < 3; ++i) {
                sg_happening event = sg_no_event();
                event.what = kinds[i];
                event.contact = k;
                if (!sg_may_happen(w, kinds[i], k)) {
                    continue;
                }
                sg_look_along(w, par, b);
                if (!sg_between(w, par, opt, a, b, &event)) {
                    return 0;
                }
                if (event.at < first->at) {
                    *first = event;
                }
            }
        }
        sg_look_along(w, par, b);
        sg_keep_sight(w);
        for (k = 0; k < sg_n_contacts(w); ++k) {
            if (w->segment.absent[k] == SG_GAP_CLOSES &&
                w->gap[sg_contact_at(w, k)->normal] <
                    -SG_DIP * sg_event_scale(w, SG_GAP_CLOSES, k)) {
                return 0; /* solved anew it stays open, but here it penetrates: too large a step */
            }
        }
    }
    return 1;
}
