/* Newton matrix and direction, responses of the linearised rows: against differences and against
   each other. Part of test_model.c, after its helpers. */

/* Row i of [A B] (dx, dR); rows and dx in elimination order. */
static double smooth_row(const m_work *w, const sg_problem *pr, int i, const double *dx,
                         const double *dR) {
    static double column[SG_N_X_TOTAL];
    double sum = 0.0;
    int k;
    for (k = pr->K.start[i]; k < pr->K.start[i + 1] && pr->K.index[k] < pr->n_x; ++k) {
        sum += w->K[k] * dx[pr->K.index[k]];
    }
    for (k = 0; k < pr->n_slots * SG_N_R; ++k) {
        sg_fill(pr->n_x, 0.0, column);
        sg_add_row(&pr->B, w->B, k, 1.0, column);
        sum += column[i] * dR[k];
    }
    return sum;
}

/* Change of phi in row k for a direction. */
static double contact_row(const m_work *w, const sg_problem *pr, int k, const double *dx,
                          const double *dR) {
    static double dy[ROWS], zero[ROWS];
    const int n_rows = pr->n_slots * SG_N_R;
    double sum;
    int i;
    if (w->rows.kind[k] == SG_ROW_ZERO) {
        return dR[k];
    }
    for (i = 0; i < n_rows; ++i) {
        dy[i] = sg_row_dot(&pr->C, w->C, i, dx) + sg_compliance(w, pr->R + i) * dR[i];
    }
    sum = sg_phi_change(w, pr, k, dy, sg_bound_change(w, pr, k, dx), -1);
    for (i = 0; i < n_rows; ++i) {
        sum += sg_phi_change(w, pr, k, zero, 0.0, i) * dR[i];
    }
    return sum;
}

/* A, B, C and the derivatives of the contact rows against central differences. */
static void test_newton_matrix(void) {
    int trial, problem, i, k;
    for (trial = 0; trial < 40; ++trial) {
        draw_start();
        open_step(0.02);
        draw_unknowns(0);
        sg_evaluate(&work, &par, &opt, 0);
        for (problem = 0; problem < SG_N_PROBLEMS; ++problem) {
            const sg_problem *pr = &sg_problems[problem];
            const int n_rows = pr->n_slots * SG_N_R;
            const double eps = 1e-6;
            static double dr[SG_N_X_TOTAL], dphi[ROWS], r_plus[SG_N_X_TOTAL];
            static double phi_plus[ROWS];
            static int kind[ROWS];
            int same = 1;
            draw_unknowns(problem);
            sg_evaluate(&work, &par, &opt, problem);
            m_derivatives(&work, &par, problem);
            for (i = 0; i < pr->n_x; ++i) {
                work.smooth.dx[i] = uniform();
            }
            for (k = 0; k < n_rows; ++k) {
                work.newton.dR[k] = uniform();
                kind[k] = work.rows.kind[k];
            }
            for (i = 0; i < pr->n_x; ++i) {
                dr[pr->K.order[i]] = smooth_row(&work, pr, i, work.smooth.dx, work.newton.dR);
            }
            for (k = 0; k < n_rows; ++k) {
                dphi[k] = contact_row(&work, pr, k, work.smooth.dx, work.newton.dR);
                ++counted[kind[k]];
            }
            sg_copy(pr->n_x, &work.x[pr->x], work.newton.x_old);
            sg_copy(n_rows, &work.R[pr->R], work.newton.R_old);
            sg_move(&work, problem, eps);
            sg_evaluate(&work, &par, &opt, problem);
            sg_copy(pr->n_x, work.r, r_plus);
            sg_copy(n_rows, work.rows.phi, phi_plus);
            for (k = 0; k < n_rows; ++k) {
                same = same && kind[k] == work.rows.kind[k];
            }
            sg_move(&work, problem, -eps);
            sg_evaluate(&work, &par, &opt, problem);
            for (k = 0; k < n_rows; ++k) {
                same = same && kind[k] == work.rows.kind[k];
            }
            for (i = 0; i < pr->n_x; ++i) {
                const double slope = (r_plus[i] - work.r[i]) / (2.0 * eps);
                ENSURE(fabs(slope - dr[i]) <= 1e-6 * (1.0 + fabs(slope)));
            }
            for (k = 0; k < n_rows && same; ++k) {
                const double slope = (phi_plus[k] - work.rows.phi[k]) / (2.0 * eps);
                ENSURE(fabs(slope - dphi[k]) <= 1e-5 * (1.0 + fabs(slope)));
            }
            sg_move(&work, problem, 0.0);
            sg_evaluate(&work, &par, &opt, problem);
        }
    }
}

