#pragma once
#include "sg_forward.h"
#include "sg_located.c"

/* Derivatives of a located step along directions, exact: the implicit function theorem on each
   segment and each impact, chained over events whose times change, too. */

/* Why there is no derivative. */
enum { SG_KNOWN, SG_CAPTURED_STEP, SG_GRAZES, SG_TOGETHER, SG_RESTED, SG_ON_EDGE, SG_IS_SINGULAR };

static void sg_lose(SG(work) * w, int why, int k) {
    if (w->directions.lost == SG_KNOWN) {
        w->directions.lost = why;
        w->directions.contact = k;
        w->directions.at = w->segment.t;
    }
}

/* The scratch changes along direction j, from the place at hand, by h in the size of what is solved
   from there. */
static void sg_turn_to(SG(work) * w, const SG(params) * par, int j, real h) {
    const SG(directions) *d = &w->directions;
    w->forward.t = d->t[j];
    w->forward.h = h;
    sg_copy(SG_N_Q, &d->q[j * SG_N_Q], w->forward.q);
    sg_copy(SG_N_Q, &d->v[j * SG_N_Q], w->forward.v);
    sg_copy(SG_N_U, &d->u[j * SG_N_U], w->forward.u);
    SG(change_parameters)(w, &d->par[j * SG_N_PAR]);
    SG(start_forward)(w, par);
}

/* Changes of gaps, velocities and guards at the place at hand. */
static void sg_look_forward(SG(work) * w, const SG(params) * par) {
    w->forward.look_t = w->forward.t;
    sg_copy(SG_N_Q, w->forward.q, w->forward.look_q);
    sg_copy(SG_N_Q, w->forward.v, w->forward.look_v);
    SG(watch_forward)(w, par);
}

/* Change of the residual of percussion row i where unknowns stay. */
static real sg_row_forward(const SG(work) * w, const sg_problem *pr, int i) {
    const SG(forward) *f = &w->forward;
    const int c = i % SG_ROWS_OF_SLOT - SG_SLIP;
    real radius = SG_C(0.0);
    if (w->rows.kind[i] == SG_ROW_ZERO) {
        return SG_C(0.0);
    }
    if (c < 0 || w->rows.kind[i] == SG_ROW_FREE) {
        return w->scales.prox_r[i] * f->y[i];
    }
    if (sg_contacts[sg_slips[c].contact].normal >= 0) {
        const int slot = i / SG_ROWS_OF_SLOT;
        const int n = SG_NORMAL + sg_contacts[sg_slips[c].contact].normal;
        radius = f->mu[sg_slips[c].contact] * w->R[pr->R + slot * SG_N_R + n];
    } else {
        radius =
            f->radius[i / SG_ROWS_OF_SLOT * SG_N_BOUNDS + sg_contacts[sg_slips[c].contact].bound];
    }
    return w->rows.slip[i] * radius + sg_phi_change(w, pr, i, f->y, SG_C(0.0), -1);
}

/* The direction for other residuals of the problem whose system was solved last. */
static void sg_solve_again(SG(work) * w, int problem) {
    const sg_problem *pr = &sg_problems[problem];
    const int n = w->system.left;
    int a;
    sg_smooth_rows(w, pr);
    sg_fill(pr->n_slots * SG_N_R, SG_C(0.0), w->newton.dR);
    for (a = 0; a < n; ++a) {
        const int follower = w->system.follower[w->system.reduced[a]];
        if (follower >= 0) {
            sg_leave(w, pr, follower, w->rows.phi[follower]);
        }
    }
    sg_solve_smooth(w, problem, 0, w->smooth.dx);
    for (a = 0; a < n; ++a) {
        sg_right_side(w, pr, a);
        w->system.solution[a] = w->system.rhs[a];
    }
    if (w->system.rank >= 0) {
        sg_cod_solve(n, w->system.rank, w->system.S, w->system.perm, w->system.tau, w->system.tau_z,
                     w->system.rhs, w->system.scratch, w->system.solution);
    } else if (n == 1) {
        w->system.solution[0] = w->system.rhs[0] / w->system.S[0];
    } else if (n > 1) {
        sg_lu_solve(n, w->system.LU, w->system.perm, w->system.solution);
    }
    sg_expand_direction(w, pr, n);
}

