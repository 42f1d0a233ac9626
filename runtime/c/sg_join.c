#pragma once
#include "sg_island_state.c"
#include "sg_large.c"
#include "sg_simulate.c"

/* Steps of a model in which contacts join parts: islands are made of the parts between which
   contacts may act, and each takes its own step. Contacts that are left out are looked at behind
   it: if one would have closed the step is taken again with it. */

/* How near a contact that may act is: in ways that its parts go in a step at their velocities. */
#define SG_NEAR SG_C(2.0)
#define SG_NEAR_LOCATED SG_C(4.0)

/* ---- which couplings may act ------------------------------------------------------------- */

/* Coordinates, or velocities, of an element. */
static void sg_pick(int element, const real *from, real *to) {
    const int *at = sg_coordinates_of(element);
    int j;
    for (j = 0; j < sg_kinds[sg_parts[element].kind].n_q; ++j) {
        to[j] = from[at[j]];
    }
}

/* What a coupling has at (t, q), in *at. Returns 1 if a gap of a contact that exists there is
   closed: those of others are of parts that do not face each other. *gap receives the smallest, if
   it is smaller. */
static int sg_is_touching(int coupling, const SG(params) * par, real t, const real q[],
                          SG(consistency) * at, real *gap) {
    const int element = SG_N_PARTS + coupling;
    const sg_kind *kind = &sg_kinds[sg_parts[element].kind];
    real own[SG_OWN_Q];
    int found = 0;
    int k;
    sg_pick(element, q, own);
    SG(part_places)(element, t, own, par, at);
    for (k = 0; k < kind->n_contacts; ++k) {
        const int n = kind->contacts[k].normal;
        if (n >= 0 && !(kind->contacts[k].guarded && at->guard[k] < SG_C(0.0))) {
            found = found || !(at->value[n] > SG_TOUCH * at->size[n]);
            *gap = sg_min(*gap, at->value[n]);
        }
    }
    return found;
}

/* 1 if a gap of a coupling, which is `places` at (t, q), is smaller than `near` times the way that
   its parts go in a step of size h. */
static int sg_may_meet(int coupling, const SG(params) * par, real t, const real q[], const real v[],
                       real h, real near, const SG(consistency) * places) {
    const int element = SG_N_PARTS + coupling;
    const sg_kind *kind = &sg_kinds[sg_parts[element].kind];
    real own_q[SG_OWN_Q], own_v[SG_OWN_Q];
    SG(consistency) rates;
    int k;
    sg_pick(element, q, own_q);
    sg_pick(element, v, own_v);
    SG(part_rates)(element, t, own_q, own_v, par, &rates);
    for (k = 0; k < kind->n_contacts; ++k) {
        const int n = kind->contacts[k].normal;
        if (n >= 0 && !(places->value[n] > near * h * rates.size[n])) {
            return 1;
        }
    }
    return 0;
}

/* 1 if a contact of a coupling exists where `at` was found. */
static int sg_is_there(int coupling, const SG(consistency) * at) {
    const sg_kind *kind = &sg_kinds[sg_parts[SG_N_PARTS + coupling].kind];
    int k;
    for (k = 0; k < kind->n_contacts; ++k) {
        if (!(kind->contacts[k].guarded && at->guard[k] < SG_C(0.0))) {
            return 1;
        }
    }
    return 0;
}

/* 1 if a contact of a coupling was closed at the end of the step before. */
static int sg_was_closed(const SG(state) * s, int coupling) {
    const int *contacts = sg_contacts_of(SG_N_PARTS + coupling);
    int k;
    for (k = 0; k < sg_kinds[sg_parts[SG_N_PARTS + coupling].kind].n_contacts; ++k) {
        if (s->contact[contacts[k]] > SG_K(OPEN)) {
            return 1;
        }
    }
    return 0;
}

/* Couplings that may act in the step, and those of which a contact exists at its start. */
static void sg_propose(SG(work) * w, const SG(state) * s, const SG(params) * par, real h,
                       real near) {
    real gap = SG_HUGE;
    int c;
    for (c = 0; c < SG_N_COUPLINGS; ++c) {
        SG(consistency) at;
        const int touches = sg_is_touching(c, par, s->t, s->q, &at, &gap);
        w->there[c] = sg_is_there(c, &at);
        w->joins[c] = w->there[c] && (sg_was_closed(s, c) || touches ||
                                      sg_may_meet(c, par, s->t, s->q, s->v, h, near, &at));
    }
}

