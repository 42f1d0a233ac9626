/* Functions of FMI 3.0 for co-simulation. */
#include "fmu.h"

#include <stdbool.h>
#include <stdint.h>

typedef void *fmi3Instance;
typedef void *fmi3InstanceEnvironment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean;
typedef char fmi3Char;
typedef const fmi3Char *fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef bool fmi3Clock;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum {
    fmi3Independent,
    fmi3Constant,
    fmi3Fixed,
    fmi3Tunable,
    fmi3Discrete,
    fmi3Dependent
} fmi3DependencyKind;
typedef enum {
    fmi3IntervalNotYetKnown,
    fmi3IntervalUnchanged,
    fmi3IntervalChanged
} fmi3IntervalQualifier;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64, fmi3Boolean,
                                               fmi3Boolean, fmi3Boolean, fmi3Boolean, fmi3Boolean *,
                                               fmi3Float64 *);
typedef void (*fmi3Preemption)(void);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);

typedef struct {
    fmu_instance *unit;
    fmi3LogMessageCallback logger;
    fmi3InstanceEnvironment environment;
} unit_3;

static fmi3Status tell(const unit_3 *c, fmi3Status status, fmi3String text) {
    if (c != NULL && c->logger != NULL) {
        c->logger(c->environment, status, "logStatusError", text);
    }
    return status;
}

static fmu_values *values_of(fmi3Instance instance) {
    return instance == NULL ? NULL : &((unit_3 *)instance)->unit->now;
}

/* 1 if a call may come in a phase. */
static int may(fmi3Instance instance, int phase) {
    const fmu_values *now = values_of(instance);
    return now != NULL && now->phase == phase;
}

FMU_EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

FMU_EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n,
                                          const fmi3String categories[]) {
    (void)on;
    (void)n;
    (void)categories;
    return c == NULL ? fmi3Error : fmi3OK;
}

FMU_EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference required[],
    size_t n_required, fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
    fmi3IntermediateUpdateCallback update) {
    unit_3 *c;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)early;
    (void)required;
    (void)n_required;
    (void)update;
    if (name == NULL || token == NULL || events || strcmp(token, FMU_TOKEN) != 0) {
        return NULL;
    }
    c = calloc(1, sizeof *c);
    if (c == NULL) {
        return NULL;
    }
    c->unit = fmu_new();
    if (c->unit == NULL) {
        free(c);
        return NULL;
    }
    c->logger = logger;
    c->environment = environment;
    return c;
}

FMU_EXPORT void fmi3FreeInstance(fmi3Instance instance) {
    unit_3 *c = instance;
    if (c != NULL) {
        free(c->unit);
        free(c);
    }
}

