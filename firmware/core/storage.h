// SPDX-License-Identifier: Apache-2.0
//
// What the EEPROM holds: the board's identity under a checksum, and the configuration in two slots that are written
// in turn. A slot counts only with its version and its checksum, so that a write which is cut short
// leaves the configuration before it.
#ifndef STORAGE_H
#define STORAGE_H

#include <stdbool.h>
#include <stdint.h>

#include "board_protocol.h"

struct storage {
    uint8_t slot;       // that holds the configuration in force; the other one is written next
    uint8_t generation; // of that slot, modulo 2^8
    uint8_t origin;     // BOARD_CONFIGURATION_ORIGIN_…
};

// The stored configuration, or the default one; storage->origin says which and why.
struct configure_arguments storage_load(struct storage *storage);

// Stores what has passed configuration_check. False if the EEPROM does not hold it afterwards.
// Writing takes 3.4 ms a byte.
bool storage_save(struct storage *storage, const struct configure_arguments *configuration);

#define STORAGE_NO_NUMBER UINT32_MAX

struct identity {
    uint32_t board_serial;
    uint32_t calibration_id;
};

// What stands in the EEPROM, whatever it is worth: one of BOARD_IDENTITY_STATE_….
uint8_t storage_identity(struct identity *identity);

// Stores numbers of which none is STORAGE_NO_NUMBER. False if the EEPROM does not hold them afterwards.
bool storage_save_identity(const struct identity *identity);

#endif
