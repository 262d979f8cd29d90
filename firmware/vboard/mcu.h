// SPDX-License-Identifier: GPL-3.0-or-later
//
// The ATmega2560: libsimavr 1.6 with what it lacks or gets wrong put right from outside (see README.md).
#ifndef VBOARD_MCU_H
#define VBOARD_MCU_H

#include <simavr/avr_eeprom.h>
#include <simavr/avr_extint.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_timer.h>
#include <simavr/avr_watchdog.h>
#include <simavr/sim_avr.h>
#include <stdbool.h>
#include <stddef.h>

#include "random.h"

typedef struct mcu {
    avr_t *avr;
    avr_extint_t *external_interrupts;
    avr_watchdog_t *watchdog;
    avr_run_t run;  // of the core; simavr's watchdog puts its own in its place to reset it
    avr_timer_t *pwm_timer;  // timer 4
    avr_timer_t *idle_timer; // timer 3
    avr_eeprom_t *eeprom;
    uint8_t *own_eeprom;  // simavr's, while a file stands in its place
    avr_io_write_t write_eecr;  // simavr's handler of EECR
    void *write_eecr_param;
    char *elf_path;
    avr_io_t reset_hook;
    uint8_t reset_flags;  // MCUSR, which on the chip outlives a reset
    bool held;            // the core stands and time passes; a reset ends that unless on_reset says so
    random_source ram_noise;
    uint64_t resets;  // the first power-on included
    void (*on_reset)(void *context);  // arms again what a reset has wiped
    void *context;
} mcu;

// Creates the microcontroller with a firmware, powered on, and an EEPROM that is a file (NULL: a blank one).
// False with one line in `error`.
bool mcu_open(mcu *self, const char *elf_path, const char *eeprom_path, uint64_t seed, void (*on_reset)(void *),
              void *context, char *error, size_t error_size);
void mcu_close(mcu *self);

// Runs to a cycle, overrunning by less than one instruction. False if the core has stopped for good.
bool mcu_run_until(mcu *self, uint64_t cycle);

// Sets bytes of a variable in RAM. False if there is none of that name, more than one, or a shorter one.
bool mcu_preset(mcu *self, const char *variable, size_t offset, const uint8_t *bytes, size_t count);

// Puts the program counter into one of the firmware's endless loops; false if it has none.
bool mcu_hang(mcu *self, bool interrupts_go_on);
// Lets an interrupt of timer 3 come, which no firmware here enables.
void mcu_stray_interrupt(mcu *self);

// Resets for one of BOARD_RESET_CAUSE_….
void mcu_reset(mcu *self, uint8_t cause);

// What a bootloader does before it starts the firmware.
void mcu_clear_reset_flags(mcu *self);
void mcu_stop_watchdog(mcu *self);

// The simavr module of a kind ("spi", "port", …) and, for ports and UARTs, a name.
avr_io_t *mcu_module(const mcu *self, const char *kind);
avr_ioport_t *mcu_port(const mcu *self, char name);

// An input pin held at a level from outside.
typedef struct mcu_pin {
    avr_ioport_t *port;
    uint8_t bit;
} mcu_pin;

mcu_pin mcu_input_pin(const mcu *self, char port, uint8_t bit);
void mcu_drive(mcu_pin pin, bool level);
// After a reset, which has wiped the pin registers but not the level outside.
void mcu_drive_again(mcu_pin pin);

// Whether the firmware drives a pin high.
bool mcu_output(const mcu *self, char port, uint8_t bit);

// The share of time that the firmware has a pin high: by timer 4's compare unit A while that has the
// pin, in a mode with its top in ICR4, else by the port.
double mcu_pwm_duty(const mcu *self, char port, uint8_t bit);

// Calls when the firmware changes an output pin. The pin is pulled up while it is an input.
void mcu_watch_pin(const mcu *self, char port, uint8_t bit, avr_irq_notify_t changed, void *context);

#endif
