// SPDX-License-Identifier: GPL-3.0-or-later
//
// The serial line between UART0 and the host, with the time that bytes take and the faults of a bad cable.
#ifndef VBOARD_SERIAL_LINE_H
#define VBOARD_SERIAL_LINE_H

#include <simavr/avr_uart.h>

#include "mcu.h"
#include "random.h"
#include "vboard.h"

typedef struct timed_byte {
    uint64_t cycle;  // its stop bit ends here (to the host only)
    uint8_t value;
} timed_byte;

typedef struct byte_queue {
    timed_byte *ring;
    size_t capacity;  // a power of two, or 0
    uint64_t first, end;
} byte_queue;

typedef struct serial_line {
    const mcu *mcu;
    avr_t *avr;
    avr_uart_t *uart;
    void (*held_byte)(void *context);  // gets what comes while the core is held
    void *context;
    byte_queue to_board, to_host;
    const vb_faults *faults;
    random_source fault_source;
    uint64_t bytes_from_host, bytes_to_host;
    uint64_t bits_flipped, bytes_dropped, bytes_doubled;
} serial_line;

// `faults` is read for every byte: the caller may change it. `held_byte` is told of each byte that comes to a
// held core, which misses it.
void serial_line_open(serial_line *self, const mcu *mcu, const vb_faults *faults, uint64_t seed,
                      void (*held_byte)(void *), void *context);
void serial_line_close(serial_line *self);
// The microcontroller was reset: goes on sending what is on its way to the board.
void serial_line_reset(serial_line *self);

// The host's end. Bytes written follow one another without a gap; bytes read have wholly left the board.
size_t serial_line_write(serial_line *self, const uint8_t *bytes, size_t count);
size_t serial_line_read(serial_line *self, uint8_t *bytes, size_t capacity);

#endif
