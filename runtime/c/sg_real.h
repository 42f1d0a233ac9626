#pragma once

#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ > 0)
#error "-ffast-math and -ffinite-math-only take away the tests for infinite values and NaN"
#endif

/* The real type, its constants and the libm calls, chosen once. SG(name) is the model's prefix. */
typedef SG(real) real;

#if SG_FLOAT
#define SG_C(x) x##F
#define SG_EPS FLT_EPSILON
#define SG_NAN ((real)NAN)
#define SG_HUGE FLT_MAX
#define SG_TINY FLT_MIN
#define SG_SQRT(x) sqrtf(x)
#define SG_POW(x, y) powf(x, y)
#define SG_FABS(x) fabsf(x)
#define SG_TOLERANCE (64.0F * FLT_EPSILON) /* default of options.tol */
#define SG_STAGNATION                                                                          \
    (4096.0F * FLT_EPSILON)                /* worst residual that a stalled iteration may keep \
                                            */
#define SG_CHECK (16384.0F * FLT_EPSILON)  /* worst residual that the checker accepts */
#define SG_RANK (512.0F * FLT_EPSILON)     /* relative pivot below which rows are dependent */
#define SG_SOFTNESS (256.0F * FLT_EPSILON) /* relative compliance of contradictory contacts */
#define SG_TOUCH (1024.0F * FLT_EPSILON)   /* share of its scale within which a gap is closed */
#define SG_GIVE (64.0F * FLT_EPSILON)      /* relative compliance of all rows along a path */
#define SG_SMALL (8192.0F * FLT_EPSILON)   /* relative pivot below which rows may be dependent */
#else
#if SG_EXTENDED
#if LDBL_MANT_DIG <= DBL_MANT_DIG
#error "long double is no wider than double on this machine: generate with precision double"
#endif
#define SG_C(x) x##L
#define SG_EPS LDBL_EPSILON
#define SG_HUGE LDBL_MAX
#define SG_TINY LDBL_MIN
#define SG_SQRT(x) sqrtl(x)
#define SG_POW(x, y) powl(x, y)
#define SG_FABS(x) fabsl(x)
#else
#define SG_C(x) x
#define SG_EPS DBL_EPSILON
#define SG_HUGE DBL_MAX
#define SG_TINY DBL_MIN
#define SG_SQRT(x) sqrt(x)
#define SG_POW(x, y) pow(x, y)
#define SG_FABS(x) fabs(x)
#endif
#define SG_NAN ((real)NAN)
#define SG_TOLERANCE (SG_C(4096.0) * SG_EPS)
#define SG_STAGNATION (SG_C(67108864.0) * SG_EPS)
#define SG_CHECK (SG_C(268435456.0) * SG_EPS)
#define SG_RANK (SG_C(1048576.0) * SG_EPS)
#define SG_SOFTNESS (SG_C(67108864.0) * SG_EPS)
#define SG_TOUCH (SG_C(4194304.0) * SG_EPS)
#define SG_GIVE (SG_C(1024.0) * SG_EPS)
#define SG_SMALL (SG_C(4294967296.0) * SG_EPS)
#endif

/* Rounding floors of rows are SG_FLOOR times their magnitude; within SG_BAND floors around zero a
   contact counts as closed. */
#define SG_FLOOR (SG_C(16.0) * SG_EPS)
#define SG_BAND SG_C(16.0)

/* Largest tolerance that options.tol may ask for, and the largest share of a row's scale that the
   checker accepts, whatever the tolerance is. */
#define SG_TOLERANCE_MOST SG_C(0.0009765625)
#define SG_CHECK_MOST SG_C(0.00390625)

/* A step may be halved ten times. Of its iterations SG_PART_WHOLE of SG_PARTS may be used by the
   whole step, SG_PART_AGAIN once it was tried again in contact states that are said, the rest by
   substeps. */
#define SG_MOST_HALVINGS 10
#define SG_FINEST 1024
#define SG_PARTS 20
#define SG_PART_WHOLE 12
#define SG_PART_AGAIN 17

/* Steps of one size after which their count begins anew: long before it is no longer exact. */
#define SG_GRID_MOST (SG_C(0.25) / SG_EPS)

/* Power iterations for the fastest oscillation, and the relative change at which they end. */
#define SG_POWER_ROUNDS 200
#define SG_POWER_CHANGE SG_C(0.0001220703125)

/* Percussions of an island that are more than these are eliminated row by row, in so many passes,
   until rows are solved to this share of their tolerance. */
#define SG_LARGE 48
#define SG_PASSES 16
#define SG_NEAR_ENOUGH SG_C(0.25)
/* Elements of up to so many unknowns are dense in the factors of such an island. */
#define SG_DRAWN_WHOLE 24
/* There: Newton iterations of a plain attempt; soft contacts: by how much they yield less from one
   problem to the next, and at least; the least that they yield, iterations in each. */
