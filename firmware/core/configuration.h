// SPDX-License-Identifier: Apache-2.0
//
// What the host may choose: rate, filter, gains and the order of the channels. It is judged as a
// whole, because a scan has to fit its period. `struct configure_arguments` of board.yaml holds it.
#ifndef CONFIGURATION_H
#define CONFIGURATION_H

#include <stdbool.h>
#include <stdint.h>

#include "board_protocol.h"

#define CONFIGURATION_NO_CHANNEL 255u

// board.yaml's values: every channel, in its order.
struct configure_arguments configuration_default(void);

// One of BOARD_STATUS_…: ok, bad_argument (a value by itself), does_not_fit (scan into period).
uint8_t configuration_check(const struct configure_arguments *configuration);

// Channels that a scan converts. Here and below the configuration has passed the check.
uint8_t configuration_channels(const struct configure_arguments *configuration);

// Ticks from one scan to the next.
uint32_t configuration_period(const struct configure_arguments *configuration);

// Ticks after the scan's start at which its last conversion has been read and its frame is on its
// way, on the slowest ADC.
uint32_t configuration_longest_scan(const struct configure_arguments *configuration);

// Whether one more conversion, for housekeeping, fits behind a scan of the slowest ADC.
bool configuration_housekeeping_fits(const struct configure_arguments *configuration);

// Ticks from one conversion to the next, on the fastest ADC.
uint32_t configuration_shortest_conversion(const struct configure_arguments *configuration);

#endif
