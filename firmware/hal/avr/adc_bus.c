// SPDX-License-Identifier: Apache-2.0
//
// The ADC's wires: SPI in mode 3, DOUT/RDY̅ and SYNC. RDY̅ is polled, not taken as an interrupt: a
// result waits as long as the next conversion lasts, and DOUT toggles with every bit that is read.
#include <avr/io.h>
#include <util/delay.h>

#include "board_protocol.h"
#include "hal.h"
#include "parts.h"
#include "pins.h"

_Static_assert(F_CPU / 4 == BOARD_ADC_SPI_CLOCK_HZ, "choose other SPR bits");

// SYNC must be low for at least four periods of the ADC's master clock (6.5 µs) to be seen.
#define SYNC_PULSE_US 8

void adc_bus_init(void)
{
    SYNC_DDR |= _BV(SYNC); // low: the ADC is held
    SPI_PORT |= _BV(SPI_CS) | _BV(SPI_SCLK) | _BV(SPI_MISO); // MISO with pull-up
    SPI_DDR |= _BV(SPI_CS) | _BV(SPI_SCLK) | _BV(SPI_MOSI);
    SPCR = _BV(SPE) | _BV(MSTR) | _BV(CPOL) | _BV(CPHA);
    SPI_PORT &= (uint8_t)~_BV(SPI_CS);
}

void hal_adc_exchange(uint8_t *bytes, uint8_t count)
{
    for (uint8_t i = 0; i < count; i++) {
        SPDR = bytes[i];
        while ((SPSR & _BV(SPIF)) == 0)
            ;
        bytes[i] = SPDR;
    }
    // Ends the transaction, whatever state line noise left it in. Then low: DOUT shows RDY̅.
    SPI_PORT |= _BV(SPI_CS);
    SPI_PORT &= (uint8_t)~_BV(SPI_CS);
}

bool hal_adc_ready(void)
{
    return (READY_PIN & _BV(READY)) == 0;
}

void hal_adc_hold(void)
{
    SYNC_PORT &= (uint8_t)~_BV(SYNC);
}

void hal_adc_restart(void)
{
    if ((SYNC_PORT & _BV(SYNC)) != 0) {
        SYNC_PORT &= (uint8_t)~_BV(SYNC);
        _delay_us(SYNC_PULSE_US);
    }
    SYNC_PORT |= _BV(SYNC);
}
