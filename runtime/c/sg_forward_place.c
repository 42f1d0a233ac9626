#pragma once
#include "sg_directions.c"
#include "sg_located.c"

/* What directions become at one place: behind an impact, of the forces there, at the start of a
 * run. */

/* Changes of gaps, velocities and guards at the place at hand. */
static void sg_look_forward(SG(work) * w, const SG(params) * par) {
    w->forward.look_t = w->forward.t;
    sg_copy(sg_n_q(w), w->forward.q, w->forward.look_q);
    sg_copy(sg_n_q(w), w->forward.v, w->forward.look_v);
    SG(watch_forward)(w, par);
}

/* 1 if friction of contact k slides at an ellipse, whose turning and axes are not differentiated.
 */
static int sg_slides_on_ellipse(const SG(work) * w, int k) {
    const int f = sg_first_slip(w) + sg_contact_at(w, k)->friction;
    return SG_N_AXES > 0 && sg_contact_at(w, k)->components > 1 && w->found.active[k] &&
           w->rows.kind[f] == SG_ROW_SLIP;
}

/* About to strike: the place moves along the motion before, so that the gap stays closed. That is
   so already where the impact was located; a step may have ended there instead. */
static void sg_forward_strike(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                              SG(report) * info) {
    SG(directions) *d = &w->directions;
    int k = 0;
    int i, j;
    d->now = w->segment.t;
    while (k < sg_n_contacts(w) - 1 && !sg_strikes(w, k)) {
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
        longer = -(w->forward.gap[sg_contact_at(w, k)->normal] /
                   w->gap_rate[sg_contact_at(w, k)->normal]);
        d->t[j] += longer;
        for (i = 0; i < sg_n_q(w); ++i) {
            d->q[j * sg_n_q(w) + i] += longer * w->trial.v[i];
            d->v[j * sg_n_q(w) + i] += longer * w->segment.acceleration[i] / w->segment.h;
        }
    }
    w->segment.known = 0;
}

/* Changes of the velocities behind an impact that was just solved. `rests`: a contact lost its
   restitution. */
static void sg_forward_impact(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                              int rests) {
    SG(directions) *d = &w->directions;
    const sg_problem *pr = sg_problem_at(w, SG_IMPACT);
    int struck = -1;
    int j, k;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        if (sg_strikes(w, k)) {
            const int n = sg_contact_at(w, k)->normal;
            if (struck >= 0) {
                sg_lose(w, SG_TOGETHER, k);
            }
            struck = k;
            if (-w->gap_rate[n] < SG_STEEP * w->scales.speed[sg_first_normal(w) + n]) {
                sg_lose(w, SG_GRAZES, k);
            }
        }
        if (!sg_is_sharp(w, pr, 0, k) || sg_slides_on_ellipse(w, k)) {
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
        sg_copy(sg_n_q(w), &w->forward.x[pr->x], &d->v[j * sg_n_q(w)]);
    }
}

