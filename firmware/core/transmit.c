// SPDX-License-Identifier: Apache-2.0
#include "transmit.h"

#include "frame.h"
#include "hal.h"

void transmit(struct transmitter *transmitter, const uint8_t *payload, uint8_t length)
{
    uint8_t frame[FRAME_MAXIMUM];
    uint8_t frame_length = frame_encode(frame, payload, length);
    if (frame_length > hal_serial_tx_space()) {
        transmitter->dropped_frames++;
        return;
    }
    hal_serial_write(frame, frame_length);
}
