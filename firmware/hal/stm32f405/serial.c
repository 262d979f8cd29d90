// SPDX-License-Identifier: Apache-2.0
//
// USART 1 to the host: interrupt-driven rings in both directions.
#include "board_protocol.h"
#include "clock.h"
#include "hal.h"
#include "parts.h"
#include "pins.h"
#include "ring.h"

_Static_assert(APB2_HZ % BOARD_WIRE_BAUD == 0, "the baud rate is not exact");

static struct ring received, to_send;
static volatile uint32_t rx_overflows;
static volatile uint64_t delimiter_time;

void usart1_handler(void);

void serial_init(void)
{
    pin_alternate(HOST, HOST_TX, HOST_FUNCTION);
    pin_alternate(HOST, HOST_RX, HOST_FUNCTION);
    pin_pull_up(HOST, HOST_RX); // a line that is not plugged in is idle
    USART1->BRR = APB2_HZ / BOARD_WIRE_BAUD;
    USART1->CR1 = USART_CR1_UE | USART_CR1_TE | USART_CR1_RE | USART_CR1_RXNEIE;
    interrupt_enable(IRQ_USART1);
}

// An overrun between the reads of SR and DR leaves ORE alone, without RXNE, and it asks for the
// interrupt until DR is read once more.
static void receive(uint32_t status)
{
    uint8_t byte = (uint8_t)USART1->DR; // clears the error, too
    if ((status & USART_SR_ORE) != 0)
        rx_overflows++;
    if ((status & USART_SR_RXNE) == 0)
        return;
    if (!ring_put(&received, byte))
        rx_overflows++;
    if (byte == BOARD_WIRE_DELIMITER)
        delimiter_time = hal_time();
}

void usart1_handler(void)
{
    uint32_t status = USART1->SR;
    if ((status & (USART_SR_RXNE | USART_SR_ORE)) != 0)
        receive(status);
    while ((USART1->CR1 & USART_CR1_TXEIE) != 0 && (USART1->SR & USART_SR_TXE) != 0) {
        uint8_t byte;
        if (ring_get(&to_send, &byte))
            USART1->DR = byte;
        else
            USART1->CR1 &= ~USART_CR1_TXEIE;
    }
}

bool hal_serial_read(uint8_t *byte)
{
    return ring_get(&received, byte);
}

uint64_t hal_serial_delimiter_time(void)
{
    uint8_t state = hal_lock();
    uint64_t time = delimiter_time;
    hal_unlock(state);
    return time;
}

uint32_t hal_serial_rx_overflows(void)
{
    return rx_overflows;
}

void serial_flush(void)
{
    while (!ring_is_empty(&to_send) || (USART1->SR & USART_SR_TC) == 0)
        ;
}

uint8_t hal_serial_tx_space(void)
{
    return ring_space(&to_send);
}

void hal_serial_write(const uint8_t *bytes, uint8_t count)
{
    ring_put_all(&to_send, bytes, count);
    USART1->CR1 |= USART_CR1_TXEIE;
    // The bit alone would do on the chip; QEMU's USART has no interrupt for it.
    interrupt_pend(IRQ_USART1);
}
