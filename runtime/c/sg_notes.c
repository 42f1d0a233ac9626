#pragma once
#include "sg_contract.h"

/* The kind of event that leads a contact from one state to another, -1: none. */
static int sg_event_kind(int before, int now, int impacts, int exists) {
    if (impacts > 0) {
        return SG_K(EVENT_IMPACT);
    }
    if (before == now || before == SG_K(UNKNOWN)) {
        return -1;
    }
    if (now == SG_K(OPEN)) {
        return exists ? SG_K(EVENT_OPEN) : SG_K(EVENT_GUARD);
    }
    if (before == SG_K(OPEN)) {
        return SG_K(EVENT_CLOSE);
    }
    if (now == SG_K(STICK)) {
        return SG_K(EVENT_STICK);
    }
    return before == SG_K(STICK) ? SG_K(EVENT_SLIP) : SG_K(EVENT_REVERSE);
}
