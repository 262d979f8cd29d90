// SPDX-License-Identifier: GPL-3.0-or-later
//
// The Unix socket (SOCK_SEQPACKET) on which a bench sends its frames; one bench at a time, which may come again.
#ifndef VBOARD_BENCH_SOCKET_H
#define VBOARD_BENCH_SOCKET_H

#include <stdbool.h>
#include <stddef.h>

#include "vboard.h"

typedef struct bench_socket {
    int listener;
    int bench;  // -1 while none is connected
    const char *path;
} bench_socket;

// Listens at `path`, in place of a socket that nobody listens on any more. False with one line in `error`.
bool bench_socket_open(bench_socket *self, const char *path, char *error, size_t error_size);
void bench_socket_close(bench_socket *self);

// Without waiting: takes a new bench if there is none, and hands all frames that have come to the board.
void bench_socket_serve(bench_socket *self, vb_board *board);

#endif
