// SPDX-License-Identifier: GPL-3.0-or-later
//
// The speed that the host has set on the port. In a file of its own: the header with any speed that is no
// multiple of 300 excludes <termios.h>.
#ifndef VBOARD_HOST_SPEED_H
#define VBOARD_HOST_SPEED_H

#include <stdint.h>

// Bits a second; 0 if that cannot be told.
uint32_t host_speed(int slave);

#endif
