// SPDX-License-Identifier: Apache-2.0
//
// The whole firmware's state and its main loop: what comes from the host, the scan, and what is due
// once a second.
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stdint.h>

#include "drive.h"
#include "frame.h"
#include "scan.h"
#include "storage.h"
#include "transmit.h"
#include "watchdog.h"

struct board {
    struct transmitter transmitter;
    struct scan scan;
    struct frame_parser parser;
    struct watchdog watchdog;
    struct storage storage;
    struct drive drive;
    bool reset_wanted;
    uint16_t sync_stamp;         // when the latest answer to `sync` was begun …
    uint16_t sync_coding_ticks;  // … and how long it took to be on its way
    uint32_t last_host_frame; // low half of the time of the last good frame
    uint32_t last_health;
};

// After hal_init: resets the ADC and sends the boot frame.
void board_init(struct board *board);

// One round of the main loop.
void board_poll(struct board *board);

// Ends the stream: the running scan finishes first, within a period, and the drive is led on meanwhile.
void board_stop(struct board *board);

// The health record as it stands now.
struct health_frame board_health(const struct board *board);

#endif