FMU_EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerant,
                                                  fmi3Float64 tolerance, fmi3Float64 start,
                                                  fmi3Boolean stops, fmi3Float64 stop) {
    (void)tolerant;
    (void)tolerance;
    if (!may(c, FMU_INSTANTIATED) || !isfinite(start) || (stops && !(stop > start))) {
        return tell(c, fmi3Error, "fmi3EnterInitializationMode: not now, or no times");
    }
    values_of(c)->t_start = start;
    values_of(c)->t_stop = stops ? stop : start + FMU_T_STOP;
    values_of(c)->phase = FMU_INITIALISING;
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    unit_3 *c = instance;
    int status;
    if (!may(c, FMU_INITIALISING)) {
        return tell(c, fmi3Error, "fmi3ExitInitializationMode: not now");
    }
    status = fmu_begin(c->unit);
    if (status > FMU_OK_SUBSTEPPED) {
        return tell(c, fmi3Error, M(status_text)(status));
    }
    c->unit->now.phase = FMU_STEPPING;
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3Terminate(fmi3Instance c) {
    if (!may(c, FMU_STEPPING)) {
        return tell(c, fmi3Error, "fmi3Terminate: not now");
    }
    values_of(c)->phase = FMU_TERMINATED;
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3Reset(fmi3Instance instance) {
    unit_3 *c = instance;
    if (c == NULL) {
        return fmi3Error;
    }
    fmu_reset(c->unit);
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                                     fmi3Float64 values[], size_t n_values) {
    unit_3 *c = instance;
    size_t k;
    if (c == NULL || n != n_values || (n > 0 && (vr == NULL || values == NULL))) {
        return tell(c, fmi3Error, "fmi3GetFloat64: one value for each variable");
    }
    for (k = 0; k < n; ++k) {
        if (!fmu_get_real(c->unit, vr[k], &values[k])) {
            return tell(c, fmi3Error, "fmi3GetFloat64: no such variable");
        }
    }
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                                     const fmi3Float64 values[], size_t n_values) {
    unit_3 *c = instance;
    size_t k;
    if (c == NULL || n != n_values || (n > 0 && (vr == NULL || values == NULL))) {
        return tell(c, fmi3Error, "fmi3SetFloat64: one value for each variable");
    }
    for (k = 0; k < n; ++k) {
        if (!fmu_set_real(c->unit, vr[k], values[k])) {
            return tell(c, fmi3Error,
                        "fmi3SetFloat64: no such variable, not now, or a value out of its range");
        }
    }
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3GetInt32(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                                   fmi3Int32 values[], size_t n_values) {
    unit_3 *c = instance;
    size_t k;
    if (c == NULL || n != n_values || (n > 0 && (vr == NULL || values == NULL))) {
        return tell(c, fmi3Error, "fmi3GetInt32: one value for each variable");
    }
    for (k = 0; k < n; ++k) {
        if (!fmu_get_integer(c->unit, vr[k], &values[k])) {
            return tell(c, fmi3Error, "fmi3GetInt32: no such variable");
        }
    }
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *kept) {
    return c != NULL && kept != NULL && fmu_keep(values_of(c), kept) ? fmi3OK : fmi3Error;
}

FMU_EXPORT fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState kept) {
    if (c == NULL || kept == NULL) {
        return fmi3Error;
    }
    memcpy(values_of(c), kept, sizeof(fmu_values));
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *kept) {
    if (c == NULL || kept == NULL) {
        return fmi3Error;
    }
    free(*kept);
    *kept = NULL;
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState kept, size_t *size) {
    if (c == NULL || kept == NULL || size == NULL) {
        return fmi3Error;
    }
    *size = fmu_bytes();
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState kept, fmi3Byte bytes[],
                                            size_t size) {
    const int given = c != NULL && kept != NULL && bytes != NULL;
    return given && fmu_pack(kept, (char *)bytes, size) ? fmi3OK : fmi3Error;
}

FMU_EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size,
                                              fmi3FMUState *kept) {
    if (c == NULL || kept == NULL || bytes == NULL) {
        return fmi3Error;
    }
    return fmu_unpack((const char *)bytes, size, kept)
               ? fmi3OK
               : tell(c, fmi3Error, "fmi3DeserializeFMUState: no state of this unit, or no memory");
}

FMU_EXPORT fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 t, fmi3Float64 h,
                                 fmi3Boolean no_set_state_before, fmi3Boolean *event,
                                 fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last) {
    unit_3 *c = instance;
    int status;
    (void)no_set_state_before;
    if (!may(c, FMU_STEPPING) || event == NULL || terminate == NULL || early == NULL ||
        last == NULL) {
        return tell(c, fmi3Error, "fmi3DoStep: not now, or an argument is none");
    }
    *event = *terminate = *early = false;
    status = fmu_step(c->unit, t, h);
    *last = c->unit->now.state.t;
    if (status == FMU_BAD_ARGUMENT) {
        return tell(c, fmi3Error, M(status_text)(status));
    }
    return status > FMU_OK_SUBSTEPPED ? tell(c, fmi3Discard, M(status_text)(status)) : fmi3OK;
}

