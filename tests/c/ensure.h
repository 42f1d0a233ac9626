/* What unit tests of C say: a condition that does not hold is printed and counted. */
#pragma once

#include <stdio.h>

static int failures = 0;

#define ENSURE(condition)                                                        \
    do {                                                                         \
        if (!(condition)) {                                                      \
            printf("%s:%d: %s does not hold\n", __FILE__, __LINE__, #condition); \
            ++failures;                                                          \
        }                                                                        \
    } while (0)
