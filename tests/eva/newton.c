/* Entry of an analysis: model functions, scales, sparse elimination, percussion system and Newton's
   method of one model, from any state, any unknowns and any contact states. */
#include "__fc_builtin.h"
#include "m.c"

#include "../c/sizes.h"

static m_work work;
static m_info info;

static void any(int n, m_real *x, m_real top) {
    int i;
    for (i = 0; i < n; ++i) {
        x[i] = Frama_C_double_interval(-top, top);
    }
}

int main(void) {
    m_params par = m_default_params();
    m_options opt = m_default_options();
    m_real measure = 0.0;
    int problem, k;
    work.t = Frama_C_double_interval(0.0, 1e3);
    work.h = Frama_C_double_interval(1e-6, 1.0);
    any(SG_N_Q, work.q, 10.0);
    any(SG_N_Q, work.v, 1e3);
    any(SG_N_U, work.u, 1e3);
    any(SG_N_X_TOTAL, work.x, 1e3);
    any(SG_N_ROWS_TOTAL, work.R, 1e3);
    work.smooth.pivoting = Frama_C_interval(0, 1);
    work.newton.mode = Frama_C_interval(SG_AT_REST, SG_LATER_ATTEMPT);
#ifdef ANY_OPTIONS
    work.newton.mode = Frama_C_interval(SG_AT_REST, SG_LAST_RESORT);
    opt.scaling = Frama_C_interval(0, 1) ? M_SCALING_ROWS : M_SCALING_NONE;
    opt.r = Frama_C_double_interval(0.0, 1e3);
#endif
#if SG_N_KEY > 0
    m_evaluate_terms(work.t, work.q, &par, work.trial.terms);
#endif
    m_start(&work, &par);
    if (!sg_masses(&work)) {
        return 1;
    }
    for (k = 0; k < SG_N_CONTACTS; ++k) {
        work.found.exists[k] = Frama_C_interval(0, 1);
        work.found.active[k] = Frama_C_interval(0, 1);
    }
    for (problem = 0; problem < SG_N_PROBLEMS; ++problem) {
        int iterations = 0;
        sg_prox_parameters(&work, &opt, problem);
        sg_newton(&work, &par, &opt, problem, Frama_C_interval(0, 200), Frama_C_interval(0, 1),
                  &iterations, &measure);
    }
    return 0;
}