/* ---- what a unit of this kind does not have ------------------------------------------------ */

/* 1 if nothing is asked for. */
static fmi3Status nothing(fmi3Instance c, size_t n) {
    return c != NULL && n == 0 ? fmi3OK : fmi3Error;
}

/* Both functions of a type of which there are no variables. */
#define FMU_NO_VARIABLES(type)                                                                   \
    FMU_EXPORT fmi3Status fmi3Get##type(fmi3Instance c, const fmi3ValueReference vr[], size_t n, \
                                        fmi3##type values[], size_t n_values) {                  \
        (void)vr;                                                                                \
        (void)values;                                                                            \
        return nothing(c, n + n_values);                                                         \
    }                                                                                            \
    FMU_EXPORT fmi3Status fmi3Set##type(fmi3Instance c, const fmi3ValueReference vr[], size_t n, \
                                        const fmi3##type values[], size_t n_values) {            \
        (void)vr;                                                                                \
        (void)values;                                                                            \
        return nothing(c, n + n_values);                                                         \
    }

FMU_NO_VARIABLES(Float32)
FMU_NO_VARIABLES(Int8)
FMU_NO_VARIABLES(UInt8)
FMU_NO_VARIABLES(Int16)
FMU_NO_VARIABLES(UInt16)
FMU_NO_VARIABLES(UInt32)
FMU_NO_VARIABLES(Int64)
FMU_NO_VARIABLES(UInt64)
FMU_NO_VARIABLES(Boolean)
FMU_NO_VARIABLES(String)

FMU_EXPORT fmi3Status fmi3SetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t n,
                                   const fmi3Int32 values[], size_t n_values) {
    (void)vr;
    (void)values;
    return nothing(c, n + n_values);
}

FMU_EXPORT fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t n,
                                    size_t sizes[], fmi3Binary values[], size_t n_values) {
    (void)vr;
    (void)sizes;
    (void)values;
    return nothing(c, n + n_values);
}

FMU_EXPORT fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n,
                                   fmi3Clock values[]) {
    (void)vr;
    (void)values;
    return nothing(c, n);
}

FMU_EXPORT fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t n,
                                    const size_t sizes[], const fmi3Binary values[],
                                    size_t n_values) {
    (void)vr;
    (void)sizes;
    (void)values;
    return nothing(c, n + n_values);
}

FMU_EXPORT fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n,
                                   const fmi3Clock values[]) {
    (void)vr;
    (void)values;
    return nothing(c, n);
}

FMU_EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token,
                                                     fmi3String resources, fmi3Boolean visible,
                                                     fmi3Boolean logging,
                                                     fmi3InstanceEnvironment environment,
                                                     fmi3LogMessageCallback logger) {
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)environment;
    (void)logger;
    return NULL;
}

FMU_EXPORT fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
    fmi3ClockUpdateCallback update, fmi3Preemption lock, fmi3Preemption unlock) {
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)environment;
    (void)logger;
    (void)update;
    (void)lock;
    (void)unlock;
    return NULL;
}

