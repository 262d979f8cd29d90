// SPDX-License-Identifier: GPL-3.0-or-later
//
// The pseudo terminal that stands for the USB serial port, and a stable name for it.
//
// It keeps to what the kernel does with a real port: the first program to open it raises DTR, the last one to
// close it lowers DTR (unless HUPCL is off), ends its exclusive use, and nobody's bytes are kept.
#ifndef VBOARD_HOST_PORT_H
#define VBOARD_HOST_PORT_H

#include <stdbool.h>
#include <stddef.h>

typedef struct host_port {
    int master;      // non-blocking
    int slave;       // kept open: else the master reads EIO whenever no host has the port open
    int watch;       // inotify: who opens and closes the slave
    unsigned opened; // so often at present, our own not counted
    bool dtr;
    char name[64];   // /dev/pts/N
    const char *link;
} host_port;

// Opens a raw pseudo terminal and, unless `link` is NULL, makes `link` a symbolic link to it, in place of an
// older link to a pseudo terminal. False with one line in `error`.
bool host_port_open(host_port *self, const char *link, char *error, size_t error_size);

// Looks who has opened and closed the port since the last call; whether DTR has been raised meanwhile.
bool host_port_attend(host_port *self);

// Closes it and removes the link if it is still ours.
void host_port_close(host_port *self);

#endif
