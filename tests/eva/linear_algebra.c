/* Entry of an analysis: dense and orthogonal factorisations, solutions and proximal points at the
   sizes of one model, for any number of rows and any values. Every array is an object of its own,
   so that an index beyond its end is seen. */
#include "__fc_builtin.h"
#include "m.c"

/* N_X velocities and N_R percussion rows of the largest problem come from the command line. */

static real full[N_X * N_X], weight[N_X], dx[N_X];
static int pivot[N_X];
static real S[N_R * N_R], rhs[N_R], tau[N_R], tau_z[N_R], scratch[N_R], solution[N_R];
static int perm[N_R];

static void any(int n, real *x) {
    int i;
    for (i = 0; i < n; ++i) {
        x[i] = Frama_C_double_interval(-1e6, 1e6);
    }
}

static void dense(void) {
    const int n = N_X;
    any(N_X * N_X, full);
    any(N_X, weight);
    any(N_X, dx);
    if (sg_lu_factor(n, full, weight, pivot)) {
        (void)sg_lu_is_regular(n, full, SG_SMALL);
        sg_lu_solve(n, full, pivot, dx);
    }
}

static void orthogonal(int n) {
    int rank;
    any(N_R * N_R, S);
    any(N_R, rhs);
    rank = sg_cod_factor(n, S, perm, tau, tau_z);
    /*@ split rank; */
    sg_cod_solve(n, rank, S, perm, tau, tau_z, rhs, scratch, solution);
    sg_cod_project(n, rank, S, perm, tau_z, scratch, solution);
}

static void prox(void) {
    real z[2], direction[2], ratio;
    const int n = Frama_C_interval(1, 2);
    any(2, z);
    (void)sg_is_closed(z[0], z[1]);
    (void)sg_prox_ball(n, z, Frama_C_double_interval(0.0, 1e6), Frama_C_double_interval(0.0, 1.0),
                       direction, &ratio);
}

int main(void) {
    dense();
    orthogonal(N_R);
    prox();
    return 0;
}
