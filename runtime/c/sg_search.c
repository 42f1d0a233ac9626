#pragma once
#include "sg_path.c"

/* Contact states of a planar problem one after another, whatever led to them: what is tried with
   friction under load, whose radius is not linear in the percussions, so that paths may end nowhere
   although a solution is there. */

#define SG_SEARCHED (SG_N_LOADS > 0)

/* 1 if friction under load takes part in a planar problem. */
static int sg_is_searched(const SG(work) * w, const sg_problem *pr) {
    int k;
    for (k = 0; k < sg_n_contacts(w) && SG_SEARCHED && !sg_is_spatial(w); ++k) {
        if (sg_contact_at(w, k)->loads > 0 && sg_joins(w, pr, k) && sg_rubbing(w, k) > 0) {
            return 1;
        }
    }
    return 0;
}

#if SG_SEARCHED
/* States of one contact: friction acts only while it is pressed. */
enum { SG_STATE_STICK, SG_STATE_FORTH, SG_STATE_BACK, SG_STATE_OPEN };

/* How many states contact k can be in: those of its friction, and open. */
static int sg_states_of(const SG(work) * w, const sg_problem *pr, int k) {
    const int rubs = sg_rubbing(w, k) > 0 ? SG_STATE_OPEN : 1;
    return !sg_joins(w, pr, k) ? 1 : rubs + (sg_contact_at(w, k)->normal >= 0);
}

/* Rows of contact k in the slot with first row `base` in its state number `state`. Returns 0 if
   another number says the same. */
static int sg_say_state(SG(work) * w, const sg_problem *pr, int base, int k, int state) {
    const sg_contact *contact = sg_contact_at(w, k);
    const int joins = sg_joins(w, pr, k);
    const int rubs = joins && sg_rubbing(w, k) > 0;
    const int open = !joins || (contact->normal >= 0 && state + 1 == sg_states_of(w, pr, k));
    const int f = sg_slip_of(w, base, k);
    int pressed;
    if (contact->normal >= 0) {
        w->rows.kind[sg_normal_of(w, base, k)] = open ? SG_ROW_ZERO : SG_ROW_FREE;
    }
    pressed = rubs && !open && sg_is_pressed(w, base, k);
    if (contact->components > 0) {
        w->rows.kind[f] = !pressed                  ? SG_ROW_ZERO
                          : state == SG_STATE_STICK ? SG_ROW_FREE
                                                    : SG_ROW_SLIP;
        w->rows.slip[f] = state == SG_STATE_BACK ? SG_C(-1.0) : SG_C(1.0);
    }
    return open || pressed || !rubs || state == SG_STATE_STICK;
}

/* Row kinds of the set of states `number`: every contact in the same state in all slots, or, with
   `apart`, in each in its own. Returns 1, 0 if another number says the same, -1 beyond the last. */
static int sg_say_states(SG(work) * w, const sg_problem *pr, int apart, int number) {
    int fresh = 1;
    int slot, k;
    for (slot = 0; slot < pr->n_slots; ++slot) {
        int rest = number;
        sg_bilateral_kinds(w, pr, slot);
        for (k = 0; k < sg_n_contacts(w); ++k) {
            const int count = sg_states_of(w, pr, k);
            fresh = sg_say_state(w, pr, slot * sg_n_R(w), k, rest % count) && fresh;
            rest /= count;
        }
        if (apart) {
            number = rest;
        } else if (rest > 0) {
            return -1;
        }
    }
    return apart && number > 0 ? -1 : fresh;
}
#endif