FMU_EXPORT fmi3Status fmi3EnterEventMode(fmi3Instance c) {
    (void)c;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) {
    (void)c;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) {
    (void)c;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance c) {
    (void)c;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) {
    (void)c;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference of,
                                                          size_t *count) {
    (void)c;
    (void)of;
    (void)count;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference of,
                                                  size_t of_elements[], fmi3ValueReference by[],
                                                  size_t by_elements[], fmi3DependencyKind kinds[],
                                                  size_t count) {
    (void)c;
    (void)of;
    (void)of_elements;
    (void)by;
    (void)by_elements;
    (void)kinds;
    (void)count;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference of[],
                                                   size_t n_of, const fmi3ValueReference by[],
                                                   size_t n_by, const fmi3Float64 seed[],
                                                   size_t n_seed, fmi3Float64 result[],
                                                   size_t n_result) {
    (void)c;
    (void)of;
    (void)n_of;
    (void)by;
    (void)n_by;
    (void)seed;
    (void)n_seed;
    (void)result;
    (void)n_result;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference of[],
                                               size_t n_of, const fmi3ValueReference by[],
                                               size_t n_by, const fmi3Float64 seed[], size_t n_seed,
                                               fmi3Float64 result[], size_t n_result) {
    (void)c;
    (void)of;
    (void)n_of;
    (void)by;
    (void)n_by;
    (void)seed;
    (void)n_seed;
    (void)result;
    (void)n_result;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference vr[],
                                             size_t n, fmi3Float64 intervals[],
                                             fmi3IntervalQualifier qualifiers[]) {
    (void)c;
    (void)vr;
    (void)n;
    (void)intervals;
    (void)qualifiers;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3GetIntervalFraction(fmi3Instance c, const fmi3ValueReference vr[],
                                              size_t n, fmi3UInt64 counters[],
                                              fmi3UInt64 resolutions[],
                                              fmi3IntervalQualifier qualifiers[]) {
    (void)c;
    (void)vr;
    (void)n;
    (void)counters;
    (void)resolutions;
    (void)qualifiers;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3GetShiftDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n,
                                          fmi3Float64 shifts[]) {
    (void)c;
    (void)vr;
    (void)n;
    (void)shifts;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3GetShiftFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n,
                                           fmi3UInt64 counters[], fmi3UInt64 resolutions[]) {
    (void)c;
    (void)vr;
    (void)n;
    (void)counters;
    (void)resolutions;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3SetIntervalDecimal(fmi3Instance c, const fmi3ValueReference vr[],
                                             size_t n, const fmi3Float64 intervals[]) {
    (void)c;
    (void)vr;
    (void)n;
    (void)intervals;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3SetIntervalFraction(fmi3Instance c, const fmi3ValueReference vr[],
                                              size_t n, const fmi3UInt64 counters[],
                                              const fmi3UInt64 resolutions[]) {
    (void)c;
    (void)vr;
    (void)n;
    (void)counters;
    (void)resolutions;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3SetShiftDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n,
                                          const fmi3Float64 shifts[]) {
    (void)c;
    (void)vr;
    (void)n;
    (void)shifts;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3SetShiftFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n,
                                           const fmi3UInt64 counters[],
                                           const fmi3UInt64 resolutions[]) {
    (void)c;
    (void)vr;
    (void)n;
    (void)counters;
    (void)resolutions;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c) {
    (void)c;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again,
                                               fmi3Boolean *terminate, fmi3Boolean *nominals,
                                               fmi3Boolean *states, fmi3Boolean *next,
                                               fmi3Float64 *time) {
    (void)c;
    (void)again;
    (void)terminate;
    (void)nominals;
    (void)states;
    (void)next;
    (void)time;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_set_state_before,
                                                  fmi3Boolean *event, fmi3Boolean *terminate) {
    (void)c;
    (void)no_set_state_before;
    (void)event;
    (void)terminate;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 t) {
    (void)c;
    (void)t;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) {
    (void)c;
    (void)x;
    (void)n;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 x[], size_t n) {
    (void)c;
    (void)x;
    (void)n;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 x[], size_t n) {
    (void)c;
    (void)x;
    (void)n;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
    (void)c;
    (void)x;
    (void)n;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
    (void)c;
    (void)x;
    (void)n;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) {
    (void)c;
    (void)n;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n) {
    (void)c;
    (void)n;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference vr[],
                                               size_t n, const fmi3Int32 orders[],
                                               fmi3Float64 values[], size_t n_values) {
    (void)c;
    (void)vr;
    (void)n;
    (void)orders;
    (void)values;
    (void)n_values;
    return fmi3Error;
}

FMU_EXPORT fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock,
                                                 fmi3Float64 t) {
    (void)c;
    (void)clock;
    (void)t;
    return fmi3Error;
}
