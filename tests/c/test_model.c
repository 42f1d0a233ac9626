/* Unit tests of the solver on any model, compiled with its generated stepper (prefix m), included
   as it is so that static functions can be called: Newton matrix and direction against difference
   quotients and against the equations they solve, the checker on every solution spoiled in one
   number, limits and failures of every loop. */
#include "m.c"
#include "m_model.c"

#include "ensure.h"
#include "sizes.h"
#include <string.h>

/* free, zero, slip rows; directions; spoiled numbers; steps; rescued; lost impacts */
static int counted[11];

#define ROWS (SG_N_ROWS_TOTAL > 0 ? SG_N_ROWS_TOTAL : 1)
#define SLOPES SG_N_X_TOTAL
#define INPUTS (SG_N_U > 0 ? SG_N_U : 1)

static m_work work, other;
static m_params par;
static m_options opt;
static m_state state;
static m_info info;
static double u[INPUTS];

/* A small deterministic generator, uniform in [-1, 1]. */
static unsigned long seed = 2463534242UL;
static double uniform(void) {
    seed = (1103515245UL * seed + 12345UL) & 0x7fffffffUL;
    return 2.0 * (double)seed / 2147483647.0 - 1.0;
}

/* A start near the model's own one. Its velocities are drawn where no constraint forbids it. */
static void draw_start(void) {
    double t, q[SG_N_Q], v[SG_N_Q];
    int j;
    m_initial_state(&par, &t, q, v);
    for (j = 0; j < SG_N_Q; ++j) {
        if (SG_N_G + SG_N_GAMMA == 0) {
            v[j] += 2.0 * uniform();
        }
    }
    for (j = 0; j < INPUTS; ++j) {
        u[j] = uniform();
    }
    ENSURE(m_set_state(&state, t + uniform(), q, v) == M_OK);
}

/* A step opened by hand: start, masses, prox parameters; all contacts take part. */
static void open_step(double h) {
    int k, problem;
    work.newton.mode = SG_FIRST_ATTEMPT;
    work.smooth.pivoting = 0;
    work.system.deficiency = 0;
    sg_copy(SG_N_U, u, work.u);
    work.trial = state;
    sg_begin(&work, &par, state.t, h);
    ENSURE(sg_elliptic_begin(&work) && sg_masses(&work));
    for (k = 0; k < SG_N_CONTACTS; ++k) {
        work.found.exists[k] = work.found.active[k] = 1;
    }
    for (problem = 0; problem < SG_N_PROBLEMS; ++problem) {
        sg_prox_parameters(&work, &opt, problem);
    }
}

static void draw_unknowns(int problem) {
    const sg_problem *pr = &sg_problems[problem];
    int i;
    for (i = 0; i < pr->n_x; ++i) {
        work.x[pr->x + i] = state.v[i % SG_N_Q] + 0.3 * uniform();
    }
    for (i = 0; i < pr->n_slots * SG_N_R; ++i) {
        work.R[pr->R + i] = 0.4 * uniform();
    }
}

#include "test_directions.h"

/* A problem tried again: contacts that hold. What it calls solved is no further off than what the
   checker is asked about. */
static void test_last_attempt(void) {
    int trial, again;
    for (trial = 0; trial < 30; ++trial) {
        for (again = 0; again < 2; ++again) {
            int status;
            draw_start();
            open_step(0.01);
            sg_reset_info(&info);
            work.found.stuck = 0;
            if (again) {
                status = sg_solve(&work, &state, &par, &opt, &info, 0, 0, SG_WHOLE, 12);
                ENSURE(info.iterations <= 12);
            }
            status = sg_solve(&work, &state, &par, &opt, &info, 0, 0, SG_AGAIN, 120);
            ENSURE(info.iterations <= 120);
            if (status == M_OK) {
                real stall;
                sg_evaluate(&work, &par, &opt, 0);
                (void)sg_merit(&work, 0, &stall);
                ENSURE(stall <= 4.0 * SG_CHECK / SG_STAGNATION);
            }
        }
    }
}

static int accepted(void) {
    int problem;
    m_finish(&work);
    for (problem = 0; problem < SG_N_PROBLEMS; ++problem) {
        m_values(&work, &par, problem);
        sg_keep_rows(&work, problem);
        if (!sg_check_problem(&work, &opt, problem)) {
            return 0;
        }
        if (problem + 1 < SG_N_PROBLEMS && sg_problems[problem + 1].follows &&
            !sg_check_active(&work, &opt, problem)) {
            return 0;
        }
    }
    return sg_all_finite(SG_N_Q, work.q_end) && sg_all_finite(SG_N_Q, work.v_end);
}

