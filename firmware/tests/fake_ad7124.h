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
    uint8_t gains[16];     // binary logarithm of the gain at which it gives that
    uint32_t deflections[16]; // added while the accelerometer's self-test pin is high
    uint8_t id;

    bool running; // SYNC high
    uint64_t started;
    uint32_t conversions_read; // of this sequence: the number of the last one read
    uint8_t last_channel;      // that was converted before the sequence began
    uint8_t position;          // from which the sequence goes on
    bool map_damaged;          // a register has flipped since the last write
    uint64_t damaged_at;

    // Faults.
    bool absent;                  // the bus reads as ones
    bool stalled;                 // no conversion ever ends
    uint32_t corrupt_reads;       // flip a bit in this many of the next reads …
    uint32_t corrupt_reads_after; // … after letting this many pass
    bool corrupt_register_reads;  // of all registers but DATA
    uint8_t skip_channel;         // leave this channel out of every sequence; 0xFF: none
    uint8_t reported_channel;     // STATUS names this one, whatever was converted; 0xFF: the true one
    double slowness;              // factor on the duration of a conversion
    bool sequence_goes_on;        // SYNC lets it go on where it was held, instead of anew
    uint32_t refuse_writes;       // so many of the next writes come while the chip is not ready
    // What happened.
    uint32_t writes_refused; // wrong CRC
    uint32_t writes_while_running;
    uint32_t reads_without_cs_en; // whose last bit a master may miss
};

// Bytes of a register.
uint8_t fake_ad7124_size_of(uint8_t address);

// Connects a fresh device to the host's hal.
void fake_ad7124_connect(struct fake_ad7124 *device);

// A bit of a register flips.
void fake_ad7124_flip_bit(struct fake_ad7124 *device, uint8_t address, uint8_t bit);

// The supply dips for a moment: the chip resets itself.
void fake_ad7124_dip(struct fake_ad7124 *device);

// Ticks that one conversion takes with the FILTER_0 that is set.
double fake_ad7124_conversion_ticks(const struct fake_ad7124 *device);

#endif
