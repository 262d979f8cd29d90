// SPDX-License-Identifier: GPL-3.0-or-later
#include "serial_line.h"

#include <stdlib.h>

enum { BITS_PER_BYTE = 10, BITS_PER_BYTE_IN_SIMAVR = 11 };

// ---------------------------------------------------------------------------------- queue

static bool queue_push(byte_queue *queue, timed_byte byte)
{
    if (queue->end - queue->first == queue->capacity) {
        size_t capacity = queue->capacity ? 2 * queue->capacity : 256;
        timed_byte *ring = malloc(capacity * sizeof *ring);
        if (!ring)
            return false;
        for (uint64_t i = queue->first; i < queue->end; i++)
            ring[i & (capacity - 1)] = queue->ring[i & (queue->capacity - 1)];
        free(queue->ring);
        queue->ring = ring;
        queue->capacity = capacity;
    }
    queue->ring[queue->end++ & (queue->capacity - 1)] = byte;
    return true;
}

static bool queue_is_empty(const byte_queue *queue)
{
    return queue->first == queue->end;
}

static timed_byte queue_front(const byte_queue *queue)
{
    return queue->ring[queue->first & (queue->capacity - 1)];
}

// ---------------------------------------------------------------------------------- faults

// Puts a byte through the cable: into the queue not at all, once, or twice.
static void transmit(serial_line *self, byte_queue *queue, timed_byte byte)
{
    const vb_faults *faults = self->faults;
    if (faults->serial_bit_error_rate > 0.0)
        for (int bit = 0; bit < 8; bit++)
            if (random_chance(&self->fault_source, faults->serial_bit_error_rate)) {
                byte.value ^= (uint8_t)(1u << bit);
                self->bits_flipped++;
            }
    if (random_chance(&self->fault_source, faults->serial_byte_drop_rate)) {
        self->bytes_dropped++;
        return;
    }
    queue_push(queue, byte);
    if (random_chance(&self->fault_source, faults->serial_byte_double_rate)) {
        self->bytes_doubled++;
        queue_push(queue, byte);
    }
}

// ------------------------------------------------------------------------------ host → board

// simavr's UART takes 11 bit times a byte; fed faster, it would overrun where the chip does not.
static avr_cycle_count_t byte_cycles(const serial_line *self)
{
    avr_cycle_count_t line = (avr_cycle_count_t)BITS_PER_BYTE_IN_SIMAVR * self->avr->frequency / BOARD_WIRE_BAUD;
    avr_cycle_count_t uart = avr_regbit_get(self->avr, self->uart->rxen) ? self->uart->cycles_per_byte : 0;
    return line > uart ? line : uart;
}

static avr_cycle_count_t feed(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)avr;
    serial_line *self = param;
    if (queue_is_empty(&self->to_board))
        return 0;
    uint8_t byte = queue_front(&self->to_board).value;
    self->to_board.first++;
    if (self->mcu->held)
        self->held_byte(self->context);
    else
        avr_raise_irq(self->uart->io.irq + UART_IRQ_INPUT, byte);
    return when + byte_cycles(self);
}

static void start_feeding(serial_line *self)
{
    // While the timer runs, the line is busy with the byte before.
    if (!queue_is_empty(&self->to_board) && avr_cycle_timer_status(self->avr, feed, self) == 0)
        avr_cycle_timer_register(self->avr, 1, feed, self);
}

size_t serial_line_write(serial_line *self, const uint8_t *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++)
        transmit(self, &self->to_board, (timed_byte){.value = bytes[i]});
    self->bytes_from_host += count;
    start_feeding(self);
    return count;
}

// ------------------------------------------------------------------------------ board → host

static void byte_sent(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    serial_line *self = param;
    // simavr tells of a byte when it is written to UDR; the host has it after its stop bit.
    avr_cycle_count_t duration = self->uart->cycles_per_byte * BITS_PER_BYTE / BITS_PER_BYTE_IN_SIMAVR;
    transmit(self, &self->to_host, (timed_byte){.cycle = self->avr->cycle + duration, .value = (uint8_t)value});
}

size_t serial_line_read(serial_line *self, uint8_t *bytes, size_t capacity)
{
    size_t count = 0;
    while (count < capacity && !queue_is_empty(&self->to_host)) {
        timed_byte byte = queue_front(&self->to_host);
        if (byte.cycle > self->avr->cycle)
            break;
        bytes[count++] = byte.value;
        self->to_host.first++;
    }
    self->bytes_to_host += count;
    return count;
}

// --------------------------------------------------------------------------- open and close

void serial_line_open(serial_line *self, const mcu *mcu, const vb_faults *faults, uint64_t seed,
                      void (*held_byte)(void *), void *context)
{
    *self = (serial_line){.mcu = mcu,
                          .avr = mcu->avr,
                          .held_byte = held_byte,
                          .context = context,
                          .faults = faults,
                          .fault_source = random_stream(seed, 3)};
    for (avr_io_t *module = mcu->avr->io_port; module; module = module->next)
        if (module->irq_ioctl_get == AVR_IOCTL_UART_GETIRQ('0'))
            self->uart = (avr_uart_t *)module;
    // Neither sleep when the firmware polls, nor print what it sends.
    uint32_t no_flags = 0;
    avr_ioctl(self->avr, AVR_IOCTL_UART_SET_FLAGS('0'), &no_flags);
    avr_irq_register_notify(self->uart->io.irq + UART_IRQ_OUTPUT, byte_sent, self);
}

void serial_line_close(serial_line *self)
{
    free(self->to_board.ring);
    free(self->to_host.ring);
}

void serial_line_reset(serial_line *self)
{
    start_feeding(self);
}