/* Steps on the way from the start; each solution is spoiled in one number at a time. */
static void test_checker(void) {
    int trial, step, i;
    for (trial = 0; trial < 6; ++trial) {
        draw_start();
        for (step = 0; step < 60; ++step) {
            sg_reset_info(&info);
            sg_copy(SG_N_U, u, work.u);
            work.trial = state;
            if (sg_attempt(&work, &par, &opt, &info, state.t, 0.01, 1, 200) != M_OK) {
                break;
            }
            ++counted[5];
            counted[6] += info.rescues != 0;
            ENSURE(accepted());
            if (step % 6 == 0) {
                other = work;
                for (i = 0; i < SG_N_X_TOTAL; ++i) {
                    work.x[i] += 1e-3 * (1.0 + fabs(work.x[i]));
                    ENSURE(!accepted());
                    work = other;
                    work.x[i] = i % 2 ? NAN : INFINITY;
                    ENSURE(!accepted());
                    work = other;
                    counted[4] += 2;
                }
                for (i = 0; i < SG_N_ROWS_TOTAL; ++i) {
                    work.R[i] += 1e-3 * (1.0 + fabs(work.R[i]));
                    ENSURE(!accepted());
                    work = other;
                    work.R[i] -= 0.1 * (1.0 + fabs(work.R[i]));
                    ENSURE(!accepted());
                    work = other;
                    work.R[i] = NAN;
                    ENSURE(!accepted());
                    work = other;
                    counted[4] += 3;
                }
                ENSURE(accepted());
            }
            sg_commit(&work, &par, &info);
            state = work.trial;
            state.t += 0.01;
        }
    }
}

/* The ellipse of friction in the solver and in the checker, against its definition. */
static void test_axes(void) {
#if SG_N_AXES > 0
    double R[2] = {0.3, -0.2};
    double gamma[2] = {1.5, 0.7};
    int k;
    open_step(0.01);
    for (k = 0; k < SG_N_CONTACTS; ++k) {
        const int c = sg_contacts[k].friction;
        const double mu = work.mu[k];
        const double *force = R;
        const double *rate = gamma;
        double in_disc[2], at_rate[2];
        sg_check_in_disc(&work, k, &force, &rate, in_disc, at_rate);
        if (sg_contacts[k].normal < 0 || sg_contacts[k].components < 2) {
            continue;
        }
        /* the work is the same, and what the ellipse bounds the disc bounds */
        ENSURE(fabs(sg_dot(2, force, rate) - sg_dot(2, R, gamma)) <= 1e-15);
        ENSURE(fabs(sg_check_norm(2, force) / mu -
                    hypot(R[0] / work.mu_F[c], R[1] / work.mu_F[c + 1])) <= 1e-14);
        ENSURE(fabs(sg_friction_size(&work, k, R) - sg_check_norm(2, force)) <= 1e-15);
        /* without friction, or with one coefficient that is none */
        work.mu[k] = 0.0;
        force = R;
        rate = gamma;
        sg_check_in_disc(&work, k, &force, &rate, in_disc, at_rate);
        ENSURE(force == R && rate == gamma);
        ENSURE(sg_elliptic_begin(&work) && work.elliptic.axis[c] == 1.0);
        work.mu[k] = mu;
        work.mu_F[c] = 0.0;
        ENSURE(!sg_elliptic_begin(&work));
        open_step(0.01);
        work.mu_F[c] = NAN;
        ENSURE(!sg_elliptic_begin(&work));
        open_step(0.01);
    }
#endif
}

