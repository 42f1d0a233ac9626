/* The program of trajectory.c with a stepper that Windows loads from LIBRARY, as Python's loader
 * would. */
#include "m.h"

/* Of Windows; its own header has names that the command line of the compiler gives to numbers. */
__declspec(dllimport) void *LoadLibraryA(const char *name);
__declspec(dllimport) void (*GetProcAddress(void *library, const char *name))(void);

#define LOADED(name) ((__typeof__(name) *)GetProcAddress(LoadLibraryA(LIBRARY), #name))
#define m_default_params LOADED(m_default_params)
#define m_default_options LOADED(m_default_options)
#define m_initial_state LOADED(m_initial_state)
#define m_init LOADED(m_init)
#define m_step LOADED(m_step)
#include "trajectory.c"
