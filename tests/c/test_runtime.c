/* Unit tests of runtime/c, compiled as it is. The "model" is one particle with one contact of two
   slip components, written by hand: x is not used by the kernels under test. */
#include <float.h>
#include <math.h>
#include <stddef.h>
#include "ensure.h"

#define SG(name) unit_##name
#define SG_K(name) UNIT_##name
#define SG_FLOAT 0
#define SG_EXTENDED 0
#define SG_UNROLLED 1
typedef double unit_real;
typedef unsigned char sg_index;
/* an arrow: order, start, column, diagonal */
static const sg_index sg_table[] = {0, 1, 2, 3, 0, 2, 4, 6, 10, 0, 3, 1,
                                    3, 2, 3, 0, 1, 2, 3, 0, 2,  4, 9};
#include "sg_numbers.h"

#include "sg_linalg.c"
#include "sg_prox.c"
#include "sg_sparse.c"

#define ENSURE_NEAR(a, b, tol) ENSURE(fabs((a) - (b)) <= (tol))

/* A small deterministic generator, uniform in [-1, 1]. */
static unsigned long seed = 12345UL;
static double uniform(void) {
    seed = (1103515245UL * seed + 12345UL) & 0x7fffffffUL;
    return 2.0 * (double)seed / 2147483647.0 - 1.0;
}

enum { N = 8 };

static void test_lu(void) {
    int trial, i, j, n;
    for (trial = 0; trial < 200; ++trial) {
        double A[N * N], LU[N * N], x[N], b[N], scale[N];
        int pivot[N];
        n = 1 + trial % N;
        for (i = 0; i < n * n; ++i) {
            A[i] = LU[i] = uniform();
        }
        for (i = 0; i < n; ++i) {
            x[i] = uniform();
            scale[i] = 1.0 + 0.5 * uniform();
        }
        for (i = 0; i < n; ++i) {
            b[i] = 0.0;
            for (j = 0; j < n; ++j) {
                b[i] += A[i * n + j] * x[j];
            }
        }
        ENSURE(sg_lu_factor(n, LU, scale, pivot));
        sg_lu_solve(n, LU, pivot, b);
        for (i = 0; i < n; ++i) {
            ENSURE_NEAR(b[i], x[i], 1e-9);
        }
    }
    {
        double zero[4] = {0.0, 0.0, 0.0, 1.0};
        double wild[4] = {NAN, 0.0, 0.0, 1.0};
        double swapped[4] = {0.0, 2.0, 4.0, 0.0};
        double scale[2] = {1.0, 1.0};
        double b[2] = {2.0, 4.0};
        int pivot[2];
        ENSURE(!sg_lu_factor(2, zero, scale, pivot));
        ENSURE(!sg_lu_factor(2, wild, scale, pivot));
        ENSURE(sg_lu_factor(2, swapped, scale, pivot));
        sg_lu_solve(2, swapped, pivot, b);
        ENSURE_NEAR(b[0], 1.0, 0.0);
        ENSURE_NEAR(b[1], 1.0, 0.0);
    }
}

/* Random matrices S = L R of given rank: the solution must solve and be orthogonal to the null
   space, the projection must not change S y. */
static void test_rank_revealing(void) {
    int trial, i, j, k;
    for (trial = 0; trial < 400; ++trial) {
        const int n = 1 + trial % N;
        const int rank = trial % (n + 1);
        double S[N * N], F[N * N], L[N * N], R[N * N], b[N], y[N], x[N], work[N], tau[N], tau_z[N];
        double projected[N];
        int perm[N];
        for (i = 0; i < n * rank; ++i) {
            L[i] = uniform();
            R[i] = uniform();
        }
        for (i = 0; i < n; ++i) {
            x[i] = uniform();
            for (j = 0; j < n; ++j) {
                S[j * n + i] = 0.0;
                for (k = 0; k < rank; ++k) {
                    S[j * n + i] += L[i * rank + k] * R[k * n + j];
                }
                F[j * n + i] = S[j * n + i];
            }
        }
        for (i = 0; i < n; ++i) {
            b[i] = 0.0;
            for (j = 0; j < n; ++j) {
                b[i] += S[j * n + i] * x[j];
            }
        }
        ENSURE(sg_cod_factor(n, F, perm, tau, tau_z) == rank);
        sg_cod_solve(n, rank, F, perm, tau, tau_z, b, work, y);
        for (i = 0; i < n; ++i) {
            projected[i] = x[i];
        }
        sg_cod_project(n, rank, F, perm, tau_z, work, projected);
        for (i = 0; i < n; ++i) {
            double left = 0.0;
            for (j = 0; j < n; ++j) {
                left += S[j * n + i] * (y[j] - x[j]);
            }
            ENSURE_NEAR(left, 0.0, 1e-8);
            /* Both are the one vector of the row space with this image. */
            ENSURE_NEAR(y[i], projected[i], 1e-6);
        }
    }
}

