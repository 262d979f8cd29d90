// SPDX-License-Identifier: Apache-2.0
#include "hal_host.h"

#include <assert.h>
#include <string.h>

#include "board_protocol.h"

// How much time the firmware's own actions take in the model.
#define TICKS_A_CLOCK_READING 2
#define TICKS_AN_ADC_BYTE 6
#define TICKS_A_SERIAL_BYTE 4
#define TICKS_AN_EEPROM_BYTE 6800

struct hal_host hal_host;

void hal_init(void)
{
}

static void interrupts(void)
{
    while (!hal_host.locked && hal_host.timer_running && hal_host.timer_next <= hal_host.time) {
        uint64_t scheduled = hal_host.timer_next;
        hal_host.timer_next += hal_host.timer_period;
        hal_host.locked = true;
        hal_host.tick_handler(hal_host.tick_context, scheduled);
        hal_host.locked = false;
    }
}

void hal_host_advance(uint64_t ticks)
{
    uint64_t end = hal_host.time + ticks;
    while (!hal_host.locked && hal_host.timer_running && hal_host.timer_next <= end) {
        if (hal_host.timer_next > hal_host.time)
            hal_host.time = hal_host.timer_next;
        interrupts();
    }
    hal_host.time = end;
}

void hal_host_receive(const uint8_t *bytes, size_t count)
{
    assert(hal_host.to_receive_length + count <= sizeof hal_host.to_receive);
    memcpy(hal_host.to_receive + hal_host.to_receive_length, bytes, count);
    hal_host.to_receive_length += count;
    if (count > 0 && bytes[count - 1] == BOARD_WIRE_DELIMITER)
        hal_host.delimiter_time = hal_host.time;
}

uint64_t hal_time(void)
{
    hal_host_advance(TICKS_A_CLOCK_READING);
    return hal_host.time;
}

uint32_t hal_beat(void)
{
    return (uint32_t)(hal_host.time >> 16);
}

void hal_delay_ms(uint8_t milliseconds)
{
    hal_host_advance((uint64_t)milliseconds * (BOARD_TICK_HZ / 1000));
}

uint8_t hal_lock(void)
{
    uint8_t state = hal_host.locked;
    hal_host.locked = true;
    return state;
}

void hal_unlock(uint8_t state)
{
    hal_host.locked = state;
    interrupts();
}

void hal_sample_timer_start(uint64_t first, uint32_t period, hal_tick_handler *handler,
                            void *context)
{
    hal_host.timer_next = first;
    hal_host.timer_period = period;
    hal_host.tick_handler = handler;
    hal_host.tick_context = context;
    hal_host.timer_running = true;
}

void hal_sample_timer_stop(void)
{
    hal_host.timer_running = false;
}

void hal_adc_exchange(uint8_t *bytes, uint8_t count)
{
    // The device sees the transaction at the end of its command byte.
    hal_host_advance(TICKS_AN_ADC_BYTE);
    hal_host.adc.exchange(hal_host.adc.device, bytes, count);
    hal_host_advance((uint64_t)(count - 1u) * TICKS_AN_ADC_BYTE);
}

bool hal_adc_ready(void)
{
    return hal_host.adc.ready(hal_host.adc.device);
}

void hal_adc_hold(void)
{
    hal_host.sync_high = false;
    hal_host.adc.sync(hal_host.adc.device, false);
}

void hal_adc_restart(void)
{
    hal_host.adc.sync(hal_host.adc.device, false);
    hal_host.sync_high = true;
    hal_host.adc.sync(hal_host.adc.device, true);
}

void hal_drive_on(uint16_t duty)
{
    assert(duty <= 10000);
    hal_host.drive_enabled = true;
    hal_host.drive_duty = duty;
}

void hal_drive_off(void)
{
    hal_host.drive_enabled = false;
    hal_host.drive_duty = 0;
}

bool hal_emergency_stop_closed(void)
{
    return !hal_host.emergency_stop_open;
}

void hal_encoders_read(struct hal_encoders *encoders)
{
    *encoders = hal_host.encoders;
}

bool hal_serial_read(uint8_t *byte)
{
    if (hal_host.received_length == hal_host.to_receive_length) {
        hal_host.received_length = hal_host.to_receive_length = 0;
        return false;
    }
    *byte = hal_host.to_receive[hal_host.received_length++];
    hal_host_advance(TICKS_A_SERIAL_BYTE);
    return true;
}

uint64_t hal_serial_delimiter_time(void)
{
    return hal_host.delimiter_time;
}

uint32_t hal_serial_rx_overflows(void)
{
    return hal_host.rx_overflows;
}

uint8_t hal_serial_tx_space(void)
{
    return hal_host.tx_space;
}

void hal_serial_write(const uint8_t *bytes, uint8_t count)
{
    assert(count <= hal_host.tx_space);
    assert(hal_host.sent_length + count <= sizeof hal_host.sent);
    memcpy(hal_host.sent + hal_host.sent_length, bytes, count);
    hal_host.sent_length += count;
    hal_host_advance((uint64_t)count * TICKS_A_SERIAL_BYTE);
}

void hal_eeprom_read(uint16_t address, uint8_t *bytes, uint8_t count)
{
    assert(address + count <= HAL_HOST_EEPROM_SIZE);
    memcpy(bytes, hal_host.eeprom + address, count);
}

void hal_eeprom_write(uint16_t address, const uint8_t *bytes, uint8_t count)
{
    assert(address + count <= HAL_HOST_EEPROM_SIZE);
    for (uint8_t i = 0; i < count; i++) {
        if (hal_host.eeprom[address + i] == bytes[i])
            continue;
        if (hal_host.eeprom_bytes_left == 0) {
            // The byte that the power left in is of no value.
            hal_host.eeprom[address + i] = 0x5A;
            return;
        }
        hal_host.eeprom_bytes_left--;
        hal_host.eeprom[address + i] = bytes[i];
        hal_host_advance(TICKS_AN_EEPROM_BYTE);
    }
}

void hal_accelerometer_self_test(bool on)
{
    hal_host.accelerometer_self_test = on;
}

void hal_reset(void)
{
    hal_host.resets++; // what follows a reset is the test's
}

void hal_watchdog_kick(void)
{
    hal_host.watchdog_kicks++;
}

void hal_led_toggle(void)
{
    hal_host.led_toggles++;
}

uint8_t hal_reset_cause(void)
{
    return hal_host.reset_cause;
}

uint16_t hal_boot_count(void)
{
    return hal_host.boot_count;
}

uint16_t hal_stack_low_water(void)
{
    return hal_host.stack_low_water;
}
