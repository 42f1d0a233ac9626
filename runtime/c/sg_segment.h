#pragma once
#include "sg_work.h"

/* Scratch of a step that is cut at its events. */

/* sg_located.c and what it includes: the segment at hand and what is known around it. */
typedef struct {
    int held;                    /* whether contacts keep their modes in the iteration */
    int rubs;                    /* whether friction or velocity constraints act */
    int solves;                  /* problems solved in the step so far */
    int known;                   /* whether accelerations at the segment's start are known */
    int prepared;                /* whether the step's start stands at the segment's start */
    int mode[SG_N_CONTACTS];     /* state of each contact in the segment */
    int before[SG_N_CONTACTS];   /* state before the event at its start */
    int touching[SG_N_CONTACTS]; /* whether its gap is closed there */
    int seen[SG_N_CONTACTS];     /* whether its event function was positive since */
    int absent[SG_N_CONTACTS];  /* event that the dense output shows and the motion does not have */
    int turned[SG_N_CONTACTS];  /* guard that an event has turned: 1 it exists since, 2 it does not
                                 */
    int exists[SG_N_CONTACTS];  /* whether its guard lets it exist */
    int impacts[SG_N_CONTACTS]; /* impacts in the step so far */
    real h;                     /* size of the whole step */
    real t;                     /* time of the segment's start */
    real span;                  /* its size */
    real mu[SG_N_CONTACTS];     /* friction coefficients at its start */
    real direction[SG_N_F];     /* direction of each slip, as its friction takes it */
    real gap_tolerance[SG_N_N]; /* within which a gap is closed */
    real rate_tolerance[SG_N_N];     /* within which it stays so */
    real slip_tolerance[SG_N_F];     /* within which a contact does not slip */
    real gap[SG_N_N];                /* gaps at the last place looked at */
    real gap_rate[SG_N_N];           /* their rates */
    real slip_rate[SG_N_F];          /* slip velocities */
    real guard[SG_N_CONTACTS];       /* guards */
    real acceleration[SG_N_Q];       /* times the step size, at the segment's start */
    real force[SG_N_R];              /* percussions of all rows there in a whole step */
    real bound[SG_N_BOUNDS];         /* given bounds there, times the step size */
    real start_acceleration[SG_N_Q]; /* the same, kept while forces are found elsewhere */
    real start_force[SG_N_R];        /* percussions */
    real start_bound[SG_N_BOUNDS];   /* bounds */
    real start_direction[SG_N_F];    /* directions of slip */
    real drift[SG_N_R];              /* chi at the start, while forces are found */
    real q[SG_N_Q];                  /* dense output: q and v at the start, v at the end */
    real v[SG_N_Q];                  /* velocities there */
    real v_end[SG_N_Q];              /* velocities at the end */
    real Q[SG_N_DENSE * SG_N_Q];     /* positions of the stages */
    real U[SG_N_DENSE * SG_N_Q];     /* velocities of the stages, where they are known */
    real P[SG_N_R];                  /* percussions of the step so far */
} SG(segment);
