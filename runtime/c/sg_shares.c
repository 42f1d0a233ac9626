#pragma once
#include "sg_real.h"

/* What each part has of the vectors of the model. */

#if SG_N_PARTS > 1
/* Of what there are places; "one" is a sum over the parts. */
enum {
    SG_OF_ONE,
    SG_OF_Q,
    SG_OF_G,
    SG_OF_GAMMA,
    SG_OF_N,
    SG_OF_F,
    SG_OF_CONTACTS,
    SG_OF_BOUNDS,
    SG_OF_COMPLIANCES,
    SG_OF_R,
    SG_OF_POINTS,
    SG_OF_AXES
};

/* Numbers of a vector of the model that belong to a part. */
static inline void sg_take(int part, int space, const real *from, real *to) {
    const int *at = &sg_places[sg_shares[part].first[space]];
    int k;
    for (k = 0; k < sg_counts[sg_shares[part].kind][space]; ++k) {
        to[k] = from[at[k]];
    }
}

/* Add a matrix of a part, row by row, to that of the model, which has `width` columns. */
static inline void sg_give(int part, int rows, int columns, int width, const real *from, real *to) {
    const int *row = &sg_places[sg_shares[part].first[rows]];
    const int *column = &sg_places[sg_shares[part].first[columns]];
    const int n = sg_counts[sg_shares[part].kind][columns];
    int i, j;
    for (i = 0; i < sg_counts[sg_shares[part].kind][rows]; ++i) {
        for (j = 0; j < n; ++j) {
            to[row[i] * width + column[j]] += from[i * n + j];
        }
    }
}
#endif
