#pragma once
#include "sg_check.c"
#include "sg_least.c"
#include "sg_path.c"
#include "sg_relax.c"
#include "sg_search.c"

/* Solution of one problem: starting points and rescues. What the checker rejects is not solved. */

/* Cold start: velocities of the step's start, no percussions. After a position problem the
   percussions of the whole step start from the mean of its slots. */
static void sg_cold_start(SG(work) * w, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    int i, c, slot;
    for (i = 0; i < pr->n_x; ++i) {
        w->x[pr->x + i] = w->v[i % sg_n_q(w)];
    }
    sg_fill(pr->n_slots * sg_n_R(w), SG_C(0.0), &w->R[pr->R]);
    if (pr->follows == 1) {
        const sg_problem *before = sg_problem_at(w, problem - 1);
        for (slot = 0; slot < before->n_slots; ++slot) {
            for (c = 0; c < sg_n_R(w); ++c) {
                w->R[pr->R + c] += w->R[before->R + slot * sg_n_R(w) + c] / (real)before->n_slots;
            }
        }
    }
}

/* Start from the prediction in the state. Percussions that are one of several stay as they are:
   their differences are of the choice, not of the motion. */
static void sg_warm_start(SG(work) * w, const SG(part) * s, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const real first = s->order > 0 ? SG_C(1.0) : SG_C(0.0);
    const real second = s->order > 1 ? SG_C(1.0) : SG_C(0.0);
    const int stay = s->choice[problem] != SG_UNIQUE;
    int i;
    for (i = pr->x; i < pr->x + pr->n_x; ++i) {
        w->x[i] = s->order < 0 ? w->v[(i - pr->x) % sg_n_q(w)]
                               : s->x[i] + first * s->x_1[i] + second * s->x_2[i];
    }
    for (i = pr->R; i < pr->R + pr->n_slots * sg_n_R(w); ++i) {
        const real change = first * s->R_1[i] + second * s->R_2[i];
        w->R[i] = s->R[i] + (stay ? SG_C(0.0) : change);
    }
}

/* Iterations for an attempt: `wish`, unless fewer are left. */
static int sg_budget(const SG(report) * info, int end, int wish) {
    const int left = end - info->iterations;
    return left < wish ? left : wish;
}

/* 1 if an earlier path ended in the present contact states; keeps them in `ends`. */
static int sg_ended_here(const SG(work) * w, int n_rows, unsigned long *ends, int *count) {
    const unsigned long here = sg_fingerprint(w, n_rows);
    int k;
    for (k = 0; k < *count; ++k) {
        if (ends[k] == here) {
            return 1;
        }
    }
    ends[*count] = here;
    ++*count;
    return 0;
}

/* Guess that contacts that touch at the start stick and hold everything. */
static void sg_hold(SG(work) * w, const SG(params) * par, const SG(options) * opt, int problem) {
    const sg_problem *pr = sg_problem_at(w, problem);
    sg_fill(pr->n_x, SG_C(0.0), &w->x[pr->x]);
    sg_evaluate(w, par, opt, problem);
    sg_say_held(w, pr);
}

/* Newton's method from where a rescue arrived, first in the contact states that it found: there,
   where percussions are not unique, some within all cones are sought. */
static int sg_land(SG(work) * w, const SG(params) * par, const SG(options) * opt, SG(report) * info,
                   int problem, int held, int end, real *measure) {
    const int last = info->iterations + sg_budget(info, end, held);
    int outside = 1;
    while (outside > 0 && info->iterations < last) {
        sg_settle(w, par, opt, problem, sg_budget(info, last, SG_HELD), &info->iterations);
        outside = sg_into_cones(w, sg_problem_at(w, problem));
    }
    return sg_newton(w, par, opt, problem, sg_budget(info, end, SG_LANDING), 0, &info->iterations,
                     measure);
}

/* Contact states along paths number `turn` to `turns` - 1, each linearised where the one before
   led; Newton's method in those that are new and from there. */
static int sg_follow(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                     SG(report) * info, int problem, int turn, int turns, int end, real *measure) {
    const int n_rows = sg_problem_at(w, problem)->n_slots * sg_n_R(w);
    unsigned long ends[SG_LAST_TURNS];
    int status = SG_K(NOT_CONVERGED);
    int count = 0;
    for (; turn < turns && info->iterations < end; ++turn) {
        ++info->iterations;
        if (!sg_path(w, par, opt, problem, turn)) {
            sg_cold_start(w, problem);
        } else if (!sg_ended_here(w, n_rows, ends, &count)) {
            status = sg_land(w, par, opt, info, problem, SG_HELD, end, measure);
            if (status == SG_K(OK)) {
                return status;
            }
        }
    }
    return status;
}

