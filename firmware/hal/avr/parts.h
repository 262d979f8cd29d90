// SPDX-License-Identifier: Apache-2.0
//
// How hal_init brings the parts of this implementation up.
#ifndef PARTS_H
#define PARTS_H

void timer_init(void);
void serial_init(void);
void serial_flush(void); // waits until the UART has all but the last bytes
void adc_bus_init(void);
void encoders_init(void);
void accelerometer_init(void);
void motor_drive_init(void);
void motor_drive_cut(void); // takes the motor's power, at any moment
void reset_init(void);

#endif
