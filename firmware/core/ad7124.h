// SPDX-License-Identifier: Apache-2.0
//
// The AD7124-8 24-bit ADC over SPI, every transaction under its CRC-8 (data sheet, "On-chip
// registers" and "SPI interface"). Set up for continuous conversion of the board's channel
// sequence, started by the SYNC pin.
#ifndef AD7124_H
#define AD7124_H

#include <stdbool.h>
#include <stdint.h>

#include "board_protocol.h"

enum ad7124_register {
    AD7124_STATUS = 0x00,
    AD7124_ADC_CONTROL = 0x01,
    AD7124_DATA = 0x02,
    AD7124_IO_CONTROL_1 = 0x03,
    AD7124_IO_CONTROL_2 = 0x04,
    AD7124_ID = 0x05,
    AD7124_ERROR = 0x06,
    AD7124_ERROR_EN = 0x07,
    AD7124_MCLK_COUNT = 0x08,
    AD7124_CHANNEL_0 = 0x09,
    AD7124_CONFIG_0 = 0x19,
    AD7124_FILTER_0 = 0x21,
    AD7124_OFFSET_0 = 0x29,
    AD7124_GAIN_0 = 0x31,
    AD7124_REGISTERS = 0x39,
};

#define AD7124_SETUPS 8u
#define AD7124_NO_HOUSEKEEPING BOARD_HOUSEKEEPING_COUNT
#define AD7124_UNKNOWN_HOUSEKEEPING (BOARD_HOUSEKEEPING_COUNT + 1u) // a write that may not have come through

// What the chip was set up to hold.
struct ad7124 {
    struct configure_arguments configuration;
    uint8_t channels;              // of it
    uint32_t filter;               // what FILTER of a slot in use holds
    uint8_t housekeeping;          // source that CHANNEL_6 converts, or one of the two above
    uint32_t gains[AD7124_SETUPS]; // each chip has its own, from its factory
    uint8_t step;                  // of the set-up
    uint32_t reset_ticks;          // low half of the time of the reset that begins it
    uint8_t examined;              // register that the round over all has come to
    uint8_t unverified; // first register in use not read back since the last write, or AD7124_REGISTERS
};

struct ad7124_conversion {
    uint32_t code;   // 24 bits
    uint8_t slot;    // number of the CHANNEL register it belongs to
    bool powered_on; // the chip has been reset since it was set up
    bool error;      // ERROR says what is wrong
};

// Resets the chip and reads its ID register; 0 if nothing answers as an AD7124-8. Takes 5 ms.
uint8_t ad7124_reset(void);

// Reads the ID register of a chip in any state, also while it converts; 0 as above.
uint8_t ad7124_identify(void);

// Whether a chip in any state has been reset since its STATUS was read last.
bool ad7124_was_reset(void);

// Sets the chip up in small steps, of which none takes longer than six transactions: a reset, then
// CHANNEL_n, CONFIG_n and FILTER_n for the n-th channel of the order, and a slot for housekeeping
// behind all that there may be, which no source has yet. What is written is read back. The ADC must
// be held by SYNC. The whole takes 5 ms of waiting and 5 to 10 ms of steps.
enum ad7124_progress { AD7124_BUSY, AD7124_DONE, AD7124_FAILED };
void ad7124_begin_set_up(struct ad7124 *adc, const struct configure_arguments *configuration);
enum ad7124_progress ad7124_go_on_with_set_up(struct ad7124 *adc);

// The same in one go; false if the chip does not answer, or a register is not as written.
bool ad7124_set_up(struct ad7124 *adc, const struct configure_arguments *configuration);

// Resets the chip and sets the self-test's slots up, the accelerometer's axes behind them.
bool ad7124_set_up_self_test(void);

// Writes patterns to a register that nobody uses and reads each back under the CRC: how many were
// not as written. After ad7124_reset, with the ADC held by SYNC.
#define AD7124_ECHOES 29u
uint8_t ad7124_echo_errors(void);

// The transaction that lets CHANNEL_6 convert a source or none, for hal_adc_exchange with the ADC
// held by SYNC. Coded apart, because interrupts are locked out while it is sent.
#define AD7124_HOUSEKEEPING_SIZE 4u
void ad7124_encode_housekeeping(uint8_t bytes[AD7124_HOUSEKEEPING_SIZE], uint8_t source);

// Reads back whether CHANNEL_6 has the source that was written; if not, what it has is unknown.
void ad7124_verify_housekeeping(struct ad7124 *adc, uint8_t source);

// Reads the finished conversion; false if its CRC is wrong.
bool ad7124_read_conversion(struct ad7124_conversion *conversion);

// Reads ERROR, which clears it; false if the CRC is wrong.
bool ad7124_read_errors(uint32_t *errors);

// Bits of ERROR that tell of a bad transaction on the bus: the registers and conversions are sound.
#define AD7124_BUS_ERRORS 0x00007Cul

// Reads one register back, the next one at each call. A write makes the chip take a bit that flipped less than
// 1/2400 s before for its own, so those that a value depends on come first behind each write; then, round and
// round, all that can be written.
enum ad7124_finding { AD7124_AS_SET_UP, AD7124_NOT_AS_SET_UP, AD7124_UNREADABLE };
enum ad7124_finding ad7124_examine(struct ad7124 *adc);

// Whether all that a value depends on has been read back, and found as set up, since the last write.
bool ad7124_is_verified(const struct ad7124 *adc);

// How many registers that is, at most: ADC_CONTROL, IO_CONTROL_1 and _2, ERROR_EN; and CHANNEL, CONFIG,
// FILTER, OFFSET and GAIN of every slot.
#define AD7124_REGISTERS_IN_USE (4u + 5u * (BOARD_CHANNEL_COUNT + 1u))

#endif
