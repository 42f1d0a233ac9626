#include "fmu.h"

enum { FMU_MOST_STEPS = 10000000 }; /* of one communication step */

fmu_instance *fmu_new(void) {
    fmu_instance *unit = calloc(1, sizeof *unit);
    if (unit != NULL) {
        fmu_reset(unit);
    }
    return unit;
}

void fmu_reset(fmu_instance *unit) {
    memset(&unit->now, 0, sizeof unit->now);
    unit->now.par = M(default_params)();
    unit->opt = M(default_options)();
    unit->opt.max_halvings = 4;
#if FMU_LOCATED
    unit->opt.events = FMU_EVENTS_LOCATED;
#endif
    unit->now.dt = FMU_DT;
    unit->now.error = 0.0;
    unit->now.t_stop = FMU_T_STOP;
    unit->now.phase = FMU_INSTANTIATED;
}

/* Fowler, Noll and Vo: offset basis and prime of 32 bits. */
static unsigned hash_of(const char bytes[], size_t size) {
    unsigned hash = 2166136261u;
    size_t k;
    for (k = 0; k < size; ++k) {
        hash = (hash ^ (unsigned char)bytes[k]) * 16777619u;
    }
    return hash;
}

size_t fmu_bytes(void) { return sizeof(fmu_values) + sizeof(unsigned); }

int fmu_keep(const fmu_values *now, void **kept) {
    if (*kept == NULL) {
        *kept = malloc(sizeof *now);
    }
    if (*kept != NULL) {
        memcpy(*kept, now, sizeof *now);
    }
    return *kept != NULL;
}

int fmu_pack(const void *kept, char bytes[], size_t size) {
    const unsigned hash = hash_of(kept, sizeof(fmu_values));
    if (size < fmu_bytes()) {
        return 0;
    }
    memcpy(bytes, kept, sizeof(fmu_values));
    memcpy(bytes + sizeof(fmu_values), &hash, sizeof hash);
    return 1;
}

int fmu_unpack(const char bytes[], size_t size, void **kept) {
    unsigned hash;
    if (size != fmu_bytes()) {
        return 0;
    }
    memcpy(&hash, bytes + sizeof(fmu_values), sizeof hash);
    if (hash != hash_of(bytes, sizeof(fmu_values))) {
        return 0;
    }
    if (*kept == NULL) {
        *kept = malloc(sizeof(fmu_values));
    }
    if (*kept != NULL) {
        memcpy(*kept, bytes, sizeof(fmu_values));
    }
    return *kept != NULL;
}

/* 1 if a number is one of `count` from `first` on. */
static int among(unsigned number, unsigned first, unsigned count) {
    return number >= first && number - first < count;
}

static double *parameter(fmu_values *now, unsigned k) {
    return (double *)(void *)((char *)&now->par + k * sizeof(double));
}

/* Where the model starts: with its parameters, but for what was set. */
static void start_of(const fmu_values *now, double *t, double q[], double v[]) {
    unsigned k;
    M(initial_state)(&now->par, t, q, v);
    for (k = 0; k < FMU_N_Q; ++k) {
        q[k] = now->given_q[k] ? now->start_q[k] : q[k];
        v[k] = now->given_v[k] ? now->start_v[k] : v[k];
    }
}

int fmu_begin(fmu_instance *unit) {
    fmu_values *now = &unit->now;
    double t, q[FMU_N_Q], v[FMU_N_Q];
    start_of(now, &t, q, v);
    memset(now->P, 0, sizeof now->P);
    now->span = 0.0;
    return M(init)(&now->state, &now->par, &unit->opt, now->t_start, q, v);
}

/* State of the moment: before the start what it is going to be. */
static void state_of(const fmu_values *now, double *t, double q[], double v[]) {
    if (now->phase == FMU_INSTANTIATED || now->phase == FMU_INITIALISING) {
        start_of(now, t, q, v);
        *t = now->t_start;
    } else {
        *t = now->state.t;
        memcpy(q, now->state.q, FMU_N_Q * sizeof(double));
        memcpy(v, now->state.v, FMU_N_Q * sizeof(double));
    }
}

