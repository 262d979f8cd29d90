// SPDX-License-Identifier: GPL-3.0-or-later
#include "bootloader.h"

static const double START_UP_NS = 65e6;
static const double WINDOW_NS = 850e6;
static const double HOLD_NS = 9e9;

void bootloader_start(bootloader *self, double now_ns)
{
    self->listens_ns = now_ns + START_UP_NS;
    self->ends_ns = self->listens_ns + WINDOW_NS;
}

void bootloader_hear(bootloader *self, double now_ns)
{
    if (now_ns >= self->listens_ns)
        self->ends_ns = now_ns + HOLD_NS;
}
