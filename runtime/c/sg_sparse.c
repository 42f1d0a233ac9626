#pragma once
#include "sg_numbers.h"

/* Sparse matrices by rows. Their patterns are tables: known when the code is generated, or of an
   island that is put together in the step. */

/* Pattern of a matrix: entries start[i] ... start[i + 1] - 1 belong to row i, `index` is the column
   of each. */
typedef struct {
    const sg_index *start, *index;
} sg_rows;

/* Pattern of the factors L + U of a square matrix: place k belongs to unknown order[k], pivots
   stand on the diagonal. */
typedef struct {
    const sg_index *order, *start, *index, *diagonal;
} sg_factors;

/* b += factor * row i. */
static inline void sg_add_row(const sg_rows *p, const real *values, int i, real factor, real *b) {
    const sg_index *start = p->start;
    const sg_index *index = p->index;
    const int last = start[i + 1];
    int k;
    for (k = start[i]; k < last; ++k) {
        b[index[k]] += factor * values[k];
    }
}

/* Row i times the vector b. */
static inline real sg_row_dot(const sg_rows *p, const real *values, int i, const real *b) {
    const sg_index *start = p->start;
    const sg_index *index = p->index;
    const int last = start[i + 1];
    real sum = SG_C(0.0);
    int k;
    for (k = start[i]; k < last; ++k) {
        sum += values[k] * b[index[k]];
    }
    return sum;
}

/* Factorise rows first ... n - 1 of A into LU without exchange of rows; the rows before stand
   there already, inverses of the pivots on the diagonal. Returns 0 where a pivot is not larger
   than `least` times its scale or anything is not finite. `row` holds n entries. */
static int sg_sparse_factor(int first, int n, const sg_factors *p, const real *scale, real least,
                            const real *A, real *LU, real *row) {
    const sg_index *start = p->start;
    const sg_index *index = p->index;
    const sg_index *diagonal = p->diagonal;
    int i, k, m;
    for (i = first; i < n; ++i) {
        const int begin = start[i];
        const int middle = diagonal[i];
        const int last = start[i + 1];
        real pivot;
        for (k = begin; k < last; ++k) {
            row[index[k]] = A[k];
        }
        for (k = begin; k < middle; ++k) {
            const int j = index[k];
            const int end = start[j + 1];
            const real factor = row[j] * LU[diagonal[j]];
            LU[k] = factor;
            for (m = diagonal[j] + 1; m < end; ++m) {
                row[index[m]] -= factor * LU[m];
            }
        }
        pivot = row[i];
        if (!(SG_FABS(pivot) > least * scale[i]) || !sg_finite(pivot)) {
            return 0;
        }
        LU[middle] = SG_C(1.0) / pivot;
        for (k = middle + 1; k < last; ++k) {
            LU[k] = row[index[k]];
        }
    }
    return 1;
}

#if SG_UNROLLED
/* 1 if pivots first ... n - 1, whose inverses stand in LU, are larger than `least` times their
   scale and finite. */
static int sg_pivots_hold(int first, int n, const sg_factors *p, const real *scale, real least,
                          const real *LU) {
    const sg_index *diagonal = p->diagonal;
    int i;
    for (i = first; i < n; ++i) {
        const real size = SG_FABS(LU[diagonal[i]]);
        if (!(size * least * scale[i] < SG_C(1.0)) || !(size > SG_C(0.0))) {
            return 0;
        }
    }
    return 1;
}
#endif

/* Solve with the factors; b, in elimination order and zero before `first`, becomes the solution. */
static void sg_sparse_solve(int n, const sg_factors *p, const real *LU, int first, real *b) {
    const sg_index *start = p->start;
    const sg_index *index = p->index;
    const sg_index *diagonal = p->diagonal;
    int i, k;
    for (i = first; i < n; ++i) {
        const int middle = diagonal[i];
        real sum = b[i];
        for (k = start[i]; k < middle; ++k) {
            sum -= LU[k] * b[index[k]];
        }
        b[i] = sum;
    }
    for (i = n - 1; i >= 0; --i) {
        const int last = start[i + 1];
        const int middle = diagonal[i];
        real sum = b[i];
        for (k = middle + 1; k < last; ++k) {
            sum -= LU[k] * b[index[k]];
        }
        b[i] = sum * LU[middle];
    }
}

/* The leading n x n block with all its entries, by rows in elimination order. */
static void sg_expand(int n, const sg_factors *p, const real *A, real *full) {
    const sg_index *start = p->start;
    const sg_index *index = p->index;
    int i, k;
    sg_fill(n * n, SG_C(0.0), full);
    for (i = 0; i < n; ++i) {
        const int last = start[i + 1];
        for (k = start[i]; k < last && index[k] < n; ++k) {
            full[i * n + index[k]] = A[k];
        }
    }
}
