/* Paths and relaxation: what they solve, where they end, what Newton's method needs from there. */

/* The percussions at the end of a path satisfy the contact laws of the linearised problem, up to a
   share `tolerance` of the largest one; `turns`: in space, too, friction is against the slip. */
static void check_linear_laws(int problem, double tolerance, int turns) {
    const sg_problem *pr = &sg_problems[problem];
    const int n = pr->n_slots * SG_N_R;
    const double *R = &work.R[pr->R];
    double top = 1e-300;
    int a, b, k, slot;
    for (a = 0; a < n; ++a) {
        work.system.dy[a] = work.linear.y_0[a] + sg_softness(&work, n, a) * R[a];
        for (b = 0; b < n; ++b) {
            work.system.dy[a] += work.system.S[b * n + a] * R[b];
        }
        top = fmax(top, fabs(R[a]));
    }
    for (slot = 0; slot < pr->n_slots; ++slot) {
        for (k = 0; k < SG_N_CONTACTS; ++k) {
            const int base = slot * SG_N_R;
            const int row = base + SG_NORMAL + sg_contacts[k].normal;
            const int f = base + SG_SLIP + sg_contacts[k].friction;
            const double small = tolerance * top;
            double radius;
            if (!sg_joins(&work, pr, k)) {
                continue;
            }
            if (sg_contacts[k].normal >= 0) {
                /* gap times stiffness is a percussion */
                const double push = work.system.dy[row] / fabs(work.system.S[row * (n + 1)]);
                ENSURE(R[row] >= -small && push >= -small);
                ENSURE(fmin(fabs(R[row]), fabs(push)) <= small);
            }
            if (sg_contacts[k].loads > 0) {
                /* a path holds the loads of the unknowns it set out from; the checker judges them
                 */
                continue;
            }
            if (sg_contacts[k].varies >= 0) {
                const double *own = &work.radius[slot * SG_N_BOUNDS + sg_contacts[k].varies];
                radius = own[0] * R[base + SG_NORMAL + sg_contacts[k].pressing] + own[1];
            } else if (sg_contacts[k].pressing >= 0) {
                radius = work.mu[k] * R[base + SG_NORMAL + sg_contacts[k].pressing];
            } else {
                radius = fmax(work.radius[slot * SG_N_BOUNDS + sg_contacts[k].bound], 0.0);
            }
            if (sg_contacts[k].components > 0) {
                const int count = sg_contacts[k].components;
                const double size = sg_friction_size(&work, k, &R[f]);
                ENSURE(size <= radius + small);
                /* friction never pushes along the slip, and is full where there is slip */
                if (count == 1) {
                    const double slip = work.system.dy[f] / fabs(work.system.S[f * (n + 1)]);
                    ENSURE(slip * R[f] <= small * (fabs(slip) + top));
                    ENSURE(fabs(slip) <= small || fabs(size - radius) <= small);
                }
                if (turns && count == 2) {
                    const double stiffness = 1.0 / fabs(work.system.S[f * (n + 1)]);
                    double against[2] = {0.0, 0.0};
                    const double slip =
                        stiffness * sg_friction_slip(&work, k, &work.system.dy[f], against);
                    const double power = stiffness * sg_dot(2, &work.system.dy[f], &R[f]);
                    ENSURE(fabs(power + radius * slip) <= small * (slip + top));
                }
            }
        }
    }
}

/* The unknowns that a path from those in `from` led to satisfy the linearised smooth rows, too. */
static void check_linear_rows(int problem, const m_work *from) {
    static double dx[SG_N_X_TOTAL], dR[ROWS];
    const sg_problem *pr = &sg_problems[problem];
    double size = 1.0;
    int i, k;
    for (i = 0; i < pr->n_x; ++i) {
        const int unknown = pr->x + pr->K.order[i];
        dx[i] = work.x[unknown] - from->x[unknown];
        size = fmax(size, fabs(dx[i]));
    }
    for (k = 0; k < pr->n_slots * SG_N_R; ++k) {
        dR[k] = work.R[pr->R + k] - from->R[pr->R + k];
        size = fmax(size, fabs(dR[k]));
    }
    for (i = 0; i < pr->n_x; ++i) {
        const double sum = work.r[pr->K.order[i]] + smooth_row(&work, pr, i, dx, dR);
        ENSURE(fabs(sum) <= 1e-9 * size);
    }
}

#if SG_SPATIAL
/* Bilateral percussions are eliminated: with what they answer to any percussions of contacts, their
   own rows of the linearised problem vanish, and those of contacts are what the whole gives. */
