// SPDX-License-Identifier: Apache-2.0
//
// The clock tree: 128 MHz, chosen because all that the board needs divides it without a rest (SPI at
// 4 MHz, the tick of 2 MHz, 250 kbaud).
#ifndef CLOCK_H
#define CLOCK_H

#define CORE_HZ 128000000u
#define APB1_HZ (CORE_HZ / 4)      // at most 42 MHz
#define APB1_TIMER_HZ (APB1_HZ * 2) // timers run twice as fast as a divided bus
#define APB2_HZ (CORE_HZ / 2)      // at most 84 MHz

#endif
