#pragma once

/* Sizes of a model that is one part, of which the runtime asks its kind. */
#ifndef SG_N_X_TOTAL
#define SG_N_X_TOTAL ((int)(sizeof(((SG(work) *)0)->x) / sizeof(double)))
#endif
#ifndef SG_N_ROWS_TOTAL
#define SG_N_ROWS_TOTAL (SG_N_R > 0 ? (int)(sizeof(((SG(work) *)0)->R) / sizeof(double)) : 0)
#endif
#ifndef SG_N_BOUNDS
#define SG_N_BOUNDS (sg_kinds[0].n_bounds)
#endif
#ifndef SG_N_TERMS
#define SG_N_TERMS (sg_kinds[0].n_terms)
#endif
#ifndef SG_N_COMPLIANCE
#define SG_N_COMPLIANCE (sg_kinds[0].n_compliance)
#endif
#ifndef SG_ROWS_OF_SLOT
#define SG_ROWS_OF_SLOT (SG_N_R > 0 ? SG_N_R : 1)
#endif
#define sg_mass (sg_kinds[0].mass)
#define sg_direction (sg_kinds[0].direction)
#define SG_MOBILITY (sg_kinds[0].mobility)