/* The part that has coordinate j of the model. */
static inline int sg_part_of(const SG(work) * w, int j) { return w->holder[j]; }

/* Islands: the first part of that of every part. Returns how many couplings join parts. */
static int sg_group(SG(work) * w) {
    int count = 0;
    int c, j, p;
    for (p = 0; p < SG_N_PARTS; ++p) {
        const int *at = sg_coordinates_of(p);
        w->root[p] = p;
        for (j = 0; j < sg_kinds[sg_parts[p].kind].n_q; ++j) {
            w->holder[at[j]] = p;
        }
    }
    for (c = 0; c < SG_N_COUPLINGS; ++c) {
        const int *at = sg_coordinates_of(SG_N_PARTS + c);
        const int n = sg_kinds[sg_parts[SG_N_PARTS + c].kind].n_q;
        if (!w->joins[c]) {
            continue;
        }
        ++count;
        for (j = 1; j < n; ++j) {
            int a = sg_part_of(w, at[0]);
            int b = sg_part_of(w, at[j]);
            while (w->root[a] != a) {
                a = w->root[a];
            }
            while (w->root[b] != b) {
                b = w->root[b];
            }
            w->root[a > b ? a : b] = a > b ? b : a;
        }
    }
    for (p = 0; p < SG_N_PARTS; ++p) {
        w->root[p] = w->root[w->root[p]]; /* roots come before what they are the roots of */
    }
    return count;
}

/* Members of the island that begins with part `first`: its parts, then its couplings. */
static void sg_gather_members(SG(work) * w, int first) {
    int c, p;
    w->n_members = 0;
    for (p = first; p < SG_N_PARTS; ++p) {
        if (w->root[p] == first) {
            w->members[w->n_members] = p;
            ++w->n_members;
        }
    }
    w->n_bodies = w->n_members;
    for (c = 0; c < SG_N_COUPLINGS; ++c) {
        if (w->joins[c] && w->root[sg_part_of(w, *sg_coordinates_of(SG_N_PARTS + c))] == first) {
            w->members[w->n_members] = SG_N_PARTS + c;
            ++w->n_members;
        }
    }
}

/* ---- what is reported -------------------------------------------------------------------- */

#if SG_LOCATED
/* The contact of the model that contact k of the island is. */
static int sg_contact_of_model(const SG(work) * w, int k) {
    int m = w->n_members - 1;
    while (sg_first_of(w, m, SG_FIRST_CONTACT) > k) {
        --m;
    }
    return sg_contacts_of(w->members[m])[k - sg_first_of(w, m, SG_FIRST_CONTACT)];
}

/* Events of the island among those of the step, by their times. */
static void sg_join_events(const SG(work) * w, SG(info) * info) {
    int i, k;
    for (i = 0; i < w->report.n_events && i < SG_MOST_EVENTS; ++i) {
        SG(event) event = w->report.events[i];
        event.contact = sg_contact_of_model(w, event.contact);
        for (k = info->n_events; k > 0 && info->events[k - 1].t > event.t; --k) {
            info->events[k] = info->events[k - 1];
        }
        info->events[k] = event;
        ++info->n_events;
    }
}
#endif

/* Add what the step of the island reports to what the others do. */
static void sg_gather_island(SG(work) * w, SG(info) * info) {
    const SG(report) *own = &w->report;
    int k, m;
    sg_add_report(info, own);
    for (m = 0; m < w->n_members; ++m) {
        const int *contacts = sg_contacts_of(w->members[m]);
        const int *rows = sg_rows_of(w->members[m]);
        const int first = sg_first_of(w, m, SG_FIRST_CONTACT);
        for (k = 0; k < sg_member_kind(w, m)->n_R; ++k) {
            info->P[rows[k]] = own->P[sg_row_of(w, m, k)];
        }
        for (k = 0; k < sg_member_kind(w, m)->n_contacts; ++k) {
            info->contact[contacts[k]] = own->contact[first + k];
            info->impacts[contacts[k]] = own->impacts[first + k];
            w->exists[contacts[k]] = w->found.exists[first + k];
        }
    }
#if SG_LOCATED
    sg_join_events(w, info);
#endif
    info->largest = w->n_bodies > info->largest ? w->n_bodies : info->largest;
    if (info->rescued < 0 && (own->rescues > 0 || own->substeps > 0)) {
        info->rescued = w->members[0];
    }
}

