#pragma once
#include "sg_shares.c"

/* The largest stable step, estimated at a state: below the first step size at which the scheme
   amplifies the fastest linear oscillation of the model, with stiffness and inertia as they are
   there. */

static void SG(part_p_v)(int part, real t, const real q[], const real v[], const SG(params) * par,
                         real out[]);
static void SG(part_L_q_q)(int part, real t, const real q[], const real v[], const SG(params) * par,
                           real out[]);
static void SG(part_f_q)(int part, real t, const real q[], const real v[], const real u[],
                         const SG(params) * par, real out[]);
static void SG(part_WR_q)(int part, real t, const real q[], const real R[], const SG(params) * par,
                          real out[]);
static void SG(part_bilateral_directions)(int part, real t, const real q[], const SG(params) * par,
                                          real out[]);

/* L of M = L L^T in place, by rows. Returns 0 if M is not positive definite. */
static int sg_cholesky(int n, real *M) {
    int i, j, k;
    for (j = 0; j < n; ++j) {
        for (i = j; i < n; ++i) {
            real sum = M[i * n + j];
            for (k = 0; k < j; ++k) {
                sum -= M[i * n + k] * M[j * n + k];
            }
            if (i > j) {
                M[i * n + j] = sum / M[j * n + j];
            } else if (sum > SG_C(0.0)) {
                M[j * n + j] = SG_SQRT(sum);
            } else {
                return 0;
            }
        }
    }
    return 1;
}

/* x := L^-1 x; x has the stride `step`. */
static void sg_forward(int n, const real *L, int step, real *x) {
    int i, k;
    for (i = 0; i < n; ++i) {
        for (k = 0; k < i; ++k) {
            x[i * step] -= L[i * n + k] * x[k * step];
        }
        x[i * step] /= L[i * n + i];
    }
}

/* Orthonormal directions of the columns of Q (n x m, by columns); dependent ones become zero. */
static void sg_orthonormal(int n, int m, real *Q) {
    int a, b, i;
    for (a = 0; a < m; ++a) {
        real *q = &Q[a * n];
        const real before = SG_SQRT(sg_dot(n, q, q));
        real size;
        for (b = 0; b < a; ++b) {
            const real part = sg_dot(n, &Q[b * n], q);
            for (i = 0; i < n; ++i) {
                q[i] -= part * Q[b * n + i];
            }
        }
        size = SG_SQRT(sg_dot(n, q, q));
        for (i = 0; i < n; ++i) {
            q[i] = size > SG_SMALL * before ? q[i] / size : SG_C(0.0);
        }
    }
}

/* x := x without its parts along Q, of length 1; returns 0 if nothing is left. */
static int sg_admissible(int n, int m, const real *Q, real *x) {
    real size;
    int a, i;
    for (a = 0; a < m; ++a) {
        const real part = sg_dot(n, &Q[a * n], x);
        for (i = 0; i < n; ++i) {
            x[i] -= part * Q[a * n + i];
        }
    }
    size = SG_SQRT(sg_dot(n, x, x));
    for (i = 0; i < n; ++i) {
        x[i] = size > SG_TINY ? x[i] / size : SG_C(0.0);
    }
    return size > SG_TINY;
}

/* K := P K P, where P takes away the parts along Q. */
static void sg_project(int n, int m, const real *Q, real *K) {
    int a, i, j;
    for (a = 0; a < m; ++a) {
        const real *q = &Q[a * n];
        for (j = 0; j < n; ++j) {
            real part = SG_C(0.0);
            for (i = 0; i < n; ++i) {
                part += q[i] * K[i * n + j];
            }
            for (i = 0; i < n; ++i) {
                K[i * n + j] -= part * q[i];
            }
        }
        for (i = 0; i < n; ++i) {
            const real part = sg_dot(n, &K[i * n], q);
            for (j = 0; j < n; ++j) {
                K[i * n + j] -= part * q[j];
            }
        }
    }
}

/* The largest eigenvalue of K among directions perpendicular to Q, by power iteration on
   K + shift I from an irregular start; the shift makes no eigenvalue negative. */
static real sg_extreme(int n, int m, const real *K, const real *Q, real shift, real *x, real *y) {
    real value = SG_C(0.0);
    int round, i;
    for (i = 0; i < n; ++i) {
        x[i] = sg_irregular(i);
    }
    if (!sg_admissible(n, m, Q, x)) {
        return SG_C(0.0);
    }
    for (round = 0; round < SG_POWER_ROUNDS; ++round) {
        const real before = value;
        for (i = 0; i < n; ++i) {
            y[i] = sg_dot(n, &K[i * n], x) + shift * x[i];
        }
        value = sg_dot(n, x, y);
        sg_copy(n, y, x);
        if (!sg_admissible(n, m, Q, x) ||
            SG_FABS(value - before) <= SG_POWER_CHANGE * SG_FABS(value - shift)) {
            break;
        }
    }
    return value - shift;
}

