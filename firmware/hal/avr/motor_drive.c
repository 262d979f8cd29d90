// SPDX-License-Identifier: Apache-2.0
//
// Timer 4 makes the PWM on OC4A, phase correct with its top in ICR4. No interrupt shares port H.
#include <avr/io.h>

#include "board_protocol.h"
#include "hal.h"
#include "parts.h"
#include "pins.h"

// Up and down once a period, without prescaler.
#define TOP (F_CPU / BOARD_DRIVE_PWM_HZ / 2)
#define FULL_DUTY 10000u
_Static_assert(TOP <= UINT16_MAX, "choose a faster PWM");
_Static_assert(FULL_DUTY % TOP == 0, "a duty is a whole number of steps");

void motor_drive_init(void)
{
    DRIVE_PORT = (uint8_t)((DRIVE_PORT & ~(_BV(DRIVE_PWM) | _BV(DRIVE_ENABLE))) |
                           _BV(DRIVE_EMERGENCY_STOP)); // pull-up
    DRIVE_DDR |= _BV(DRIVE_PWM) | _BV(DRIVE_ENABLE);
}

void hal_drive_on(uint16_t duty)
{
    TCCR4A = _BV(COM4A1) | _BV(WGM41);
    TCCR4B = _BV(WGM43) | _BV(CS40);
    ICR4 = TOP; // which no other mode can write
    OCR4A = duty / (FULL_DUTY / TOP); // taken over at the top: no short pulse
    DRIVE_PORT |= _BV(DRIVE_ENABLE);
}

void hal_drive_off(void)
{
    DRIVE_PORT &= (uint8_t)~_BV(DRIVE_ENABLE);
    TCCR4A = 0; // the pin is the port's again, low
    TCCR4B = 0;
    OCR4A = 0;
    TCNT4 = 0;
}

bool hal_emergency_stop_closed(void)
{
    return (DRIVE_PIN & _BV(DRIVE_EMERGENCY_STOP)) == 0;
}
