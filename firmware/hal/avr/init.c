// SPDX-License-Identifier: Apache-2.0
#include <avr/interrupt.h>
#include <avr/wdt.h>
#include <util/delay.h>

#include "hal.h"
#include "parts.h"
#include "pins.h"

_Static_assert(F_CPU == BOARD_CLOCK_HZ, "F_CPU differs from board.yaml");
_Static_assert(BOARD_WATCHDOG_MS == 500, "choose another WDTO_ constant");

void hal_init(void)
{
    wdt_enable(WDTO_500MS);
    LED_DDR |= _BV(LED);
    reset_init();
    timer_init();
    serial_init();
    adc_bus_init();
    encoders_init();
    accelerometer_init();
    motor_drive_init();
    sei();
}

void hal_watchdog_kick(void)
{
    wdt_reset();
}

void hal_led_toggle(void)
{
    LED_PIN = _BV(LED); // writing a one to PINx toggles the output
}

void hal_delay_ms(uint8_t milliseconds)
{
    while (milliseconds-- > 0)
        _delay_ms(1);
}

uint8_t hal_lock(void)
{
    uint8_t state = SREG;
    cli();
    return state;
}

void hal_unlock(uint8_t state)
{
    SREG = state;
}
