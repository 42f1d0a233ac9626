/* Start, many steps, and the evaluation of one problem at given unknowns. */

/* 1 if |value| is small against the terms of its row: direction `row`, argument x. The constant
   covers terms that only parameters make up. */
static int sg_is_consistent(real value, const real *row, const real *x, real drift) {
    real size = SG_FABS(drift);
    int j;
    for (j = 0; j < SG_NQ; ++j) {
        size += SG_FABS(row[j] * x[j]);
    }
    return SG_FABS(value) <= SG_STAGNATION * size + SG_C(64.0) * SG_EPS;
}

int SG(init)(SG(state) * s, const SG(params) * par, const SG(options) * opt, real t0,
             const real q0[], const real v0[]) {
    SG(consistency) at;
    int c, k;
    const int status = SG(set_state)(s, t0, q0, v0);
    if (status != SG_K(OK)) {
        return status;
    }
    if (par == NULL || opt == NULL || !sg_are_options(opt)) {
        return SG_K(BAD_ARGUMENT);
    }
    SG(evaluate_consistency)(t0, q0, v0, par, &at);
    for (c = 0; c < SG_NG; ++c) {
        if (!sg_finite(at.position[c])) {
            return SG_K(NONFINITE);
        }
        if (!sg_is_consistent(at.position[c], &at.direction[c * SG_NQ], q0, SG_C(0.0))) {
            return SG_K(INCONSISTENT_START);
        }
    }
    for (c = 0; c < SG_NORMAL; ++c) {
        if (!sg_finite(at.velocity[c])) {
            return SG_K(NONFINITE);
        }
        if (!sg_is_consistent(at.velocity[c], &at.direction[c * SG_NQ], v0, at.drift[c])) {
            return SG_K(INCONSISTENT_START);
        }
    }
    for (k = 0; k < SG_NK; ++k) {
        const int n = SG_NORMAL + sg_contacts[k].normal;
        if (sg_contacts[k].normal >= 0 && !(sg_contacts[k].guarded && at.guard[k] < SG_C(0.0))) {
            if (!sg_finite(at.position[n])) {
                return SG_K(NONFINITE);
            }
            if (at.position[n] < SG_C(0.0) &&
                !sg_is_consistent(at.position[n], &at.direction[n * SG_NQ], q0, SG_C(0.0))) {
                return SG_K(INCONSISTENT_START);
            }
        }
    }
    return SG_K(OK);
}

/* Row `row` of the record after a step. */
static void sg_record(const SG(record) * to, int row, const SG(state) * s, const SG(work) * w,
                      const SG(info) * info) {
    if (to->t != NULL) {
        to->t[row] = s->t;
    }
    if (to->q != NULL) {
        sg_copy(SG_NQ, s->q, &to->q[row * SG_NQ]);
    }
    if (to->v != NULL) {
        sg_copy(SG_NQ, s->v, &to->v[row * SG_NQ]);
    }
    if (to->P != NULL) {
        sg_copy(SG_NC, info->P, &to->P[row * SG_NC]);
    }
    if (to->residual != NULL) {
        to->residual[row] = info->residual;
    }
    if (to->smallest_gap != NULL) {
        to->smallest_gap[row] = info->smallest_gap;
    }
    if (to->counts != NULL) {
        int *counts = &to->counts[row * 6];
        counts[0] = info->status;
        counts[1] = info->iterations;
        counts[2] = info->substeps;
        counts[3] = info->rescues;
        counts[4] = info->percussions;
        counts[5] = info->lost_impacts;
    }
    if (to->stage_t != NULL && to->stage_q != NULL && to->stage_v != NULL && to->stage_R != NULL) {
        SG(stages)(w, &to->stage_t[row * SG_STAGES], &to->stage_q[row * SG_STAGES * SG_NQ],
                   &to->stage_v[row * SG_STAGES * SG_NQ], &to->stage_R[row * SG_STAGES * SG_NC]);
    }
}

int SG(simulate)(SG(state) * s, SG(work) * w, SG(info) * info, const SG(params) * par,
                 const SG(options) * opt, const real u[], real h, int n_steps, int every,
                 const SG(record) * record, int *done) {
    int step;
    if (done == NULL || n_steps < 0 || every < 1 || (SG_NU > 0 && u == NULL)) {
        return SG_K(BAD_ARGUMENT);
    }
    for (*done = 0, step = 0; step < n_steps; ++step) {
        const int status = SG(step)(s, w, info, par, opt, SG_NU > 0 ? &u[step * SG_NU] : u, h);
        if (status > SG_K(OK_SUBSTEPPED)) {
            return status;
        }
        ++*done;
        if (record != NULL && *done % every == 0) {
            sg_record(record, *done / every - 1, s, w, info);
        }
    }
    return SG_K(OK);
}

int SG(problem)(const SG(state) * s, SG(work) * w, const SG(params) * par, const SG(options) * opt,
                const real u[], real h, int problem, const real x[], const real lambda[]) {
    SG(info) info;
    int j, k;
    if (s == NULL || w == NULL || par == NULL || opt == NULL || x == NULL || lambda == NULL ||
        problem < 0 || problem >= SG_PROBLEMS || !(h > SG_C(0.0)) || (SG_NU > 0 && u == NULL)) {
        return SG_K(BAD_ARGUMENT);
    }
    sg_reset_info(&info);
    sg_copy(SG_NX_TOTAL, x, w->x);
    sg_copy(SG_NL_TOTAL, lambda, w->lambda);
    for (j = 0; j < SG_NU; ++j) {
        w->u[j] = u[j];
    }
    for (j = 0; j < SG_NGAMMA; ++j) {
        w->carried[j] = s->has_force ? s->carried[j] : lambda[SG_NG + j] / h;
    }
    w->trial = *s;
    sg_begin(w, par, s->t, h);
    if (!sg_masses(w)) {
        return SG_K(SINGULAR);
    }
    for (k = 0; k < SG_NK; ++k) {
        w->exists[k] = !sg_contacts[k].guarded || w->guard[k] >= SG_C(0.0);
        w->active[k] = w->exists[k];
    }
    for (k = 0; k <= problem; ++k) {
        sg_prox_parameters(w, opt, k);
        sg_evaluate(w, par, opt, k);
        if (k < problem && sg_problems[k + 1].follows) {
            sg_activity(w, opt, &info, k);
        }
    }
    SG(derivatives)(w, par, problem);
    return SG_K(OK);
}