/* Stages of the island among those of the model, if they are those of the whole step. */
static void sg_keep_stages(SG(work) * w) {
    const int whole = sg_has_stages(&w->trial, &w->report);
    int i, j, m;
    w->staged = w->staged && whole;
    for (m = 0; m < w->n_bodies; ++m) {
        w->whole[w->members[m]] = whole;
    }
    for (m = 0; m < w->n_members && whole; ++m) {
        const sg_kind *own = sg_member_kind(w, m);
        const int *at = sg_coordinates_of(w->members[m]);
        const int *rows = sg_rows_of(w->members[m]);
        SG(part_stages)(sg_parts[w->members[m]].kind, &w->element[m], w->stage_t, w->part_q,
                        w->part_v, w->part_R);
        for (i = 0; i < SG_N_STAGES; ++i) {
            for (j = 0; j < own->n_q && m < w->n_bodies; ++j) {
                w->stage_q[i * SG_N_Q + at[j]] = w->part_q[i * own->n_q + j];
                w->stage_v[i * SG_N_Q + at[j]] = w->part_v[i * own->n_q + j];
            }
            for (j = 0; j < own->n_R; ++j) {
                w->stage_R[i * SG_N_R + rows[j]] = w->part_R[i * own->n_R + j];
            }
        }
    }
}

/* ---- the step ---------------------------------------------------------------------------- */

/* The steps of all islands. */
static int sg_step_each(const SG(state) * s, SG(work) * w, SG(info) * info, const SG(params) * par,
                        const SG(options) * opt, real h) {
    sg_island island;
    int m, p;
    w->staged = 1;
    w->n_links = 0;
    sg_fill(SG_N_STAGES * SG_N_R, SG_C(0.0), w->stage_R);
    for (p = 0; p < SG_N_PARTS; ++p) {
        int status, print;
        if (w->root[p] != p) {
            continue;
        }
        sg_gather_members(w, p);
        sg_put_together(w, &island);
        sg_take_up(w, s, &w->origin);
        sg_copy_part(w, &w->origin, &w->trial);
        sg_reset_report(&w->report, sg_n_contacts(w), sg_n_R(w));
        status = sg_step_part(&w->origin, w, &w->report, par, opt, h);
        if (status != SG_K(OK)) {
            const int used = info->iterations + w->report.iterations;
            sg_reset_info(info);
            info->iterations = used;
            info->failed = p;
            return status;
        }
        sg_gather_island(w, info);
        sg_keep_stages(w);
        print = sg_print_of(w);
        for (m = 0; m < w->n_bodies; ++m) {
            sg_keep_part(w, m, print);
        }
        for (; m < w->n_members; ++m) {
            sg_keep_coupling(w, m);
        }
    }
    return SG_K(OK);
}

/* 1 if the stages of all parts of a coupling are those of the whole step. */
static int sg_is_whole(const SG(work) * w, int coupling) {
    const int *at = sg_coordinates_of(SG_N_PARTS + coupling);
    int j;
    for (j = 0; j < sg_kinds[sg_parts[SG_N_PARTS + coupling].kind].n_q; ++j) {
        if (!w->whole[sg_part_of(w, at[j])]) {
            return 0;
        }
    }
    return 1;
}

/* Couplings that were left out and whose gaps did not stay open join their parts, too. Returns how
   many. Gaps are looked at where the stages are, but for the start, and at the end; where there are
   no stages of the whole step, they must be as wide at the end as they had to be at the start.
   Contacts count where they exist: what does not at the start takes part in no whole step, what
   does not at the end in none of several. */
static int sg_look_behind(SG(work) * w, const SG(params) * par, SG(info) * info, real t, real h,
                          const real q_end[], const real v_end[], real near) {
    /* a scheme that knows no gaps at its stages tells none */
    real unused = SG_HUGE;
    real *gap = sg_kinds[0].problems[0].gap_slots > 0 ? &info->smallest_gap : &unused;
    int found = 0;
    int c, i;
    for (c = 0; c < SG_N_COUPLINGS; ++c) {
        const int whole = sg_is_whole(w, c);
        SG(consistency) at;
        if (w->joins[c] || (whole && !w->there[c])) {
            continue;
        }
        for (i = 0; i < SG_N_STAGES && whole; ++i) {
            if (w->stage_t[i] > t && w->stage_t[i] < t + h) {
                w->joins[c] =
                    sg_is_touching(c, par, w->stage_t[i], &w->stage_q[i * SG_N_Q], &at, gap) ||
                    w->joins[c];
            }
        }
        w->joins[c] = sg_is_touching(c, par, t + h, q_end, &at, gap) ||
                      (!whole && sg_may_meet(c, par, t + h, q_end, v_end, h, near, &at)) ||
                      w->joins[c];
        w->joins[c] = w->joins[c] && (whole || sg_is_there(c, &at));
        found += w->joins[c];
    }
    return found;
}

