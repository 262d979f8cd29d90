// SPDX-License-Identifier: GPL-3.0-or-later
#include "spi_master.h"

#include <string.h>

enum {
    SPCR_DORD = 1 << 5,
    SPCR_MODE_MASK = 3 << 2,
    SPCR_MODE_3 = 3 << 2,
    SPSR_WCOL = 1 << 6,
};

static const uint32_t DEVICE_MAXIMUM_HZ = 5000000;

static unsigned clock_divider(const avr_t *avr, const avr_spi_t *spi)
{
    static const unsigned dividers[] = {4, 16, 64, 128};
    unsigned divider = dividers[avr->data[spi->r_spcr] & 3];
    bool doubled = avr->data[spi->r_spsr] & 1;
    return doubled ? divider / 2 : divider;
}

static bool device_understands(const avr_t *avr, const avr_spi_t *spi)
{
    uint8_t control = avr->data[spi->r_spcr];
    return (control & SPCR_MODE_MASK) == SPCR_MODE_3 && !(control & SPCR_DORD) &&
           avr->frequency <= DEVICE_MAXIMUM_HZ * clock_divider(avr, spi);
}

static avr_cycle_count_t byte_done(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)when;
    spi_master *self = param;
    self->busy = false;
    uint8_t miso = 0xFF;
    if (device_understands(avr, self->spi))
        miso = self->exchange(self->device, self->mosi);
    else
        self->misuse++;
    self->spi->input_data_register = miso;
    avr_raise_interrupt(avr, &self->spi->spi);
    return 0;
}

static void write_data(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param)
{
    (void)address;
    spi_master *self = param;
    avr_spi_t *spi = self->spi;
    if (self->busy) {
        avr->data[spi->r_spsr] |= SPSR_WCOL;
        return;
    }
    avr->data[spi->r_spsr] &= (uint8_t)~SPSR_WCOL;
    avr_regbit_clear(avr, spi->spi.raised);
    if (!avr_regbit_get(avr, spi->spe) || !avr_regbit_get(avr, spi->mstr))
        return;
    self->mosi = value;
    self->busy = true;
    avr_cycle_timer_register(avr, (avr_cycle_count_t)8 * clock_divider(avr, spi), byte_done, self);
}

void spi_master_open(spi_master *self, const mcu *mcu, uint8_t (*exchange)(void *, uint8_t), void *device)
{
    *self = (spi_master){
        .spi = (avr_spi_t *)mcu_module(mcu, "spi"),
        .exchange = exchange,
        .device = device,
    };
    // Set directly: avr_register_io_write would keep simavr's handler, with its 100 µs, beside this one.
    avr_t *avr = mcu->avr;
    avr_io_addr_t data = AVR_DATA_TO_IO(self->spi->r_spdr);
    avr->io[data].w.c = write_data;
    avr->io[data].w.param = self;
}

void spi_master_reset(spi_master *self)
{
    self->busy = false;
}
