// SPDX-License-Identifier: Apache-2.0
//
// What both fuzz targets share: a board with its fake ADC and a host that judges all that it sends.
#ifndef FUZZ_TARGET_H
#define FUZZ_TARGET_H

#include <stddef.h>
#include <stdint.h>

// A board as after power-on, its EEPROM blank. Bits of `faults`: the ADC is absent (0), never ready
// (1), has some reads corrupted (2); the EEPROM stops taking bytes (3); where, stands in the upper
// four.
void fuzz_power_up(uint8_t faults);

// Lets the board receive these bytes and work on them; aborts if what it sends is not what a board
// may send: good frames only, known types, each response of the right size and at most one for each
// delimiter received.
void fuzz_receive(const uint8_t *bytes, size_t count);

// Aborts unless the board still answers, is healthy and holds a configuration that passes its check.
void fuzz_power_down(void);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
