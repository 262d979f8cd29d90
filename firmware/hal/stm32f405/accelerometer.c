// SPDX-License-Identifier: Apache-2.0
#include "hal.h"
#include "parts.h"
#include "pins.h"

void accelerometer_init(void)
{
    pin_output(ACCEL_SELF_TEST, ACCEL_SELF_TEST_PIN); // low
}

void hal_accelerometer_self_test(bool on)
{
    pin_set(ACCEL_SELF_TEST, ACCEL_SELF_TEST_PIN, on);
}