static void test_prox(void) {
    double direction[2] = {0.0, 0.0};
    double ratio = 0.0;
    const double inside[2] = {0.3, -0.4};
    const double outside[2] = {3.0, -4.0};
    const double origin[2] = {0.0, 0.0};
    const double huge[2] = {1e200, 1e200};
    const double line = -2.0;
    ENSURE(sg_is_closed(-1.0, 0.0) && sg_is_closed(0.0, 0.0) && !sg_is_closed(1e-300, 0.0));
    ENSURE(sg_is_closed(1e-14, 1e-13));
    ENSURE(!sg_is_closed(NAN, 0.0));
    ENSURE(sg_prox_ball(2, inside, 0.5, 0.0, direction, &ratio) && ratio == 1.0);
    ENSURE(!sg_prox_ball(2, outside, 0.5, 0.0, direction, &ratio));
    ENSURE_NEAR(direction[0], 0.6, 1e-16);
    ENSURE_NEAR(direction[1], -0.8, 1e-16);
    ENSURE_NEAR(ratio, 0.1, 1e-16);
    ENSURE(sg_prox_ball(2, origin, 0.0, 0.0, direction, &ratio)); /* no division at the origin */
    ENSURE(!sg_prox_ball(1, &line, 0.5, 0.0, direction, &ratio));
    ENSURE_NEAR(direction[0], -1.0, 0.0);
    ENSURE_NEAR(ratio, 0.25, 0.0);
    ENSURE(!sg_prox_ball(2, huge, 1.0, 0.0, direction, &ratio)); /* no overflow */
    ENSURE_NEAR(direction[0], sqrt(0.5), 1e-15);
    ENSURE_NEAR(sg_norm(2, origin), 0.0, 0.0);
}

static void test_vectors(void) {
    double x[3] = {1.0, 2.0, 3.0};
    double y[3];
    sg_fill(3, 2.0, y);
    ENSURE(sg_dot(3, x, y) == 12.0);
    sg_copy(3, x, y);
    ENSURE(y[2] == 3.0 && sg_all_finite(3, y));
    y[1] = INFINITY;
    ENSURE(!sg_all_finite(3, y) && !sg_finite(NAN) && sg_max(1.0, 2.0) == 2.0);
}

/* An arrow: every row couples with the last, whose pivot is what the others leave. */
static void test_sparse(void) {
    static const int diagonal[] = {0, 2, 4, 9};
    const sg_factors p = {sg_table, sg_table + 4, sg_table + 9, sg_table + 19};
    const sg_rows rows = {sg_table + 4, sg_table + 9};
    const double scale[4] = {1.0, 1.0, 1.0, 1.0};
    int trial, i, k;
    for (trial = 0; trial < 200; ++trial) {
        double A[10], LU[10], full[16], x[4], b[4], row[4], ones[4];
        int pivot[4];
        for (k = 0; k < 10; ++k) {
            A[k] = uniform();
        }
        for (i = 0; i < 4; ++i) {
            A[diagonal[i]] += A[diagonal[i]] > 0.0 ? 3.0 : -3.0;
            x[i] = uniform();
            ones[i] = 1.0;
        }
        for (i = 0; i < 4; ++i) {
            b[i] = sg_row_dot(&rows, A, i, x);
        }
        sg_expand(4, &p, A, full);
        for (i = 0; i < 4; ++i) {
            ENSURE_NEAR(sg_dot(4, &full[4 * i], x), b[i], 1e-14);
        }
        /* in two goes, as velocities and percussions are */
        ENSURE(sg_sparse_factor(0, 3, &p, scale, 1e-6, A, LU, row));
        ENSURE(sg_sparse_factor(3, 4, &p, scale, 1e-6, A, LU, row));
        ENSURE(sg_pivots_hold(0, 4, &p, scale, 1e-6, LU));
        ENSURE(!sg_pivots_hold(0, 4, &p, scale, 1e6, LU));
        ENSURE(!sg_sparse_factor(0, 4, &p, scale, 1e6, A, LU, row));
        ENSURE(sg_sparse_factor(0, 4, &p, scale, 0.0, A, LU, row));
        sg_sparse_solve(4, &p, LU, 0, b);
        for (i = 0; i < 4; ++i) {
            ENSURE_NEAR(b[i], x[i], 1e-12);
        }
        ENSURE(sg_lu_factor(4, full, ones, pivot));
        ENSURE(sg_lu_is_regular(4, full, 1e-6) && !sg_lu_is_regular(4, full, 1.5));
        /* a right-hand side that begins with zeros */
        sg_fill(4, 0.0, b);
        sg_fill(4, 0.0, x);
        sg_add_row(&rows, A, 2, 2.0, b);
        x[2] = 2.0 * A[4];
        x[3] = 2.0 * A[5];
        sg_sparse_solve(4, &p, LU, 2, b);
        sg_lu_solve(4, full, pivot, x);
        for (i = 0; i < 4; ++i) {
            ENSURE_NEAR(b[i], x[i], 1e-12);
        }
        A[diagonal[1]] = NAN;
        ENSURE(!sg_sparse_factor(0, 4, &p, scale, 1e-6, A, LU, row));
        A[diagonal[1]] = 0.0;
        ENSURE(!sg_sparse_factor(0, 4, &p, scale, 1e-6, A, LU, row));
    }
}

int main(void) {
    test_sparse();
    test_vectors();
    test_lu();
    test_rank_revealing();
    test_prox();
    printf("%d failed\n", failures);
    return failures != 0;
}
