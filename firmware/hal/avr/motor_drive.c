// SPDX-License-Identifier: Apache-2.0
//
// Timer 4 makes the PWM on OC4A, counting up to its top in ICR4. Once a period its interrupt looks at
// the emergency-stop loop, whatever holds the main loop up, and whether the main loop still leads the motor.
#include <avr/interrupt.h>
#include <avr/io.h>

#include "board_protocol.h"
#include "hal.h"
#include "parts.h"
#include "pins.h"

// Of the clock, without prescaler.
#define PERIOD (F_CPU / BOARD_DRIVE_PWM_HZ)
#define FULL_DUTY 10000u
_Static_assert(PERIOD <= UINT16_MAX, "choose a faster PWM");

// The loop was open, however shortly, while the motor had power.
static volatile bool opened;
// For which the motor keeps its power without a word of the main loop.
static volatile uint16_t periods_left;

static bool loop_closed(void)
{
    return (DRIVE_PIN & _BV(DRIVE_EMERGENCY_STOP)) == 0;
}

void motor_drive_cut(void)
{
    DRIVE_PORT &= (uint8_t)~(_BV(DRIVE_PWM) | _BV(DRIVE_ENABLE));
    TCCR4A = 0; // the PWM's pin is the port's
}

void motor_drive_init(void)
{
    motor_drive_cut();
    DRIVE_PORT |= _BV(DRIVE_EMERGENCY_STOP); // pull-up
    DRIVE_DDR |= _BV(DRIVE_PWM) | _BV(DRIVE_ENABLE);
}

void hal_drive_on(uint16_t duty)
{
    uint16_t high = (uint16_t)((uint32_t)duty * PERIOD / FULL_DUTY);
    ICR4 = PERIOD - 1; // as the top it is no input capture's, which would be the ADC's SYNC pin's
    TCCR4B = _BV(WGM43) | _BV(WGM42) | _BV(CS40);
    // Taken over at the period's end: no short pulse. One of no length is the port's low.
    OCR4A = high > 0 ? high - 1 : 0;
    TCCR4A = high > 0 ? _BV(COM4A1) | _BV(WGM41) : _BV(WGM41);
    TIMSK4 = _BV(TOIE4);
    uint8_t state = hal_lock();
    periods_left = BOARD_DRIVE_ALIVE_PERIODS;
    if (!opened)
        DRIVE_PORT |= _BV(DRIVE_ENABLE);
    hal_unlock(state);
}

ISR(TIMER4_OVF_vect)
{
    if (!loop_closed())
        opened = true;
    uint16_t left = periods_left;
    if (left > 0)
        periods_left = left - 1;
    if (opened || left == 0)
        DRIVE_PORT &= (uint8_t)~_BV(DRIVE_ENABLE);
}

void hal_drive_off(void)
{
    TIMSK4 = 0;
    DRIVE_PORT &= (uint8_t)~_BV(DRIVE_ENABLE);
    opened = false;
    TCCR4A = 0; // the pin is the port's again, low
    TCCR4B = 0;
    OCR4A = 0;
    TCNT4 = 0;
}

bool hal_emergency_stop_closed(void)
{
    return loop_closed() && !opened;
}
