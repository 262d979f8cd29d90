// SPDX-License-Identifier: Apache-2.0
//
// Consistent Overhead Byte Stuffing (Cheshire and Baker, IEEE/ACM Trans. Networking 7(2), 1999)
// for messages of at most 254 bytes: the coded message holds no zero, so that a zero can end it.
#ifndef COBS_H
#define COBS_H

#include <stdbool.h>
#include <stdint.h>

#define COBS_MAXIMUM 254u

// Codes `length` bytes (at most COBS_MAXIMUM) into `coded`, which has room for length + 1.
// Returns the coded length, length + 1.
uint8_t cobs_encode(uint8_t *coded, const uint8_t *message, uint8_t length);

// Decodes in place. Returns false if the bytes are not a coded message.
bool cobs_decode(uint8_t *bytes, uint8_t *length);

#endif
