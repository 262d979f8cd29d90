// SPDX-License-Identifier: Apache-2.0
//
// Every pin of this port. (board.yaml has those of the board that is built, with the ATmega2560.)
#ifndef PINS_H
#define PINS_H

#include <stdbool.h>

#include "registers.h"

// Encoders: port C, A and B of one encoder side by side (EXTI 0 … 3), pulled up to
// 3.3 V for open collectors. An encoder that drives 5 V needs a level shifter: with its pull-up on, no
// pin of this chip is to be held to bear 5 V.
#define ENCODERS GPIOC
#define CRANK_SHIFT 0u
#define CARRIAGE_SHIFT 2u

// SPI 1. MISO is DOUT/RDY̅: an input can be read while the SPI has the pin.
#define ADC GPIOA
#define ADC_CS 4u
#define ADC_SCLK 5u
#define ADC_DOUT 6u
#define ADC_DIN 7u
#define ADC_FUNCTION 5u

// USART 1.
#define HOST GPIOA
#define HOST_TX 9u
#define HOST_RX 10u
#define HOST_FUNCTION 7u

#define SYNC GPIOB
#define SYNC_PIN 0u
#define ACCEL_SELF_TEST GPIOB
#define ACCEL_SELF_TEST_PIN 1u
// The emergency-stop loop is closed to ground.
#define DRIVE GPIOB
#define DRIVE_ENABLE_PIN 5u
#define EMERGENCY_STOP_PIN 6u
// PWM: channel 1 of timer 3. Not PB4, which has it too: that pin is pulled up during a reset (NJTRST).
#define DRIVE_PWM GPIOC
#define DRIVE_PWM_PIN 6u
#define DRIVE_PWM_FUNCTION 2u
#define LED GPIOB
#define LED_PIN 12u

// No interrupt sets a pin of a port up: no lock is needed.

static inline void pin_mode(struct gpio *port, uint32_t pin, uint32_t mode)
{
    port->MODER = (port->MODER & ~(3u << 2 * pin)) | mode << 2 * pin;
}

static inline void pin_pull_up(struct gpio *port, uint32_t pin)
{
    port->PUPDR = (port->PUPDR & ~(3u << 2 * pin)) | 1u << 2 * pin;
}

static inline void pin_output(struct gpio *port, uint32_t pin)
{
    pin_mode(port, pin, 1);
}

// Gives the pin to a device; `function` is its number in the data sheet's table.
static inline void pin_alternate(struct gpio *port, uint32_t pin, uint32_t function)
{
    volatile uint32_t *select = &port->AFR[pin / 8];
    *select = (*select & ~(15u << 4 * (pin % 8))) | function << 4 * (pin % 8);
    pin_mode(port, pin, 2);
}

// In one access: no lock is needed.
static inline void pin_set(struct gpio *port, uint32_t pin, bool high)
{
    port->BSRR = BIT(high ? pin : pin + 16);
}

static inline bool pin_is_high(const struct gpio *port, uint32_t pin)
{
    return (port->IDR & BIT(pin)) != 0;
}

#endif