/* Changes of the directions of slip, of contacts that slip in space. */
static void sg_turn_directions(SG(work) * w, int j) {
    SG(directions) *d = &w->directions;
    real *turn = &d->direction[j * sg_n_F(w)];
    int e, g, k;
    sg_fill(sg_n_F(w), SG_C(0.0), turn);
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const int f = sg_contact_at(w, k)->friction;
        real size = SG_C(0.0);
        if (sg_contact_at(w, k)->components < 2 || !sg_rubs(w, k) ||
            !sg_slips_in(w->segment.mode[k])) {
            continue;
        }
        size = sg_norm(sg_contact_at(w, k)->components, &w->slip_rate[f]);
        if (SG_N_AXES > 0 || !(sg_slip_size(w, k) > SG_C(1.0))) {
            sg_lose(w, SG_ON_EDGE, k);
            continue;
        }
        for (e = 0; e < sg_contact_at(w, k)->components; ++e) {
            for (g = 0; g < sg_contact_at(w, k)->components; ++g) {
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
    sg_fill(sg_n_gamma(w) + sg_n_F(w), SG_C(0.0), f->given);
    sg_fill(sg_n_F(w), SG_C(0.0), f->share);
    for (c = 0; c < sg_n_gamma(w) && forces; ++c) {
        f->given[c] = part * d->force[j * sg_n_R(w) + sg_n_g(w) + c] +
                      longer * w->segment.force[sg_n_g(w) + c];
    }
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const sg_contact *contact = sg_contact_at(w, k);
        const int slips = sg_slips_in(w->segment.mode[k]);
        for (e = 0; e < contact->components && sg_rubs(w, k); ++e) {
            const int s = contact->friction + e;
            const real along = w->segment.direction[s];
            const real turn = d->direction[j * sg_n_F(w) + s];
            if (slips && contact->presser >= 0) {
                f->share[s] = -(f->mu[k] * along + w->segment.mu[k] * turn);
            } else if (slips) {
                const real bound = w->segment.bound[contact->bound];
                f->given[sg_n_gamma(w) + s] =
                    -((part * d->bound[j * sg_n_bounds(w) + contact->bound] + longer * bound) *
                          along +
                      part * bound * turn);
            } else if (forces) {
                f->given[sg_n_gamma(w) + s] =
                    part * d->force[j * sg_n_R(w) + sg_first_slip(w) + s] +
                    longer * w->segment.force[sg_first_slip(w) + s];
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
    const sg_problem *pr = sg_problem_at(w, SG_ACCELERATIONS);
    int e, j, k;
    sg_copy(sg_n_q(w), w->trial.v, w->v); /* forces are measured without */
    SG(derivatives)(w, par, SG_ACCELERATIONS);
    for (j = 0; j <= last; ++j) {
        real *force = &d->force[j * sg_n_R(w)];
        sg_turn_to(w, par, j, SG_C(0.0));
        sg_look_forward(w, par);
        sg_turn_directions(w, j);
        sg_fill(pr->n_x, SG_C(0.0), &f->x[pr->x]);
        sg_fill(sg_n_R(w), SG_C(0.0), &f->R[pr->R]);
        sg_change_given(w, j, SG_C(0.0), SG_C(0.0), 0);
        SG(values_forward)(w, par, SG_ACCELERATIONS);
        sg_copy(sg_n_bounds(w), f->radius, &d->bound[j * sg_n_bounds(w)]);
        sg_change_given(w, j, SG_C(1.0), SG_C(0.0), 0);
        sg_solve_forward(w, par, opt, SG_ACCELERATIONS, j);
        sg_copy(sg_n_R(w), &f->R[pr->R], force);
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const sg_contact *contact = sg_contact_at(w, k);
            for (e = 0; e < contact->components; ++e) {
                const int s = contact->friction + e;
                force[sg_first_slip(w) + s] += f->given[sg_n_gamma(w) + s];
                if (contact->pressing >= 0) {
                    const int n = sg_first_normal(w) + contact->pressing;
                    force[sg_first_slip(w) + s] +=
                        f->share[s] * w->segment.force[n] + w->share[s] * force[n];
                }
            }
        }
    }
}

/* 1 if a change of row c that should keep its place is one, measured by what its terms can be. */
static int sg_is_change(const SG(work) * w, int c, real change) {
    real size = SG_C(0.0);
    real most = SG_C(0.0);
    int e, j;
    for (e = sg_kind_of(w)->direction.start[c]; e < sg_kind_of(w)->direction.start[c + 1]; ++e) {
        size += SG_FABS(w->direction[e]);
    }
    for (j = 0; j < sg_n_q(w); ++j) {
        most = sg_max(most, SG_FABS(w->forward.q[j]) + SG_FABS(w->forward.v[j]) + SG_FABS(w->v[j]));
    }
    return SG_FABS(change) > SG_TOUCH * size * most + SG_TINY;
}

/* 1 if the direction at hand leaves what holds at the start of a run: constraints, contacts that
   stay closed, sticking. */
static int sg_leaves_start(SG(work) * w, const SG(params) * par) {
    const sg_problem *pr = sg_problem_at(w, SG_IMPACT);
    SG(forward) *f = &w->forward;
    int found = 0;
    int c, e, k;
    for (c = 0; c < sg_n_g(w); ++c) {
        const real change =
            sg_row_dot(&sg_kind_of(w)->direction, w->direction, c, f->q) + w->drift[c] * f->t;
        found = found || sg_is_change(w, c, change);
    }
    sg_copy(sg_n_q(w), w->v, &w->x[pr->x]);
    sg_copy(sg_n_q(w), f->v, &f->x[pr->x]);
    sg_fill(sg_n_R(w), SG_C(0.0), &w->R[pr->R]);
    sg_fill(sg_n_R(w), SG_C(0.0), &f->R[pr->R]);
    SG(values)(w, par, SG_IMPACT);
    SG(values_forward)(w, par, SG_IMPACT);
    for (c = 0; c < sg_n_g(w) + sg_n_gamma(w); ++c) {
        found = found || sg_is_change(w, c, f->y[c]);
    }
    sg_look_forward(w, par);
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const int n = sg_contact_at(w, k)->normal;
        const int s = sg_contact_at(w, k)->friction;
        if (sg_holds(w, k) && n >= 0) {
            found = found || sg_is_change(w, sg_first_normal(w) + n, f->gap[n]) ||
                    sg_is_change(w, sg_first_normal(w) + n, f->gap_rate[n]);
        }
        for (e = 0; e < sg_contact_at(w, k)->components; ++e) {
            /* sticking, or about to slip one way: another velocity would slip the other */
            found = found || (sg_rubs(w, k) && !(sg_slip_size(w, k) > SG_C(1.0)) &&
                              sg_is_change(w, sg_first_slip(w) + s + e, f->slip_rate[s + e]));
        }
    }
    return found;
}

/* Forces at the place contradict the modes before: contacts that are far from what they may carry
   leave their modes whatever small change there is. So it is where inputs jump as a step begins. */
static void sg_forward_jump(SG(work) * w) {
    int k;
    for (k = 0; k < sg_n_contacts(w); ++k) {
        const sg_contact *contact = sg_contact_at(w, k);
        const int f = sg_first_slip(w) + contact->friction;
        const real *R = w->segment.force;
        real radius = SG_C(0.0);
        real scale = SG_C(0.0);
        int jumps = 0;
        if (contact->pressing >= 0) {
            const int n = sg_first_normal(w) + contact->pressing;
            scale = w->scales.percussion_scale[n];
            radius = w->segment.mu[k] * R[n];
            jumps = R[n] < -(SG_STEEP * scale);
        } else {
            radius = w->segment.bound[contact->bound];
            scale = radius;
        }
        if (sg_rubs(w, k) && !sg_slips_in(w->segment.mode[k])) {
            scale = SG_STEEP * sg_max(scale, w->scales.percussion_scale[f]);
            jumps = jumps || sg_friction_size(w, k, &R[f]) > radius + scale;
        }
        w->directions.jumps[k] = sg_holds(w, k) && jumps;
    }
}

/* Arrived at a place, modes chosen: changes of the forces there. */
static void sg_forward_place(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                             SG(report) * info, int struck) {
    SG(directions) *d = &w->directions;
    int used, j, k;
    d->now = w->segment.t;
    for (k = 0; k < sg_n_contacts(w) && !struck && d->begins && !d->fresh; ++k) {
        if (w->segment.mode[k] != w->segment.before[k] && w->segment.before[k] != SG_K(UNKNOWN) &&
            !d->jumps[k]) {
            sg_lose(w, SG_TOGETHER, k); /* a mode ends with the step */
        }
    }
    for (k = 0; k < sg_n_contacts(w); ++k) {
        d->jumps[k] = 0;
    }
    d->begins = 0;
    sg_fill((d->count + 1) * sg_n_R(w), SG_C(0.0), d->force);
    sg_fill((d->count + 1) * sg_n_bounds(w), SG_C(0.0), d->bound);
    sg_fill((d->count + 1) * sg_n_F(w), SG_C(0.0), d->direction);
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
    sg_copy(sg_n_q(w), w->segment.start_acceleration, w->segment.acceleration);
    sg_copy(sg_n_R(w), w->segment.start_force, w->segment.force);
    sg_copy(sg_n_bounds(w), w->segment.start_bound, w->segment.bound);
}
