// SPDX-License-Identifier: Apache-2.0
//
// Frames on the serial line: COBS(payload ‖ CRC-16/CCITT-FALSE, little-endian) and a zero byte.
#ifndef FRAME_H
#define FRAME_H

#include <stdbool.h>
#include <stdint.h>

#include "board_protocol.h"

#define FRAME_CRC_SIZE 2u
// The longest frame: payload, CRC, COBS overhead, delimiter.
#define FRAME_MAXIMUM (BOARD_WIRE_MAXIMUM_PAYLOAD + FRAME_CRC_SIZE + 2u)

// Writes the frame of a payload of at most BOARD_WIRE_MAXIMUM_PAYLOAD bytes; returns its length.
uint8_t frame_encode(uint8_t frame[FRAME_MAXIMUM], const uint8_t *payload, uint8_t length);

struct frame_parser {
    uint8_t bytes[FRAME_MAXIMUM]; // after frame_parse returned a length: the payload
    uint8_t length;
    bool too_long;
    uint32_t bad_frames;
};

// Takes the next byte from the line. Returns the payload's length when the byte completes a good
// frame, 0 otherwise; the payload stands in parser->bytes until the next call.
uint8_t frame_parse(struct frame_parser *parser, uint8_t byte);

#endif
