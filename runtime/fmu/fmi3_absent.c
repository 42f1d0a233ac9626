/* Functions that FMI 3.0 asks every unit for and that mean nothing here: types of which there are
   no variables, clocks, events, model exchange, scheduled execution, derivatives. */
#include "fmi3.h"

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
