// SPDX-License-Identifier: Apache-2.0
//
// How hal_init brings the parts of this implementation up, and what they lend each other.
#ifndef PARTS_H
#define PARTS_H

#include <stdint.h>

void clock_init(void);
void watchdog_init(void);
void timer_init(void);
void serial_init(void);
void serial_flush(void); // waits until the UART has sent all
void adc_bus_init(void);
void encoders_init(void);
void accelerometer_init(void);
void motor_drive_init(void);
void motor_drive_cut(void); // takes the motor's power, at any moment
void reset_init(void);
void storage_init(void);

// Waits for this many ticks and at most one more.
void timer_wait(uint32_t ticks);

// How long the watchdog waits for the next kick from now on, at least; up to 1.3 s.
void watchdog_grant(uint32_t milliseconds);

#endif
