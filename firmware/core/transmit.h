// SPDX-License-Identifier: Apache-2.0
//
// The way out: a payload goes into the transmit buffer as a whole frame or not at all.
#ifndef TRANSMIT_H
#define TRANSMIT_H

#include <stdint.h>

struct transmitter {
    uint32_t dropped_frames; // the buffer had no room
};

// `length` is at most BOARD_WIRE_MAXIMUM_PAYLOAD.
void transmit(struct transmitter *transmitter, const uint8_t *payload, uint8_t length);

#endif
