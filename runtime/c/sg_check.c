/* Acceptance of a step. Reads the state before, the unknowns and what the model says there
   (r_found, y_found, radius_found); shares nothing with the iteration that found them but the
   scales of the rows. */

/* Keep what the model says at the unknowns of one problem. */
static void sg_keep_rows(SG(work) * w, int problem) {
    const sg_problem *pr = &sg_problems[problem];
    sg_copy(pr->n_x, w->r, &w->r_found[pr->x]);
    sg_copy(pr->n_slots * SG_NC, w->y, &w->y_found[pr->lambda]);
    sg_copy(pr->n_slots * SG_NB, w->radius, &w->radius_found[pr->lambda / SG_ROWS * SG_NB]);
}

/* What the checker accepts: a share of a row's scale, or an absolute value; never more than the
   share SG_CHECK_MOST. */
typedef struct {
    real share, absolute;
} sg_limit;

static sg_limit sg_limits(const SG(options) * opt) {
    const real wish = SG_C(16.0) * opt->tol;
    const int absolute = opt->scaling == SG_K(SCALING_NONE);
    sg_limit limit;
    limit.share = absolute ? SG_CHECK : sg_min(sg_max(SG_CHECK, wish), SG_CHECK_MOST);
    limit.absolute = absolute ? wish : SG_C(0.0);
    return limit;
}

/* |x| within the limit for `scale`, plus an absolute floor. NaN is not. */
static inline int sg_small(real x, real scale, real floor, const sg_limit *limit) {
    const real bound = limit->share * scale + SG_C(64.0) * floor;
    return SG_FABS(x) <= sg_max(bound, sg_min(limit->absolute, SG_CHECK_MOST * scale));
}

/* 0 <= gap, 0 <= percussion, one of them zero. `floor` is the round-off of the percussion: that of
   the gap which it closes, times the response. */
static int sg_check_normal(real gap, real gap_scale, real gap_floor, real percussion, real scale,
                           real floor, const sg_limit *limit) {
    return (gap >= SG_C(0.0) || sg_small(gap, gap_scale, gap_floor, limit)) &&
           (percussion >= SG_C(0.0) || sg_small(percussion, scale, floor, limit)) &&
           (sg_small(gap, gap_scale, gap_floor, limit) ||
            sg_small(percussion, scale, floor, limit));
}

/* Percussion in the disc, and against the slip: the dissipation radius |gamma| is attained. `floor`
   is the round-off of the slip velocity, `blur` that of the radius. */
static int sg_check_friction(int n, const real *gamma, real speed, const real *percussion,
                             real radius, real scale, real floor, real blur,
                             const sg_limit *limit) {
    const real size = sg_norm(n, percussion);
    const real slip = sg_norm(n, gamma);
    const real power = sg_dot(n, gamma, percussion);
    const real bound = sg_max(radius, SG_C(0.0));
    if (!sg_finite(size) || !sg_finite(slip)) {
        return 0;
    }
    if (size > bound && !sg_small(size - bound, sg_max(scale, bound), blur, limit)) {
        return 0;
    }
    return sg_small(bound * slip + power, sg_max(scale, bound) * sg_max(speed, slip),
                    sg_max(scale, bound) * floor + blur * slip, limit);
}

/* Round-off of the normal percussion of a slot: the iteration takes a contact for closed within it,
   so the checker cannot ask for more. */
static real sg_normal_floor(const SG(work) * w, const sg_problem *pr, int slot, int n) {
    const real own = SG_FLOOR * w->percussion_scale[n];
    return sg_is_gap(pr, slot, n)
               ? own + w->m_eff[n] * w->gap_floor[n] / (w->h * sg_response[pr->response + slot][0])
               : own;
}

