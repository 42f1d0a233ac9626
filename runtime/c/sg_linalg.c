#pragma once
#include "sg_numbers.h"

/* Dense linear algebra: LU with scaled pivots, rank-revealing QR with minimum-norm solution. */

/* LU of the n x n row-major matrix A in place; pivot rows are chosen by size times `weight`, so
   that a change of units does not change them. `weight` is permuted along with the rows; inverses
   of the pivots stand on the diagonal. Returns 0 if A is singular or not finite. */
static int sg_lu_factor(int n, real *A, real *weight, int *pivot) {
    int i, j, k;
    for (k = 0; k < n; ++k) {
        real best = SG_C(-1.0);
        int row = k;
        for (i = k; i < n; ++i) {
            const real size = SG_FABS(A[i * n + k]) * weight[i];
            if (size > best) {
                best = size;
                row = i;
            }
        }
        pivot[k] = row;
        if (!(best > SG_C(0.0)) || !sg_finite(best)) {
            return 0;
        }
        if (row != k) {
            const real s = weight[k];
            weight[k] = weight[row];
            weight[row] = s;
            for (j = 0; j < n; ++j) {
                const real a = A[k * n + j];
                A[k * n + j] = A[row * n + j];
                A[row * n + j] = a;
            }
        }
        A[k * n + k] = SG_C(1.0) / A[k * n + k];
        for (i = k + 1; i < n; ++i) {
            if (A[i * n + k] != SG_C(0.0)) {
                const real factor = A[i * n + k] * A[k * n + k];
                A[i * n + k] = factor;
                for (j = k + 1; j < n; ++j) {
                    A[i * n + j] -= factor * A[k * n + j];
                }
            }
        }
    }
    return 1;
}

/* Solve A x = b with the factors of sg_lu_factor; b is overwritten with x. */
static void sg_lu_solve(int n, const real *A, const int *pivot, real *b) {
    int i, j;
    for (i = 0; i < n; ++i) {
        const real swap = b[pivot[i]];
        b[pivot[i]] = b[i];
        b[i] = swap;
    }
    for (i = 1; i < n; ++i) {
        real sum = b[i];
        for (j = 0; j < i; ++j) {
            sum -= A[i * n + j] * b[j];
        }
        b[i] = sum;
    }
    for (i = n - 1; i >= 0; --i) {
        real sum = b[i];
        for (j = i + 1; j < n; ++j) {
            sum -= A[i * n + j] * b[j];
        }
        b[i] = sum * A[i * n + i];
    }
}

/* 1 if all pivots of sg_lu_factor are larger than `share` times the largest. */
static int sg_lu_is_regular(int n, const real *A, real share) {
    real least = SG_C(0.0);
    real most = SG_HUGE;
    int k;
    for (k = 0; k < n; ++k) {
        const real inverse = SG_FABS(A[k * n + k]);
        least = sg_max(least, inverse);
        most = inverse < most ? inverse : most;
    }
    return most > share * least;
}

/* Householder reflection H = I - tau (1, w)(1, w)^T that maps (alpha, x) to (beta, 0): overwrites
   x (n entries, `stride` apart) with w, returns tau and beta. */
static real sg_householder(int n, int stride, real alpha, real *x, real *beta) {
    real sum = SG_C(0.0);
    real tau = SG_C(0.0);
    int i;
    for (i = 0; i < n; ++i) {
        sum += x[i * stride] * x[i * stride];
    }
    *beta = alpha;
    if (sum > SG_C(0.0)) {
        const real norm = SG_SQRT(alpha * alpha + sum);
        const real head = alpha > SG_C(0.0) ? alpha + norm : alpha - norm;
        *beta = alpha > SG_C(0.0) ? -norm : norm;
        tau = -head / *beta;
        for (i = 0; i < n; ++i) {
            x[i * stride] /= head;
        }
    }
    return tau;
}

/* y := H y for one reflection with head y[0] and tail `tail`, both with their strides. */
static void sg_reflect(int n, int stride, const real *w, real tau, real *head, int step,
                       real *tail) {
    real sum = *head;
    int i;
    for (i = 0; i < n; ++i) {
        sum += w[i * stride] * tail[i * step];
    }
    sum *= tau;
    *head -= sum;
    for (i = 0; i < n; ++i) {
        tail[i * step] -= sum * w[i * stride];
    }
}