/* Changes of the rows of a problem along the direction at hand where its unknowns stay. */
static void sg_ask_forward(SG(work) * w, const SG(params) * par, int problem) {
    const sg_problem *pr = &sg_problems[problem];
    sg_fill(pr->n_x, SG_C(0.0), &w->forward.x[pr->x]);
    sg_fill(pr->n_slots * SG_N_R, SG_C(0.0), &w->forward.R[pr->R]);
    SG(values_forward)(w, par, problem);
}

/* Changes of the unknowns that make up for them, for direction j; the solution stands in the work
   struct with its derivatives. For the first direction the system is factorised. */
static void sg_answer_forward(SG(work) * w, const SG(options) * opt, int problem, int j) {
    const sg_problem *pr = &sg_problems[problem];
    SG(forward) *f = &w->forward;
    const int n_rows = pr->n_slots * SG_N_R;
    int i;
    sg_copy(pr->n_x, f->r, w->r);
    sg_copy(n_rows, f->y, w->y);
    for (i = 0; i < n_rows; ++i) {
        w->rows.phi[i] = sg_row_forward(w, pr, i);
    }
    if (j > 0) {
        sg_solve_again(w, problem);
    } else {
        w->system.deficiency = 0;
        if (sg_newton_direction(w, opt, problem, 0) < 0) {
            sg_lose(w, SG_IS_SINGULAR, -1);
            w->system.left = 0;
        }
    }
    for (i = 0; i < pr->n_x; ++i) {
        f->x[pr->x + sg_table[pr->K.order + i]] = w->smooth.dx[i];
    }
    sg_copy(n_rows, w->newton.dR, &f->R[pr->R]);
}

static void sg_solve_forward(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                             int problem, int j) {
    sg_ask_forward(w, par, problem);
    sg_answer_forward(w, opt, problem, j);
}

/* 1 if a small change of the data leaves every row of an impact in its kind. */
static int sg_is_sharp(const SG(work) * w, const sg_problem *pr, int k) {
    const sg_contact *contact = &sg_contacts[k];
    const int n = SG_NORMAL + contact->normal;
    const int f = SG_SLIP + contact->friction;
    const real *R = &w->R[pr->R];
    if (contact->normal < 0 || !w->found.active[k]) {
        return 1;
    }
    if (w->rows.kind[n] == SG_ROW_ZERO) {
        return SG_FABS(w->y[n]) > SG_TOUCH * w->scales.speed[n];
    }
    if (!(R[n] > SG_TOUCH * w->scales.percussion_scale[n])) {
        return 0;
    }
    return contact->components == 0 || w->rows.kind[f] != SG_ROW_FREE || !(w->mu[k] > SG_C(0.0)) ||
           sg_friction_size(w, k, &R[f]) < w->mu[k] * R[n] * (SG_C(1.0) - SG_TOUCH);
}

/* About to strike: the place moves along the motion before, so that the gap stays closed. That is
   so already where the impact was located; a step may have ended there instead. */
static void sg_forward_strike(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                              SG(info) * info) {
    SG(directions) *d = &w->directions;
    int k = 0;
    int i, j;
    while (k < SG_N_CONTACTS - 1 && !sg_strikes(w, k)) {
        ++k;
    }
    if (d->fresh) {
        return; /* said with the impact */
    }
    if (sg_find_forces(w, par, opt, info) != SG_K(OK)) {
        sg_lose(w, SG_IS_SINGULAR, k);
    }
    sg_measure_motion(w, w->segment.h);
    sg_look(w, par, w->segment.t, w->trial.q, w->trial.v);
    for (j = 0; j < d->count; ++j) {
        real longer;
        sg_turn_to(w, par, j, SG_C(0.0));
        sg_look_forward(w, par);
        longer = -(w->forward.gap[sg_contacts[k].normal] / w->gap_rate[sg_contacts[k].normal]);
        d->t[j] += longer;
        for (i = 0; i < SG_N_Q; ++i) {
            d->q[j * SG_N_Q + i] += longer * w->trial.v[i];
            d->v[j * SG_N_Q + i] += longer * w->segment.acceleration[i] / w->segment.h;
        }
    }
    w->segment.known = 0;
}

/* Changes of the velocities behind an impact that was just solved. `rests`: a contact lost its
   restitution. */
