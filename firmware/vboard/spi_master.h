// SPDX-License-Identifier: GPL-3.0-or-later
//
// The ATmega2560's SPI as master with the time that a byte really takes: 8 bits at the clock that SPCR and SPSR
// set. (libsimavr takes 100 µs for any byte.)
#ifndef VBOARD_SPI_MASTER_H
#define VBOARD_SPI_MASTER_H

#include <simavr/avr_spi.h>
#include <stdint.h>

#include "mcu.h"

typedef struct spi_master {
    avr_spi_t *spi;
    uint8_t mosi;
    bool busy;
    uint64_t misuse;  // bytes that an AD7124 would not have understood
    // What hangs on the bus: takes a byte at the end of its eighth clock, returns what it sent.
    uint8_t (*exchange)(void *device, uint8_t mosi);
    void *device;
} spi_master;

void spi_master_open(spi_master *self, const mcu *mcu, uint8_t (*exchange)(void *, uint8_t), void *device);
// The microcontroller was reset: a byte under way is lost.
void spi_master_reset(spi_master *self);

#endif
