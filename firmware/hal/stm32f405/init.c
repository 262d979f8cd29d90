// SPDX-License-Identifier: Apache-2.0
#include "board_protocol.h"
#include "hal.h"
#include "parts.h"
#include "pins.h"

void hal_init(void)
{
    clock_init();
    reset_init();
    timer_init();
    pin_output(LED, LED_PIN);
    watchdog_init();
    storage_init(); // may erase flash, which holds the processor up: before anything counts
    serial_init();
    adc_bus_init();
    encoders_init();
    accelerometer_init();
    motor_drive_init();
    __asm volatile("cpsie i" ::: "memory");
}

void hal_led_toggle(void)
{
    pin_set(LED, LED_PIN, (LED->ODR & BIT(LED_PIN)) == 0);
}

uint8_t hal_lock(void)
{
    uint32_t state;
    __asm volatile("mrs %0, primask\n\tcpsid i" : "=r"(state)::"memory");
    return (uint8_t)state;
}

void hal_unlock(uint8_t state)
{
    __asm volatile("msr primask, %0" ::"r"((uint32_t)state) : "memory");
}