/* The Newton direction solves the linearised equations it claims to solve. */
static void test_newton_direction(void) {
    int trial, problem, i, k;
    for (trial = 0; trial < 40; ++trial) {
        draw_start();
        open_step(0.02);
        for (problem = 0; problem < SG_N_PROBLEMS; ++problem) {
            const sg_problem *pr = &sg_problems[problem];
            const int n_rows = pr->n_slots * SG_N_R;
            draw_unknowns(problem);
            sg_evaluate(&work, &par, &opt, problem);
            m_derivatives(&work, &par, problem);
            other = work;
            if (sg_newton_direction(&work, &opt, problem, 0) == 0) {
                double size = 0.0;
                for (i = 0; i < pr->n_x; ++i) {
                    size = sg_max(size, fabs(work.smooth.dx[i]));
                }
                for (k = 0; k < n_rows; ++k) {
                    size = sg_max(size, fabs(work.newton.dR[k]));
                }
                for (i = 0; i < pr->n_x; ++i) {
                    const double sum = other.r[pr->K.order[i]] +
                                       smooth_row(&other, pr, i, work.smooth.dx, work.newton.dR);
                    ENSURE(fabs(sum) <= 1e-9 * (1.0 + size));
                }
                for (k = 0; k < n_rows; ++k) {
                    const double sum = other.rows.phi[k] +
                                       contact_row(&other, pr, k, work.smooth.dx, work.newton.dR);
                    ENSURE(fabs(sum) <= 1e-7 * (1.0 + size));
                }
                ++counted[3];
            }
            work = other;
            sg_evaluate(&work, &par, &opt, problem);
        }
    }
}

/* Responses of the linearised rows to percussions, whose velocities follow, against differences. */
static void test_linearised(void) {
    static double dR[ROWS], y_plus[ROWS], x_old[SG_N_X_TOTAL], R_old[ROWS];
    const double eps = 1e-6;
    int trial, problem, way, i, k, b;
    for (trial = 0; trial < 20; ++trial) {
        draw_start();
        open_step(0.02);
        for (problem = 0; problem < SG_N_PROBLEMS; ++problem) {
            const sg_problem *pr = &sg_problems[problem];
            const int n_rows = pr->n_slots * SG_N_R;
            draw_unknowns(problem);
            ENSURE(sg_linearise(&work, &par, &opt, problem));
            sg_copy(pr->n_x, &work.x[pr->x], x_old);
            sg_copy(n_rows, &work.R[pr->R], R_old);
            for (k = 0; k < n_rows; ++k) {
                dR[k] = uniform();
            }
            for (way = 1; way >= -1; way -= 2) {
                sg_copy(pr->n_x, x_old, &work.x[pr->x]);
                for (b = 0; b < n_rows; ++b) {
                    work.R[pr->R + b] = R_old[b] + way * eps * dR[b];
                    for (i = 0; i < pr->n_x; ++i) {
                        work.x[pr->x + pr->K.order[i]] -=
                            way * eps * work.system.Z[b * pr->n_border + i] * dR[b];
                    }
                }
                sg_evaluate(&work, &par, &opt, problem);
                if (way > 0) {
                    sg_copy(n_rows, work.y, y_plus);
                }
            }
            for (k = 0; k < n_rows; ++k) {
                const double slope = (y_plus[k] - work.y[k]) / (2.0 * eps);
                double sum = 0.0;
                for (b = 0; b < n_rows; ++b) {
                    sum += work.system.S[b * n_rows + k] * dR[b];
                }
                ENSURE(fabs(slope - sum) <= 1e-5 * (1.0 + fabs(slope)));
            }
        }
    }
}

/* Elimination with the border, without it, and with exchange of rows give the same direction. */
static void test_eliminations_agree(void) {
    static double dx[SG_N_X_TOTAL], dR[ROWS];
    int trial, problem, way, i, k;
    for (trial = 0; trial < 20; ++trial) {
        draw_start();
        open_step(0.02);
        for (problem = 0; problem < SG_N_PROBLEMS; ++problem) {
            const sg_problem *pr = &sg_problems[problem];
            const int n_rows = pr->n_slots * SG_N_R;
            draw_unknowns(problem);
            sg_evaluate(&work, &par, &opt, problem);
            m_derivatives(&work, &par, problem);
            for (way = 0; way < 3; ++way) {
                int n;
                work.smooth.pivoting = way == 2;
                n = sg_reduce(&work, problem, way == 0);
                ENSURE(n >= 0 && (way == 0 || !work.smooth.bordered) &&
                       work.smooth.exchanged == (way == 2));
                if (n < 0 || !sg_solve_regular(&work, n)) {
                    break; /* dependent rows: each way finds another of many percussions */
                }
                sg_expand_direction(&work, pr, n);
                for (i = 0; i < pr->n_x; ++i) {
                    ENSURE(way == 0 ||
                           fabs(work.smooth.dx[i] - dx[i]) <= 1e-8 * (1.0 + fabs(dx[i])));
                    dx[i] = work.smooth.dx[i];
                }
                for (k = 0; k < n_rows; ++k) {
                    ENSURE(way == 0 ||
                           fabs(work.newton.dR[k] - dR[k]) <= 1e-8 * (1.0 + fabs(dR[k])));
                    dR[k] = work.newton.dR[k];
                }
            }
            work.newton.mode = SG_FIRST_ATTEMPT;
            work.smooth.pivoting = 0;
            sg_evaluate(&work, &par, &opt, problem);
        }
    }
}
