#pragma once
#include "sg_law_bound.c"
#include "sg_law_elliptic.c"
#include "sg_law_signorini.c"

/* Coulomb's law of one or two slip components: |R_F| <= radius, against the slip while it slips, as
   -R_F = prox(r gamma - R_F) onto the ball (65). What a slip direction is to the ball, `slip` is to
   the set of friction: R_F = -radius slip. */

/* Size of a percussion of contact k: at most its radius. */
static inline real sg_friction_size(const SG(work) * w, int k, const real *R) {
    const sg_contact *contact = sg_contact_at(w, k);
    if (SG_N_AXES > 0 && contact->components > 1) {
        real own[SG_N_SLIP];
        int d;
        for (d = 0; d < contact->components; ++d) {
            own[d] = sg_over_axis(w, contact->friction + d, R[d]);
        }
        return sg_norm(contact->components, own);
    }
    return sg_norm(contact->components, R);
}

/* `slip` for a slip velocity; returns the velocity's size. Where it is zero `slip` stays. */
static inline real sg_friction_slip(const SG(work) * w, int k, const real *gamma, real *slip) {
    const sg_contact *contact = sg_contact_at(w, k);
    real own[SG_N_SLIP];
    real size;
    int d;
    sg_fill(SG_N_SLIP, SG_C(0.0), own);
    for (d = 0; d < contact->components; ++d) {
        own[d] = sg_times_axis(w, contact->friction + d, gamma[d]);
    }
    size = sg_norm(contact->components, own);
    for (d = 0; d < contact->components && size > SG_C(0.0); ++d) {
        slip[d] = sg_times_axis(w, contact->friction + d, own[d] / size);
    }
    return size;
}

/* State and residual of the rows of contact k that begin at f, for percussions R of the problem. */
static inline void sg_friction_rows(SG(work) * w, int k, int f, const real *R, real radius) {
    const sg_contact *contact = sg_contact_at(w, k);
    real z[SG_N_SLIP];
    real ratio;
    int d;
    sg_fill(SG_N_SLIP, SG_C(0.0), z);
    for (d = 0; d < contact->components; ++d) {
        z[d] = sg_over_axis(w, contact->friction + d,
                            w->scales.prox_r[f + d] * w->y[f + d] - R[f + d]);
    }
    if (sg_prox_ball(contact->components, z, radius, w->scales.phi_floor[f], &w->rows.slip[f],
                     &ratio)) {
        for (d = 0; d < contact->components; ++d) {
            w->rows.kind[f + d] = SG_ROW_FREE;
            w->rows.phi[f + d] = sg_kinematic_residual(w, f + d);
        }
    } else {
        for (d = 0; d < contact->components; ++d) {
            const int c = contact->friction + d;
            w->rows.kind[f + d] = SG_ROW_SLIP;
            w->rows.slip[f + d] = sg_times_axis(w, c, w->rows.slip[f + d]);
            w->rows.phi[f + d] = R[f + d] + radius * w->rows.slip[f + d];
            w->rows.ratio[f + d] = ratio;
        }
    }
}

/* Rows without friction, whose percussions are to vanish. */
static inline void sg_friction_off(SG(work) * w, int k, int f, const real *R) {
    int d;
    for (d = 0; d < sg_contact_at(w, k)->components; ++d) {
        w->rows.kind[f + d] = SG_ROW_ZERO;
        w->rows.phi[f + d] = R[f + d];
    }
}

/* The same rows where a contact keeps the state that it is in. In space the direction of slip is
   that of the prox argument. */
static inline void sg_friction_held(SG(work) * w, int k, int f, const real *R, real radius) {
    const sg_contact *contact = sg_contact_at(w, k);
    real z[SG_N_SLIP];
    real size;
    int d;
    if (contact->components == 0 || w->rows.kind[f] != SG_ROW_SLIP) {
        return;
    }
    sg_fill(SG_N_SLIP, SG_C(0.0), z);
    for (d = 0; d < contact->components && contact->components > 1; ++d) {
        z[d] = sg_over_axis(w, contact->friction + d,
                            w->scales.prox_r[f + d] * w->y[f + d] - R[f + d]);
    }
    size = sg_norm(SG_N_SLIP, z);
    for (d = 0; d < contact->components; ++d) {
        if (size > SG_C(0.0)) {
            w->rows.slip[f + d] = sg_times_axis(w, contact->friction + d, z[d] / size);
            w->rows.ratio[f + d] = sg_max(SG_C(0.0), radius / size);
        }
        w->rows.phi[f + d] = R[f + d] + w->rows.slip[f + d] * radius;
    }
}

/* Change of phi in slip row `row` while it slips: `radius` is the change of the radius, dy holds
   the changes of the kinematic rows; row `column` (-1: none) has its percussion changed by one. */
