// SPDX-License-Identifier: Apache-2.0
//
// The board's look at itself: the SPI bus by registers written and read back, the ADC by a short, its
// own test voltage and its supply against both references, the accelerometer by its self-test pin.
// It only measures; what is good is for the host to say.
#ifndef SELF_TEST_H
#define SELF_TEST_H

#include "board_protocol.h"

// Takes 0.26 s, less than the watchdog grants, whatever the ADC does. Leaves the ADC held and not
// set up. Only while not streaming.
struct self_test_response self_test_run(void);

#endif
