#pragma once
#include "sg_work.h"

/* Scratch, and interface, of steps that are differentiated. */

/* Changes of a motion along directions, one behind the other in every array. */
typedef struct {
    int count;    /* directions, at most SG_N_WAYS - 1 */
    int moves;    /* set by the step: whether it differentiates */
    int fresh;    /* whether a run begins: directions are compared with its constraints */
    int begins;   /* whether the step begins */
    int near;     /* 1 + contact that nearly touches in the segment at hand, 0: none */
    int lost;     /* why there is no derivative; 0: there is one */
    int contact;  /* contact of the event that has none */
    real now;     /* time of the (sub)step or segment at hand */
    real near_at; /* where in the segment it is nearest */
    real at;      /* its time */
    int jumps[SG_N_CONTACTS]; /* whether forces at the start of the step are far from its mode */
    int idle[SG_N_WAYS];      /* whether nothing depends on what a direction changes */
    int leaves[SG_N_WAYS];    /* whether a direction leaves the constraints of the start */
    real grid[SG_N_WAYS];     /* change of the time at which a step begins */
    real t[SG_N_WAYS];        /* of that of the state: another one where a step ends in an event */
    real h[SG_N_WAYS];        /* of the size of the step */
    real q[SG_N_WAYS * SG_N_Q];          /* of the coordinates */
    real v[SG_N_WAYS * SG_N_Q];          /* of the velocities */
    real u[SG_N_WAYS * SG_N_U];          /* of the inputs */
    real par[SG_N_WAYS * SG_N_PAR];      /* of the parameters */
    real force[SG_N_WAYS * SG_N_R];      /* of the percussions of a whole step at the place */
    real bound[SG_N_WAYS * SG_N_BOUNDS]; /* of given bounds there, times the step size */
    real direction[SG_N_WAYS * SG_N_F];  /* of the directions of slip */
    real r[SG_N_WAYS * SG_N_X];      /* of the smooth rows of the velocities at a segment's end */
    real y[SG_N_WAYS * SG_N_ROWS];   /* of its kinematic rows */
    real q_end[SG_N_WAYS * SG_N_Q];  /* of its end, with its size as it is; the last: by its size */
    real v_end[SG_N_WAYS * SG_N_Q];  /* velocities there */
    real event[SG_N_WAYS];           /* of the event function there */
    real x[SG_N_WAYS * SG_N_X_KEPT]; /* of all unknown velocities of a captured step */
    real R[SG_N_WAYS * SG_N_ROWS_KEPT]; /* of its percussions */
} SG(directions);
