/* Functions of FMI 3.0 for co-simulation. */
#include "fmi3.h"

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
