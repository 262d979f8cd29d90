// SPDX-License-Identifier: GPL-3.0-or-later
//
// The pseudo terminal that stands for the USB serial port, and a stable name for it.
#ifndef VBOARD_HOST_PORT_H
#define VBOARD_HOST_PORT_H

#include <stdbool.h>
#include <stddef.h>

typedef struct host_port {
    int master;      // non-blocking
    int slave;       // kept open: else the master reads EIO whenever no host has the port open
    char name[64];   // /dev/pts/N
    const char *link;
} host_port;

// Opens a raw pseudo terminal and, unless `link` is NULL, makes `link` a symbolic link to it, in place of an
// older link to a pseudo terminal. False with one line in `error`.
bool host_port_open(host_port *self, const char *link, char *error, size_t error_size);

// Closes it and removes the link if it is still ours.
void host_port_close(host_port *self);

#endif