/* Rows of one problem at the solution. */
static int sg_check_problem(const SG(work) * w, const SG(options) * opt, int problem) {
    const sg_problem *pr = &sg_problems[problem];
    const real *lambda = &w->lambda[pr->lambda];
    const real *y = &w->y_found[pr->lambda];
    const sg_limit limit = sg_limits(opt);
    int slot, c, i, j, k;
    if (!sg_all_finite(pr->n_x, &w->x[pr->x]) || !sg_all_finite(pr->n_slots * SG_NC, lambda)) {
        return 0;
    }
    for (i = pr->x; i < pr->x + pr->n_x; i += SG_NQ) {
        for (j = 0; j < SG_NQ; ++j) {
            if (!sg_small(w->r_found[i + j], w->momentum_scale[j], SG_C(0.0), &limit)) {
                return 0;
            }
        }
    }
    for (slot = 0; slot < pr->n_slots; ++slot) {
        const int base = slot * SG_NC;
        const real rate = sg_slot_rate(w, pr, slot);
        for (c = 0; c < SG_NORMAL; ++c) {
            const int gap = sg_is_gap(pr, slot, c);
            if (!sg_takes_part(pr, slot, c)) {
                if (lambda[base + c] != SG_C(0.0)) {
                    return 0;
                }
                continue;
            }
            if (!sg_small(y[base + c], gap ? w->h * w->speed[c] : w->speed[c],
                          gap ? w->gap_floor[c] : w->gap_floor[c] * rate, &limit)) {
                return 0;
            }
        }
        for (k = 0; k < SG_NK; ++k) {
            const sg_contact *contact = &sg_contacts[k];
            const int f = SG_SLIP + contact->friction;
            real radius = SG_C(0.0);
            real scale = contact->components > 0 ? w->percussion_scale[f] : SG_C(0.0);
            real blur = SG_C(0.0);
            int closed = w->exists[k];
            if (contact->normal >= 0) {
                const int n = SG_NORMAL + contact->normal;
                const real R = lambda[base + n];
                const int position = sg_is_gap(pr, slot, n);
                const real floor = sg_normal_floor(w, pr, slot, n);
                if (pr->follows) {
                    closed = closed && w->active[k];
                }
                if (!closed) {
                    if (R != SG_C(0.0)) {
                        return 0;
                    }
                } else if (!sg_check_normal(y[base + n],
                                            position ? w->h * w->speed[n] : w->speed[n],
                                            position ? w->gap_floor[n] : SG_C(0.0), R,
                                            w->percussion_scale[n], floor, &limit)) {
                    return 0;
                }
                radius = w->mu[k] * R;
                blur = w->mu[k] * floor;
                /* The radius is as uncertain as the normal percussion. */
                scale = sg_max(scale, w->mu[k] * w->percussion_scale[n]);
            } else {
                radius = w->radius_found[(pr->lambda / SG_ROWS + slot) * SG_NB + contact->bound];
            }
            if (!closed) {
                for (i = 0; i < contact->components; ++i) {
                    if (lambda[base + f + i] != SG_C(0.0)) {
                        return 0;
                    }
                }
            } else if (contact->components > 0 &&
                       !sg_check_friction(contact->components, &y[base + f], w->speed[f],
                                          &lambda[base + f], radius, scale, w->gap_floor[f] * rate,
                                          blur, &limit)) {
                return 0;
            }
        }
    }
    return 1;
}

/* Contacts that must, or must not, take part in the impact equations (67), judged from gaps and
   percussions of the position problem with the checker's tolerance. */
static int sg_check_active(const SG(work) * w, const SG(options) * opt, int problem) {
    const sg_problem *pr = &sg_problems[problem];
    const sg_limit limit = sg_limits(opt);
    int k, slot;
    for (k = 0; k < SG_NK; ++k) {
        int must = 0;
        int may = 0;
        const int n = SG_NORMAL + sg_contacts[k].normal;
        if (sg_contacts[k].normal < 0 || !w->exists[k]) {
            continue;
        }
        for (slot = 0; slot < pr->n_slots; ++slot) {
            const int row = slot * SG_NC + n;
            if (opt->active_set == SG_K(ACTIVE_END) && slot + 1 < pr->n_slots) {
                continue;
            }
            if (!sg_small(w->lambda[pr->lambda + row], w->percussion_scale[n],
                          sg_normal_floor(w, pr, slot, n), &limit)) {
                must = 1;
            }
            if (sg_small(w->y_found[pr->lambda + row], w->h * w->speed[n], w->gap_floor[n],
                         &limit)) {
                may = 1;
            }
        }
        if ((must && !w->active[k]) || (w->active[k] && !may)) {
            return 0;
        }
    }
    return 1;
}
