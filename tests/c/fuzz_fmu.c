/* Calls of a functional mock-up unit in any order, with any arguments, for the sanitizers: nothing
   may crash, and whatever happened before, a fresh instance takes the same step. Compiled behind
   fmi2.c or fmi3.c in one unit; FMI says which. */
#include <stdio.h>

static unsigned long seed = 1;

static unsigned draw(unsigned below) {
    seed = seed * 6364136223846793005UL + 1442695040888963407UL;
    return (unsigned)(seed >> 33) % below;
}

static double number(void) {
    static const double some[] = {0.0, -1.0, 1e-3, 1.0, 0.5, 1e300, -1e300, 1e-300};
    const unsigned k = draw(10);
    return k < 8 ? some[k] : k == 8 ? (double)NAN : (double)INFINITY;
}

static unsigned reference(void) {
    return draw(4) ? draw(FMU_CONTACT + FMU_N_CONTACTS + 3u) : draw(0x7fffffffu);
}

#if FMI == 2
#define FN(name) fmi2##name
typedef fmi2Component Instance;
typedef fmi2Status Status;
static Instance fresh(void) {
    return fmi2Instantiate("x", fmi2CoSimulation, FMU_TOKEN, "", NULL, 0, 0);
}
static Status begin(Instance c, double t) {
    Status s = fmi2SetupExperiment(c, 0, 0.0, t, 0, 0.0);
    s = s == fmi2OK ? fmi2EnterInitializationMode(c) : s;
    return s;
}
static Status step(Instance c, double t, double h) { return fmi2DoStep(c, t, h, 1); }
static Status get(Instance c, const unsigned *vr, size_t n, double *x) {
    return fmi2GetReal(c, vr, n, x);
}
static Status set(Instance c, const unsigned *vr, size_t n, const double *x) {
    return fmi2SetReal(c, vr, n, x);
}
static Status whole(Instance c, const unsigned *vr, int *x) { return fmi2GetInteger(c, vr, 1, x); }
static Status keep(Instance c, void **kept) { return fmi2GetFMUstate(c, kept); }
static Status put(Instance c, void *kept) { return fmi2SetFMUstate(c, kept); }
static Status drop(Instance c, void **kept) { return fmi2FreeFMUstate(c, kept); }
static Status pack(Instance c, void *kept, char *to, size_t n) {
    return fmi2SerializeFMUstate(c, kept, to, n);
}
static Status unpack(Instance c, char *from, size_t n, void **kept) {
    return fmi2DeSerializeFMUstate(c, from, n, kept);
}
#else
#define FN(name) fmi3##name
typedef fmi3Instance Instance;
typedef fmi3Status Status;
static Instance fresh(void) {
    return fmi3InstantiateCoSimulation("x", FMU_TOKEN, "", 0, 0, 0, 0, NULL, 0, NULL, NULL, NULL);
}
static Status begin(Instance c, double t) {
    return fmi3EnterInitializationMode(c, 0, 0.0, t, 0, 0.0);
}
static Status step(Instance c, double t, double h) {
    fmi3Boolean a, b, e;
    double last;
    return fmi3DoStep(c, t, h, 1, &a, &b, &e, &last);
}
static Status get(Instance c, const unsigned *vr, size_t n, double *x) {
    return fmi3GetFloat64(c, vr, n, x, n);
}
static Status set(Instance c, const unsigned *vr, size_t n, const double *x) {
    return fmi3SetFloat64(c, vr, n, x, n);
}
static Status whole(Instance c, const unsigned *vr, int *x) { return fmi3GetInt32(c, vr, 1, x, 1); }
static Status keep(Instance c, void **kept) { return fmi3GetFMUState(c, kept); }
static Status put(Instance c, void *kept) { return fmi3SetFMUState(c, kept); }
static Status drop(Instance c, void **kept) { return fmi3FreeFMUState(c, kept); }
static Status pack(Instance c, void *kept, char *to, size_t n) {
    return fmi3SerializeFMUState(c, kept, (fmi3Byte *)to, n);
}
static Status unpack(Instance c, char *from, size_t n, void **kept) {
    return fmi3DeserializeFMUState(c, (fmi3Byte *)from, n, kept);
}
#endif

/* Where the first coordinate is after one step of a fresh instance. */
static double known(void) {
    const unsigned vr = FMU_Q;
    double x = 0.0;
    Instance c = fresh();
    int bad = c == NULL || begin(c, 0.0) || FN(ExitInitializationMode)(c) || step(c, 0.0, FMU_DT) ||
              get(c, &vr, 1, &x);
    FN(FreeInstance)(c);
    return bad ? -1e9 : x;
}

int main(int argc, char **argv) {
    const long calls = argc > 1 ? atol(argv[1]) : 20000;
    const double before = known();
    Instance c = NULL;
    void *kept = NULL;
    char *bytes = calloc(1, fmu_bytes());
    double t = 0.0, x[3];
    long k;
    int taken = 0, refused = 0;
    for (k = 0; k < calls; ++k) {
        const unsigned vr[3] = {reference(), reference(), reference()};
        double values[3] = {number(), number(), number()};
        Instance at = draw(50) ? c : NULL;
        int i;
        Status s = 0;
        switch (draw(16)) {
            case 0:
                if (c == NULL || draw(20) == 0) {
                    FN(FreeInstance)(c);
                    c = fresh();
                    t = 0.0;
                }
                break;
            case 1:
                s = begin(at, draw(3) ? 0.0 : number());
                break;
            case 2:
                s = FN(ExitInitializationMode)(at);
                break;
            case 3:
                for (i = 0; i < 3; ++i) {
                    /* small steps take long, that is all */
                    if ((vr[i] == FMU_STEP_SIZE || vr[i] == FMU_ERROR) && values[i] < 1e-3 &&
                        values[i] > 0.0) {
                        values[i] = 1e-3;
                    }
                }
                s = set(at, vr, draw(4), values);
                break;
            case 4:
                s = get(at, vr, draw(4), x);
                break;
            case 5:
                s = whole(at, vr, &i);
                break;
            case 6:
                s = keep(at, &kept);
                break;
            case 7:
                s = put(at, kept);
                break;
            case 8:
                s = draw(4) ? 0 : drop(at, &kept);
                break;
            case 9:
                s = pack(at, kept, bytes, draw(3) ? fmu_bytes() : draw(64));
                break;
            case 10:
                if (draw(2)) {
                    bytes[draw((unsigned)fmu_bytes())] ^= (char)(1 + draw(255));
                }
                s = unpack(at, bytes, draw(4) ? fmu_bytes() : draw(64), &kept);
                break;
            case 11:
                s = draw(8) ? 0 : FN(Terminate)(at);
                break;
            case 12:
                s = draw(8) ? 0 : FN(Reset)(at);
                break;
            default: {
                const unsigned time = FMU_TIME;
                const double h = draw(4) ? FMU_DT : number();
                if (c != NULL) {
                    (void)get(c, &time, 1, &t);
                }
                s = step(at, draw(8) ? t : number(), h < 1.0 ? h : 0.1);
                taken += s == 0;
            }
        }
        refused += s != 0;
    }
    if (kept != NULL && c != NULL) {
        (void)drop(c, &kept);
    }
    free(kept);
    free(bytes);
    FN(FreeInstance)(c);
    printf("%d steps, %d refused\n", taken, refused);
    return !(known() == before && taken > 100 && refused > 1000);
}
