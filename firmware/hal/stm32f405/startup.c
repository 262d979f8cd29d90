// SPDX-License-Identifier: Apache-2.0
//
// From reset to main: vectors, stack painting, variables.
#include <stdint.h>
#include <string.h>

#include "parts.h"
#include "registers.h"
#include "stack.h"

int main(void);

// The linker script's.
extern uint8_t _data_start, _data_end, _bss_start, _bss_end; // NOLINT
extern const uint8_t _data_image;                            // NOLINT

void reset_handler(void);
void systick_handler(void);
void crank_edge_handler(void);
void carriage_edge_handler(void);
void tim3_handler(void);
void usart1_handler(void);
void tim5_handler(void);

// What follows a fault: the motor has no power, and the watchdog starts the board anew.
__attribute__((used, noreturn)) static void end(void)
{
    motor_drive_cut();
    for (;;)
        ;
}

// Faults and interrupts that nobody enabled. No other interrupt comes through a fault, the one that looks at
// the emergency stop neither. The stack may be what failed: it begins anew.
__attribute__((naked)) static void unexpected_handler(void)
{
    __asm volatile("cpsid i\n\t"
                   "ldr r0, =_stack_top\n\t"
                   "mov sp, r0\n\t"
                   "b end");
}

typedef void vector(void);

struct vectors {
    uint8_t *stack_top;
    vector *reset, *nmi, *hard_fault, *memory_fault, *bus_fault, *usage_fault;
    vector *reserved_1[4], *svcall, *debug, *reserved_2, *pendsv, *systick;
    vector *interrupts[IRQ_COUNT];
};

__attribute__((used, section(".vectors"))) static const struct vectors vectors = {
    .stack_top = &_stack_top,
    .reset = reset_handler,
    .nmi = unexpected_handler,
    .hard_fault = unexpected_handler,
    .memory_fault = unexpected_handler,
    .bus_fault = unexpected_handler,
    .usage_fault = unexpected_handler,
    .svcall = unexpected_handler,
    .debug = unexpected_handler,
    .pendsv = unexpected_handler,
    .systick = systick_handler,
    .interrupts =
        {
            [0 ... IRQ_EXTI0 - 1] = unexpected_handler,
            [IRQ_EXTI0] = crank_edge_handler,
            [IRQ_EXTI1] = crank_edge_handler,
            [IRQ_EXTI2] = carriage_edge_handler,
            [IRQ_EXTI3] = carriage_edge_handler,
            [IRQ_EXTI3 + 1 ... IRQ_TIM3 - 1] = unexpected_handler,
            [IRQ_TIM3] = tim3_handler,
            [IRQ_TIM3 + 1 ... IRQ_USART1 - 1] = unexpected_handler,
            [IRQ_USART1] = usart1_handler,
            [IRQ_USART1 + 1 ... IRQ_TIM5 - 1] = unexpected_handler,
            [IRQ_TIM5] = tim5_handler,
            [IRQ_TIM5 + 1 ... IRQ_COUNT - 1] = unexpected_handler,
        },
};

void reset_handler(void)
{
    uint8_t *stack;
    __asm volatile("mov %0, sp" : "=r"(stack));
    for (volatile uint8_t *byte = &_stack_bottom; byte < stack; byte++)
        *byte = STACK_PAINT;
    memcpy(&_data_start, &_data_image, (size_t)(&_data_end - &_data_start));
    memset(&_bss_start, 0, (size_t)(&_bss_end - &_bss_start));
    main();
}
