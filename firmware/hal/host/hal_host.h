// SPDX-License-Identifier: Apache-2.0
//
// The hardware of hal.h as a model for tests. Its time moves when the firmware looks at the clock or
// moves bytes, or when the test says so; interrupts come at their times unless locked out.
#ifndef HAL_HOST_H
#define HAL_HOST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal.h"

// What hangs on the ADC's wires.
struct hal_host_adc {
    void *device;
    void (*exchange)(void *device, uint8_t *bytes, uint8_t count);
    bool (*ready)(void *device);
    void (*sync)(void *device, bool high);
};

#define HAL_HOST_SENT_MAXIMUM 65536u
#define HAL_HOST_EEPROM_SIZE 256u

struct hal_host {
    uint64_t time;
    struct hal_host_adc adc;
    struct hal_encoders encoders;
    uint8_t reset_cause;
    uint16_t boot_count;
    uint16_t stack_low_water;
    uint8_t eeprom[HAL_HOST_EEPROM_SIZE];
    uint32_t eeprom_bytes_left; // bytes that can still be written; then the power is gone

    // Serial line: what the test sends, what the firmware sent, and the room it is told to have.
    uint8_t to_receive[1024];
    size_t to_receive_length, received_length;
    uint64_t delimiter_time;
    uint32_t rx_overflows;
    uint8_t sent[HAL_HOST_SENT_MAXIMUM];
    size_t sent_length;
    uint8_t tx_space;

    bool timer_running;
    uint64_t timer_next;
    uint32_t timer_period;
    hal_tick_handler *tick_handler;
    void *tick_context;

    bool locked;
    bool sync_high;
    bool accelerometer_self_test;
    bool drive_enabled;
    uint16_t drive_duty;
    bool emergency_stop_open;
    uint32_t resets;
    uint32_t watchdog_kicks;
    uint32_t led_toggles;
};

extern struct hal_host hal_host; // hal.h's functions take no handle, so there is one

// Lets time pass; the sample timer fires on its way.
void hal_host_advance(uint64_t ticks);

// Lets the firmware's serial line receive these bytes.
void hal_host_receive(const uint8_t *bytes, size_t count);

#endif
