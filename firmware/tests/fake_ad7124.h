// SPDX-License-Identifier: Apache-2.0
//
// An AD7124-8 for the host tests: registers, CRC, SYNC and conversions in the model's time, with
// faults that a test can inject. Written from the data sheet, apart from the driver.
#ifndef FAKE_AD7124_H
#define FAKE_AD7124_H

#include <stdbool.h>
#include <stdint.h>

#define FAKE_AD7124_REGISTERS 0x39

struct fake_ad7124 {
    uint32_t registers[FAKE_AD7124_REGISTERS];
    uint32_t inputs[16]; // code that a conversion of CHANNEL_n gives
    uint32_t deflections[16]; // added while the accelerometer's self-test pin is high
    uint8_t id;

    bool running; // SYNC high
    uint64_t started;
    uint32_t conversions_read; // of this sequence: the number of the last one read
    uint8_t last_channel;      // that was converted before the sequence began

    // Faults.
    bool absent;                  // the bus reads as ones
    bool stalled;                 // no conversion ever ends
    uint32_t corrupt_reads;       // flip a bit in this many of the next reads …
    uint32_t corrupt_reads_after; // … after letting this many pass
    uint8_t skip_channel;         // leave this channel out of every sequence; 0xFF: none
    uint8_t reported_channel;     // STATUS names this one, whatever was converted; 0xFF: the true one
    double slowness;              // factor on the duration of a conversion
    // What happened.
    uint32_t writes_refused; // wrong CRC
    uint32_t writes_while_running;
};

// Connects a fresh device to the host's hal.
void fake_ad7124_connect(struct fake_ad7124 *device);

// Ticks that one conversion takes with the FILTER_0 that is set.
double fake_ad7124_conversion_ticks(const struct fake_ad7124 *device);

#endif
