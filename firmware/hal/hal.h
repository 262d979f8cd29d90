// SPDX-License-Identifier: Apache-2.0
//
// What the firmware asks of its microcontroller. core/ reaches the hardware through these functions
// only; hal/avr/ and hal/stm32f405/ implement them with registers, hal/host/ with a model for tests.
//
// Every function is called from the main loop unless it says otherwise.
#ifndef HAL_H
#define HAL_H

#include <stdbool.h>
#include <stdint.h>

// Brings pins, timers, UART, SPI and watchdog up and enables interrupts. Called once.
void hal_init(void);

// ---- time: a free-running counter of BOARD_TICK_HZ since reset

uint64_t hal_time(void);
void hal_delay_ms(uint8_t milliseconds);
// Changes at least every 0.1 s, and only by an interrupt: it stands still when interrupts do.
uint32_t hal_beat(void);

// Keeps interrupts out of a few instructions; hand the returned state back to hal_unlock.
uint8_t hal_lock(void);
void hal_unlock(uint8_t state);

// ---- sample timer

// Called in interrupt context at each sample instant, given the instant that the compare unit was
// set to.
typedef void hal_tick_handler(void *context, uint64_t scheduled);

// Fires the handler at `first` and every `period` ticks after it. `first` lies at least 1 ms ahead.
void hal_sample_timer_start(uint64_t first, uint32_t period, hal_tick_handler *handler,
                            void *context);
void hal_sample_timer_stop(void);

// ---- ADC: SPI bus, DOUT/RDY and SYNC

// One transaction: sends `bytes` and puts what came back in their place.
void hal_adc_exchange(uint8_t *bytes, uint8_t count);
// Whether DOUT/RDY shows a finished conversion. Only valid between transactions.
bool hal_adc_ready(void);
// Holds the ADC's filter and sequencer in reset. Called locked while the sample timer runs.
void hal_adc_hold(void);
// Restarts the sequence at this instant, held or not. Called in interrupt context or locked.
void hal_adc_restart(void);

// ---- accelerometer: its self-test pin, low until told otherwise

void hal_accelerometer_self_test(bool on);

// ---- encoders

struct hal_encoders {
    int32_t crank;
    int32_t carriage;
    uint32_t illegal_steps; // of both together
    uint8_t crank_edges;    // of either direction: one dead track lets the count go to and fro
};

// Called in interrupt context or locked.
void hal_encoders_read(struct hal_encoders *encoders);

// ---- the crank's drive: PWM and enable line of its driver, off until told otherwise

// From on to off an interrupt looks at the emergency-stop loop: within a period of the PWM it takes the
// enable line away, until hal_drive_off. So it does, until the next hal_drive_on, when that has not come for
// BOARD_DRIVE_ALIVE_PERIODS of the PWM: the main loop is stuck.
void hal_drive_on(uint16_t duty); // 0.01 %, at most 10000
void hal_drive_off(void);
// Whether the emergency-stop loop is closed, and has been since hal_drive_off; a broken wire reads as
// open.
bool hal_emergency_stop_closed(void);

// ---- serial line to the host

bool hal_serial_read(uint8_t *byte);
// Instant at which the frame delimiter that was received last was complete.
uint64_t hal_serial_delimiter_time(void);
uint32_t hal_serial_rx_overflows(void);
uint8_t hal_serial_tx_space(void);
// `count` is at most hal_serial_tx_space().
void hal_serial_write(const uint8_t *bytes, uint8_t count);

// ---- checksums, in whatever way is fast on the machine

uint16_t hal_crc16_ccitt(uint16_t crc, const uint8_t *bytes, uint8_t count); // polynomial 0x1021
uint8_t hal_crc8_ccitt(uint8_t crc, const uint8_t *bytes, uint8_t count);    // polynomial 0x07

// ---- EEPROM: bytes that outlive power, 0xFF where never written

void hal_eeprom_read(uint16_t address, uint8_t *bytes, uint8_t count);
// Takes 3.4 ms for each byte that differs.
void hal_eeprom_write(uint16_t address, const uint8_t *bytes, uint8_t count);

// ---- the board itself

void hal_watchdog_kick(void);
// Lets what was written to the serial line go out, then starts anew with reset cause `command`.
void hal_reset(void);
void hal_led_toggle(void);
uint8_t hal_reset_cause(void);       // BOARD_RESET_CAUSE_… bits
uint16_t hal_boot_count(void);       // resets since power-on, this one included
uint16_t hal_stack_low_water(void);  // bytes of stack never used; settles over the first calls

#endif
