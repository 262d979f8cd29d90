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
    AD7124_ID = 0x05,
    AD7124_ERROR = 0x06,
    AD7124_ERROR_EN = 0x07,
    AD7124_CHANNEL_0 = 0x09,
    AD7124_CONFIG_0 = 0x19,
    AD7124_FILTER_0 = 0x21,
    AD7124_OFFSET_0 = 0x29,
};

struct ad7124_conversion {
    uint32_t code;   // 24 bits
    uint8_t slot;    // number of the CHANNEL register it belongs to
};

// Resets the chip and reads its ID register; 0 if nothing answers as an AD7124-8.
uint8_t ad7124_reset(void);

// Resets the chip and writes a configuration: CHANNEL_n, CONFIG_n and FILTER_n for the n-th channel
// of its order, and housekeeping source 0 behind all that there may be. Every register is read back;
// false if one is not as written. The ADC must be held by SYNC.
bool ad7124_set_up(const struct configure_arguments *configuration);

// Resets the chip and sets the self-test's slots up, the accelerometer's axes behind them.
bool ad7124_set_up_self_test(void);

// Writes patterns to a register that nobody uses and reads each back under the CRC: how many were
// not as written. After ad7124_reset, with the ADC held by SYNC.
#define AD7124_ECHOES 29u
uint8_t ad7124_echo_errors(void);

// The transaction that chooses the housekeeping source, for hal_adc_exchange with the ADC held by
// SYNC. Coded apart, because interrupts are locked out while it is sent.
#define AD7124_HOUSEKEEPING_SIZE 4u
void ad7124_encode_housekeeping(uint8_t bytes[AD7124_HOUSEKEEPING_SIZE], uint8_t source);

// Reads the finished conversion; false if its CRC is wrong.
bool ad7124_read_conversion(struct ad7124_conversion *conversion);

#endif
