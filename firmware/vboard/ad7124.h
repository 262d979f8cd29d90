// SPDX-License-Identifier: GPL-3.0-or-later
//
// Model of the AD7124-8 as seen from its pins: registers, SPI transactions with their CRC, the channel sequence
// with settled conversions, SYNC, DOUT/RDY̅, and the codes. It knows nothing of the emulator: time comes in
// with every call (nanoseconds, never decreasing), analog inputs through callbacks.
#ifndef VBOARD_AD7124_H
#define VBOARD_AD7124_H

#include <stdbool.h>
#include <stdint.h>

enum {
    AD7124_STATUS = 0x00,
    AD7124_ADC_CONTROL = 0x01,
    AD7124_DATA = 0x02,
    AD7124_ID = 0x05,
    AD7124_ERROR = 0x06,
    AD7124_ERROR_EN = 0x07,
    AD7124_MCLK_COUNT = 0x08,
    AD7124_CHANNEL_0 = 0x09,
    AD7124_CONFIG_0 = 0x19,
    AD7124_FILTER_0 = 0x21,
    AD7124_OFFSET_0 = 0x29,
    AD7124_GAIN_0 = 0x31,
    AD7124_REGISTER_COUNT = 0x39,
};

// A pair of pins, in volts against AVSS.
typedef struct ad7124_pair {
    double positive, negative;
} ad7124_pair;

// What is connected to the analog pins; volts at an instant that may lie a conversion in the past.
typedef struct ad7124_inputs {
    void *context;
    ad7124_pair (*pin_volts)(void *context, unsigned positive, unsigned negative, double time_ns);
    ad7124_pair (*refin1_volts)(void *context, double time_ns);
} ad7124_inputs;

// What the rising edge of SYNC does to the sequence of channels: the data sheet leaves both open.
typedef enum ad7124_sequence { AD7124_BEGINS_ANEW, AD7124_GOES_ON } ad7124_sequence;

typedef struct ad7124 {
    ad7124_inputs inputs;
    ad7124_sequence sequence;
    double clock_scale;  // of the internal oscillator, 1 = nominal
    uint32_t registers[AD7124_REGISTER_COUNT];

    // SPI transaction
    bool selected;
    bool in_transaction;
    uint8_t command;
    uint8_t bytes[6];  // after the command: data, status, CRC
    unsigned byte_count, byte_index;
    bool holds_last_bit;  // CS_EN: DOUT keeps the last bit read until CS rises
    bool last_bit;
    unsigned ones;         // consecutive ones on DIN
    double accessible_ns;  // SPI answers from here (after a reset)

    // Sequencer
    bool sync_low;
    double sync_fell_ns;
    bool converting;
    unsigned channel;  // being converted
    double done_ns;
    bool ready;  // a result waits to be read
    uint8_t status;    // as it was at the end of that conversion
    bool map_damaged;  // a register has flipped since the chip made its checksum of them
    double damaged_ns;
    uint64_t conversions;
    uint64_t conversions_out_of_range;  // a pin or the reference was beyond what the data sheet guarantees
    uint64_t short_sync_pulses;
} ad7124;

void ad7124_power_on(ad7124 *adc, const ad7124_inputs *inputs, ad7124_sequence sequence, double clock_ppm,
                     double now_ns);

// The supply dips for so short a time that the chip resets itself.
void ad7124_dip(ad7124 *adc, double now_ns);

// A bit of a register flips, as by a particle. False for a register or a bit that is not there.
bool ad7124_flip_bit(ad7124 *adc, unsigned address, unsigned bit, double now_ns);

// Pins in: CS and SYNC (levels), and eight SCLK periods. The byte returned is what DOUT showed meanwhile.
void ad7124_select(ad7124 *adc, bool cs_level);
void ad7124_sync(ad7124 *adc, bool sync_level, double now_ns);
uint8_t ad7124_exchange(ad7124 *adc, uint8_t din, double now_ns);

// Pin out: DOUT/RDY̅ between bytes; high while CS is high (pulled up).
bool ad7124_dout(const ad7124 *adc);
// Whether DOUT is showing RDY̅ now.
bool ad7124_shows_ready(const ad7124 *adc);
// Whether the next byte exchanged is read data.
bool ad7124_reads(const ad7124 *adc);

// The instant of the next end of conversion, or INFINITY; the instant for which its code will hold, likewise;
// and the end itself.
double ad7124_next_ns(const ad7124 *adc);
double ad7124_sampling_ns(const ad7124 *adc);
void ad7124_finish_conversion(ad7124 *adc);

// The ideal code: 2^24·x unipolar, 2^23·(x + 1) bipolar, with x = V·pga/Vref, to the nearest and clipped.
uint32_t ad7124_ideal_code(double ratio, bool bipolar);

uint8_t ad7124_crc8(uint8_t crc, uint8_t byte);

#endif
