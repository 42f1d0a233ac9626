/* Generated functions that the runtime calls, and questions about rows that it asks often. */

/* All read the step's start and the unknowns from the work struct and write there. */
static void SG(start)(SG(work) * w, const SG(params) * par);
static void SG(values)(SG(work) * w, const SG(params) * par, int problem);
static void SG(derivatives)(SG(work) * w, const SG(params) * par, int problem);
static int SG(eliminate)(SG(work) * w, int problem, int border);
static void SG(substitute)(const SG(work) * w, int problem, int first, real b[]);
static void SG(finish)(SG(work) * w);
static void SG(stages)(const SG(work) * w, real stage_t[], real stage_q[], real stage_v[],
                       real stage_R[]);
static void SG(evaluate_places)(real t, const real q[], const SG(params) * par,
                                SG(consistency) * out);
static void SG(evaluate_rates)(real t, const real q[], const real v[], const SG(params) * par,
                               SG(consistency) * out);
static void SG(bilateral_directions)(real t, const real q[], const SG(params) * par, real out[]);
static real SG(energy_at)(real t, const real q[], const real v[], const SG(params) * par);

#if SG_KEY > 0
static void SG(evaluate_terms)(real t, const real q[], const SG(params) * par, real out[]);
static void SG(key)(real t, const real q[], const SG(params) * par, real out[]);
#endif

/* 1 if percussion row c of a slot stands for a gap (g, g_N), 0 for a velocity. */
static inline int sg_is_gap(const sg_problem *pr, int slot, int c) {
    return slot < pr->gap_slots &&
           (c < SG_NG || (c >= SG_NG + SG_NGAMMA && c < SG_NG + SG_NGAMMA + SG_NN));
}

/* 1 if bilateral row c of a slot takes part. */
static inline int sg_takes_part(const sg_problem *pr, int slot, int c) {
    return slot + 1 < pr->n_slots || c < pr->last_rows;
}

/* Percussion rows of a slot, at least one, for divisions. */
#if SG_NC > 0
#define SG_ROWS SG_NC
#else
#define SG_ROWS 1
#endif

/* First of the slip rows in a slot. */
enum { SG_NORMAL = SG_NG + SG_NGAMMA, SG_SLIP = SG_NG + SG_NGAMMA + SG_NN };