/* Complete orthogonal factorisation of the n x n column-major matrix S in place:
   Q^T S P = [T 0; 0 0] Z with T of size rank x rank. Columns whose pivot falls below
   SG_RANK times the first count as dependent. perm, tau and tau_z hold n entries. */
static int sg_cod_factor(int n, real *S, int *perm, real *tau, real *tau_z) {
    int rank = n;
    int i, j, k;
    real first = SG_C(0.0);
    for (j = 0; j < n; ++j) {
        perm[j] = j;
    }
    for (k = 0; k < n; ++k) {
        real best = SG_C(-1.0);
        real beta;
        int column = k;
        for (j = k; j < n; ++j) {
            const real norm = sg_dot(n - k, &S[j * n + k], &S[j * n + k]);
            /* The margin keeps the order of columns that are equal but for round-off. */
            if (norm > best * (SG_C(1.0) + SG_RANK)) {
                best = norm;
                column = j;
            }
        }
        if (column != k) {
            const int p = perm[k];
            perm[k] = perm[column];
            perm[column] = p;
            for (i = 0; i < n; ++i) {
                const real s = S[k * n + i];
                S[k * n + i] = S[column * n + i];
                S[column * n + i] = s;
            }
        }
        tau[k] = sg_householder(n - k - 1, 1, S[k * n + k], &S[k * n + k + 1], &beta);
        S[k * n + k] = beta;
        if (k == 0) {
            first = SG_FABS(beta);
        }
        if (!(SG_FABS(beta) > SG_RANK * first)) {
            rank = k;
            break;
        }
        for (j = k + 1; j < n; ++j) {
            sg_reflect(n - k - 1, 1, &S[k * n + k + 1], tau[k], &S[j * n + k], 1,
                       &S[j * n + k + 1]);
        }
    }
    /* Reflections from the right turn [R11 R12] into [T 0]. */
    for (k = rank - 1; k >= 0 && rank < n; --k) {
        real beta;
        tau_z[k] = sg_householder(n - rank, n, S[k * n + k], &S[rank * n + k], &beta);
        S[k * n + k] = beta;
        for (i = 0; i < k; ++i) {
            sg_reflect(n - rank, n, &S[rank * n + k], tau_z[k], &S[k * n + i], n, &S[rank * n + i]);
        }
    }
    return rank;
}

/* Minimum-norm solution of S y = b with the factors of sg_cod_factor; b becomes Q^T b. */
static void sg_cod_solve(int n, int rank, const real *S, const int *perm, const real *tau,
                         const real *tau_z, real *b, real *work, real *y) {
    int i, j, k;
    for (k = 0; k < rank; ++k) {
        sg_reflect(n - k - 1, 1, &S[k * n + k + 1], tau[k], &b[k], 1, &b[k + 1]);
    }
    for (i = rank - 1; i >= 0; --i) {
        real sum = b[i];
        for (j = i + 1; j < rank; ++j) {
            sum -= S[j * n + i] * work[j];
        }
        work[i] = sum / S[i * n + i];
    }
    sg_fill(n - rank, SG_C(0.0), &work[rank]);
    for (k = 0; k < rank && rank < n; ++k) {
        sg_reflect(n - rank, n, &S[rank * n + k], tau_z[k], &work[k], 1, &work[rank]);
    }
    for (k = 0; k < n; ++k) {
        y[perm[k]] = work[k];
    }
}

/* y := the part of y without components in the null space of S. */
static void sg_cod_project(int n, int rank, const real *S, const int *perm, const real *tau_z,
                           real *work, real *y) {
    int k;
    if (rank == n) {
        return;
    }
    for (k = 0; k < n; ++k) {
        work[k] = y[perm[k]];
    }
    for (k = rank - 1; k >= 0; --k) {
        sg_reflect(n - rank, n, &S[rank * n + k], tau_z[k], &work[k], 1, &work[rank]);
    }
    sg_fill(n - rank, SG_C(0.0), &work[rank]);
    for (k = 0; k < rank; ++k) {
        sg_reflect(n - rank, n, &S[rank * n + k], tau_z[k], &work[k], 1, &work[rank]);
    }
    for (k = 0; k < n; ++k) {
        y[perm[k]] = work[k];
    }
}
