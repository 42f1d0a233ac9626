#pragma once
#include "sg_contract.h"

/* Scratch of one step that only the runtime uses, grouped by the file that fills it. A slot is one
   group of SG_N_R percussion rows; SG_N_ROWS are the rows of all slots of the largest problem, of
   which SG_N_ACTING have room in a dense system. */

/* sg_mass.c: inertia of coordinates and directions at the start of the step. */
typedef struct {
    real inertia[SG_N_Q];      /* |M_jj| of every coordinate */
    real root_inertia[SG_N_Q]; /* its square root relative to the first */
    real momentum[SG_N_Q];     /* larger of |p| and h force_size */
    real m_eff[SG_N_R];        /* effective mass of each direction */
    real reach[SG_N_R];        /* terms of each gap at the start, summed up */
    real preload[SG_N_R];      /* percussion of what yields, as it is compressed at the start */
    real row[SG_N_Q];          /* one direction, coordinate by coordinate */
    real solved[SG_N_Q];       /* M^-1 times that */
} SG(masses);

/* sg_scale.c: what the rows of a problem are measured by. */
typedef struct {
    int formed;                    /* whether the scales were formed in this step */
    int floored;                   /* 1 + problem for which the floors were formed */
    real fastest[SG_N_Q];          /* largest velocity of the iterate when they were formed */
    real now[SG_N_Q];              /* largest velocity of the present iterate */
    real pace[SG_N_Q];             /* speed of each coordinate in the step */
    real momentum_scale[SG_N_Q];   /* scale of the momentum rows */
    real momentum_inverse[SG_N_Q]; /* its inverse */
    real speed[SG_N_R];            /* speed of each direction */
    real gap_floor[SG_N_R];        /* round-off of each gap */
    real percussion_scale[SG_N_R]; /* m_eff times speed */
    real r_auto[SG_N_ROWS];        /* inverse response of each row to its own percussion */
    real prox_r[SG_N_ROWS];        /* prox parameter r in use */
    real phi_floor[SG_N_ROWS];     /* round-off of phi */
    real phi_inverse[SG_N_ROWS];   /* inverse of the tolerance of phi */
    real rounding[SG_N_ROWS];      /* round-off of phi if every gap is closed to its own */
} SG(scales);

/* sg_contact.c and the laws: the percussion rows at the present point. */
typedef struct {
    int kind[SG_N_ROWS];   /* SG_ROW_ZERO, SG_ROW_FREE or SG_ROW_SLIP */
    real phi[SG_N_ROWS];   /* residual of the law, a percussion */
    real slip[SG_N_ROWS];  /* friction against the slip over its radius: R_F = -radius slip */
    real ratio[SG_N_ROWS]; /* radius over the size of the prox argument */
} SG(rows);

/* sg_smooth.c: the linear system of the velocities; sg_mass.c factorises the mass matrix here. */
typedef struct {
    int pivoting;                  /* whether rows are to be exchanged in any case */
    int exchanged;                 /* whether rows were exchanged: the factors stand in `full` */
    int bordered;                  /* whether the bilateral percussions are unknowns, too */
    int perm[SG_N_X];              /* order of the rows of `full` */
    real factors[SG_N_FACTORS];    /* L and U as the pattern of K stores them, diagonal inverted */
    real full[SG_N_X * SG_N_X];    /* factors where rows are exchanged */
    real pivot_scale[SG_N_BORDER]; /* what pivots or rows are measured by */
    real row[SG_N_BORDER];         /* one row during the elimination */
    real dx[SG_N_BORDER];          /* right-hand side and solution, in elimination order */
} SG(smooth);

/* sg_system.c: the system reduced to the percussions. */
typedef struct {
    int condensed;           /* whether percussions that need no pivoting are eliminated, too */
    int left;                /* percussions left in the system last solved */
    int rank;                /* its rank; -1: it was factorised as it is */
    int deficiency;          /* dependent rows in the last direction */
    int determined;          /* contact state in which it found none; -1: it did not look */
    int follower[SG_N_ROWS]; /* friction row eliminated with this one, or -1 */
    int reduced[SG_N_ROWS];  /* rows of the system */
    int perm[SG_N_ROWS];     /* order of its rows or columns in the factors */
    real Z[SG_N_ACTING * SG_N_BORDER];  /* K^-1 B by columns: how the velocities answer */
    real S[SG_N_ACTING * SG_N_ACTING];  /* how the rows answer, by columns */
    real LU[SG_N_ACTING * SG_N_ACTING]; /* factors of a square matrix of percussions */
    real weight[SG_N_ROWS];             /* of its rows in the choice of pivots */
    real rhs[SG_N_ROWS];                /* right-hand side */
    real solution[SG_N_ROWS];           /* changes of the percussions over root_scale */
    real root_scale[SG_N_ROWS];         /* scales of the percussions, roots of masses */
    real inverse_scale[SG_N_ROWS];      /* their inverses */
    real dy[SG_N_ROWS];                 /* changes of kinematic rows along one column */
    real scratch[SG_N_ROWS];            /* of the orthogonal factorisation */
    real tau[SG_N_ROWS];                /* scalars of its reflections from the left */
    real tau_z[SG_N_ROWS];              /* and from the right */
} SG(system);

