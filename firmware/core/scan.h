// SPDX-License-Identifier: Apache-2.0
//
// The scan scheduler. The sample timer's tick latches the encoders and restarts the ADC's sequence;
// the main loop reads the conversions as they finish and sends one data frame a tick.
//
// A tick that comes while the scan before it is incomplete cuts that scan short: its frame goes out
// with the channels that were read. A tick that comes before the main loop saw the one before is a
// missed tick of the earlier one. So the host can account for every tick.
//
// An ADC that has lost its registers, by a reset of its own, a flipped bit or its power, is set up anew
// while the ticks go on: their frames hold the encoders, no channel, and a flag.
//
// A write hides a bit that has just flipped from the chip's own check. So no scan is sent with values before
// the registers that they depend on have been read back since the last write.
//
// Whether the rising edge of SYNC begins the sequence anew or lets it go on where it was held, nobody
// says. So the sequence has the scan's channels alone, and is held behind the last of them: there the
// two are the same. A conversion that is not at its own time since the tick is not taken.
#ifndef SCAN_H
#define SCAN_H

#include <stdbool.h>
#include <stdint.h>

#include "ad7124.h"
#include "board_protocol.h"
#include "hal.h"
#include "transmit.h"

// Other work that is begun between two conversions, 0.5 ms: a step of the drive, or a frame. Under many
// encoder edges it takes a little longer, and the next conversion is then read so much later, long before
// the one behind it.
#define SCAN_OTHER_WORK_TICKS (BOARD_TICK_HZ / 2000)

// A register is read back between two conversions, 50 µs (65 under 40 000 encoder edges a second).
#define SCAN_READ_BACK_TICKS (BOARD_TICK_HZ / 20000)

// What the interrupt hands to the main loop.
struct scan_tick {
    volatile bool pending;
    uint32_t number; // of the scan since start, from 0
    uint32_t ticks;  // low half of the scheduled instant
    struct hal_encoders encoders;
    bool without_adc; // which is being set up anew, and was not started
};

struct scan_counters {
    uint32_t missed_ticks; // counted by the interrupt
    uint32_t overruns;
    uint32_t spi_crc_errors;
    uint32_t sequence_errors;
    uint32_t adc_errors;
    uint32_t adc_restarts;
};

struct scan {
    struct transmitter *transmitter;
    struct configure_arguments configuration; // of this and the next stream
    uint8_t channels;                         // that a scan converts
    uint32_t period;                          // ticks
    uint32_t latest_conversion; // ticks after the scan's start: what ends later is of another round
    uint32_t shortest_conversion; // ticks
    uint32_t spare_ticks;         // behind a conversion, in which other work can be begun
    bool housekeeping_fits;       // behind a scan's channels
    bool streaming;               // between start and stop

    // The interrupt writes these; the main loop touches them locked.
    struct scan_tick latch;
    uint32_t scheduled; // ticks since start
    struct scan_counters counters;

    // An ADC that is set up anew; the interrupt does not start it meanwhile.
    struct ad7124 adc;
    volatile bool adc_lost;
    bool adc_in_set_up;
    uint32_t last_set_up;   // low half of the time at which it was begun
    uint32_t adc_error_bits; // that ERROR has shown since the board's reset
    uint8_t empty_scans;     // in a row

    // The scan that the main loop reads.
    bool converting;  // conversions of it are still to come
    uint8_t slot;     // the next one; behind the last channel comes housekeeping
    bool out_of_step; // one came too soon, and with it all that are still to come
    uint32_t last_conversion; // low half of the time at which it was read, or of the scan's start
    struct data_frame record;
    uint32_t reported_missed_ticks; // what the last record knew
    uint32_t reported_illegal_steps;

    bool housekeeping_due;
    uint8_t housekeeping_next; // source
    uint32_t housekeeping_codes[BOARD_HOUSEKEEPING_COUNT]; // 0 until first read
};

void scan_init(struct scan *scan, struct transmitter *transmitter,
               const struct configure_arguments *configuration);

// Takes a configuration that has passed configuration_check for the next start. Only while not
// streaming.
void scan_configure(struct scan *scan, const struct configure_arguments *configuration);

// Sets the ADC up and starts the sample timer; *first is scan 0's instant. False if the ADC does
// not answer as it should. Takes 10 to 15 ms.
bool scan_start(struct scan *scan, uint64_t *first);

// Whether scan_poll still has something to read, once the sample timer has been stopped.
bool scan_unfinished(const struct scan *scan);

// Sends what there is of the running scan and ends the stream. The sample timer has been stopped.
void scan_end(struct scan *scan);

// Call often: at least once in the time of a conversion. True when a data frame went out: then the
// next conversion is farthest away, and there is time for other work.
bool scan_poll(struct scan *scan);

// Whether SCAN_OTHER_WORK_TICKS of other work can be begun now, before the next conversion is due.
bool scan_leaves_time(const struct scan *scan);

// Asks for one housekeeping conversion behind one of the next scans.
void scan_request_housekeeping(struct scan *scan);

uint32_t scan_scheduled(const struct scan *scan);
struct scan_counters scan_read_counters(const struct scan *scan);

#endif