static void sg_forward_impact(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                              int rests) {
    SG(directions) *d = &w->directions;
    const sg_problem *pr = &sg_problems[SG_IMPACT];
    int struck = -1;
    int j, k;
    for (k = 0; k < SG_N_CONTACTS; ++k) {
        if (sg_strikes(w, k)) {
            const int n = sg_contacts[k].normal;
            if (struck >= 0) {
                sg_lose(w, SG_TOGETHER, k);
            }
            struck = k;
            if (-w->gap_rate[n] < SG_STEEP * w->scales.speed[SG_NORMAL + n]) {
                sg_lose(w, SG_GRAZES, k);
            }
        }
        if (!sg_is_sharp(w, pr, k)) {
            sg_lose(w, SG_ON_EDGE, k);
        }
    }
    if (rests) {
        sg_lose(w, SG_RESTED, struck);
    }
    if (d->fresh) {
        sg_lose(w, SG_TOGETHER, struck); /* with the start itself */
    }
    SG(derivatives)(w, par, SG_IMPACT);
    for (j = 0; j < d->count; ++j) {
        sg_turn_to(w, par, j, SG_C(0.0));
        sg_solve_forward(w, par, opt, SG_IMPACT, j);
        sg_copy(SG_N_Q, &w->forward.x[pr->x], &d->v[j * SG_N_Q]);
    }
}

/* Changes of the directions of slip, of contacts that slip in space. */
static void sg_turn_directions(SG(work) * w, int j) {
    SG(directions) *d = &w->directions;
    real *turn = &d->direction[j * SG_N_F];
    int e, g, k;
    sg_fill(SG_N_F, SG_C(0.0), turn);
    for (k = 0; k < SG_N_CONTACTS; ++k) {
        const int f = sg_contacts[k].friction;
        real size = SG_C(0.0);
        if (sg_contacts[k].components < 2 || !sg_rubs(w, k) || !sg_slips_in(w->segment.mode[k])) {
            continue;
        }
        size = sg_norm(2, &w->slip_rate[f]);
        if (SG_N_AXES > 0 || !(sg_slip_size(w, k) > SG_C(1.0))) {
            sg_lose(w, SG_ON_EDGE, k);
            continue;
        }
        for (e = 0; e < sg_contacts[k].components; ++e) {
            for (g = 0; g < sg_contacts[k].components; ++g) {
                const real unit = e == g ? SG_C(1.0) : SG_C(0.0);
                turn[f + e] += (unit - w->segment.direction[f + e] * w->segment.direction[f + g]) *
                               w->forward.slip_rate[f + g] / size;
            }
        }
    }
}

/* Changes of shares of friction, and of what is given at the first stage of a segment that takes
   `part` of the step and changes by `longer` of it. */
static void sg_change_given(SG(work) * w, int j, real part, real longer, int forces) {
    SG(directions) *d = &w->directions;
    SG(forward) *f = &w->forward;
    int c, e, k;
    sg_fill(SG_N_GAMMA + SG_N_F, SG_C(0.0), f->given);
    sg_fill(SG_N_F, SG_C(0.0), f->share);
    for (c = 0; c < SG_N_GAMMA && forces; ++c) {
        f->given[c] =
            part * d->force[j * SG_N_R + SG_N_G + c] + longer * w->segment.force[SG_N_G + c];
    }
    for (k = 0; k < SG_N_CONTACTS; ++k) {
        const sg_contact *contact = &sg_contacts[k];
        const int slips = sg_slips_in(w->segment.mode[k]);
        for (e = 0; e < contact->components && sg_rubs(w, k); ++e) {
            const int s = contact->friction + e;
            const real along = w->segment.direction[s];
            const real turn = d->direction[j * SG_N_F + s];
            if (slips && contact->normal >= 0) {
                f->share[s] = -(f->mu[k] * along + w->segment.mu[k] * turn);
            } else if (slips) {
                const real bound = w->segment.bound[contact->bound];
                f->given[SG_N_GAMMA + s] =
                    -((part * d->bound[j * SG_N_BOUNDS + contact->bound] + longer * bound) * along +
                      part * bound * turn);
            } else if (forces) {
                f->given[SG_N_GAMMA + s] = part * d->force[j * SG_N_R + SG_SLIP + s] +
                                           longer * w->segment.force[SG_SLIP + s];
            }
        }
    }
}

