// SPDX-License-Identifier: Apache-2.0
//
// What outlives a reset or has to be done before C starts: reset cause, boot count, stack painting.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>

#include "board_protocol.h"
#include "hal.h"
#include "parts.h"

_Static_assert(BOARD_RESET_CAUSE_POWER_ON == _BV(PORF) &&
                   BOARD_RESET_CAUSE_EXTERNAL == _BV(EXTRF) &&
                   BOARD_RESET_CAUSE_BROWN_OUT == _BV(BORF) &&
                   BOARD_RESET_CAUSE_WATCHDOG == _BV(WDRF) && BOARD_RESET_CAUSE_JTAG == _BV(JTRF),
               "reset_cause in board.yaml is not MCUSR");

#define STACK_PAINT 0xA5
// A painted stretch of this length counts as never used: a frame may leave some bytes alone.
#define STACK_WINDOW 64

#define NOINIT __attribute__((section(".noinit")))

static uint8_t mcusr NOINIT;
// SRAM keeps its contents over a reset; after power-on it is random, which the complement shows.
static uint16_t boots NOINIT;
static uint16_t boots_complement NOINIT;
static uint32_t reset_mark NOINIT; // COMMANDED: the reset that follows was asked for

#define COMMANDED UINT32_C(0x72657365)

extern uint8_t _end; // NOLINT: the linker's name of the first byte behind the variables

// Runs before variables are initialised. A program that has lost its way may come here without a reset,
// the pins as they were: the motor's first. The watchdog stays on over its own reset, with its shortest
// period, until WDRF is cleared.
__attribute__((naked, used, section(".init3"))) static void early(void)
{
    motor_drive_cut();
    mcusr = MCUSR;
    MCUSR = 0;
    wdt_disable();
    for (uint8_t *byte = &_end; byte <= (uint8_t *)RAMEND; byte++)
        *byte = STACK_PAINT;
}

void reset_init(void)
{
    if ((mcusr & (_BV(PORF) | _BV(BORF))) != 0 || (uint16_t)~boots != boots_complement)
        boots = 0;
    boots++;
    bool power_lost = (mcusr & (_BV(PORF) | _BV(BORF))) != 0;
    if (!power_lost && reset_mark == COMMANDED)
        mcusr = BOARD_RESET_CAUSE_COMMAND; // not `watchdog`, by whose help it came
    reset_mark = 0;
    boots_complement = (uint16_t)~boots;
}

void hal_reset(void)
{
    serial_flush();
    reset_mark = COMMANDED;
    for (;;) // until the watchdog bites
        ;
}

// An interrupt that nobody enabled. Without this one avr-libc would start the program anew in the middle
// of what it does; a reset starts the board.
ISR(BADISR_vect)
{
    motor_drive_cut();
    wdt_enable(WDTO_15MS);
    for (;;)
        ;
}

uint8_t hal_reset_cause(void)
{
    return mcusr;
}

uint16_t hal_boot_count(void)
{
    return boots;
}

uint16_t hal_stack_low_water(void)
{
    static uint8_t *lowest = (uint8_t *)RAMEND + 1;
    uint8_t *byte = lowest;
    // One window a call, because a whole search would take longer than a conversion.
    for (uint8_t i = 0; i < STACK_WINDOW && byte > &_end; i++) {
        if (*--byte != STACK_PAINT)
            lowest = byte;
    }
    return (uint16_t)(lowest - &_end);
}
