// SPDX-License-Identifier: Apache-2.0
//
// Any bytes on the serial line: framing, COBS, CRC.
#include "fuzz_target.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_power_up(0);
    fuzz_receive(data, size);
    fuzz_power_down();
    return 0;
}
