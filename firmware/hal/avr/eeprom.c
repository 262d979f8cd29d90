// SPDX-License-Identifier: Apache-2.0
#include <avr/eeprom.h>

#include "hal.h"

// avr-libc takes addresses in the EEPROM as pointers.

void hal_eeprom_read(uint16_t address, uint8_t *bytes, uint8_t count)
{
    eeprom_read_block(bytes, (const void *)address, count);
}

void hal_eeprom_write(uint16_t address, const uint8_t *bytes, uint8_t count)
{
    eeprom_update_block(bytes, (void *)address, count);
    eeprom_busy_wait();
}
