// SPDX-License-Identifier: Apache-2.0
//
// A byte queue between one writer and one reader, of which one may be an interrupt handler.
// The indices are single bytes, which an 8-bit machine reads and writes in one access; they wrap
// with the 256-byte buffer by themselves. Holds 255 bytes.
#ifndef RING_H
#define RING_H

#include <stdbool.h>
#include <stdint.h>

struct ring {
    volatile uint8_t head; // where the writer puts the next byte
    volatile uint8_t tail; // where the reader takes the next byte
    volatile uint8_t bytes[256];
};

static inline uint8_t ring_space(const struct ring *ring)
{
    return (uint8_t)(ring->tail - ring->head - 1);
}

static inline bool ring_is_empty(const struct ring *ring)
{
    return ring->head == ring->tail;
}

static inline bool ring_put(struct ring *ring, uint8_t byte)
{
    uint8_t head = ring->head;
    if ((uint8_t)(head + 1) == ring->tail)
        return false;
    ring->bytes[head] = byte;
    ring->head = (uint8_t)(head + 1);
    return true;
}

// `count` is at most ring_space().
static inline void ring_put_all(struct ring *ring, const uint8_t *bytes, uint8_t count)
{
    uint8_t head = ring->head;
    for (uint8_t i = 0; i < count; i++)
        ring->bytes[head++] = bytes[i];
    ring->head = head; // only now the reader may have them
}

static inline bool ring_get(struct ring *ring, uint8_t *byte)
{
    uint8_t tail = ring->tail;
    if (tail == ring->head)
        return false;
    *byte = ring->bytes[tail];
    ring->tail = (uint8_t)(tail + 1);
    return true;
}

#endif
