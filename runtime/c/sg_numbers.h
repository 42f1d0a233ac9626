#pragma once
#include "sg_real.h"

/* Helpers that the stepper needs beside those of the model functions. */

static inline real sg_min(real a, real b) { return a < b ? a : b; }

/* 1 if x is neither infinite nor NaN. */
static inline int sg_finite(real x) { return x - x == SG_C(0.0); }

static inline void sg_fill(int n, real value, real *x) {
    int i;
    for (i = 0; i < n; ++i) {
        x[i] = value;
    }
}