static void test_relaxation_eliminates(void) {
    static double S[ROWS * ROWS], y_0[ROWS], R[ROWS], y[ROWS];
    int trial, problem, a, b;
    for (trial = 0; trial < 20; ++trial) {
        draw_start();
        open_step(0.02);
        for (problem = 0; problem < SG_N_PROBLEMS; ++problem) {
            const sg_problem *pr = &sg_problems[problem];
            const int n = pr->n_slots * SG_N_R;
            double top = 1e-300;
            draw_unknowns(problem);
            if (!sg_linearise(&work, &par, &opt, problem)) {
                continue;
            }
            sg_copy(n * n, work.system.S, S);
            sg_copy(n, work.linear.y_0, y_0);
            for (a = 0; a < pr->n_slots; ++a) {
                sg_bilateral_kinds(&work, pr, a);
            }
            if (!sg_relax_reduce(&work, pr)) {
                continue;
            }
            for (a = 0; a < n; ++a) {
                const int holds = a % SG_N_R < SG_NORMAL;
                R[a] = holds ? 0.0 : uniform();
            }
            for (a = 0; a < n; ++a) {
                y[a] = work.linear.y_0[a];
                for (b = 0; b < n; ++b) {
                    y[a] += work.system.S[b * n + a] * R[b];
                }
            }
            for (a = 0; a < n; ++a) {
                if (a % SG_N_R < SG_NORMAL) {
                    R[a] = work.rows.kind[a] == SG_ROW_FREE ? y[a] : 0.0;
                }
                top = fmax(top, fabs(R[a]));
            }
            for (a = 0; a < n; ++a) {
                double whole = y_0[a] + sg_softness(&work, n, a) * (a % SG_N_R < SG_NORMAL) * R[a];
                double size = fabs(y_0[a]);
                for (b = 0; b < n; ++b) {
                    whole += S[b * n + a] * R[b];
                    size += fabs(S[b * n + a] * R[b]);
                }
                if (a % SG_N_R < SG_NORMAL && work.rows.kind[a] == SG_ROW_FREE) {
                    ENSURE(fabs(whole) <= 1e-6 * size);
                } else if (a % SG_N_R >= SG_NORMAL) {
                    ENSURE(fabs(whole - y[a]) <= 1e-6 * (size + fabs(y[a])));
                }
            }
        }
        sg_fill(SG_N_R, 0.0, work.scales.percussion_scale);
        ENSURE(SG_N_R == 0 || !sg_relax_scales(&work, &sg_problems[0]));
    }
}

/* Two normal percussions that act alike, while their contacts contradict each other by 2e-7: in
   each sweep one takes so little over from the other, in leaps all of it. */
static void test_relaxation_leaps(void) {
    const sg_problem *pr = &sg_problems[0];
    const int n = pr->n_slots * SG_N_R;
    int row[2];
    int count = 0;
    int k, a, sweep;
    draw_start();
    open_step(0.02);
    for (k = 0; k < SG_N_CONTACTS && count < 2; ++k) {
        if (sg_contacts[k].normal >= 0 && sg_joins(&work, pr, k)) {
            row[count] = sg_normal_of(&work, 0, k);
            ++count;
        }
    }
    if (count < 2) {
        return;
    }
    sg_fill(n * n, 0.0, work.system.S);
    sg_fill(n, 0.0, work.path.y);
    sg_fill(n, 0.0, work.path.R);
    for (a = 0; a < n; ++a) {
        work.system.S[a * (n + 1)] = 1.0;
        work.relax.scale[a] = 1.0;
    }
    for (k = 0; k < 2; ++k) {
        work.path.y[row[k]] = k == 0 ? 1e-7 : -1e-7;
        work.system.S[row[k] * n + row[1 - k]] = 1.0;
    }
    work.path.R[row[0]] = 0.5;
    for (sweep = 1; sweep <= 4 * SG_RELAX_LEAP; ++sweep) {
        (void)sg_relax_sweep(&work, pr);
        if (sweep % SG_RELAX_LEAP == 0) {
            sg_relax_leap(&work, pr);
        }
    }
    ENSURE(work.path.R[row[0]] == 0.0 && fabs(work.path.R[row[1]] - 0.5) < 1e-6);
    ENSURE(work.path.y[row[0]] > 1e-7 && fabs(work.path.y[row[1]]) < 1e-12);
}

/* Where relaxation comes to an end the laws of the linearised problem hold; Newton's method needs
   few iterations from there. */
static void test_relaxation(void) {
    static m_work found;
    int settled = 0;
    int solved = 0;
    int trial, problem, k;
    for (trial = 0; trial < 40; ++trial) {
        draw_start();
        open_step(0.02);
        for (problem = 0; problem < SG_N_PROBLEMS; ++problem) {
            int iterations = 0;
            double measure = 0.0;
            sg_cold_start(&work, problem);
            sg_leave_out(&work, problem);
            other = work;
            if (SG_N_R > 0 && sg_relax(&work, &par, &opt, problem) &&
                sg_relax_sweep(&work, &sg_problems[problem]) <= 1e-9) {
                ++settled;
                for (k = 0; k < sg_problems[problem].n_slots * SG_N_R; ++k) {
                    /* the states that it says have friction against their slip */
                    ENSURE(work.rows.kind[k] != SG_ROW_SLIP ||
                           work.path.R[k] * work.rows.slip[k] <= 0.0);
                }
                found = work;
                work = other;
                ENSURE(sg_linearise(&work, &par, &opt, problem));
                found.linear = work.linear;
                sg_copy(ROWS * ROWS, work.system.S, found.system.S);
                work = found;
                check_linear_laws(problem, 1e-2, 1);
                check_linear_rows(problem, &other);
                solved +=
                    sg_newton(&work, &par, &opt, problem, 8, 0, &iterations, &measure) == M_OK;
            }
            (void)sg_newton(&work, &par, &opt, problem, 60, 1, &iterations, &measure);
            if (problem + 1 < SG_N_PROBLEMS && sg_problems[problem + 1].follows) {
                sg_activity(&work, &opt, &info, problem);
            }
        }
    }
    ENSURE(SG_N_R == 0 || settled >= 40);
    ENSURE(solved >= settled - settled / 10);
}
#endif

