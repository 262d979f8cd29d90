// SPDX-License-Identifier: Apache-2.0
//
// The chip has no EEPROM: a journal in flash takes its place.
#include "hal.h"
#include "journal.h"
#include "parts.h"

void storage_init(void)
{
    journal_init();
}

void hal_eeprom_read(uint16_t address, uint8_t *bytes, uint8_t count)
{
    journal_read(address, bytes, count);
}

void hal_eeprom_write(uint16_t address, const uint8_t *bytes, uint8_t count)
{
    journal_write(address, bytes, count);
}
