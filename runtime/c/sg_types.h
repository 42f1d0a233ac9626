/* What the generated part tells the runtime: contacts, nonlinear problems, model evaluations. */

/* One contact: row of its normal law (-1: friction with a given bound), first slip row, number of
   slip components, index of its bound (-1: none), whether it has a guard. */
typedef struct {
    int normal, friction, components, bound, guarded;
} sg_contact;

/* Contact of a slip row, and the component of its slip velocity. */
typedef struct {
    int contact, component;
} sg_slip;

/* One nonlinear problem of the scheme: n_x smooth unknowns (blocks of velocities), n_slots groups
   of SG_NC percussions, first unknown and first percussion of the problem in work.x and
   work.lambda, first row of the response table; gap_slots: in how many slots, from the first, the
   rows of g and g_N are gaps, in the rest they are velocities; last_rows: how many bilateral rows
   the last slot has; follows: only contacts that the problem before left closed take part;
   n_border: size of K, which has the bilateral rows and percussions, too; K, B, C, C_radius: where
   entries of the derivatives stand, B by columns. */
typedef struct {
    int n_x, n_slots, x, lambda, response, gap_slots, last_rows, follows;
    int n_border;
    sg_factors K;
    sg_rows B, C, C_radius;
} sg_problem;

enum { SG_ROW_FREE, SG_ROW_ZERO, SG_ROW_SLIP };         /* kind of a percussion row */
enum { SG_UNIQUE, SG_LEAST_NORM, SG_AS_FOUND };         /* info.percussions */
enum { SG_COLD = 1, SG_CENTRAL_PATH = 2, SG_PATH = 4 }; /* info.rescues */
