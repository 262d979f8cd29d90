// SPDX-License-Identifier: Apache-2.0
//
// Every pin of the board. The asserts tie this file to protocol/board.yaml.
#ifndef PINS_H
#define PINS_H

#include <avr/io.h>

#include "board_protocol.h"

#define ASSERT_PIN(name, port, bit)                                                                \
    _Static_assert(BOARD_PIN_##name##_PORT == (port) && BOARD_PIN_##name##_BIT == (bit),           \
                   #name " is another pin in board.yaml")

// Encoders: port D, A and B of one encoder side by side (INT0 … INT3).
#define ENCODERS_PORT PORTD
#define ENCODERS_PIN PIND
#define CRANK_SHIFT 0
#define CARRIAGE_SHIFT 2
#define ENCODERS_MASK 0x0F
ASSERT_PIN(CRANK_A, 'D', CRANK_SHIFT);
ASSERT_PIN(CRANK_B, 'D', CRANK_SHIFT + 1);
ASSERT_PIN(CARRIAGE_A, 'D', CARRIAGE_SHIFT);
ASSERT_PIN(CARRIAGE_B, 'D', CARRIAGE_SHIFT + 1);

// SPI and the LED: port B.
#define SPI_PORT PORTB
#define SPI_DDR DDRB
#define SPI_CS PB0
#define SPI_SCLK PB1
#define SPI_MOSI PB2
#define SPI_MISO PB3
ASSERT_PIN(ADC_CS, 'B', SPI_CS);
ASSERT_PIN(ADC_SCLK, 'B', SPI_SCLK);
ASSERT_PIN(ADC_DIN, 'B', SPI_MOSI);
ASSERT_PIN(ADC_DOUT, 'B', SPI_MISO);

#define LED_DDR DDRB
#define LED_PIN PINB
#define LED PB7
ASSERT_PIN(LED, 'B', LED);

// The ADC's DOUT once more, where it is read as RDY̅.
#define READY_PIN PINE
#define READY PE4
ASSERT_PIN(ADC_READY, 'E', READY);

#define SYNC_PORT PORTL
#define SYNC_DDR DDRL
#define SYNC PL0
ASSERT_PIN(ADC_SYNC, 'L', SYNC);

#define ACCEL_SELF_TEST_PORT PORTL
#define ACCEL_SELF_TEST_DDR DDRL
#define ACCEL_SELF_TEST PL1
ASSERT_PIN(ACCEL_SELF_TEST, 'L', ACCEL_SELF_TEST);

// The motor's driver: port H, with the output of timer 4's compare unit A.
#define DRIVE_PORT PORTH
#define DRIVE_DDR DDRH
#define DRIVE_PIN PINH
#define DRIVE_PWM PH3
#define DRIVE_ENABLE PH4
#define DRIVE_EMERGENCY_STOP PH5
ASSERT_PIN(DRIVE_PWM, 'H', DRIVE_PWM);
ASSERT_PIN(DRIVE_ENABLE, 'H', DRIVE_ENABLE);
ASSERT_PIN(EMERGENCY_STOP, 'H', DRIVE_EMERGENCY_STOP);

// UART 0 takes PE0 and PE1 over when it is enabled.
ASSERT_PIN(HOST_RX, 'E', PE0);
ASSERT_PIN(HOST_TX, 'E', PE1);

#endif
