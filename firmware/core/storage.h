// SPDX-License-Identifier: Apache-2.0
//
// What the EEPROM holds: the board's identity, and the configuration in two slots that are written
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

// A u32 at an address of board.yaml; 0xFFFFFFFF if never written.
uint32_t storage_number(uint16_t address);

#endif