/* Changes of forces at the place where they were just found, by directions whose changes of t, q, v
   there are given. */
static void sg_forward_forces(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                              int last) {
    SG(directions) *d = &w->directions;
    SG(forward) *f = &w->forward;
    const sg_problem *pr = &sg_problems[SG_ACCELERATIONS];
    int e, j, k;
    sg_copy(SG_N_Q, w->trial.v, w->v); /* forces are measured without */
    SG(derivatives)(w, par, SG_ACCELERATIONS);
    for (j = 0; j <= last; ++j) {
        real *force = &d->force[j * SG_N_R];
        sg_turn_to(w, par, j, SG_C(0.0));
        sg_look_forward(w, par);
        sg_turn_directions(w, j);
        sg_fill(pr->n_x, SG_C(0.0), &f->x[pr->x]);
        sg_fill(SG_N_R, SG_C(0.0), &f->R[pr->R]);
        sg_change_given(w, j, SG_C(0.0), SG_C(0.0), 0);
        SG(values_forward)(w, par, SG_ACCELERATIONS);
        sg_copy(SG_N_BOUNDS, f->radius, &d->bound[j * SG_N_BOUNDS]);
        sg_change_given(w, j, SG_C(1.0), SG_C(0.0), 0);
        sg_solve_forward(w, par, opt, SG_ACCELERATIONS, j);
        sg_copy(SG_N_R, &f->R[pr->R], force);
        for (k = 0; k < SG_N_CONTACTS; ++k) {
            const sg_contact *contact = &sg_contacts[k];
            for (e = 0; e < contact->components; ++e) {
                const int s = contact->friction + e;
                force[SG_SLIP + s] += f->given[SG_N_GAMMA + s];
                if (contact->normal >= 0) {
                    const int n = SG_NORMAL + contact->normal;
                    force[SG_SLIP + s] +=
                        f->share[s] * w->segment.force[n] + w->share[s] * force[n];
                }
            }
        }
    }
}

/* 1 if a change of row c that should keep its place is one, measured by its terms. */
static int sg_is_change(const SG(work) * w, int c, real change) {
    real size = SG_C(0.0);
    int e;
    for (e = sg_table[sg_direction.start + c]; e < sg_table[sg_direction.start + c + 1]; ++e) {
        const int j = sg_table[sg_direction.index + e];
        size += SG_FABS(w->direction[e]) *
                (SG_FABS(w->forward.q[j]) + SG_FABS(w->forward.v[j]) + SG_FABS(w->v[j]));
    }
    return SG_FABS(change) > SG_TOUCH * size + SG_TINY;
}

/* 1 if the direction at hand leaves what holds at the start of a run: constraints, contacts that
   stay closed, sticking. */
static int sg_leaves_start(SG(work) * w, const SG(params) * par) {
    const sg_problem *pr = &sg_problems[SG_IMPACT];
    SG(forward) *f = &w->forward;
    int found = 0;
    int c, e, k;
    for (c = 0; c < SG_N_G; ++c) {
        const real change = sg_row_dot(&sg_direction, w->direction, c, f->q) + w->drift[c] * f->t;
        found = found || sg_is_change(w, c, change);
    }
    sg_copy(SG_N_Q, w->v, &w->x[pr->x]);
    sg_copy(SG_N_Q, f->v, &f->x[pr->x]);
    sg_fill(SG_N_R, SG_C(0.0), &w->R[pr->R]);
    sg_fill(SG_N_R, SG_C(0.0), &f->R[pr->R]);
    SG(values)(w, par, SG_IMPACT);
    SG(values_forward)(w, par, SG_IMPACT);
    for (c = 0; c < SG_N_G + SG_N_GAMMA; ++c) {
        found = found || sg_is_change(w, c, f->y[c]);
    }
    sg_look_forward(w, par);
    for (k = 0; k < SG_N_CONTACTS; ++k) {
        const int n = sg_contacts[k].normal;
        const int s = sg_contacts[k].friction;
        if (sg_holds(w, k) && n >= 0) {
            found = found || sg_is_change(w, SG_NORMAL + n, f->gap[n]) ||
                    sg_is_change(w, SG_NORMAL + n, f->gap_rate[n]);
        }
        for (e = 0; e < sg_contacts[k].components; ++e) {
            /* sticking, or about to slip one way: another velocity would slip the other */
            found = found || (sg_rubs(w, k) && !(sg_slip_size(w, k) > SG_C(1.0)) &&
                              sg_is_change(w, SG_SLIP + s + e, f->slip_rate[s + e]));
        }
    }
    return found;
}

