/* Functions of FMI 2.0 for co-simulation. */
#include "fmu.h"

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Char;
typedef const fmi2Char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum {
    fmi2DoStepStatus,
    fmi2PendingStatus,
    fmi2LastSuccessfulTime,
    fmi2Terminated
} fmi2StatusKind;
typedef void (*fmi2CallbackLogger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String,
                                   fmi2String, ...);
typedef struct {
    fmi2CallbackLogger logger;
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

typedef struct {
    fmu_instance *unit;
    fmi2CallbackLogger logger;
    fmi2ComponentEnvironment environment;
    char name[64];
} unit_2;

static fmi2Status tell(const unit_2 *c, fmi2Status status, fmi2String text) {
    if (c != NULL && c->logger != NULL) {
        c->logger(c->environment, c->name, status, "logStatusError", "%s", text);
    }
    return status;
}

static fmu_values *values_of(fmi2Component component) {
    return component == NULL ? NULL : &((unit_2 *)component)->unit->now;
}

/* 1 if a call may come in one of two phases. */
static int may(fmi2Component component, int first, int last) {
    const fmu_values *now = values_of(component);
    return now != NULL && now->phase >= first && now->phase <= last;
}

FMU_EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
FMU_EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

FMU_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n,
                                          const fmi2String categories[]) {
    (void)on;
    (void)n;
    (void)categories;
    return c == NULL ? fmi2Error : fmi2OK;
}

FMU_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid,
                                         fmi2String resources,
                                         const fmi2CallbackFunctions *functions,
                                         fmi2Boolean visible, fmi2Boolean logging) {
    unit_2 *c;
    (void)resources;
    (void)visible;
    (void)logging;
    if (name == NULL || guid == NULL || type != fmi2CoSimulation || strcmp(guid, FMU_TOKEN) != 0) {
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
    strncpy(c->name, name, sizeof c->name - 1);
    if (functions != NULL) {
        c->logger = functions->logger;
        c->environment = functions->componentEnvironment;
    }
    return c;
}

FMU_EXPORT void fmi2FreeInstance(fmi2Component component) {
    unit_2 *c = component;
    if (c != NULL) {
        free(c->unit);
        free(c);
    }
}

FMU_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerant, fmi2Real tolerance,
                                          fmi2Real start, fmi2Boolean stops, fmi2Real stop) {
    (void)tolerant;
    (void)tolerance;
    if (!may(c, FMU_INSTANTIATED, FMU_INSTANTIATED) || !isfinite(start) ||
        (stops && !(stop > start))) {
        return tell(c, fmi2Error, "fmi2SetupExperiment: not now, or no times");
    }
    values_of(c)->t_start = start;
    values_of(c)->t_stop = stops ? stop : start + FMU_T_STOP;
    return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    if (!may(c, FMU_INSTANTIATED, FMU_INSTANTIATED)) {
        return tell(c, fmi2Error, "fmi2EnterInitializationMode: not now");
    }
    values_of(c)->phase = FMU_INITIALISING;
    return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component component) {
    unit_2 *c = component;
    int status;
    if (!may(c, FMU_INITIALISING, FMU_INITIALISING)) {
        return tell(c, fmi2Error, "fmi2ExitInitializationMode: not now");
    }
    status = fmu_begin(c->unit);
    if (status > FMU_OK_SUBSTEPPED) {
        return tell(c, fmi2Error, M(status_text)(status));
    }
    c->unit->now.phase = FMU_STEPPING;
    return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2Terminate(fmi2Component c) {
    if (!may(c, FMU_STEPPING, FMU_STEPPING)) {
        return tell(c, fmi2Error, "fmi2Terminate: not now");
    }
    values_of(c)->phase = FMU_TERMINATED;
    return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2Reset(fmi2Component component) {
    unit_2 *c = component;
    if (c == NULL) {
        return fmi2Error;
    }
    fmu_reset(c->unit);
    return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2GetReal(fmi2Component component, const fmi2ValueReference vr[], size_t n,
                                  fmi2Real value[]) {
    unit_2 *c = component;
    size_t k;
    if (c == NULL || (n > 0 && (vr == NULL || value == NULL))) {
        return fmi2Error;
    }
    for (k = 0; k < n; ++k) {
        if (!fmu_get_real(c->unit, vr[k], &value[k])) {
            return tell(c, fmi2Error, "fmi2GetReal: no such variable");
        }
    }
    return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2GetInteger(fmi2Component component, const fmi2ValueReference vr[],
                                     size_t n, fmi2Integer value[]) {
    unit_2 *c = component;
    size_t k;
    if (c == NULL || (n > 0 && (vr == NULL || value == NULL))) {
        return fmi2Error;
    }
    for (k = 0; k < n; ++k) {
        if (!fmu_get_integer(c->unit, vr[k], &value[k])) {
            return tell(c, fmi2Error, "fmi2GetInteger: no such variable");
        }
    }
    return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2SetReal(fmi2Component component, const fmi2ValueReference vr[], size_t n,
                                  const fmi2Real value[]) {
    unit_2 *c = component;
    size_t k;
    if (c == NULL || (n > 0 && (vr == NULL || value == NULL))) {
        return fmi2Error;
    }
    for (k = 0; k < n; ++k) {
        if (!fmu_set_real(c->unit, vr[k], value[k])) {
            return tell(c, fmi2Error,
                        "fmi2SetReal: no such variable, not now, or a value out of its range");
        }
    }
    return fmi2OK;
}

/* Variables of these types there are none. */
static fmi2Status nothing(fmi2Component c, size_t n) {
    return c != NULL && n == 0 ? fmi2OK : fmi2Error;
}

FMU_EXPORT fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                     fmi2Boolean value[]) {
    (void)vr;
    (void)value;
    return nothing(c, n);
}

FMU_EXPORT fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                    fmi2String value[]) {
    (void)vr;
    (void)value;
    return nothing(c, n);
}

FMU_EXPORT fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                     const fmi2Integer value[]) {
    (void)vr;
    (void)value;
    return nothing(c, n);
}

FMU_EXPORT fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                     const fmi2Boolean value[]) {
    (void)vr;
    (void)value;
    return nothing(c, n);
}

FMU_EXPORT fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                    const fmi2String value[]) {
    (void)vr;
    (void)value;
    return nothing(c, n);
}

