/* Peak of one core: twelve independent chains of fused multiply-adds, eight numbers wide. Prints
   operations per nanosecond, a fused multiply-add counted as two. */
#define _POSIX_C_SOURCE 200809L

#include <stdio.h>
#include <time.h>

typedef double lane __attribute__((vector_size(64)));

enum { CHAINS = 12, ROUNDS = 2000000 };

int main(void) {
    lane x[CHAINS];
    const lane a = {0.999999, 0.999999, 0.999999, 0.999999, 0.999999, 0.999999, 0.999999, 0.999999};
    const lane b = {1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6};
    double best = 0.0;
    double sum = 0.0;
    int trial, k, i;
    for (trial = 0; trial < 7; ++trial) {
        struct timespec start, end;
        double rate;
        for (i = 0; i < CHAINS; ++i) {
            x[i] = b * (double)i;
        }
        clock_gettime(CLOCK_MONOTONIC, &start);
        for (k = 0; k < ROUNDS; ++k) {
            for (i = 0; i < CHAINS; ++i) {
                x[i] = x[i] * a + b;
            }
        }
        clock_gettime(CLOCK_MONOTONIC, &end);
        rate = 2.0 * CHAINS * 8.0 * ROUNDS /
               ((double)(end.tv_sec - start.tv_sec) * 1e9 + (double)(end.tv_nsec - start.tv_nsec));
        best = rate > best ? rate : best;
        for (i = 0; i < CHAINS; ++i) {
            sum += x[i][0];
        }
    }
    printf("%.9g %g\n", best, sum);
    return 0;
}