/* Arrived at a place, modes chosen: changes of the forces there. */
static void sg_forward_place(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                             SG(info) * info, int struck) {
    SG(directions) *d = &w->directions;
    int used, j, k;
    for (k = 0; k < SG_N_CONTACTS && !struck && d->begins && !d->fresh; ++k) {
        if (w->segment.mode[k] != w->segment.before[k] && w->segment.before[k] != SG_K(UNKNOWN)) {
            sg_lose(w, SG_TOGETHER, k); /* a mode ends with the step */
        }
    }
    d->begins = 0;
    sg_fill(SG_N_WAYS * SG_N_R, SG_C(0.0), d->force);
    sg_fill(SG_N_WAYS * SG_N_BOUNDS, SG_C(0.0), d->bound);
    sg_fill(SG_N_WAYS * SG_N_F, SG_C(0.0), d->direction);
    if (w->segment.known) {
        sg_measure_motion(w, w->segment.h);
    }
    sg_look(w, par, w->segment.t, w->trial.q, w->trial.v);
    for (j = 0; j < d->count && d->fresh; ++j) {
        sg_turn_to(w, par, j, SG_C(0.0));
        d->leaves[j] = sg_leaves_start(w, par);
    }
    d->fresh = 0;
    if (!w->segment.rubs) {
        return;
    }
    /* modes that were sought are held now; the step goes on with what it has found */
    sg_keep_start(w);
    used = info->iterations;
    if (sg_find_forces(w, par, opt, info) == SG_K(OK)) {
        sg_forward_forces(w, par, opt, d->count - 1);
    } else {
        sg_lose(w, SG_IS_SINGULAR, -1);
    }
    info->iterations = used;
    sg_copy(SG_N_Q, w->segment.start_acceleration, w->segment.acceleration);
    sg_copy(SG_N_R, w->segment.start_force, w->segment.force);
    sg_copy(SG_N_BOUNDS, w->segment.start_bound, w->segment.bound);
}

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
    const sg_problem *pr = &sg_problems[end];
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
        SG(values_forward)(w, par, problem); /* of all that follows from the unknowns */
        if (end == problem) {
            SG(finish_segment_forward)(w);
            sg_copy(SG_N_Q, f->v_end, &d->v_end[j * SG_N_Q]);
        } else {
            sg_ask_forward(w, par, end);
            sg_copy(pr->n_x, f->r, &d->r[j * SG_N_X]);
            sg_copy(pr->n_slots * SG_N_R, f->y, &d->y[j * SG_N_ROWS]);
            SG(finish_forward)(w);
        }
        sg_copy(SG_N_Q, f->q_end, &d->q_end[j * SG_N_Q]);
    }
}

/* Changes of the end of the segment at hand. */
static void sg_forward_end(SG(work) * w, const SG(params) * par, const SG(options) * opt) {
    SG(directions) *d = &w->directions;
    const int last = SG_N_CHAIN - 1;
    const sg_problem *pr = &sg_problems[last];
    int j;
    if (w->segment.rubs) {
        sg_forward_stages(w, par, opt, SG_SEGMENT, SG_SEGMENT);
        return;
    }
    sg_forward_stages(w, par, opt, 0, last);
    sg_stand_in(w, par, opt, last);
    for (j = 0; j <= d->count; ++j) {
        sg_copy(pr->n_x, &d->r[j * SG_N_X], w->forward.r);
        sg_copy(pr->n_slots * SG_N_R, &d->y[j * SG_N_ROWS], w->forward.y);
        sg_answer_forward(w, opt, last, j);
        sg_copy(SG_N_Q, &w->forward.x[pr->x], &d->v_end[j * SG_N_Q]);
    }
}

/* Direction j moves to the end of the segment, with its size as it is; the last goes along it. */
static void sg_move_to_end(SG(work) * w) {
    SG(directions) *d = &w->directions;
    d->t[d->count] = SG_C(1.0);
    sg_copy((d->count + 1) * SG_N_Q, d->q_end, d->q);
    sg_copy((d->count + 1) * SG_N_Q, d->v_end, d->v);
}