#if SG_SPATIAL
/* At most `turns` relaxations, each of the problem linearised where the one before ended; Newton's
   method from there, unless that is a solution. */
static int sg_follow_relaxed(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                             SG(report) * info, int problem, int turns, int end, real *measure) {
    const sg_problem *pr = sg_problem_at(w, problem);
    const int n_rows = pr->n_slots * sg_n_R(w);
    int status = SG_K(NOT_CONVERGED);
    int turn;
    for (turn = 0; turn < turns && info->iterations < end; ++turn) {
        ++info->iterations;
        if (!sg_relax(w, par, opt, problem)) {
            return status;
        }
        *measure = sg_measure(w, par, opt, problem);
        if (*measure <= SG_C(1.0)) {
            return SG_K(OK);
        }
        sg_copy(pr->n_x, &w->x[pr->x], w->relax.x_end);
        sg_copy(n_rows, &w->R[pr->R], w->relax.R_end);
        status = sg_land(w, par, opt, info, problem, SG_HELD, end, measure);
        if (status == SG_K(OK)) {
            return status;
        }
        sg_copy(pr->n_x, w->relax.x_end, &w->x[pr->x]);
        sg_copy(n_rows, w->relax.R_end, &w->R[pr->R]);
    }
    return status;
}
#endif

#if SG_SEARCHED
/* Newton's method from the cold start, at first in the contact states that are said. */
static int sg_from_states(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                          SG(report) * info, int problem, int end, real *measure) {
    sg_cold_start(w, problem);
    sg_leave_out(w, problem);
    sg_settle(w, par, opt, problem, sg_budget(info, end, SG_SAID), &info->iterations);
    return sg_newton(w, par, opt, problem, sg_budget(info, end, SG_AFTER_SAID), 0,
                     &info->iterations, measure);
}

/* All contact states, each from the cold start: at first those that are the same in all slots.
   From where the last search in this problem of the step ended. */
static int sg_seek(SG(work) * w, const SG(params) * par, const SG(options) * opt, SG(report) * info,
                   int problem, int end, real *measure) {
    const sg_problem *pr = sg_problem_at(w, problem);
    int status = SG_K(NOT_CONVERGED);
    int *apart = &w->found.apart[problem];
    int *said = &w->found.said[problem];
    while (status != SG_K(OK) && *apart < 2 && info->iterations < end) {
        const int fresh = sg_say_states(w, pr, *apart, *said);
        if (fresh > 0) {
            status = sg_from_states(w, par, opt, info, problem, end, measure);
            if (status != SG_K(OK) && info->iterations >= end) {
                return status; /* cut short: the next search begins with them */
            }
        }
        ++(*said);
        if (fresh < 0 || *said == SG_MOST_STATES) {
            *said = 0;
            *apart += pr->n_slots > 1 ? 1 : 2;
        }
    }
    return status;
}
#endif

#if SG_JOINS
/* Soft contacts in a large island (sg_large.c). */
static int sg_harden(SG(work) * w, const SG(params) * par, const SG(options) * opt,
                     SG(report) * info, int problem, int end, real *measure);
#endif

enum {
    SG_HOLD,
    SG_WARM_START,
    SG_COLD_START,
    SG_HARDEN,
    SG_RELAX,
    SG_FOLLOW,
    SG_FOLLOW_ON,
    SG_SEEK,
    SG_ATTEMPTS
};

/* How much is tried: for a whole step, for it again once that failed, in a substep. */
enum { SG_WHOLE, SG_AGAIN, SG_SUBSTEP };

/* 1 if an attempt belongs to the effort: paths in the plane, relaxation in space, in a substep
   few of them; again only contacts that hold, in the problem that failed or that it follows. */
static int sg_is_tried(const SG(work) * w, int problem, int attempt, int warm, int effort) {
    const int stuck = effort == SG_AGAIN && problem == w->found.stuck;
    const sg_problem *pr = sg_problem_at(w, problem);
    const int searched = sg_is_searched(w, pr);
    const int fits = sg_have_room(pr->n_slots * sg_n_R(w)); /* both need all rows */
    const int ahead = effort == SG_AGAIN && problem + 1 == w->found.stuck &&
                      sg_problem_at(w, w->found.stuck)->follows;
    switch (attempt) {
        case SG_HOLD:
            return stuck || ahead;
        case SG_SEEK:
            return searched && effort != SG_SUBSTEP;
        case SG_WARM_START:
            return warm && !stuck;
        case SG_COLD_START:
            return !stuck && !(warm && sg_is_heavy(w));
        case SG_HARDEN:
            return sg_is_heavy(w) && !stuck;
        case SG_RELAX:
            return fits && sg_is_spatial(w) && !stuck;
        case SG_FOLLOW:
            return fits && !sg_is_spatial(w) && !stuck;
        case SG_FOLLOW_ON:
            return fits && !sg_is_spatial(w) && effort != SG_SUBSTEP && !stuck && !searched;
        default:
            return !stuck;
    }
}

