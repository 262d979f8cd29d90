// SPDX-License-Identifier: Apache-2.0
#include <avr/io.h>

#include "hal.h"
#include "parts.h"
#include "pins.h"

void accelerometer_init(void)
{
    ACCEL_SELF_TEST_DDR |= _BV(ACCEL_SELF_TEST); // low
}

void hal_accelerometer_self_test(bool on)
{
    // Port L cannot be reached by SBI: the sample timer's SYNC shares it.
    uint8_t state = hal_lock();
    if (on)
        ACCEL_SELF_TEST_PORT |= _BV(ACCEL_SELF_TEST);
    else
        ACCEL_SELF_TEST_PORT &= (uint8_t)~_BV(ACCEL_SELF_TEST);
    hal_unlock(state);
}
