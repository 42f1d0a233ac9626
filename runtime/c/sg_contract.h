#pragma once
#include "sg_sparse.c"

/* What the generated part tells the runtime: contacts, nonlinear problems, model evaluations. Sizes
   carry the names that they have in Python: n_q coordinates, n_R percussion rows of a slot (g,
   gamma, N, F in turn), n_contacts contacts and friction elements, n_bounds given bounds; SG_N_Q
   and so on are those of the whole model. */

/* One contact or friction element: row of its normal law (-1: none, an element), first slip row,
   number of slip components, index of a given bound of its friction (-1: none), whether it has a
   guard; the contact that presses its friction (itself, or another one before it; -1: none) and
   that one's normal row; the next element that the same contact presses (-1: none); the first
   bilateral row, and their number, whose percussions press it instead (0: none); where among the
   radii its coefficient stands that holds for a stage, and what else its radius has (-1: the
   coefficient holds for the step). */
typedef struct {
    int normal, friction, components, bound, guarded, presser, pressing, next, load, loads, varies;
} sg_contact;

/* Contact of a slip row, and the component of its slip velocity. */
typedef struct {
    int contact, component;
} sg_slip;

/* One nonlinear problem of the scheme: n_x smooth unknowns (blocks of velocities), n_slots groups
   of n_R percussions, first unknown and first percussion of the problem in work.x and work.R,
   first row of the response table; gap_slots: in how many slots, from the first, the rows of g and
   g_N are gaps, in the rest they are velocities; last_rows: how many bilateral rows the last slot
   has; follows: 1 if only contacts that the
   problem before left closed take part, 2 if only those that are said to; n_border: size of K,
   which has the bilateral rows and percussions, too; K, B, C, C_radius: where entries of the
   derivatives stand, B by columns. */
typedef struct {
    int n_x, n_slots, x, R, response, gap_slots, last_rows, follows;
    int n_border;
    sg_factors K;
    sg_rows B, C, C_radius;
} sg_problem;

/* What parts of one kind have in common; most models are a single part. Sizes carry the names that
   they have in Python. spatial: whether friction has several components; mobility: whether the
   generated code finds the mobilities of all directions. Of its rows: which normal rows are
   velocities, which rows yield; of its contacts: which restitution is Poisson's. NULL where the
   model has none of these. */
typedef struct {
    int n_q, n_g, n_gamma, n_N, n_F, n_R, n_contacts, n_bounds, n_compliance, n_loads, n_key,
        n_terms;
    int spatial, mobility;
    sg_factors mass;
    sg_rows direction;
    const sg_contact *contacts;
    const sg_slip *slips;
    const sg_problem *problems;
    const int *one_way, *yielding, *poisson;
} sg_kind;

/* A part of the model: its kind, where its places begin in sg_members, and its constants in sg_own.
 */
typedef struct {
    int kind, first, own;
} sg_member;

enum { SG_ROW_FREE, SG_ROW_ZERO, SG_ROW_SLIP };                  /* kind of a percussion row */
enum { SG_UNIQUE, SG_LEAST_NORM, SG_AS_FOUND };                  /* info.percussions */
enum { SG_COLD = 1, SG_PATH = 4, SG_SOFT = 8, SG_RELAXED = 16 }; /* info.rescues */

/* What an iteration may take for granted: velocities stay as they are but for round-off, which is
   not corrected; it is the first of a problem and will succeed; others failed before; it is the
   last, and its nearest point may be as far away as the checker accepts. */
enum { SG_AT_REST, SG_FIRST_ATTEMPT, SG_LATER_ATTEMPT, SG_LAST_RESORT };

/* What generated functions read the step's start and the unknowns from, and write to. */
#if SG_JOINS
#define SG_ELEMENT SG(element)
#else
#define SG_ELEMENT SG(work)
#endif

/* Generated functions; of an island that is put together those of its elements (sg_assemble.c). */
static void SG(start)(SG(work) * w, const SG(params) * par);
static void SG(values)(SG(work) * w, const SG(params) * par, int problem);
static void SG(derivatives)(SG(work) * w, const SG(params) * par, int problem);
static int SG(eliminate)(SG(work) * w, int problem, int border);
static void SG(substitute)(const SG(work) * w, int problem, int first, real b[]);
static void SG(finish)(SG(work) * w);

#if SG_LOCATED
static void SG(watch)(SG(work) * w, const SG(params) * par);
static void SG(finish_segment)(SG(work) * w);
#endif
#if SG_DERIVATIVES
static void SG(change_parameters)(SG(work) * w, const real change[]);
static void SG(start_forward)(SG(work) * w, const SG(params) * par);
static void SG(values_forward)(SG(work) * w, const SG(params) * par, int problem);
static void SG(finish_forward)(SG(work) * w);
#if SG_LOCATED
static void SG(places_forward)(SG(work) * w);
static void SG(watch_forward)(SG(work) * w, const SG(params) * par);
static void SG(finish_segment_forward)(SG(work) * w);
#endif
#endif

/* The same of a part, by its number; what needs no constants by its kind. */
static void SG(part_energy)(int part, real t, const real q[], const real v[],
                            const SG(params) * par, real out[]);
static void SG(part_places)(int part, real t, const real q[], const SG(params) * par,
                            SG(consistency) * out);
static void SG(part_rates)(int part, real t, const real q[], const real v[], const SG(params) * par,
                           SG(consistency) * out);
static void SG(part_stages)(int kind, const SG_ELEMENT *w, real stage_t[], real stage_q[],
                            real stage_v[], real stage_R[]);
#if SG_N_KEY > 0
static void SG(part_terms)(int part, real t, const real q[], const SG(params) * par, real out[]);
static void SG(part_key)(int part, real t, const real q[], const SG(params) * par, real out[]);
#endif

#if SG_JOINS
/* What the functions above do for an island, for one of its elements; `kind` is that of the
   element. */
static void SG(part_start)(int kind, SG(element) * w, const SG(params) * par);
static void SG(part_values)(int kind, SG(element) * w, const SG(params) * par, int problem);
static void SG(part_derivatives)(int kind, SG(element) * w, const SG(params) * par, int problem);
static void SG(part_finish)(int kind, SG(element) * w);
static int SG(part_eliminate)(SG(work) * w, int problem, int border);
static void SG(part_substitute)(const SG(work) * w, int problem, int first, real b[]);
#if SG_LOCATED
static void SG(part_watch)(int kind, SG(element) * w, const SG(params) * par);
static void SG(part_finish_segment)(int kind, SG(element) * w);
#endif
#endif

/* First of the normal rows and of the slip rows in a slot of the whole model. */
enum { SG_NORMAL = SG_N_G + SG_N_GAMMA, SG_SLIP = SG_N_G + SG_N_GAMMA + SG_N_N };
