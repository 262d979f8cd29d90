// SPDX-License-Identifier: Apache-2.0
//
// What outlives a reset: its cause, the boot count; and the stack's low-water mark.
#include <stdbool.h>

#include "board_protocol.h"
#include "hal.h"
#include "parts.h"
#include "registers.h"
#include "stack.h"

// A painted stretch of this length counts as never used: a frame may leave some bytes alone.
#define STACK_WINDOW 64

#define NOINIT __attribute__((section(".noinit")))

// SRAM keeps its contents over a reset; after power-on it is random, which the complement shows.
static uint16_t boots NOINIT;
static uint16_t boots_complement NOINIT;
static uint32_t reset_mark NOINIT; // COMMANDED: the reset that follows was asked for

#define COMMANDED UINT32_C(0x72657365)

static uint8_t cause;

// Every reset but the pin's own pulls the pin as well, and a power-on raises brown-out, too: only the
// first that applies counts.
static uint8_t cause_of(uint32_t flags)
{
    if ((flags & RCC_CSR_PORRSTF) != 0)
        return BOARD_RESET_CAUSE_POWER_ON;
    if ((flags & RCC_CSR_BORRSTF) != 0)
        return BOARD_RESET_CAUSE_BROWN_OUT;
    if ((flags & (RCC_CSR_IWDGRSTF | RCC_CSR_WWDGRSTF)) != 0)
        return BOARD_RESET_CAUSE_WATCHDOG;
    if ((flags & RCC_CSR_SFTRSTF) != 0)
        return BOARD_RESET_CAUSE_JTAG; // a debugger's: our own have their mark
    if ((flags & RCC_CSR_PINRSTF) != 0)
        return BOARD_RESET_CAUSE_EXTERNAL;
    return 0;
}

void reset_init(void)
{
    cause = cause_of(RCC->CSR);
    RCC->CSR |= RCC_CSR_RMVF;
    bool power_lost = cause == BOARD_RESET_CAUSE_POWER_ON || cause == BOARD_RESET_CAUSE_BROWN_OUT;
    if (power_lost || (boots ^ boots_complement) != UINT16_MAX)
        boots = 0;
    boots++;
    boots_complement = (uint16_t)~boots;
    if (!power_lost && reset_mark == COMMANDED)
        cause = BOARD_RESET_CAUSE_COMMAND;
    reset_mark = 0;
}

void hal_reset(void)
{
    serial_flush();
    reset_mark = COMMANDED;
    __asm volatile("dsb" ::: "memory");
    SCB_AIRCR = SCB_AIRCR_VECTKEY | SCB_AIRCR_SYSRESETREQ;
    for (;;)
        ;
}

uint8_t hal_reset_cause(void)
{
    return cause;
}

uint16_t hal_boot_count(void)
{
    return boots;
}

uint16_t hal_stack_low_water(void)
{
    static uint8_t *lowest = &_stack_top;
    uint8_t *byte = lowest;
    // One window a call, because a whole search would take longer than a conversion.
    for (uint8_t i = 0; i < STACK_WINDOW && byte > &_stack_bottom; i++) {
        if (*--byte != STACK_PAINT)
            lowest = byte;
    }
    return (uint16_t)(lowest - &_stack_bottom);
}
