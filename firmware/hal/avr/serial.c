// SPDX-License-Identifier: Apache-2.0
//
// UART 0 to the host: interrupt-driven rings in both directions.
#include <avr/interrupt.h>
#include <avr/io.h>

#include "board_protocol.h"
#include "hal.h"
#include "parts.h"
#include "ring.h"

// Double speed (U2X): 8 clocks a bit sample.
#define UBRR (F_CPU / 8 / BOARD_WIRE_BAUD - 1)
_Static_assert(F_CPU % (8 * BOARD_WIRE_BAUD) == 0, "the baud rate is not exact");

static struct ring received, to_send;
static volatile uint32_t rx_overflows;
static volatile uint64_t delimiter_time;

void serial_init(void)
{
    UCSR0A = _BV(U2X0);
    UBRR0 = UBRR;
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UCSR0B = _BV(RXCIE0) | _BV(RXEN0) | _BV(TXEN0);
}

ISR(USART0_RX_vect)
{
    uint8_t status = UCSR0A; // belongs to the byte that reading UDR0 takes
    uint8_t byte = UDR0;
    if ((status & _BV(DOR0)) != 0)
        rx_overflows++;
    if (!ring_put(&received, byte))
        rx_overflows++;
    if (byte == BOARD_WIRE_DELIMITER)
        delimiter_time = hal_time();
}

ISR(USART0_UDRE_vect)
{
    uint8_t byte;
    if (ring_get(&to_send, &byte))
        UDR0 = byte;
    else
        UCSR0B &= (uint8_t)~_BV(UDRIE0);
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
    uint8_t state = hal_lock();
    uint32_t overflows = rx_overflows;
    hal_unlock(state);
    return overflows;
}

void serial_flush(void)
{
    while (!ring_is_empty(&to_send))
        ;
}

uint8_t hal_serial_tx_space(void)
{
    return ring_space(&to_send);
}

void hal_serial_write(const uint8_t *bytes, uint8_t count)
{
    ring_put_all(&to_send, bytes, count);
    UCSR0B |= _BV(UDRIE0);
}