/* sg_newton.c: the iteration. */
typedef struct {
    int mode;               /* what it may take for granted: SG_AT_REST, ... */
    real dR[SG_N_ROWS];     /* direction of the percussions */
    real x_old[SG_N_X];     /* where a search along the direction begins */
    real R_old[SG_N_ROWS];  /* and its percussions */
    real x_best[SG_N_X];    /* nearest point so far */
    real R_best[SG_N_ROWS]; /* and its percussions */
} SG(newton);

/* sg_least.c: percussions of least norm, in the scales of the reduced system. */
typedef struct {
    real norm[SG_N_ROWS];       /* of least norm, the laws left aside */
    real within[SG_N_ROWS];     /* the nearest that the laws allow */
    real correction[SG_N_ROWS]; /* what the projections left out so far */
} SG(least);

/* sg_poisson.c: what the compression of an impact leaves to its expansion. */
typedef struct {
    int expands;                    /* whether the expansion is being solved */
    real given[SG_N_EXPANDED];      /* percussions that are given, row by row */
    real back[SG_N_EXPANDED];       /* of normal rows what e_N gives back */
    real momentum[SG_N_EXPANDED_X]; /* what the given percussions do to the momenta */
} SG(expansion);

/* sg_law_elliptic.c: semi-axes of the sets of friction, one for each slip component. */
typedef struct {
    real axis[SG_N_AXES]; /* relative to the larger coefficient of its contact */
} SG(elliptic);

/* sg_linear.c: the linearised problem. */
typedef struct {
    real y_0[SG_N_ROWS]; /* kinematic rows without any percussion */
} SG(linear);

/* sg_path.c: contact states along a path of the linearised problem. */
typedef struct {
    int first;                 /* percussion of the problem in work.R */
    real row_scale[SG_N_ROWS]; /* of the rows in the choice of pivots */
    real d[SG_N_ROWS];         /* how fast the rows are moved apart with tau */
    real y[SG_N_ROWS];         /* rows at the present tau */
    real y_rate[SG_N_ROWS];    /* their rate with tau */
    real R[SG_N_ROWS];         /* percussions at the present tau */
    real R_rate[SG_N_ROWS];    /* their rate with tau */
} SG(path);

/* sg_relax.c: relaxation of contacts in space; one number each where there are none. */
typedef struct {
    real scale[SG_N_RELAX];   /* of the percussions, one energy for all contacts */
    real before[SG_N_RELAX];  /* percussions before a sweep */
    real change[SG_N_RELAX];  /* by how much it changed them */
    real x_end[SG_N_RELAX_X]; /* where relaxation ended */
    real R_end[SG_N_RELAX];   /* and its percussions */
} SG(relax);

/* sg_solve.c and sg_step.c: what was found, for the checker and the next step. */
typedef struct {
    int stuck;                     /* problem that was not solved, -1: none */
    int exists[SG_N_CONTACTS];     /* guard >= 0 at the start */
    int active[SG_N_CONTACTS];     /* closed at the end, (67) */
    int states[SG_N_PROBLEMS];     /* contact states of the solutions, in one number */
    int choice[SG_N_PROBLEMS];     /* how their percussions were chosen */
    int said[SG_N_PROBLEMS];       /* number of the contact states that are said next, */
    int apart[SG_N_PROBLEMS];      /* 1 where each slot has its own */
    real r[SG_N_X_TOTAL];          /* smooth rows at the solutions */
    real y[SG_N_ROWS_TOTAL];       /* kinematic rows at the solutions */
    real radius[SG_N_RADII_TOTAL]; /* given radii of friction at the solutions */
} SG(found);