/* Paths solve the linearised problem: a Newton iteration from there needs few steps. */
static void test_paths_and_rescues(void) {
    int unsolved = 0;
    int followed = 0;
    int trial, problem;
    for (trial = 0; trial < 40; ++trial) {
        m_options few = opt;
        m_state before;
        int status;
        draw_start();
        open_step(0.02);
        for (problem = 0; problem < SG_N_PROBLEMS; ++problem) {
            int iterations = 0;
            double measure = 0.0;
            sg_cold_start(&work, problem);
            sg_leave_out(&work, problem);
            other = work;
            if (sg_path(&work, &par, &opt, problem, trial % 3)) {
                ++followed;
                check_linear_laws(problem, 1e-7, 0);
                check_linear_rows(problem, &other);
                sg_settle(&work, &par, &opt, problem, SG_HELD, &iterations);
                ENSURE(iterations <= SG_HELD);
            }
            status = sg_newton(&work, &par, &opt, problem, 60, 1, &iterations, &measure);
            unsolved += status != M_OK;
            if (problem + 1 < SG_N_PROBLEMS && sg_problems[problem + 1].follows) {
                sg_activity(&work, &opt, &info, problem);
            }
        }
        /* a budget of few iterations: rescues and substeps come in, or the state stays */
        few.max_iterations = 1 + trial % 5;
        few.max_halvings = trial % 3;
        few.active_set = trial % 2 ? M_ACTIVE_END : M_ACTIVE_ANY_STAGE;
        before = state;
        status = m_step(&state, &work, &info, &par, &few, u, 0.05);
        ENSURE(status == info.status);
        ENSURE(status <= M_OK_SUBSTEPPED ? state.t > before.t
                                         : !memcmp(&state, &before, sizeof state));
        few = opt;
        few.r = 0.7;
        (void)m_step(&state, &work, &info, &par, &few, u, 0.01);
        few.r = 0.0;
        few.scaling = M_SCALING_NONE;
        few.tol = 1e-8;
        (void)m_step(&state, &work, &info, &par, &few, u, 0.01);
        /* a new size makes the guess stale; a spoiled guess of the same size is rescued */
        status = m_step(&state, &work, &info, &par, &opt, u, 0.005);
        if (status == M_OK && state.warm) {
            sg_fill(SG_N_X_TOTAL, NAN, state.x);
            status = m_step(&state, &work, &info, &par, &opt, u, 0.005);
            ENSURE(status > M_OK_SUBSTEPPED || info.rescues > 0);
        }
    }
    ENSURE(unsolved <= 4);
}

#if SG_SEARCHED
/* States that contacts, elements of friction by themselves and what contacts press have in one
   slot: each counted once. */
static long states_of_slot(void) {
    long all = 1;
    int k, i;
    for (k = 0; k < SG_N_CONTACTS; ++k) {
        if (sg_contacts[k].normal >= 0) {
            long pressed = 1;
            for (i = 0; i < SG_N_CONTACTS; ++i) {
                pressed *= sg_contacts[i].presser == k && sg_rubbing(&work, i) > 0 ? 3 : 1;
            }
            all *= 1 + pressed;
        } else if (sg_contacts[k].presser < 0) {
            all *= sg_rubbing(&work, k) > 0 ? 3 : 1;
        }
    }
    return all;
}

/* The search says every set of contact states, and none twice. */
static void test_states_are_all_said(void) {
    static unsigned long seen[SG_MOST_STATES];
    int problem, apart, slot, i;
    draw_start();
    open_step(0.01);
    for (problem = 0; problem < SG_N_CHAIN; ++problem) {
        const sg_problem *pr = &sg_problems[problem];
        for (apart = 0; apart < 2; ++apart) {
            long expected = states_of_slot();
            int said = 0;
            int number = 0;
            int fresh = 1;
            for (slot = 1; apart && slot < pr->n_slots && expected <= SG_MOST_STATES; ++slot) {
                expected *= states_of_slot();
            }
            for (; fresh >= 0 && expected <= SG_MOST_STATES / 16; ++number) {
                fresh = sg_say_states(&work, pr, apart, number);
                if (fresh > 0) {
                    seen[said] = sg_fingerprint(&work, pr->n_slots * SG_N_R);
                    for (i = 0; i < said; ++i) {
                        ENSURE(seen[i] != seen[said]);
                    }
                    ++said;
                }
            }
            ENSURE(said == (expected <= SG_MOST_STATES / 16 ? expected : 0));
        }
    }
}
#endif