static inline real sg_friction_change(const SG(work) * w, int row, const real *dy, real radius,
                                      int column) {
    const int c = row % sg_rows_of_slot(w) - sg_first_slip(w);
    const sg_contact *contact = sg_contact_at(w, sg_slip_at(w, c)->contact);
    const int first = row - sg_slip_at(w, c)->component;
    real change = row == column ? SG_C(1.0) : SG_C(0.0);
    int e;
    change += w->rows.slip[row] * radius;
    /* direction: ratio (1 - n n^T) (r C dx - dR), n n^T in units of the semi-axes */
    for (e = 0; e < contact->components && contact->components > 1; ++e) {
        const int other = first + e;
        const int c_e = contact->friction + e;
        const real along = sg_over_axis(w, c_e, sg_over_axis(w, c_e, w->rows.slip[other]));
        const real projector = (row == other ? SG_C(1.0) : SG_C(0.0)) - w->rows.slip[row] * along;
        real turn = w->scales.prox_r[other] * dy[other];
        if (other == column) {
            turn -= SG_C(1.0);
        }
        change += w->rows.ratio[row] * projector * turn;
    }
    return change;
}

/* Where friction is at the boundary of its set, it follows the normal percussion. */
static inline real sg_pressing_share(const SG(work) * w, int f, real R_N) {
    const int c = f % sg_rows_of_slot(w) - sg_first_slip(w);
    const real mu = c < 0
                        ? SG_C(0.0)
                        : sg_coefficient(w, f - f % sg_rows_of_slot(w), sg_slip_at(w, c)->contact);
    return R_N >= SG_C(0.0) || sg_is_followed(w) ? -(w->rows.slip[f] * mu) : SG_C(0.0);
}

/* Move a percussion R_F of n components with its normal percussion into a round cone, by as little
   as possible in units where a percussion of friction weighs as much as `unit` of the normal one.
   Returns 1 if it was outside. `share` < 1 leads a little into the cone. */
static inline int sg_into_cone(int n, real mu, real unit, real share, real *R_N, real *R_F) {
    const real slope = share * mu / unit;
    const real size = sg_norm(n, R_F) / unit;
    real push;
    int d;
    if (!(unit * size > mu * *R_N)) {
        return 0;
    }
    push = sg_max(*R_N + slope * size, SG_C(0.0)) / (SG_C(1.0) + slope * slope);
    *R_N = push;
    for (d = 0; d < n && size > SG_C(0.0); ++d) {
        R_F[d] *= slope * push / size;
    }
    return 1;
}

#if SG_SPATIAL
/* Percussions that the law asks of contact k where its rows y answer 1 / step to them, as moved =
   -prox(step y - R); steps are shorter along shorter semi-axes, as in (65) for an ellipse. */
static inline void sg_friction_relaxed(const SG(work) * w, int k, const real *y, const real *R,
                                       real step, real radius, real *moved) {
    const sg_contact *contact = sg_contact_at(w, k);
    real z[SG_N_SLIP];
    real share;
    int d;
    sg_fill(SG_N_SLIP, SG_C(0.0), z);
    for (d = 0; d < contact->components; ++d) {
        z[d] = sg_times_axis(w, contact->friction + d, step * y[d]) -
               sg_over_axis(w, contact->friction + d, R[d]);
    }
    share = sg_norm(contact->components, z);
    share = share > radius ? radius / share : SG_C(1.0);
    for (d = 0; d < contact->components; ++d) {
        moved[d] = -sg_times_axis(w, contact->friction + d, share * z[d]);
    }
}

/* 1 if percussions R of contact k are at the boundary of the set; `slip` is then their direction.
 */
static inline int sg_friction_leans(const SG(work) * w, int k, const real *R, real radius,
                                    real *slip) {
    int d;
    if (!(sg_friction_size(w, k, R) > radius * (SG_C(1.0) - SG_SMALL))) {
        return 0;
    }
    for (d = 0; d < sg_contact_at(w, k)->components && radius > SG_C(0.0); ++d) {
        slip[d] = -R[d] / radius;
    }
    return 1;
}
#endif

/* Radius on a path: that of bilateral percussions stays as it was where the path began. */
static inline real sg_path_radius(const SG(work) * w, int base, int k) {
    return sg_radius(w, base, k, sg_contact_at(w, k)->loads > 0 ? &w->R[w->path.first] : w->path.R);
}

/* Margin of a sticking contact to its cone: (mu R_N)^2 - |R_F|^2 = c + b t + a t^2 along a path;
   returns the first zero beyond t = 0. `entering`: c is zero, the margin grows. */
static real sg_friction_margin(real a, real b, real c, int entering) {
    real root, q;
    if (entering) {
        return b > SG_C(0.0) && a < SG_C(0.0) ? -b / a : SG_HUGE;
    }
    if (!(c > SG_C(0.0))) {
        return b < SG_C(0.0) || a < SG_C(0.0) ? SG_C(0.0) : SG_HUGE;
    }
    root = b * b - SG_C(4.0) * a * c;
    if (root < SG_C(0.0)) {
        return SG_HUGE;
    }
    /* Of the stable pair of roots q / a and c / q the smallest positive one. */
    q = b > SG_C(0.0) ? -(b + SG_SQRT(root)) / SG_C(2.0) : -(b - SG_SQRT(root)) / SG_C(2.0);
    {
        const real one = a != SG_C(0.0) ? q / a : SG_HUGE;
        const real two = q != SG_C(0.0) ? c / q : SG_HUGE;
        const real first = one > SG_C(0.0) ? one : SG_HUGE;
        const real second = two > SG_C(0.0) ? two : SG_HUGE;
        return first < second ? first : second;
    }
}

