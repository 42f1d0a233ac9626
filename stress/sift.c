/* Combinations of contact states that a linearised problem y = y0 + D R does not rule out.
 *
 * Rows and percussions 0 ... n - 1 are the normals of n spots (contact and stage), n ... 2 n - 1
 * their slips. A spot is open, sticks, or slips one way or the other; those without friction have
 * no slip row.
 */
#include <math.h>

enum { OPEN, STICK, FORTH, BACK, MOST = 32 };

/* Percussions beyond this many times those that stop free motion are no solution near it. */
#define FAR 1e6

/* Solve A x = b, n x n by rows, in place; 0 if a pivot vanishes. */
static int solve(int n, double *A, double *b) {
    int i, j, k;
    for (k = 0; k < n; ++k) {
        int row = k;
        for (i = k + 1; i < n; ++i) {
            if (fabs(A[i * n + k]) > fabs(A[row * n + k])) {
                row = i;
            }
        }
        if (!(fabs(A[row * n + k]) > 0.0)) {
            return 0;
        }
        if (row != k) {
            const double c = b[k];
            b[k] = b[row];
            b[row] = c;
            for (j = k; j < n; ++j) {
                const double a = A[k * n + j];
                A[k * n + j] = A[row * n + j];
                A[row * n + j] = a;
            }
        }
        for (i = k + 1; i < n; ++i) {
            const double factor = A[i * n + k] / A[k * n + k];
            for (j = k + 1; j < n && factor != 0.0; ++j) {
                A[i * n + j] -= factor * A[k * n + j];
            }
            b[i] -= factor * b[k];
        }
    }
    for (k = n - 1; k >= 0; --k) {
        for (j = k + 1; j < n; ++j) {
            b[k] -= A[k * n + j] * b[j];
        }
        b[k] /= A[k * n + k];
    }
    return 1;
}

static double row_of(int n, const double *D, const double *y0, const double *R, int row) {
    double sum = y0[row];
    int j;
    for (j = 0; j < 2 * n; ++j) {
        sum += D[row * 2 * n + j] * R[j];
    }
    return sum;
}

/* 1 if the combination violates no inequality by more than `loose` of the largest percussion. */
static int holds(int n, const double *D, const double *y0, const double *mu, const int *slides,
                 const double *size, double soft, double loose, const unsigned char *kind) {
    double A[4 * MOST * MOST], b[2 * MOST], R[2 * MOST], tie[MOST];
    int unknown[2 * MOST];
    double push = 0.0;
    double rest = 1e-300;
    double slack;
    int m = 0;
    int i, j, a, c;
    for (j = 0; j < n; ++j) {
        R[j] = R[n + j] = 0.0;
        tie[j] = kind[j] == FORTH ? -mu[j] : kind[j] == BACK ? mu[j] : 0.0;
        tie[j] = slides[j] ? tie[j] : 0.0;
        if (kind[j] != OPEN) {
            unknown[m++] = j;
        }
    }
    for (j = 0; j < n; ++j) {
        if (kind[j] == STICK && slides[j]) {
            unknown[m++] = n + j;
        }
    }
    for (a = 0; a < m; ++a) {
        const double *row = &D[unknown[a] * 2 * n];
        for (c = 0; c < m; ++c) {
            j = unknown[c];
            A[a * m + c] = row[j] + (j < n ? tie[j] * row[n + j] : 0.0);
        }
        A[a * m + a] += soft * size[unknown[a]];
        b[a] = -y0[unknown[a]];
    }
    if (!solve(m, A, b)) {
        return 1; /* nothing is ruled out */
    }
    for (a = 0; a < m; ++a) {
        R[unknown[a]] = b[a];
    }
    for (j = 0; j < n; ++j) {
        if (tie[j] != 0.0) {
            R[n + j] = tie[j] * R[j];
        }
        rest = fmax(rest, fabs(y0[j] / size[j]));
        if (slides[j]) {
            rest = fmax(rest, fabs(y0[n + j] / size[n + j]));
        }
        push = fmax(push, fmax(fabs(R[j]), fabs(R[n + j])));
    }
    if (push > FAR * rest) {
        return 0;
    }
    slack = loose * (push + rest);
    for (j = 0; j < n; ++j) {
        if (kind[j] != OPEN && R[j] < -slack) {
            return 0;
        }
        if (kind[j] == STICK && slides[j] && fabs(R[n + j]) > mu[j] * fmax(R[j], 0.0) + slack) {
            return 0;
        }
    }
    for (i = 0; i < n; ++i) {
        if (kind[i] == OPEN) {
            if (row_of(n, D, y0, R, i) / size[i] < -slack) {
                return 0;
            }
        } else if (kind[i] != STICK && slides[i]) {
            const double rate = row_of(n, D, y0, R, n + i) / size[n + i];
            if (kind[i] == FORTH ? (mu[i] > 0.0 && rate < -slack) : rate > slack) {
                return 0;
            }
        }
    }
    return 1;
}

/* Combinations first ... last - 1, the last spot changing fastest; `choice` holds count[j] states
   of spot j from 4 j on. The states of those that hold go to `found`, n for each, at most `most` of
   them; *next is the first combination not looked at. Returns their number, -1 for too many
   spots. */
long sift(int n, const double *D, const double *y0, const double *mu, const int *slides,
          const double *size, double soft, double loose, const int *count, const int *choice,
          long first, long last, long most, unsigned char *found, long *next) {
    unsigned char kind[MOST];
    long hits = 0;
    long k;
    int j;
    if (n > MOST) {
        return -1;
    }
    for (k = first; k < last && hits < most; ++k) {
        long rest = k;
        for (j = n - 1; j >= 0; --j) {
            kind[j] = (unsigned char)choice[4 * j + rest % count[j]];
            rest /= count[j];
        }
        if (holds(n, D, y0, mu, slides, size, soft, loose, kind)) {
            for (j = 0; j < n; ++j) {
                found[hits * n + j] = kind[j];
            }
            ++hits;
        }
    }
    *next = k;
    return hits;
}
