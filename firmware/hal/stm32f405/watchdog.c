// SPDX-License-Identifier: Apache-2.0
//
// The independent watchdog, with a clock of its own that is 17 to 47 kHz: what is granted is the
// least that it waits, at 47 kHz. At 17 kHz it waits 2.8 times as long.
#include "board_protocol.h"
#include "hal.h"
#include "parts.h"
#include "registers.h"

#define FASTEST_HZ 47000u
#define PRESCALER 16u
#define UPDATE_PATIENCE 100000u // an update takes some periods of the watchdog's clock

void watchdog_init(void)
{
    IWDG->KR = IWDG_KR_START;
    watchdog_grant(BOARD_WATCHDOG_MS);
}

void watchdog_grant(uint32_t milliseconds)
{
    uint32_t reload = milliseconds * (FASTEST_HZ / PRESCALER) / 1000 + 1;
    IWDG->KR = IWDG_KR_UNLOCK;
    IWDG->PR = IWDG_PR_BY_16;
    IWDG->RLR = reload < IWDG_RLR_MAXIMUM ? reload : IWDG_RLR_MAXIMUM;
    for (uint32_t i = 0; i < UPDATE_PATIENCE && IWDG->SR != 0; i++)
        ;
    hal_watchdog_kick();
}

void hal_watchdog_kick(void)
{
    IWDG->KR = IWDG_KR_RELOAD;
}
