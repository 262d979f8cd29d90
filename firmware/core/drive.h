// SPDX-License-Identifier: Apache-2.0
//
// The crank's drive: a motor in one direction, led along a ramp to a speed by the crank's encoder, and
// stopped by everything that should stop it.
//
// Speeds are in 0.01 rpm of the crank, duties in 0.01 %.
#ifndef DRIVE_H
#define DRIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "board_protocol.h"
#include "transmit.h"

struct drive {
    uint8_t state, trip;
    bool news;                 // the state has changed since the last frame
    bool moved;                // since the start
    bool backwards;            // the encoder's count falls when the crank turns forward
    uint16_t counts_per_revolution;
    uint16_t target, setpoint; // the setpoint follows the target along the ramp
    uint16_t reference;        // that leads the crank: the setpoint, in a stop at most the speed
    int16_t speed;             // over the last control steps …
    bool keeps_on;             // … and it still turned in the last one
    uint16_t duty;
    uint32_t last_command;     // low half of the time of the last `run` …
    uint32_t last_step;        // … of the last control step …
    uint32_t last_movement;    // … of the last movement, or of the start …
    uint32_t last_reserve;     // … of the last step with a duty below its ceiling …
    uint32_t last_frame;
    int32_t mark;              // count at the last movement …
    int16_t mark_speed;        // … the speed then …
    uint16_t edges;            // … and the encoder's edges since
    uint8_t last_edges;        // of the step before
    uint16_t coast;            // the speed that a crank without power may still have
    uint8_t steps_to_fade;     // steps in which that is still found out
    int32_t last_count;        // of the step before
    int32_t counts[BOARD_DRIVE_WINDOW_STEPS]; // of the last control steps …
    uint32_t times[BOARD_DRIVE_WINDOW_STEPS]; // … and low halves of their times
    uint8_t oldest;            // of both
    uint16_t remainder;        // what the reference's steps have left over
    int32_t lag;               // of the crank behind the reference, 1/256 count, bounded
};

// At rest.
void drive_init(struct drive *drive, uint32_t now);

// Carries a request out and returns its status.
uint8_t drive_command(struct drive *drive, const struct drive_arguments *request, uint32_t now);

// Whether it turns, or may.
bool drive_turns(const struct drive *drive);

// In every round of the main loop: stops the motor at once when the emergency-stop loop opens.
void drive_watch(struct drive *drive);

// When there is time to spare: the control step and the frame that are due; one of them at a time.
void drive_poll(struct drive *drive, struct transmitter *transmitter, uint32_t now);

#endif