/* One attempt at a problem from its own start. No more iterations begin once info.iterations has
   reached `end`. */
static int sg_try(SG(work) * w, const SG(part) * s, const SG(params) * par, const SG(options) * opt,
                  SG(report) * info, int problem, int attempt, int effort, int end, real *measure) {
    /* of the first half of the iterations something is left for what comes after more paths */
    const int half = opt->max_iterations / 2;
    const int on = effort == SG_WHOLE && half < end ? half : end;
    if (attempt == SG_WARM_START) {
        sg_warm_start(w, s, problem);
    } else {
        sg_cold_start(w, problem);
    }
    sg_leave_out(w, problem);
    switch (attempt) {
        case SG_HOLD:
            ++info->iterations;
            sg_hold(w, par, opt, problem);
            return sg_land(w, par, opt, info, problem, SG_HOLDING, end, measure);
#if SG_JOINS
        case SG_HARDEN:
            return sg_harden(w, par, opt, info, problem, end, measure);
#endif
        case SG_FOLLOW:
            return sg_follow(w, par, opt, info, problem, 0, effort == SG_SUBSTEP ? 1 : SG_TURNS,
                             end, measure);
        case SG_FOLLOW_ON:
            return sg_follow(w, par, opt, info, problem, SG_TURNS, SG_LAST_TURNS, on, measure);
#if SG_SEARCHED
        case SG_SEEK:
            return sg_seek(w, par, opt, info, problem, on, measure);
#endif
#if SG_SPATIAL
        case SG_RELAX:
            return sg_follow_relaxed(w, par, opt, info, problem,
                                     effort == SG_SUBSTEP ? 1 : SG_RELAX_TURNS, end, measure);
#endif
        default:
            return sg_newton(w, par, opt, problem,
                             sg_budget(info, end, sg_is_heavy(w) ? SG_HEAVY : SG_PLAIN), 0,
                             &info->iterations, measure);
    }
}

/* Solve one problem: from the warm start if there is one, from a cold start, along paths. No
   attempt begins once info.iterations has reached `end`. */
static int sg_solve(SG(work) * w, const SG(part) * s, const SG(params) * par,
                    const SG(options) * opt, SG(report) * info, int problem, int warm, int effort,
                    int end) {
    static const int rescue[SG_ATTEMPTS] = {SG_PATH,    0,       SG_COLD, SG_SOFT,
                                            SG_RELAXED, SG_PATH, SG_PATH, SG_PATH};
    const int stuck = effort == SG_AGAIN && problem == w->found.stuck;
    int status = SG_K(NOT_CONVERGED);
    real measure = SG_HUGE;
    int attempt;
    w->smooth.pivoting = stuck;
    if (effort == SG_WHOLE) {
        w->found.said[problem] = 0;
        w->found.apart[problem] = 0;
    }
    sg_prox_parameters(w, opt, problem);
    for (attempt = SG_HOLD; attempt < SG_ATTEMPTS && status != SG_K(OK) && info->iterations < end;
         ++attempt) {
        const int before = status;
        const int used = info->iterations;
        if (!sg_is_tried(w, problem, attempt, warm, effort)) {
            continue;
        }
        w->newton.mode = stuck                                      ? SG_LAST_RESORT
                         : attempt == SG_WARM_START && s->order < 0 ? SG_AT_REST
                         : w->smooth.pivoting                       ? SG_LATER_ATTEMPT
                                                                    : SG_FIRST_ATTEMPT;
        status = sg_try(w, s, par, opt, info, problem, attempt, effort, end, &measure);
        w->smooth.pivoting = 1;
        if (status == SG_K(OK)) {
            sg_choose(w, s, par, opt, info, problem, info->iterations > used, &measure);
            sg_keep_rows(w, problem);
            status = sg_check_problem(w, opt, problem) ? SG_K(OK) : SG_K(REJECTED);
        }
        if (status == SG_K(NOT_CONVERGED)) {
            status = before; /* singular, not finite or rejected says more */
        }
        if (status == SG_K(OK) && (warm || attempt != SG_COLD_START)) {
            info->rescues |= rescue[attempt];
        }
    }
    if (status == SG_K(OK)) {
        const int choice = w->found.choice[problem];
        info->percussions = choice > info->percussions ? choice : info->percussions;
        info->residual = sg_max(info->residual, measure * sg_max(opt->tol, SG_FLOOR));
    }
    return status;
}