/* When contact k, which rubs in the rows from f on, begins to slip or to stick if tau moves on in
   the direction `way`, and which of the two. `was`: what it did at the last change. */
static real sg_friction_event(const SG(work) * w, int base, int k, real way, int was, int *what) {
    const sg_contact *contact = sg_contact_at(w, k);
    const int f = base + sg_first_slip(w) + contact->friction;
    int d;
    if (w->rows.kind[f] == SG_ROW_SLIP) {
        real value = SG_C(0.0);
        real rate = SG_C(0.0);
        for (d = 0; d < contact->components; ++d) {
            value += w->rows.slip[f + d] * w->path.y[f + d];
            rate += w->rows.slip[f + d] * w->path.y_rate[f + d];
        }
        *what = SG_STICKS;
        return was == SG_SLIPS ? SG_HUGE : sg_path_zero(value, way * rate);
    } else {
        const real radius = sg_path_radius(w, base, k);
        const real rate =
            contact->pressing >= 0 ? sg_radius(w, base, k, w->path.R_rate) : SG_C(0.0);
        real a = rate * rate;
        real b = SG_C(2.0) * way * radius * rate;
        real c = radius * radius;
        for (d = 0; d < contact->components; ++d) {
            const real force = sg_over_axis(w, contact->friction + d, w->path.R[f + d]);
            const real change = sg_over_axis(w, contact->friction + d, w->path.R_rate[f + d]);
            a -= change * change;
            b -= SG_C(2.0) * way * force * change;
            c -= force * force;
        }
        *what = SG_SLIPS;
        if (was == SG_STICKS && !(radius > SG_C(0.0)) && a < SG_C(0.0)) {
            return SG_C(0.0); /* from the apex friction would leave the cone */
        }
        return sg_friction_margin(a, b, c, was == SG_STICKS);
    }
}

/* How fast the quantity of the change `what` of contact k grows with tau right behind it. */
static real sg_friction_growth(const SG(work) * w, int base, int k, int what) {
    const sg_contact *contact = sg_contact_at(w, k);
    const int f = base + sg_first_slip(w) + contact->friction;
    real growth = SG_C(0.0);
    int d;
    if (what == SG_SLIPS) {
        for (d = 0; d < contact->components; ++d) {
            growth += w->rows.slip[f + d] * w->path.y_rate[f + d];
        }
    } else {
        const real radius = sg_path_radius(w, base, k);
        growth = contact->pressing >= 0 ? sg_radius(w, base, k, w->path.R_rate) : SG_C(0.0);
        if (!(radius > SG_C(0.0)) && contact->pressing >= 0) {
            return growth; /* closed without any slip: still at the apex of its cone */
        }
        growth *= radius;
        for (d = 0; d < contact->components; ++d) {
            growth -= sg_over_axis(w, contact->friction + d, w->path.R[f + d]) *
                      sg_over_axis(w, contact->friction + d, w->path.R_rate[f + d]);
        }
    }
    return growth;
}

/* Direction in which contact k slips once it closes or no longer sticks: where it moves, or against
   its friction; from the apex of the cone where friction would go. A direction that is known when
   it closes stays. */
static void sg_friction_slips(SG(work) * w, int base, int k, int what, real way) {
    const sg_contact *contact = sg_contact_at(w, k);
    const int f = base + sg_first_slip(w) + contact->friction;
    real direction[SG_N_SLIP];
    real size;
    int d;
    sg_fill(SG_N_SLIP, SG_C(0.0), direction);
    direction[0] = SG_C(1.0);
    if (what == SG_CLOSES && contact->components > 1 &&
        sg_norm(contact->components, &w->rows.slip[f]) > SG_C(0.0)) {
        return;
    }
    if (what == SG_CLOSES) {
        size = sg_friction_slip(w, k, &w->path.y[f], direction);
    } else {
        for (d = 0; d < contact->components; ++d) {
            direction[d] = -w->path.R[f + d];
        }
        size = sg_friction_size(w, k, direction);
        if (!(size > SG_C(0.0))) {
            for (d = 0; d < contact->components; ++d) {
                direction[d] = -way * w->path.R_rate[f + d];
            }
            size = sg_friction_size(w, k, direction);
        }
        for (d = 0; d < contact->components && size > SG_C(0.0); ++d) {
            direction[d] = direction[d] / size;
        }
    }
    for (d = 0; d < contact->components; ++d) {
        w->rows.slip[f + d] = size > SG_C(0.0) ? direction[d]
                              : d == 0         ? sg_times_axis(w, contact->friction, SG_C(1.0))
                                               : SG_C(0.0);
    }
}