/* The segment has no length, because a step ended where its event is: the state and its changes
   stay, time would go on as it did. */
static void sg_stay(SG(work) * w) {
    SG(directions) *d = &w->directions;
    int i;
    d->t[d->count] = SG_C(1.0);
    for (i = 0; i < SG_N_Q; ++i) {
        d->q[d->count * SG_N_Q + i] = w->segment.v[i];
        d->v[d->count * SG_N_Q + i] = w->segment.acceleration[i] / w->segment.h;
    }
    sg_copy(SG_N_Q, w->segment.q, w->q_end);
    sg_copy(SG_N_Q, w->segment.v, w->v_end);
    if (!w->segment.known) {
        sg_lose(w, SG_TOGETHER, -1);
    }
}

/* Change of an event function of gaps, slips and guards along the direction at hand. */
static real sg_event_forward(const SG(work) * w, const sg_happening *event) {
    const SG(forward) *f = &w->forward;
    const sg_contact *contact = &sg_contacts[event->contact];
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
    const sg_contact *contact = &sg_contacts[event->contact];
    const real *force = &d->force[j * SG_N_R];
    const int n = SG_NORMAL + contact->normal;
    const int f = SG_SLIP + contact->friction;
    const real *F = &w->segment.force[f];
    const real size = sg_norm(contact->components, F);
    real change;
    int e;
    if (event->what == SG_FORCE_ENDS) {
        return force[n];
    }
    change = contact->normal >= 0 ? w->segment.mu[event->contact] * force[n] +
                                        w->forward.mu[event->contact] * w->segment.force[n]
                                  : d->bound[j * SG_N_BOUNDS + contact->bound];
    for (e = 0; e < contact->components; ++e) {
        change -= F[e] / size * force[f + e];
    }
    return change;
}

/* Changes of the event function at the end of the segment. */
static void sg_forward_event(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                             SG(info) * info, const sg_happening *event) {
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
            sg_copy(SG_N_Q, &d->q[j * SG_N_Q], w->forward.q);
            sg_copy(SG_N_Q, &d->v[j * SG_N_Q], w->forward.v);
            SG(change_parameters)(w, &d->par[j * SG_N_PAR]);
            sg_look_forward(w, par);
            d->event[j] = sg_event_forward(w, event);
        }
    }
}

/* How the end of the segment just accepted changes: events move in time, the step's end by what is
   said of it. */
static void sg_forward_segment(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                               SG(info) * info, const sg_happening *event) {
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
        sg_fill(SG_N_Q, SG_C(0.0), &d->q[last * SG_N_Q]);
        sg_fill(SG_N_Q, SG_C(0.0), &d->v[last * SG_N_Q]);
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
        for (i = 0; i < SG_N_Q; ++i) {
            d->q[j * SG_N_Q + i] += longer * d->q[last * SG_N_Q + i];
            d->v[j * SG_N_Q + i] += longer * d->v[last * SG_N_Q + i];
        }
    }
}

int SG(step_forward)(SG(state) * s, SG(work) * w, SG(info) * info, const SG(params) * par,
                     const SG(options) * opt, const real u[], real h, SG(directions) * d) {
    int status, j;
    if (w == NULL || d == NULL || opt == NULL || d->count < 0 || d->count > SG_N_WAYS - 1 ||
        opt->events != SG_K(EVENTS_LOCATED)) {
        if (info != NULL) {
            sg_reset_info(info);
            info->status = SG_K(BAD_ARGUMENT);
        }
        return SG_K(BAD_ARGUMENT);
    }
    w->directions = *d;
    w->directions.moves = 1;
    w->directions.begins = 1;
    for (j = 0; j < d->count; ++j) {
        w->directions.grid[j] += d->h[j];
    }
    /* the last direction is the size of a segment alone */
    sg_fill(SG_N_U, SG_C(0.0), &w->directions.u[d->count * SG_N_U]);
    sg_fill(SG_N_PAR, SG_C(0.0), &w->directions.par[d->count * SG_N_PAR]);
    status = sg_take_step(s, w, info, par, opt, u, h);
    if (status <= SG_K(OK_SUBSTEPPED)) {
        if (info->captured) {
            sg_lose(w, SG_CAPTURED_STEP, -1);
        }
        *d = w->directions;
    }
    return status;
}
