// SPDX-License-Identifier: Apache-2.0
//
// When the hardware watchdog is kicked: only from the main loop, and only when the timer interrupt
// has beaten since the kick before. If either stops, the board resets.
#ifndef WATCHDOG_H
#define WATCHDOG_H

#include <stdint.h>

struct watchdog {
    uint32_t last_beat;
};

// `beat` changes as long as the timer interrupt lives.
void watchdog_poll(struct watchdog *watchdog, uint32_t beat);

#endif