/* What the parts are behind the step is what the model is. */
static void sg_follow_parts(SG(state) * s, const SG(work) * w, const SG(info) * info) {
    int j, part;
    for (part = 0; part < SG_N_PARTS; ++part) {
        const int *at = sg_coordinates_of(part);
        s->part[part] = w->next[part];
        for (j = 0; j < sg_kinds[sg_parts[part].kind].n_q; ++j) {
            s->q[at[j]] = w->next[part].q[j];
            s->v[at[j]] = w->next[part].v[j];
        }
    }
    for (j = 0; j < SG_N_CONTACTS; ++j) {
        s->contact[j] = info->contact[j];
    }
    s->n_links = w->n_links;
    for (j = 0; j < w->n_links; ++j) {
        s->link[j] = w->link[j];
    }
}

/* Contacts that were left out are open. */
static void sg_tell_left_out(SG(work) * w, SG(info) * info) {
    int c, k;
    for (c = 0; c < SG_N_COUPLINGS; ++c) {
        const int *contacts = sg_contacts_of(SG_N_PARTS + c);
        const sg_kind *kind = &sg_kinds[sg_parts[SG_N_PARTS + c].kind];
        for (k = 0; k < kind->n_contacts && !w->joins[c]; ++k) {
            info->contact[contacts[k]] = SG_K(OPEN);
            w->exists[contacts[k]] = 1;
        }
    }
}

static int sg_step_islands(SG(state) * s, SG(work) * w, SG(info) * info, const SG(params) * par,
                           const SG(options) * opt, real h) {
#if SG_LOCATED
    const real near = opt->events == SG_K(EVENTS_LOCATED) ? SG_NEAR_LOCATED : SG_NEAR;
#else
    const real near = SG_NEAR;
#endif
    int again = 1;
    int used = 0;
    int j, part, p, status;
    sg_propose(w, s, par, h, near);
    while (again) {
        if (sg_group(w) > SG_N_JOINED) {
            sg_reset_info(info);
            return SG_K(CROWDED);
        }
        status = sg_step_each(s, w, info, par, opt, h);
        info->iterations += used;
        if (status != SG_K(OK)) {
            return status;
        }
        for (part = 0; part < SG_N_PARTS; ++part) {
            const int *at = sg_coordinates_of(part);
            for (j = 0; j < sg_kinds[sg_parts[part].kind].n_q; ++j) {
                w->end_q[at[j]] = w->next[part].q[j];
                w->end_v[at[j]] = w->next[part].v[j];
            }
        }
        again = sg_look_behind(w, par, info, s->t, h, w->end_q, w->end_v, near);
        if (again > 0) {
            used = info->iterations;
            sg_reset_info(info);
        }
    }
    for (p = 0; p < SG_N_PARTS; ++p) {
        info->islands += w->root[p] == p;
    }
    sg_tell_left_out(w, info);
    sg_follow_parts(s, w, info);
    return SG_K(OK);
}

/* One problem of the model as a single island with as many couplings as there is room for, those of
   the share number `share`; of share 0 without any. */
static int sg_evaluate_joined(const SG(state) * s, SG(work) * w, const SG(params) * par,
                              const SG(options) * opt, real h, int share, int problem,
                              const real x[], const real R[]) {
    sg_island island;
    int c, p, status;
    for (c = 0; c < SG_N_COUPLINGS; ++c) {
        w->joins[c] = c / SG_N_JOINED + 1 == share;
    }
    (void)sg_group(w);
    for (p = 0; p < SG_N_PARTS; ++p) {
        w->root[p] = 0;
    }
    sg_gather_members(w, 0);
    sg_put_together(w, &island);
    sg_take_up(w, s, &w->origin);
    status = sg_evaluate_problem(&w->origin, w, par, opt, h, problem, x, R);
    w->island = NULL;
    return status;
}
