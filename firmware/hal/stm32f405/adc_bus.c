// SPDX-License-Identifier: Apache-2.0
//
// The ADC's wires: SPI in mode 3, DOUT/RDY̅ and SYNC, at the ADC's own 3.3 V.
#include "board_protocol.h"
#include "clock.h"
#include "hal.h"
#include "parts.h"
#include "pins.h"

_Static_assert(APB2_HZ / 16 == BOARD_ADC_SPI_CLOCK_HZ, "choose other BR bits");

// SYNC must be low for at least four periods of the ADC's master clock (6.5 µs) to be seen.
#define SYNC_PULSE_TICKS (BOARD_TICK_HZ / 125000)
#define CS_PULSE_TICKS 1u

void adc_bus_init(void)
{
    pin_output(SYNC, SYNC_PIN); // low: the ADC is held
    pin_output(ADC, ADC_CS);
    pin_set(ADC, ADC_CS, true);
    pin_pull_up(ADC, ADC_DOUT);
    SPI1->CR1 = SPI_CR1_MSTR | SPI_CR1_CPOL | SPI_CR1_CPHA | SPI_CR1_BR_BY_16 | SPI_CR1_SSM |
                SPI_CR1_SSI | SPI_CR1_SPE;
    pin_alternate(ADC, ADC_SCLK, ADC_FUNCTION);
    pin_alternate(ADC, ADC_DOUT, ADC_FUNCTION);
    pin_alternate(ADC, ADC_DIN, ADC_FUNCTION);
    pin_set(ADC, ADC_CS, false);
}

void hal_adc_exchange(uint8_t *bytes, uint8_t count)
{
    for (uint8_t i = 0; i < count; i++) {
        SPI1->DR = bytes[i];
        while ((SPI1->SR & SPI_SR_RXNE) == 0)
            ;
        bytes[i] = (uint8_t)SPI1->DR;
    }
    // Ends the transaction, whatever state line noise left it in. Then low: DOUT shows RDY̅.
    pin_set(ADC, ADC_CS, true);
    timer_wait(CS_PULSE_TICKS);
    pin_set(ADC, ADC_CS, false);
}

bool hal_adc_ready(void)
{
    return !pin_is_high(ADC, ADC_DOUT);
}

void hal_adc_hold(void)
{
    pin_set(SYNC, SYNC_PIN, false);
}

void hal_adc_restart(void)
{
    if ((SYNC->ODR & BIT(SYNC_PIN)) != 0) {
        pin_set(SYNC, SYNC_PIN, false);
        timer_wait(SYNC_PULSE_TICKS);
    }
    pin_set(SYNC, SYNC_PIN, true);
}
