// SPDX-License-Identifier: Apache-2.0
#include "cobs.h"

uint8_t cobs_encode(uint8_t *coded, const uint8_t *message, uint8_t length)
{
    uint8_t code_at = 0; // where the distance to the next zero will stand
    uint8_t at = 1;
    for (uint8_t i = 0; i < length; i++) {
        if (message[i] != 0) {
            coded[at++] = message[i];
        } else {
            coded[code_at] = (uint8_t)(at - code_at);
            code_at = at++;
        }
    }
    coded[code_at] = (uint8_t)(at - code_at);
    return at;
}

bool cobs_decode(uint8_t *bytes, uint8_t *length)
{
    uint8_t coded = *length;
    uint8_t from = 0, to = 0;
    while (from < coded) {
        uint8_t code = bytes[from++];
        if (code == 0 || code - 1 > coded - from)
            return false;
        for (uint8_t i = 1; i < code; i++) {
            if (bytes[from] == 0)
                return false;
            bytes[to++] = bytes[from++];
        }
        // Each block but the last stands for a zero behind it. (Blocks of 254 bytes do not, but one
        // of them would be the whole message.)
        if (from < coded)
            bytes[to++] = 0;
    }
    *length = to;
    return coded != 0;
}