#define SG_HEAVY 16
#define SG_HARDER SG_C(0.125)
#define SG_HARD (SG_C(0.0625) * SG_SOFTNESS)
#define SG_HARDER_AT_LEAST SG_C(0.8)
#define SG_SOFTLY 12

/* Sweeps of alternating projections that seek percussions of least norm in their cones. */
#define SG_SWEEPS 200

/* Newton iterations of a plain attempt, of contact states held, of contacts that are said to hold,
   from where a path or a relaxation led; paths followed in one problem at first and in all; sets of
   contact states that are looked through, iterations in each of them and from there. */
#define SG_PLAIN 9
#define SG_HELD 5
#define SG_HOLDING 20
#define SG_LANDING 5
#define SG_TURNS 6
#define SG_LAST_TURNS 24
#define SG_MOST_STATES 4096
#define SG_SAID 2
#define SG_AFTER_SAID 4

/* Relaxation: how often in one problem, visits to all contacts in each, visits after which leaps
   are thought of, and how equal the changes of two visits must be for one. */
#define SG_RELAX_TURNS 4
#define SG_RELAX_SWEEPS 2000
#define SG_RELAX_LEAP 20
#define SG_RELAX_STEADY SG_C(0.03125)

/* Share of the residual that counts as clearly nearer; share of the decrease along a direction that
   a search asks for; how often it halves its step. */
#define SG_CLEARLY SG_C(0.25)
#define SG_DESCENT SG_C(0.125)
#define SG_SEARCHES 6

/* Iterations that are looked back on for contact states that come again. */
#define SG_CYCLE 4

/* Percussions that are moved into their cones end this share of the radius within. */
#define SG_INSIDE SG_C(0.984375)

/* The least share of the largest term that a direction's mobility, or a coordinate's scale, may be
   measured by. */
#define SG_LEAST_SHARE SG_C(0.0009765625)

/* Located events: places of a segment at which gaps and slips, and forces, are looked at; rounds to
   find a root on the dense output, its width, rounds to find a dip, to find where a function was
   positive, to locate an event by secants and in all; shares of force that leave no doubt, and
   how far beyond the stages a force may go on as it varies over them; an
   impact within this share of the step behind the last lets the contact rest. */
#define SG_SAMPLES 16
#define SG_FORCE_SAMPLES 2
#define SG_ROOT_ROUNDS 40
#define SG_ROOT_NEAR (SG_C(16.0) * SG_EPS)
#define SG_DIP_ROUNDS 24
#define SG_BACK_ROUNDS 20
#define SG_SECANT_ROUNDS 10
#define SG_LOCATE_ROUNDS 64
#define SG_ABSENT_TURNS 4
/* Events of a step at one place, for each contact: more of them are a contact that opens and closes
   in turn. */
#define SG_EVENTS_AT_PLACE 3
#define SG_CLEAR_PUSH SG_C(0.25)
#define SG_CLEAR_FRICTION SG_C(0.875)
#define SG_CLEAR_GROWTH SG_C(2.0)
#define SG_REST SG_C(0.01)
#define SG_STEEP SG_C(0.0001220703125) /* slowest approach that has a derivative, of its scale */
#define SG_SOLVES 2048 /* problems that a step may solve, and its iterations in units of */
#define SG_EFFORT 16   /* options.max_iterations, before it is captured */
#define SG_DIP SG_C(0.0009765625) /* share of the way that truncation may take from a gap */

/* Numbers of a row of record.counts. */
#define SG_COUNTS 10

/* Floors of round-off within which the checker takes a row as solved. */
#define SG_CHECK_FLOORS SG_C(64.0)

static inline real sg_max(real a, real b) { return a > b ? a : b; }

/* Irregular numbers in [1, 2), the same in every run, that tell apart what is symmetric: 37 and 64
   have no common divisor, so that 64 in succession differ. */
static inline real sg_irregular(int i) {
    const int part = (37 * i) % 64;
    return SG_C(1.0) + (real)part * SG_C(0.015625);
}

static inline int sg_all_finite(int n, const real *x) {
    real sum = SG_C(0.0); /* NaN if any x - x is */
    int i;
    for (i = 0; i < n; ++i) {
        sum += x[i] - x[i];
    }
    return sum == SG_C(0.0);
}

static inline void sg_copy(int n, const real *from, real *to) {
    int i;
    for (i = 0; i < n; ++i) {
        to[i] = from[i];
    }
}

static inline real sg_dot(int n, const real *a, const real *b) {
    real sum = SG_C(0.0);
    int i;
    for (i = 0; i < n; ++i) {
        sum += a[i] * b[i];
    }
    return sum;
}