int fmu_get_real(fmu_instance *unit, unsigned number, double *value) {
    fmu_values *now = &unit->now;
    double t, q[FMU_N_Q], v[FMU_N_Q];
    double out[FMU_N_OUT];
    state_of(now, &t, q, v);
    if (number == FMU_TIME) {
        *value = t;
    } else if (among(number, FMU_PAR, FMU_N_PAR)) {
        *value = *parameter(now, number - FMU_PAR);
    } else if (number == FMU_STEP_SIZE) {
        *value = now->dt;
    } else if (number == FMU_ERROR && FMU_ADAPTIVE) {
        *value = now->error;
    } else if (among(number, FMU_Q, FMU_N_Q)) {
        *value = q[number - FMU_Q];
    } else if (among(number, FMU_V, FMU_N_Q)) {
        *value = v[number - FMU_V];
    } else if (among(number, FMU_U, FMU_N_U)) {
        *value = now->u[number - FMU_U];
    } else if (among(number, FMU_OUTPUT, FMU_N_OUTPUTS)) {
        fmu_outputs(t, q, v, now->u, &now->par, out);
        *value = out[number - FMU_OUTPUT];
    } else if (number == FMU_ENERGY) {
        M(energy)(t, q, v, &now->par, out);
        *value = out[0];
    } else if (among(number, FMU_GAP, FMU_N_N)) {
        fmu_gaps(t, q, &now->par, out);
        *value = out[number - FMU_GAP];
    } else if (among(number, FMU_FORCE, FMU_N_R)) {
        *value = now->span > 0.0 ? now->P[number - FMU_FORCE] / now->span : 0.0;
    } else {
        return 0;
    }
    return 1;
}

int fmu_get_integer(const fmu_instance *unit, unsigned number, int *value) {
    if (!among(number, FMU_CONTACT, FMU_N_CONTACTS)) {
        return 0;
    }
    *value = unit->now.phase < FMU_STEPPING ? -1 : unit->now.state.contact[number - FMU_CONTACT];
    return 1;
}

int fmu_set_real(fmu_instance *unit, unsigned number, double value) {
    fmu_values *now = &unit->now;
    const int before = now->phase == FMU_INSTANTIATED || now->phase == FMU_INITIALISING;
    if (!isfinite(value) || now->phase > FMU_STEPPING) {
        return 0;
    }
    if (among(number, FMU_PAR, FMU_N_PAR)) {
        *parameter(now, number - FMU_PAR) = value;
    } else if (number == FMU_STEP_SIZE && value > 0.0) {
        now->dt = value;
    } else if (number == FMU_ERROR && FMU_ADAPTIVE && value >= 0.0) {
        now->error = value;
    } else if (among(number, FMU_U, FMU_N_U)) {
        now->u[number - FMU_U] = value;
    } else if (among(number, FMU_Q, FMU_N_Q) && before) {
        now->start_q[number - FMU_Q] = value;
        now->given_q[number - FMU_Q] = 1;
    } else if (among(number, FMU_V, FMU_N_Q) && before) {
        now->start_v[number - FMU_V] = value;
        now->given_v[number - FMU_V] = 1;
    } else {
        return 0;
    }
    return 1;
}

/* Steps as exact as is asked for. */
static int advance(fmu_instance *unit, double t_end) {
#if FMU_ADAPTIVE
    fmu_values *now = &unit->now;
    unsigned k;
    int status;
    memset(&unit->control, 0, sizeof unit->control);
    unit->control.error = now->error;
    unit->control.span = fmax(now->t_stop - now->t_start, t_end - now->state.t);
    unit->control.h = now->dt;
    for (k = 0; k < FMU_N_Q; ++k) {
        unit->control.scale[k] = 1.0;
    }
    status = M(advance_to)(&now->state, &unit->work, &unit->info, &now->par, &unit->opt, now->u,
                           t_end, &unit->control);
    memcpy(now->P, unit->info.P, FMU_N_R * sizeof(double));
    return status;
#else
    (void)unit;
    (void)t_end;
    return FMU_BAD_ARGUMENT; /* never asked for */
#endif
}

/* Equal steps of at most dt. */
static int go(fmu_instance *unit, double h) {
    fmu_values *now = &unit->now;
    const double exact = ceil(h / now->dt * (1.0 - 1e-9));
    const int n = exact <= FMU_MOST_STEPS ? (int)fmax(exact, 1.0) : 0;
    int status = FMU_OK;
    unsigned k;
    int step;
    if (n == 0) {
        return FMU_BAD_ARGUMENT; /* solver.dt is far too small for such a step */
    }
    memset(now->P, 0, sizeof now->P);
    for (step = 0; step < n && status <= FMU_OK_SUBSTEPPED; ++step) {
        status =
            M(step)(&now->state, &unit->work, &unit->info, &now->par, &unit->opt, now->u, h / n);
        for (k = 0; k < FMU_N_R && status <= FMU_OK_SUBSTEPPED; ++k) {
            now->P[k] += unit->info.P[k];
        }
    }
    return status;
}

int fmu_step(fmu_instance *unit, double t, double h) {
    const fmu_values before = unit->now;
    fmu_values *now = &unit->now;
    int status;
    if (!(h > 0.0) || !isfinite(h) || !(fabs(t - now->state.t) <= 1e-9 * fmax(fabs(t), h))) {
        return FMU_BAD_ARGUMENT;
    }
    status = now->error > 0.0 ? advance(unit, t + h) : go(unit, h);
    if (status > FMU_OK_SUBSTEPPED) {
        *now = before;
        return status;
    }
    now->state.t = t + h;
    now->span = h;
    return status;
}
