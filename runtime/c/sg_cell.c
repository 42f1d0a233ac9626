#pragma once
#include "sg_real.h"

/* Search in the points of a table. */

#if SG_TABULATED > 0
/* Number of the n increasing points that are not beyond x: the cell of x; 0 for a NaN. */
static int sg_cell(const real points[], int n, real x) {
    int low = 0; /* points[0 .. low) are not beyond x, points[high .. n) are */
    int high = n;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (points[middle] <= x) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}
#endif