FMU_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *kept) {
    return c != NULL && kept != NULL && fmu_keep(values_of(c), kept) ? fmi2OK : fmi2Error;
}

FMU_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate kept) {
    if (c == NULL || kept == NULL) {
        return fmi2Error;
    }
    memcpy(values_of(c), kept, sizeof(fmu_values));
    return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *kept) {
    if (c == NULL || kept == NULL) {
        return fmi2Error;
    }
    free(*kept);
    *kept = NULL;
    return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate kept, size_t *size) {
    if (c == NULL || kept == NULL || size == NULL) {
        return fmi2Error;
    }
    *size = fmu_bytes();
    return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate kept, fmi2Byte bytes[],
                                            size_t size) {
    const int given = c != NULL && kept != NULL && bytes != NULL;
    return given && fmu_pack(kept, bytes, size) ? fmi2OK : fmi2Error;
}

FMU_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                              fmi2FMUstate *kept) {
    if (c == NULL || kept == NULL || bytes == NULL) {
        return fmi2Error;
    }
    return fmu_unpack(bytes, size, kept)
               ? fmi2OK
               : tell(c, fmi2Error, "fmi2DeSerializeFMUstate: no state of this unit, or no memory");
}

FMU_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference of[],
                                                   size_t n_of, const fmi2ValueReference by[],
                                                   size_t n_by, const fmi2Real change[],
                                                   fmi2Real result[]) {
    (void)of;
    (void)n_of;
    (void)by;
    (void)n_by;
    (void)change;
    (void)result;
    return tell(c, fmi2Error, "fmi2GetDirectionalDerivative: this unit has none");
}

FMU_EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[],
                                                  size_t n, const fmi2Integer order[],
                                                  const fmi2Real value[]) {
    (void)vr;
    (void)order;
    (void)value;
    return nothing(c, n);
}

FMU_EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[],
                                                   size_t n, const fmi2Integer order[],
                                                   fmi2Real value[]) {
    (void)vr;
    (void)order;
    (void)value;
    return nothing(c, n);
}

FMU_EXPORT fmi2Status fmi2DoStep(fmi2Component component, fmi2Real t, fmi2Real h,
                                 fmi2Boolean no_set_state_before) {
    unit_2 *c = component;
    int status;
    (void)no_set_state_before;
    if (!may(c, FMU_STEPPING, FMU_STEPPING)) {
        return tell(c, fmi2Error, "fmi2DoStep: not now");
    }
    status = fmu_step(c->unit, t, h);
    if (status == FMU_BAD_ARGUMENT) {
        return tell(c, fmi2Error, M(status_text)(status));
    }
    return status > FMU_OK_SUBSTEPPED ? tell(c, fmi2Discard, M(status_text)(status)) : fmi2OK;
}

FMU_EXPORT fmi2Status fmi2CancelStep(fmi2Component c) {
    return tell(c, fmi2Error, "fmi2CancelStep: no step is pending");
}

FMU_EXPORT fmi2Status fmi2GetStatus(fmi2Component c, fmi2StatusKind kind, fmi2Status *value) {
    (void)kind;
    (void)value;
    return tell(c, fmi2Discard, "fmi2GetStatus: no step is pending");
}

FMU_EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, fmi2StatusKind kind, fmi2Real *value) {
    if (!may(c, FMU_STEPPING, FMU_FAILED) || value == NULL || kind != fmi2LastSuccessfulTime) {
        return tell(c, fmi2Discard, "fmi2GetRealStatus: no such status");
    }
    *value = values_of(c)->state.t;
    return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, fmi2StatusKind kind,
                                           fmi2Integer *value) {
    (void)kind;
    (void)value;
    return tell(c, fmi2Discard, "fmi2GetIntegerStatus: no such status");
}

FMU_EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, fmi2StatusKind kind,
                                           fmi2Boolean *value) {
    if (c == NULL || value == NULL || kind != fmi2Terminated) {
        return tell(c, fmi2Discard, "fmi2GetBooleanStatus: no such status");
    }
    *value = 0;
    return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, fmi2StatusKind kind, fmi2String *value) {
    (void)kind;
    (void)value;
    return tell(c, fmi2Discard, "fmi2GetStringStatus: no such status");
}
