// SPDX-License-Identifier: Apache-2.0
//
// The firmware's board on the host's hal with a fake ADC, and a host on the other end of the line.
#ifndef WHOLE_BOARD_H
#define WHOLE_BOARD_H

#include <stdint.h>

#include "board.h"
#include "fake_ad7124.h"
#include "hal_host.h"

struct received_frame {
    uint8_t payload[BOARD_WIRE_MAXIMUM_PAYLOAD];
    uint8_t length;
};

struct whole_board {
    struct board board;
    struct fake_ad7124 adc;
    struct received_frame frames[2048]; // what the board sent since the last whole_board_forget
    size_t frame_count;
    struct frame_parser host_parser;
    size_t parsed;
};

// Powers the board up; the ADC's inputs are 0x100000 + n. The test frees what this returns.
struct whole_board *whole_board_new(void);
// The same with the clock at `time`.
struct whole_board *whole_board_new_at(uint64_t time);

// Setups and teardown of cmocka's tests, whose state is the board: as it comes up, or when what it
// sent by then is forgotten.
int whole_board_power_up(void **state);
int whole_board_power_up_forgetful(void **state);
int whole_board_power_down(void **state);

// Runs the main loop until this time or for this long, then takes in what the board sent.
void whole_board_run_until(struct whole_board *whole, uint64_t time);
void whole_board_run_ms(struct whole_board *whole, uint32_t milliseconds);

// Forgets the frames so far.
void whole_board_forget(struct whole_board *whole);

// Sends a request, runs the board until it has answered, returns the response.
// Other frames stay in `frames`.
struct received_frame whole_board_request(struct whole_board *whole, uint8_t type, uint8_t id,
                                          const uint8_t *arguments, uint8_t length);

// The status of a configure request; the second with all but rate and filter word at their defaults.
uint8_t whole_board_configure(struct whole_board *whole,
                              const struct configure_arguments *configuration);
uint8_t whole_board_set_rate(struct whole_board *whole, uint16_t rate_hz, uint16_t fs);

// The n-th frame of this type among `frames`, NULL if there are fewer.
const struct received_frame *whole_board_frame(const struct whole_board *whole, uint8_t type,
                                               size_t n);
size_t whole_board_count(const struct whole_board *whole, uint8_t type);

struct data_frame whole_board_data(const struct whole_board *whole, size_t n);
struct health_frame whole_board_counters(struct whole_board *whole);

#endif
