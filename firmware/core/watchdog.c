// SPDX-License-Identifier: Apache-2.0
#include "watchdog.h"

#include "hal.h"

void watchdog_poll(struct watchdog *watchdog, uint32_t beat)
{
    if (beat == watchdog->last_beat)
        return;
    watchdog->last_beat = beat;
    hal_watchdog_kick();
}
