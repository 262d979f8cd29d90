// SPDX-License-Identifier: GPL-3.0-or-later
#include "host_speed.h"

#include <asm/termbits.h>
#include <sys/ioctl.h>

uint32_t host_speed(int slave)
{
    struct termios2 settings;
    return ioctl(slave, TCGETS2, &settings) == 0 ? settings.c_ospeed : 0;
}