/* What ends an iteration: a limit, a number that is not finite, a singular matrix. */
static void test_ends(void) {
    m_params bad = par;
    double measure = 0.0;
    int iterations = 0;
    int problem;
    draw_start();
    open_step(0.02);
    for (problem = 0; problem < SG_N_PROBLEMS; ++problem) {
        const sg_problem *pr = &sg_problems[problem];
        const int n_rows = pr->n_slots * SG_N_R;
        draw_unknowns(problem);
        iterations = 0;
        ENSURE(sg_newton(&work, &par, &opt, problem, 0, 0, &iterations, &measure) ==
               M_NOT_CONVERGED);
        ENSURE(iterations == 0 && measure > 1.0);
        work.x[pr->x] = NAN;
        ENSURE(sg_newton(&work, &par, &opt, problem, 5, 0, &iterations, &measure) == M_NONFINITE);
        ENSURE(sg_newton(&work, &par, &opt, problem, 5, 1, &iterations, &measure) == M_NONFINITE);
        ENSURE(sg_residual(&work, &opt, problem) == SG_HUGE);
        draw_unknowns(problem);
        sg_evaluate(&work, &par, &opt, problem);
        if (n_rows > 0) {
            work.rows.phi[n_rows - 1] = INFINITY;
            ENSURE(sg_residual(&work, &opt, problem) == SG_HUGE);
        }
        /* a smooth block that is singular or not finite */
        sg_evaluate(&work, &par, &opt, problem);
        m_derivatives(&work, &par, problem);
        sg_fill(pr->K.start[pr->n_border], 0.0, work.K);
        ENSURE(sg_newton_direction(&work, &opt, problem, 0) == -1);
        sg_fill(pr->K.start[pr->n_border], NAN, work.K);
        ENSURE(sg_newton_direction(&work, &opt, problem, 1) == -1);
        ENSURE(sg_reduce(&work, problem, 1) == -1);
        /* one undamped and one damped solution agree */
        sg_cold_start(&work, problem);
        if (sg_newton(&work, &par, &opt, problem, 50, 0, &iterations, &measure) == M_OK) {
            static double found[SG_N_X_TOTAL];
            int i;
            sg_copy(pr->n_x, &work.x[pr->x], found);
            sg_cold_start(&work, problem);
            if (sg_newton(&work, &par, &opt, problem, 50, 1, &iterations, &measure) == M_OK) {
                for (i = 0; i < pr->n_x; ++i) {
                    ENSURE(fabs(found[i] - work.x[pr->x + i]) <= 1e-7 * (1.0 + fabs(found[i])));
                }
            }
        }
        sg_cold_start(&work, problem);
    }
    /* parameters that make the masses vanish or not finite */
    memset(&bad, 0, sizeof bad);
    ENSURE(m_step(&state, &work, &info, &bad, &opt, u, 0.01) > M_OK_SUBSTEPPED || !M_MASSES);
    memset(&bad, 0xff, sizeof bad); /* all NaN */
    ENSURE(m_step(&state, &work, &info, &bad, &opt, u, 0.01) > M_OK_SUBSTEPPED || !M_MASSES);
    ENSURE(!sg_path(&work, &bad, &opt, 0, 0) || !M_MASSES);
    memset(&bad, 0, sizeof bad);
    if (M_MASSES) {
        open_step(0.02);
        draw_unknowns(0);
        ENSURE(sg_newton(&work, &bad, &opt, 0, 5, 0, &iterations, &measure) == M_SINGULAR);
        ENSURE(!sg_path(&work, &bad, &opt, 0, 0));
#if SG_SPATIAL
        ENSURE(!sg_relax(&work, &bad, &opt, 0));
#endif
    }
    /* masses: not finite, singular, without a diagonal */
    open_step(0.01);
    work.mass[0] = work.mass_pivot[0] = NAN;
    ENSURE(!sg_masses(&work));
    open_step(0.01);
    work.p[0] = INFINITY;
    ENSURE(!sg_masses(&work));
    open_step(0.01);
    sg_fill(sg_mass.start[SG_N_Q], 0.0, work.mass);
    sg_fill(SG_N_Q, 0.0, work.mass_pivot);
    ENSURE(!sg_masses(&work));
    if (SG_N_R > 0) {
        open_step(0.01);
        /* no direction pushes: masses are borrowed */
        sg_fill(sg_direction.start[SG_N_R], 0.0, work.direction);
        sg_fill(SG_N_R, 0.0, work.mobility);
        ENSURE(sg_masses(&work) && work.masses.m_eff[0] == work.masses.inertia[0]);
        /* a mass beyond all numbers */
        sg_fill(sg_direction.start[SG_N_R], 1e-160, work.direction);
        sg_fill(SG_N_R, 1e-320, work.mobility);
        ENSURE(!sg_masses(&work));
    }
    if (SG_MOBILITY) {
        /* the same masses without the generated mobilities */
        int c;
        open_step(0.01);
        other = work;
        sg_fill(SG_N_Q, 0.0, work.mass_pivot);
        ENSURE(sg_elliptic_begin(&work) && sg_masses(&work));
        for (c = 0; c < SG_N_R; ++c) {
            ENSURE(fabs(work.masses.m_eff[c] - other.masses.m_eff[c]) <=
                   1e-12 * fabs(other.masses.m_eff[c]));
        }
    }
    if (SG_N_Q > 1) {
        /* a diagonal of zeros: what the rest of the row says */
        int k, at = -1;
        for (k = sg_mass.start[0]; k < sg_mass.start[1]; ++k) {
            at = sg_mass.index[k] == 1 ? k : at;
        }
        if (at >= 0) {
            const int first = sg_mass.order[0];
            const int second = sg_mass.order[1];
            int mirror = sg_mass.start[1];
            while (sg_mass.index[mirror] != 0) {
                ++mirror;
            }
            sg_fill(sg_mass.start[SG_N_Q], 0.0, work.mass);
            work.mass[at] = work.mass[mirror] = 3.0;
            sg_inertia(&work);
            ENSURE(work.masses.inertia[first] == 3.0 && work.masses.inertia[second] == 3.0);
            work.mass[sg_mass.diagonal[1]] = 2.0;
            sg_inertia(&work);
            ENSURE(work.masses.inertia[first] == 4.5 && work.masses.inertia[second] == 2.0);
        }
    }
}

