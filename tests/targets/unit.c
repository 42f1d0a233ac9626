/* Runs a unit of FMI 3 that Windows loads from LIBRARY; prints N_VALUES of its variables from FIRST
 * on. */
#include "fmi3Functions.h"

#include <stdio.h>
/* Of Windows; its own header has names that the command line of the compiler gives to numbers. */
__declspec(dllimport) void *LoadLibraryA(const char *name);
__declspec(dllimport) void (*GetProcAddress(void *library, const char *name))(void);

#define LOADED(name) ((name##TYPE *)GetProcAddress(unit, #name))

int main(void) {
    void *const unit = LoadLibraryA(LIBRARY);
    fmi3ValueReference references[N_VALUES];
    fmi3Float64 values[N_VALUES], t = 0.0, last;
    fmi3Boolean event, stop, early;
    fmi3Instance instance;
    int k, step, bad = 0;
    for (k = 0; k < N_VALUES; ++k) {
        references[k] = (fmi3ValueReference)(FIRST + k);
    }
    instance = LOADED(fmi3InstantiateCoSimulation)("one", TOKEN, NULL, fmi3False, fmi3False,
                                                   fmi3False, fmi3False, NULL, 0, NULL, NULL, NULL);
    bad |= LOADED(fmi3EnterInitializationMode)(instance, fmi3False, 0.0, 0.0, fmi3False, 0.0);
    bad |= LOADED(fmi3ExitInitializationMode)(instance);
    for (step = 0; step < STEPS && bad == 0; ++step) {
        bad |= LOADED(fmi3DoStep)(instance, t, H, fmi3True, &event, &stop, &early, &last);
        bad |= LOADED(fmi3GetFloat64)(instance, references, N_VALUES, values, N_VALUES);
        t += H;
        for (k = 0; k < N_VALUES; ++k) {
            printf("%.17g ", values[k]);
        }
        printf("\n");
    }
    bad |= LOADED(fmi3Terminate)(instance);
    LOADED(fmi3FreeInstance)(instance);
    printf("end\n");
    return bad == 0 ? 42 : 1;
}