/* Inertia M, stiffness K and directions Q of bilateral constraints of a part; `Q` is scratch
   before. */
static void sg_linearised(int part, const SG(params) * par, real t, const real q[], const real v[],
                          const real u[], const real force[], int n, real *M, real *K, real *Q) {
    int i, j;
    SG(part_p_v)(part, t, q, v, par, M);
    SG(part_L_q_q)(part, t, q, v, par, K);
    SG(part_f_q)(part, t, q, v, u, par, Q);
    for (i = 0; i < n * n; ++i) {
        K[i] = -(K[i] + Q[i]);
    }
    if (force != NULL) {
        SG(part_WR_q)(part, t, q, force, par, Q);
        for (i = 0; i < n * n; ++i) {
            K[i] -= Q[i];
        }
    }
    for (i = 0; i < n; ++i) {
        for (j = 0; j < i; ++j) {
            const real mean = SG_C(0.5) * (K[i * n + j] + K[j * n + i]);
            K[i * n + j] = mean;
            K[j * n + i] = mean;
        }
    }
    SG(part_bilateral_directions)(part, t, q, par, Q);
}

/* The largest stable step of a part with n coordinates and m bilateral constraints. */
static real sg_stable_part(int part, int n, int m, const SG(params) * par, real t, const real q[],
                           const real v[], const real u[], const real force[], real scratch[]) {
    real *M = scratch;
    real *K = &scratch[n * n];
    real *Q = &scratch[2 * n * n];
    real *x = &scratch[SG_STABLE - 2 * n];
    real *y = &scratch[SG_STABLE - n];
    real bound = SG_C(0.0);
    real top;
    int i, j;
    sg_linearised(part, par, t, q, v, u, force, n, M, K, Q);
    if (!sg_all_finite(n * n, K) || !sg_cholesky(n, M)) {
        return SG_HUGE;
    }
    /* K := L^-1 K L^-T; directions of constraints likewise */
    for (i = 0; i < n; ++i) {
        sg_forward(n, M, n, &K[i]);
    }
    for (i = 0; i < n; ++i) {
        sg_forward(n, M, 1, &K[i * n]);
    }
    for (j = 0; j < m; ++j) {
        sg_forward(n, M, 1, &Q[j * n]);
    }
    sg_orthonormal(n, m, Q);
    sg_project(n, m, Q, K);
    /* moved by the largest sum of a row no eigenvalue is negative: an instability of the model's
       own, or one as large as the fastest oscillation, does not hide it */
    for (i = 0; i < n; ++i) {
        real sum = SG_C(0.0);
        for (j = 0; j < n; ++j) {
            sum += SG_FABS(K[i * n + j]);
        }
        bound = sg_max(bound, sum);
    }
    top = sg_extreme(n, m, K, Q, bound, x, y);
    return top > SG_TINY ? SG_STABLE_PHASE / SG_SQRT(top) : SG_HUGE;
}

real SG(stable_step)(const SG(params) * par, real t, const real q[], const real v[], const real u[],
                     const real force[], real scratch[]) {
#if SG_N_PARTS > 1
    real own_q[SG_MOST_Q], own_v[SG_MOST_Q], own_R[SG_MOST_R];
    real stable = SG_HUGE;
    int part;
    for (part = 0; part < SG_N_PARTS; ++part) {
        const int kind = sg_shares[part].kind;
        const int m = sg_counts[kind][SG_OF_G] + sg_counts[kind][SG_OF_GAMMA];
        real own;
        sg_take(part, SG_OF_Q, q, own_q);
        sg_take(part, SG_OF_Q, v, own_v);
        if (force != NULL) {
            sg_take(part, SG_OF_R, force, own_R);
        }
        own = sg_stable_part(part, sg_counts[kind][SG_OF_Q], m, par, t, own_q, own_v, u,
                             force != NULL ? own_R : NULL, scratch);
        stable = own < stable ? own : stable;
    }
    return stable;
#else
    return sg_stable_part(0, SG_N_Q, SG_N_G + SG_N_GAMMA, par, t, q, v, u, force, scratch);
#endif
}
