// SPDX-License-Identifier: Apache-2.0
//
// Any payloads in good frames, which random bytes would hardly ever be. The input is a row of
// payloads, each behind its length; its first byte says what is wrong with the board.
#include "frame.h"
#include "fuzz_target.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0)
        return 0;
    fuzz_power_up(data[0]);
    data++, size--;
    while (size > 1) {
        size_t length = data[0] % (BOARD_WIRE_MAXIMUM_PAYLOAD + 1u);
        data++, size--;
        if (length > size)
            length = size;
        uint8_t frame[FRAME_MAXIMUM];
        fuzz_receive(frame, frame_encode(frame, data, (uint8_t)length));
        data += length;
        size -= length;
    }
    fuzz_power_down();
    return 0;
}
