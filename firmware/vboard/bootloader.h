// SPDX-License-Identifier: GPL-3.0-or-later
//
// The bootloader of an Arduino Mega 2560, as host and firmware see it: what it does when, no instruction of
// it. Every reset starts it (fuse BOOTRST), and the firmware comes after it:
//
//     start-up   65 ms       by the fuses; the UART is off, and what the host sends is lost
//     window     850 ms      listening at 115200 baud. Without a byte, the firmware starts
//     hold       9.0 s       from the last byte, once there was one in the window: it waits for a programmer
//                            and takes everything for an attempt. Then the firmware starts
//
// Times are those of stk500v2 in ArduinoCore-avr 1.8, at 16 MHz. It clears MCUSR and stops the watchdog; the
// firmware is told no cause. The one shipped until 2012 does neither: a reset by the watchdog leaves that on,
// at its shortest period, and it strikes again and again in the bootloader; only the power ends it.
#ifndef VBOARD_BOOTLOADER_H
#define VBOARD_BOOTLOADER_H

#include <stdbool.h>

typedef struct bootloader {
    double listens_ns;  // from here on a byte holds it
    double ends_ns;     // the firmware starts, unless a byte comes
} bootloader;

void bootloader_start(bootloader *self, double now_ns);

// A byte from the host.
void bootloader_hear(bootloader *self, double now_ns);

#endif
