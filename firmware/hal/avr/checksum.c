// SPDX-License-Identifier: Apache-2.0
//
// avr-libc's hand-written steps: bitwise C would not keep up with 200 scans a second.
#include <util/crc16.h>

#include "hal.h"

uint16_t hal_crc16_ccitt(uint16_t crc, const uint8_t *bytes, uint8_t count)
{
    while (count-- > 0)
        crc = _crc_xmodem_update(crc, *bytes++);
    return crc;
}

uint8_t hal_crc8_ccitt(uint8_t crc, const uint8_t *bytes, uint8_t count)
{
    while (count-- > 0)
        crc = _crc8_ccitt_update(crc, *bytes++);
    return crc;
}
