/* A model as a functional mock-up unit for co-simulation: what both versions of the standard need.
   Plain C around a generated stepper; `fmu_model.h` is generated and says what the model has. An
   instance lives on the heap because the standard says so; nothing else does. */
#ifndef SIGNORINI_FMU_H
#define SIGNORINI_FMU_H

#include "fmu_model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#define FMU_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FMU_EXPORT __attribute__((visibility("default")))
#else
#define FMU_EXPORT
#endif

/* In which order calls may come. */
enum { FMU_INSTANTIATED, FMU_INITIALISING, FMU_STEPPING, FMU_TERMINATED, FMU_FAILED };

/* All that a state of the unit is; plain data. */
typedef struct {
    M(params) par;
    M(state) state;
    double start_q[FMU_N_Q], start_v[FMU_N_Q]; /* where to begin, if set before */
    int given_q[FMU_N_Q], given_v[FMU_N_Q];
    double u[FMU_N_U + 1];
    double P[FMU_N_R + 1]; /* percussions of the last communication step */
    double span;           /* its size */
    double dt, error;      /* largest step; wanted error, 0: steps have the size dt */
    double t_start, t_stop;
    int phase;
} fmu_values;

typedef struct {
    fmu_values now;
    M(options) opt;
    M(work) work;
    M(info) info;
#if FMU_ADAPTIVE
    M(control) control;
#endif
} fmu_instance;

/* Values by their number; 0 if there is none of it, or it cannot be set now. */
int fmu_get_real(fmu_instance *unit, unsigned number, double *value);
int fmu_get_integer(const fmu_instance *unit, unsigned number, int *value);
int fmu_set_real(fmu_instance *unit, unsigned number, double value);

/* States that the importer keeps, as bytes, and back; 0 if that cannot be: no memory, no such
 * bytes. */
int fmu_keep(const fmu_values *now, void **kept);
size_t fmu_bytes(void);
int fmu_pack(const void *kept, char bytes[], size_t size);
int fmu_unpack(const char bytes[], size_t size, void **kept);

fmu_instance *fmu_new(void);
void fmu_reset(fmu_instance *unit);

/* The start, from what was set; a status of the stepper. */
int fmu_begin(fmu_instance *unit);

/* From t to t + h; a status of the stepper. If it fails the state is as it was before. */
int fmu_step(fmu_instance *unit, double t, double h);

#endif
