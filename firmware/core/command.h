// SPDX-License-Identifier: Apache-2.0
//
// The host's requests. Each is answered by one response that echoes its request id.
#ifndef COMMAND_H
#define COMMAND_H

#include <stdbool.h>
#include <stdint.h>

struct board;

// Carries a request out and sends the response. False if the payload is no request at all.
bool command_handle(struct board *board, const uint8_t *payload, uint8_t length);

#endif