/* Percussions of least norm: nothing to choose where they are unique, nothing kept that does not
   solve the problem, and never a longer vector than before. */
static void test_least_norm(void) {
    int trial, problem, i;
    for (trial = 0; trial < 20; ++trial) {
        draw_start();
        open_step(0.02);
        for (problem = 0; problem < SG_N_PROBLEMS; ++problem) {
            const sg_problem *pr = &sg_problems[problem];
            const int n_rows = pr->n_slots * SG_N_R;
            double measure = 0.0;
            int iterations = 0;
            int choice;
            draw_unknowns(problem);
            for (i = 0; i < n_rows; ++i) {
                work.R[pr->R + i] = fabs(work.R[pr->R + i]) + 2.0;
            }
            sg_evaluate(&work, &par, &opt, problem);
            other = work;
            choice = sg_least_norm(&work, &par, &opt, problem, &iterations, &measure);
            ENSURE(choice != SG_LEAST_NORM); /* a point that solves nothing stays */
            for (i = 0; i < n_rows && choice == SG_AS_FOUND; ++i) {
                ENSURE(work.R[pr->R + i] == other.R[pr->R + i]);
            }
            sg_cold_start(&work, problem);
        }
    }
}

/* Which percussion rows stand for gaps, group by group: g, gamma, N, F. */
static void test_gaps_among_rows(void) {
    const int first[] = {0, SG_N_G, SG_N_G + SG_N_GAMMA, SG_N_G + SG_N_GAMMA + SG_N_N, SG_N_R};
    int problem, slot, group, c;
    for (problem = 0; problem < SG_N_PROBLEMS; ++problem) {
        const sg_problem *pr = &sg_problems[problem];
        for (slot = 0; slot < pr->n_slots; ++slot) {
            for (group = 0; group < 4; ++group) {
                for (c = first[group]; c < first[group + 1]; ++c) {
                    const int *one_way = sg_kinds[0].one_way;
                    const int place =
                        group == 0 || (group == 2 && (one_way == NULL || !one_way[c - first[2]]));
                    ENSURE(sg_is_gap(&work, pr, slot, c) == (place && slot < pr->gap_slots));
                }
            }
        }
    }
}

#include "test_kept.h"
#include "test_refusals.h"
#include "test_records.h"
#include "test_rescues.h"

int main(void) {
    par = m_default_params();
    opt = m_default_options();
    opt.max_halvings = 4;
    test_newton_matrix();
    test_newton_direction();
    test_linearised();
    test_eliminations_agree();
    test_ends();
    test_gaps_among_rows();
    test_last_attempt();
    test_checker();
    test_axes();
#if SG_N_KEY > 0
    test_terms();
#endif
    test_least_norm();
#if SG_SPATIAL
    test_relaxation_eliminates();
    test_relaxation_leaps();
    test_relaxation();
#endif
#if SG_SEARCHED
    test_states_are_all_said();
#endif
    test_paths_and_rescues();
    test_substeps();
    test_parameters();
    test_arguments();
    test_inconsistent_starts();
    test_records();
    test_stable_step();
    test_nearest_in_cones();
    printf(
        "rows free %d, zero %d, slip %d; directions %d; spoiled %d; steps %d, rescued %d; "
        "lost impacts %d\n",
        counted[0], counted[1], counted[2], counted[3], counted[4], counted[5], counted[6],
        counted[7]);
    printf("%d failed\n", failures);
    return failures != 0;
}
