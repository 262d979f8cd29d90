// SPDX-License-Identifier: Apache-2.0
#include "frame.h"

#include "cobs.h"
#include "hal.h"

uint8_t frame_encode(uint8_t frame[FRAME_MAXIMUM], const uint8_t *payload, uint8_t length)
{
    uint8_t message[BOARD_WIRE_MAXIMUM_PAYLOAD + FRAME_CRC_SIZE];
    memcpy(message, payload, length);
    board_put_u16(message + length, hal_crc16_ccitt(BOARD_WIRE_CRC16_INITIAL, payload, length));
    uint8_t coded = cobs_encode(frame, message, (uint8_t)(length + FRAME_CRC_SIZE));
    frame[coded] = BOARD_WIRE_DELIMITER;
    return (uint8_t)(coded + 1);
}

static bool decode(struct frame_parser *parser)
{
    if (parser->too_long || !cobs_decode(parser->bytes, &parser->length))
        return false;
    if (parser->length <= FRAME_CRC_SIZE)
        return false;
    parser->length = (uint8_t)(parser->length - FRAME_CRC_SIZE);
    uint16_t crc = hal_crc16_ccitt(BOARD_WIRE_CRC16_INITIAL, parser->bytes, parser->length);
    return crc == board_get_u16(parser->bytes + parser->length);
}

uint8_t frame_parse(struct frame_parser *parser, uint8_t byte)
{
    if (byte != BOARD_WIRE_DELIMITER) {
        // One byte of the buffer is the delimiter's: a longer frame cannot be a good one.
        if (parser->length < FRAME_MAXIMUM - 1)
            parser->bytes[parser->length++] = byte;
        else
            parser->too_long = true;
        return 0;
    }
    uint8_t payload_length = 0;
    if (parser->length != 0) { // bare delimiters flush the line and mean nothing
        if (decode(parser))
            payload_length = parser->length;
        else
            parser->bad_frames++;
    }
    parser->length = 0;
    parser->too_long = false;
    return payload_length;
}
