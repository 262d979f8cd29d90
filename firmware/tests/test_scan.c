// SPDX-License-Identifier: Apache-2.0
//
// The scan scheduler in the whole board, seen from the host: what each tick becomes.
#include <stdlib.h>

#include "check.h"
#include "configuration.h"
#include "whole_board.h"

#define PERIOD_MS 10
#define ALL_VALID 0x3F

static struct start_response start(struct whole_board *whole)
{
    struct received_frame frame = whole_board_request(whole, BOARD_COMMAND_START, 1, NULL, 0);
    assert_int_equal(frame.payload[2], BOARD_STATUS_OK);
    struct start_response response;
    start_response_unpack(&response, frame.payload + 3);
    whole_board_forget(whole);
    return response;
}

static uint32_t stop(struct whole_board *whole)
{
    struct received_frame frame = whole_board_request(whole, BOARD_COMMAND_STOP, 2, NULL, 0);
    assert_int_equal(frame.payload[2], BOARD_STATUS_OK);
    struct stop_response response;
    stop_response_unpack(&response, frame.payload + 3);
    return response.scans_scheduled;
}

static void configure(struct whole_board *whole, uint16_t rate_hz, uint16_t fs)
{
    assert_int_equal(whole_board_set_rate(whole, rate_hz, fs), BOARD_STATUS_OK);
}

static void every_tick_becomes_one_complete_record(void **state)
{
    struct whole_board *whole = *state;
    struct start_response response = start(whole);
    assert_int_equal(response.period_ticks, 20000);
    whole_board_run_ms(whole, 1000);
    uint32_t scheduled = stop(whole);
    assert_in_range(scheduled, 99, 100);
    assert_int_equal(whole_board_count(whole, BOARD_FRAME_DATA), scheduled);
    for (uint32_t n = 0; n < scheduled; n++) {
        struct data_frame data = whole_board_data(whole, n);
        assert_int_equal(data.schema, BOARD_SCHEMA_HASH & 0xFF);
        assert_int_equal(data.sequence, n);
        assert_int_equal(data.ticks, (uint32_t)(response.first_tick + n * response.period_ticks));
        assert_int_equal(data.valid_mask, ALL_VALID);
        assert_int_equal(data.flags, 0);
        for (uint32_t channel = 0; channel < BOARD_CHANNEL_COUNT; channel++)
            assert_int_equal(data.codes[channel], 0x100000 + channel);
    }
    assert_int_equal(whole->adc.writes_while_running, 0);
    struct health_frame health = whole_board_counters(whole);
    assert_int_equal(health.missed_ticks, 0);
    assert_int_equal(health.scan_overruns, 0);
    assert_int_equal(health.spi_crc_errors, 0);
    assert_int_equal(health.adc_sequence_errors, 0);
    assert_int_equal(health.scans_scheduled, scheduled);
}

static void every_rate_keeps_its_period(void **state)
{
    struct whole_board *whole = *state;
    static const struct {
        uint16_t rate_hz, fs;
    } settings[] = {{10, 6}, {50, 15}, {100, 6}, {200, 3}};
    for (size_t i = 0; i < sizeof settings / sizeof settings[0]; i++) {
        configure(whole, settings[i].rate_hz, settings[i].fs);
        struct start_response response = start(whole);
        assert_int_equal(response.period_ticks, BOARD_TICK_HZ / settings[i].rate_hz);
        whole_board_run_ms(whole, 500);
        uint32_t scheduled = stop(whole);
        assert_true(scheduled + 2 >= settings[i].rate_hz / 2u);
        for (uint32_t n = 0; n < scheduled; n++) {
            struct data_frame data = whole_board_data(whole, n);
            assert_int_equal(data.sequence, n);
            assert_int_equal(data.ticks,
                             (uint32_t)(response.first_tick + n * response.period_ticks));
            assert_int_equal(data.valid_mask, ALL_VALID);
        }
        whole_board_forget(whole);
    }
    assert_int_equal(whole_board_counters(whole).scan_overruns, 0);
}

static void channels_are_converted_in_the_order_configured(void **state)
{
    struct whole_board *whole = *state;
    struct configure_arguments configuration = configuration_default();
    const uint8_t order[BOARD_CHANNEL_COUNT] = {5, 2, 0, 255, 255, 255};
    memcpy(configuration.order, order, sizeof order);
    configuration.rate_hz = 200;
    configuration.filter_fs = 6; // six channels would not fit
    assert_int_equal(whole_board_configure(whole, &configuration), BOARD_STATUS_OK);
    start(whole);
    whole_board_run_ms(whole, 3000);
    uint32_t scheduled = stop(whole);
    assert_int_equal(whole_board_count(whole, BOARD_FRAME_DATA), scheduled);
    for (uint32_t n = 0; n < scheduled; n++) {
        struct data_frame data = whole_board_data(whole, n);
        assert_int_equal(data.valid_mask, 1 << 5 | 1 << 2 | 1 << 0);
        assert_int_equal(data.flags, 0);
        // The fake's inputs belong to CHANNEL_n, here the place in the order.
        const uint32_t codes[BOARD_CHANNEL_COUNT] = {0x100002, 0, 0x100001, 0, 0, 0x100000};
        assert_memory_equal(data.codes, codes, sizeof codes);
    }
    struct health_frame health = whole_board_counters(whole);
    assert_int_equal(health.adc_sequence_errors, 0);
    assert_int_equal(health.adc_temperature_code, 0x100006);
}

static void sequence_and_ticks_wrap_without_a_seam(void **state)
{
    (void)state;
    struct whole_board *whole = whole_board_new_at((UINT64_C(1) << 32) - 3000000); // 1.5 s before
    struct start_response response = start(whole);
    whole->board.scan.scheduled = 65536 - 100; // as after eleven minutes
    whole_board_run_ms(whole, 3000);
    uint32_t scheduled = stop(whole);
    assert_in_range(scheduled, 65536 + 190, 65536 + 210);
    size_t records = whole_board_count(whole, BOARD_FRAME_DATA);
    assert_int_equal(records, scheduled - (65536 - 100));
    for (size_t n = 0; n < records; n++) {
        struct data_frame data = whole_board_data(whole, n);
        assert_int_equal(data.sequence, (uint16_t)(65536 - 100 + n));
        assert_int_equal(data.ticks, (uint32_t)(response.first_tick + n * response.period_ticks));
        assert_int_equal(data.valid_mask, ALL_VALID);
        assert_int_equal(data.flags, 0);
    }
    assert_int_equal(whole_board_count(whole, BOARD_FRAME_HEALTH), 3);
    free(whole);
}

static void encoders_are_those_at_the_tick(void **state)
{
    struct whole_board *whole = *state;
    struct start_response response = start(whole);
    for (int32_t n = 0; n < 20; n++) {
        hal_host.encoders.crank = 1000 * n;
        hal_host.encoders.carriage = -77 * n;
        uint64_t tick = response.first_tick + (uint64_t)n * response.period_ticks;
        whole_board_run_until(whole, tick + response.period_ticks / 2);
    }
    whole_board_run_ms(whole, PERIOD_MS / 2);
    for (int32_t n = 0; n < 20; n++) {
        struct data_frame data = whole_board_data(whole, (size_t)n);
        assert_int_equal(data.crank, 1000 * n);
        assert_int_equal(data.carriage, -77 * n);
    }
}

static void an_illegal_step_is_flagged_once(void **state)
{
    struct whole_board *whole = *state;
    hal_host.encoders.illegal_steps = 5; // before the start: no matter of this run
    start(whole);
    whole_board_run_ms(whole, 3 * PERIOD_MS);
    hal_host.encoders.illegal_steps = 6;
    whole_board_run_ms(whole, 5 * PERIOD_MS);
    stop(whole);
    size_t flagged = 0;
    for (size_t n = 0; n < whole_board_count(whole, BOARD_FRAME_DATA); n++)
        flagged += (whole_board_data(whole, n).flags & BOARD_FLAG_ILLEGAL_STEP) != 0;
    assert_int_equal(flagged, 1);
    assert_int_equal(whole_board_counters(whole).illegal_steps, 6);
}

static void a_crc_error_costs_one_channel(void **state)
{
    struct whole_board *whole = *state;
    start(whole);
    whole_board_run_ms(whole, PERIOD_MS / 2); // what the start wrote has been read back
    whole->adc.corrupt_reads_after = 2; // the third conversion, accel_x
    whole->adc.corrupt_reads = 1;
    whole_board_run_ms(whole, 4 * PERIOD_MS);
    struct data_frame hit = whole_board_data(whole, 0), next = whole_board_data(whole, 1);
    assert_int_equal(hit.valid_mask, ALL_VALID & ~(1 << BOARD_CHANNEL_ACCEL_X));
    assert_int_equal(hit.codes[BOARD_CHANNEL_ACCEL_X], 0);
    assert_int_equal(hit.flags, BOARD_FLAG_ADC_ERROR);
    assert_int_equal(next.valid_mask, ALL_VALID);
    assert_int_equal(next.flags, 0);
    assert_int_equal(whole_board_counters(whole).spi_crc_errors, 1);
}

static void random_crc_errors_never_give_a_wrong_code(void **state)
{
    struct whole_board *whole = *state;
    uint32_t random = 8;
    uint32_t expected_errors = 0;
    start(whole);
    for (int i = 0; i < 200; i++) {
        whole->adc.corrupt_reads = next_random(&random) % 4;
        expected_errors += whole->adc.corrupt_reads;
        whole_board_run_ms(whole, PERIOD_MS);
    }
    stop(whole);
    uint32_t missing = 0;
    for (size_t n = 0; n < whole_board_count(whole, BOARD_FRAME_DATA); n++) {
        struct data_frame data = whole_board_data(whole, n);
        for (uint32_t channel = 0; channel < BOARD_CHANNEL_COUNT; channel++) {
            bool valid = (data.valid_mask >> channel & 1) != 0;
            assert_int_equal(data.codes[channel], valid ? 0x100000 + channel : 0);
            missing += !valid;
        }
    }
    struct health_frame health = whole_board_counters(whole);
    assert_int_equal(health.spi_crc_errors, expected_errors);
    // All but those that hit the housekeeping slot, of which there are two at most each second.
    assert_in_range(missing, expected_errors - 4, expected_errors);
    assert_true(expected_errors > 200);
}

static void a_left_out_channel_is_a_sequence_error(void **state)
{
    struct whole_board *whole = *state;
    start(whole);
    whole->adc.skip_channel = BOARD_CHANNEL_ACCEL_Y;
    whole_board_run_ms(whole, 3 * PERIOD_MS);
    assert_int_equal(whole_board_counters(whole).adc_sequence_errors,
                     2 * whole_board_count(whole, BOARD_FRAME_DATA));
    struct data_frame data = whole_board_data(whole, 0);
    // Those behind it come a conversion too soon: not at the instants that the host takes them for.
    assert_int_equal(data.valid_mask, 0x07);
    assert_int_equal(data.flags, BOARD_FLAG_ADC_ERROR);
    whole_board_forget(whole);
    whole->adc.skip_channel = BOARD_CHANNEL_EXCITATION; // the last: the first comes in its place
    whole_board_run_ms(whole, 3 * PERIOD_MS);
    data = whole_board_data(whole, 1);
    assert_int_equal(data.valid_mask, ALL_VALID & ~(1 << BOARD_CHANNEL_EXCITATION));
    assert_int_equal(data.flags, BOARD_FLAG_ADC_ERROR);
}

static void a_conversion_of_a_channel_that_was_read_ends_the_scan(void **state)
{
    struct whole_board *whole = *state;
    start(whole);
    whole->adc.reported_channel = 0;
    whole_board_run_ms(whole, 3 * PERIOD_MS);
    struct data_frame data = whole_board_data(whole, 0);
    assert_int_equal(data.valid_mask, 0x01);
    assert_int_equal(data.codes[0], 0x100000);
    assert_int_equal(data.flags, BOARD_FLAG_ADC_ERROR);
}

static void conversions_of_a_later_round_are_not_taken(void **state)
{
    struct whole_board *whole = *state;
    configure(whole, 10, 6);
    struct start_response response = start(whole);
    // Three conversions of the first scan, then asleep for longer than a round of six.
    whole_board_run_until(whole, response.first_tick + 7644);
    hal_host_advance(7 * 2184); // the tenth conversion would be of the channel that is next
    whole_board_run_ms(whole, 20);
    struct data_frame data = whole_board_data(whole, 0);
    assert_int_equal(data.valid_mask, 0x07);
    assert_int_equal(data.flags, BOARD_FLAG_ADC_ERROR);
    assert_int_equal(whole_board_counters(whole).adc_sequence_errors, 1);
}

// A rate and filter word at which the scan of an ADC 5 % slow just fits the period.
#define TIGHT_RATE_HZ 124
#define TIGHT_FS 7
#define TIGHT_PERIOD 16129
#define TIGHT_CONVERSION ((96 * TIGHT_FS + 95) / 614400.0 * 2e6)

// Four scans, of which the conversion numbered `last` (from 1) ends `end` ticks after the tick.
static void four_tight_scans(struct whole_board *whole, int last, double end, bool housekeeping)
{
    whole->adc.slowness = end / (last * TIGHT_CONVERSION);
    struct start_response response = start(whole);
    whole->board.scan.housekeeping_due = housekeeping;
    whole_board_run_until(whole, response.first_tick + 4 * response.period_ticks - 2000);
    stop(whole);
    assert_int_equal(whole_board_count(whole, BOARD_FRAME_DATA), 4);
}

static void a_tick_at_any_moment_of_the_read_out_harms_neither_scan(void **state)
{
    struct whole_board *whole = *state;
    configure(whole, TIGHT_RATE_HZ, TIGHT_FS);
    // From 0.3 ms before the next tick to just behind it.
    for (int end = TIGHT_PERIOD - 600; end < TIGHT_PERIOD + 100; end++) {
        four_tight_scans(whole, BOARD_CHANNEL_COUNT, end, end % 2 == 0);
        for (size_t n = 0; n < 4; n++) {
            struct data_frame data = whole_board_data(whole, n);
            // Complete, or without the last channel, and then it says so.
            bool complete = data.valid_mask == ALL_VALID;
            assert_true(complete || data.valid_mask == (ALL_VALID & ~(1 << 5)));
            assert_int_equal(data.flags != 0, !complete);
            for (uint32_t channel = 0; channel < BOARD_CHANNEL_COUNT; channel++) {
                if ((data.valid_mask >> channel & 1) != 0)
                    assert_int_equal(data.codes[channel], 0x100000 + channel);
            }
        }
        whole_board_forget(whole);
    }
    assert_int_equal(whole_board_counters(whole).missed_ticks, 0);
}

// A rate at which housekeeping just fits, and an ADC that is slower than it may be.
static void a_tick_during_housekeeping_harms_neither(void **state)
{
    struct whole_board *whole = *state;
    const int period = 18868;
    for (int goes_on = 0; goes_on < 2; goes_on++) {
        configure(whole, 106, TIGHT_FS);
        whole->adc.sequence_goes_on = goes_on;
        for (int end = period - 300; end < period + 50; end++) {
            four_tight_scans(whole, BOARD_CHANNEL_COUNT + 1, end, true);
            for (size_t n = 0; n < 4; n++) {
                struct data_frame data = whole_board_data(whole, n);
                assert_int_equal(data.flags == 0, data.valid_mask == ALL_VALID);
                for (uint32_t channel = 0; channel < BOARD_CHANNEL_COUNT; channel++) {
                    if ((data.valid_mask >> channel & 1) != 0)
                        assert_int_equal(data.codes[channel], 0x100000 + channel);
                }
            }
            uint32_t code = whole_board_counters(whole).adc_temperature_code;
            assert_true(code == 0 || code == 0x100006);
            whole_board_forget(whole);
        }
    }
    assert_int_equal(whole->adc.writes_while_running, 0);
    assert_int_equal(whole_board_counters(whole).adc_temperature_code, 0x100006);
}

static void housekeeping_without_room_is_left_out(void **state)
{
    struct whole_board *whole = *state;
    configure(whole, TIGHT_RATE_HZ, TIGHT_FS);
    for (int slow = 0; slow < 2; slow++) {
        whole->adc.slowness = slow ? 1.05 : 1.0;
        start(whole);
        whole_board_run_ms(whole, 2500);
        uint32_t scheduled = stop(whole);
        for (uint32_t n = 0; n < scheduled; n++) {
            assert_int_equal(whole_board_data(whole, n).valid_mask, ALL_VALID);
            assert_int_equal(whole_board_data(whole, n).flags, 0);
        }
        whole_board_forget(whole);
    }
    struct health_frame health = whole_board_counters(whole);
    assert_int_equal(health.adc_temperature_code, 0);
    assert_int_equal(health.supply_code, 0);
}

static void a_silent_adc_gives_marked_records_at_the_full_rate(void **state)
{
    struct whole_board *whole = *state;
    start(whole);
    whole->adc.stalled = true;
    whole_board_run_ms(whole, 3000);
    assert_in_range(whole_board_count(whole, BOARD_FRAME_HEALTH), 2, 3);
    uint32_t scheduled = stop(whole);
    assert_in_range(scheduled, 298, 301);
    assert_int_equal(whole_board_count(whole, BOARD_FRAME_DATA), scheduled);
    uint32_t overruns = 0, restarts = 0;
    for (uint32_t n = 0; n < scheduled; n++) {
        struct data_frame data = whole_board_data(whole, n);
        assert_int_equal(data.sequence, n);
        assert_int_equal(data.valid_mask, 0);
        // Waited for in vain, or being set up anew after two such scans.
        bool overrun = data.flags == BOARD_FLAG_OVERRUN;
        assert_true(overrun || data.flags == BOARD_FLAG_ADC_RESTART);
        overruns += overrun;
        restarts += !overrun;
    }
    struct health_frame health = whole_board_counters(whole);
    assert_int_equal(health.scan_overruns, overruns);
    assert_in_range(restarts, 200, scheduled);
    assert_in_range(health.adc_restarts, 28, 30); // ten a second
}

// The data frames from the n-th on: how many in a row are not whole; each of them says so, and no
// number is left out. All behind them are whole.
static uint32_t marked_in_a_row(const struct whole_board *whole, uint8_t flag)
{
    size_t count = whole_board_count(whole, BOARD_FRAME_DATA);
    uint32_t marked = 0;
    bool over = false;
    for (size_t n = 0; n < count; n++) {
        struct data_frame data = whole_board_data(whole, n);
        if (n > 0)
            assert_int_equal(data.sequence, (uint16_t)(whole_board_data(whole, n - 1).sequence + 1));
        if (data.valid_mask == ALL_VALID && data.flags == 0) {
            over = over || marked > 0;
        } else {
            assert_false(over);
            marked++;
            assert_true((data.flags & (flag | BOARD_FLAG_OVERRUN | BOARD_FLAG_ADC_ERROR)) != 0);
        }
        for (uint32_t channel = 0; channel < BOARD_CHANNEL_COUNT; channel++) {
            bool valid = (data.valid_mask >> channel & 1) != 0;
            assert_int_equal(data.codes[channel], valid ? 0x100000 + channel : 0);
        }
    }
    assert_true(over);
    return marked;
}

static void an_adc_that_resets_itself_is_set_up_anew(void **state)
{
    struct whole_board *whole = *state;
    static const struct {
        uint16_t rate_hz, fs;
    } settings[] = {{10, 6}, {100, 6}, {200, 3}};
    uint32_t random = 5;
    for (size_t i = 0; i < sizeof settings / sizeof settings[0]; i++) {
        configure(whole, settings[i].rate_hz, settings[i].fs);
        for (uint32_t round = 0; round < 30; round++) {
            struct start_response response = start(whole);
            whole_board_run_until(whole, response.first_tick + 6 * response.period_ticks +
                                             next_random(&random) % response.period_ticks);
            uint32_t restarts = whole_board_counters(whole).adc_restarts;
            fake_ad7124_dip(&whole->adc);
            whole_board_run_until(whole, hal_host.time + 12 * response.period_ticks + 200000);
            stop(whole);
            // Cut short, two empty, and those in the 10 ms of the set-up, which may have to wait for
            // 0.1 s after that of the start.
            uint32_t set_up = (uint32_t)((10 + 100) * settings[i].rate_hz / 1000 + 1);
            assert_in_range(marked_in_a_row(whole, BOARD_FLAG_ADC_RESTART), 2, 3 + set_up);
            assert_int_equal(whole_board_counters(whole).adc_restarts, restarts + 1);
            whole_board_forget(whole);
        }
    }
}

static void an_adc_without_supply_comes_back_with_it(void **state)
{
    struct whole_board *whole = *state;
    start(whole);
    whole_board_run_ms(whole, 500);
    whole->adc.absent = true;
    whole_board_run_ms(whole, 3000);
    whole->adc.absent = false;
    fake_ad7124_dip(&whole->adc);
    whole_board_run_ms(whole, 500);
    uint32_t scheduled = stop(whole);
    assert_int_equal(whole_board_count(whole, BOARD_FRAME_DATA), scheduled);
    // Back within a set-up's period, and a set-up.
    assert_in_range(marked_in_a_row(whole, BOARD_FLAG_ADC_RESTART), 300, 300 + 12);
    assert_in_range(whole_board_counters(whole).adc_restarts, 29, 32);
}

static void a_reset_that_only_status_tells_of_is_believed(void **state)
{
    struct whole_board *whole = *state;
    start(whole);
    whole_board_run_ms(whole, 300);
    whole->adc.registers[0] |= 0x10;
    whole_board_run_ms(whole, 300);
    stop(whole);
    assert_in_range(marked_in_a_row(whole, BOARD_FLAG_ADC_RESTART), 1, 3);
    struct health_frame health = whole_board_counters(whole);
    assert_int_equal(health.adc_errors, 1);
    assert_int_equal(health.adc_restarts, 1);
    assert_int_equal(health.adc_error_bits, BOARD_ADC_ERROR_POWER_ON);
}

#define CONTROL 0x01

// Every bit of every register that can be written flips at some moment of a scan.
static void every_flipped_bit_is_found_and_mended(void **state)
{
    struct whole_board *whole = *state;
    uint32_t random = 17, flips = 0;
    start(whole);
    whole_board_run_ms(whole, 300);
    for (uint8_t address = CONTROL; address < FAKE_AD7124_REGISTERS; address++) {
        if (address == 0x02 || address == 0x05 || address == 0x06 || address == 0x08)
            continue;
        for (uint8_t bit = 0; bit < 8 * fake_ad7124_size_of(address); bit++) {
            uint64_t until = hal_host.time + next_random(&random) % 20000;
            whole_board_run_until(whole, until);
            whole_board_forget(whole);
            uint16_t in_scan = (uint16_t)(whole->board.scan.scheduled - 1);
            fake_ad7124_flip_bit(&whole->adc, address, bit);
            flips++;
            whole_board_run_ms(whole, 120); // the set-ups lie 0.1 s apart
            if (whole_board_counters(whole).adc_restarts != flips) { // which keeps the board streaming, too
                // The chip's own check is off, or no value depends on what a write has hidden from it: the
                // round over all registers comes to it.
                whole_board_run_ms(whole, 520);
                assert_int_equal(whole_board_counters(whole).adc_restarts, flips);
            }
            uint32_t wrong = 0, marked = 0;
            for (size_t n = 0; n < whole_board_count(whole, BOARD_FRAME_DATA); n++) {
                struct data_frame data = whole_board_data(whole, n);
                marked += (data.flags & BOARD_FLAG_ADC_RESTART) != 0;
                for (uint32_t channel = 0; channel < BOARD_CHANNEL_COUNT; channel++) {
                    if ((data.valid_mask >> channel & 1) == 0 ||
                        data.codes[channel] == 0x100000 + channel)
                        continue;
                    wrong++; // the conversion read before the chip looked, at the end of its scan
                    assert_int_equal(data.sequence, in_scan);
                    assert_int_equal(channel, BOARD_CHANNEL_COUNT - 1);
                }
            }
            assert_in_range(wrong, 0, 1);
            assert_in_range(marked, 1, 5);
            struct data_frame last =
                whole_board_data(whole, whole_board_count(whole, BOARD_FRAME_DATA) - 1);
            assert_int_equal(last.valid_mask, ALL_VALID);
            assert_int_equal(last.flags, 0);
        }
    }
    assert_int_equal(flips, 16 + 24 + 16 + 24 + 16 * 16 + 8 * 16 + 3 * 8 * 24);
}

// Up to the next write of a stream, of which there are two for each source of housekeeping.
static void run_to_the_next_write(struct whole_board *whole)
{
    uint8_t before = whole->board.scan.adc.housekeeping;
    while (whole->board.scan.adc.housekeeping == before)
        whole_board_run_until(whole, hal_host.time + 1);
}

// A bit that flips just before a write is in the checksum that the chip makes at it, and nobody but the reading
// back finds it: before the next scan is sent, at any rate, filter and number of channels.
static void a_bit_that_a_write_hides_spoils_no_scan_unmarked(void **state)
{
    struct whole_board *whole = *state;
    static const struct {
        uint16_t rate_hz, fs;
        uint8_t channels;
    } settings[] = {{10, 85, 6}, {10, 6, 6}, {100, 6, 6}, {200, 3, 6}, {200, 6, 3}, {200, 9, 1}};
    // Of slot 0 in each: where only the gain's lowest bit shows in the codes of this ADC's model.
    static const uint8_t in_use[] = {CONTROL, 0x03, 0x04, 0x07, 0x09, 0x19, 0x21, 0x29, 0x31};
    for (size_t i = 0; i < sizeof settings / sizeof settings[0]; i++) {
        struct configure_arguments configuration = configuration_default();
        configuration.rate_hz = settings[i].rate_hz;
        configuration.filter_fs = settings[i].fs;
        for (uint8_t slot = settings[i].channels; slot < BOARD_CHANNEL_COUNT; slot++)
            configuration.order[slot] = CONFIGURATION_NO_CHANNEL;
        assert_int_equal(whole_board_configure(whole, &configuration), BOARD_STATUS_OK);
        uint8_t all = (uint8_t)((1 << settings[i].channels) - 1);
        uint32_t restarts = whole_board_counters(whole).adc_restarts;
        start(whole);
        whole_board_run_ms(whole, 500);
        for (uint8_t n = 0; n < 2 * sizeof in_use; n++) { // the writes that choose a source, and none
            uint8_t slot = (uint8_t)(n % settings[i].channels);
            uint8_t address = in_use[n / 2];
            run_to_the_next_write(whole);
            whole_board_forget(whole);
            fake_ad7124_flip_bit(&whole->adc, (uint8_t)(address + (address < 0x09 ? 0 : slot)), 0);
            whole->adc.map_damaged = false;
            uint64_t flipped = hal_host.time;
            while (whole->board.scan.counters.adc_restarts == restarts)
                whole_board_run_until(whole, hal_host.time + 1);
            assert_int_equal(whole_board_counters(whole).adc_restarts, ++restarts); // and keeps it streaming
            assert_true(hal_host.time - flipped <= BOARD_TICK_HZ / settings[i].rate_hz);
            for (size_t scan = 0; scan < whole_board_count(whole, BOARD_FRAME_DATA); scan++) {
                struct data_frame data = whole_board_data(whole, scan);
                assert_int_equal(data.valid_mask, 0);
                assert_int_equal(data.flags, BOARD_FLAG_ADC_RESTART);
            }
            whole_board_forget(whole);
            whole_board_run_ms(whole, 250);
            size_t count = whole_board_count(whole, BOARD_FRAME_DATA), good = 0;
            for (size_t scan = 0; scan < count; scan++) {
                struct data_frame data = whole_board_data(whole, scan);
                good += data.valid_mask == all;
                assert_true(data.valid_mask == all || data.flags == BOARD_FLAG_ADC_RESTART);
                for (uint32_t channel = 0; data.valid_mask != 0 && channel < settings[i].channels; channel++)
                    assert_int_equal(data.codes[channel], 0x100000 + channel);
            }
            assert_true(good > 0);
        }
        stop(whole);
        whole_board_forget(whole);
    }
}

// A register that no value depends on comes in its turn, one a scan.
static void a_bit_of_a_register_in_no_use_is_read_back_within_a_round(void **state)
{
    struct whole_board *whole = *state;
    start(whole);
    whole_board_run_ms(whole, 300);
    fake_ad7124_flip_bit(&whole->adc, 0x15, 0); // CHANNEL_12
    whole->adc.map_damaged = false;
    whole_board_run_ms(whole, 640);
    assert_int_equal(whole_board_counters(whole).adc_restarts, 1);
}

// Without a bus to read them back by, no scan goes out on registers that a write may have hidden a bit of.
static void what_cannot_be_read_back_is_not_sent_as_valid(void **state)
{
    struct whole_board *whole = *state;
    start(whole);
    whole_board_run_ms(whole, 300);
    run_to_the_next_write(whole);
    whole_board_forget(whole);
    fake_ad7124_flip_bit(&whole->adc, 0x19, 0);
    whole->adc.map_damaged = false;
    whole->adc.corrupt_register_reads = true;
    whole_board_run_ms(whole, 2 * PERIOD_MS);
    struct data_frame data = whole_board_data(whole, 0);
    assert_int_equal(data.valid_mask, 0);
    assert_true((data.flags & BOARD_FLAG_ADC_ERROR) != 0);
}

static void a_command_that_the_adc_could_not_take_is_counted_and_repeated(void **state)
{
    struct whole_board *whole = *state;
    start(whole);
    whole_board_run_ms(whole, 300);
    whole_board_forget(whole);
    whole->adc.inputs[6] = 0x123456;
    whole->adc.refuse_writes = 3;
    whole_board_run_ms(whole, 3000);
    stop(whole);
    for (size_t n = 0; n < whole_board_count(whole, BOARD_FRAME_DATA); n++) {
        assert_int_equal(whole_board_data(whole, n).valid_mask, ALL_VALID);
        assert_int_equal(whole_board_data(whole, n).flags & ~BOARD_FLAG_ADC_ERROR, 0);
    }
    struct health_frame health = whole_board_counters(whole);
    assert_int_equal(health.adc_restarts, 0);
    assert_in_range(health.adc_errors, 1, 3);
    assert_int_equal(health.adc_error_bits, BOARD_ADC_ERROR_SPI_NOT_READY);
    assert_int_equal(health.adc_temperature_code, 0x123456);
    assert_int_equal(health.supply_code, 0x123456);
}

static void a_sequence_that_goes_on_from_sync_is_as_good_as_one_that_begins_anew(void **state)
{
    struct whole_board *whole = *state;
    static const struct {
        uint16_t rate_hz, fs;
    } settings[] = {{10, 6}, {100, 6}, {TIGHT_RATE_HZ, TIGHT_FS}, {200, 3}};
    whole->adc.sequence_goes_on = true;
    for (size_t i = 0; i < sizeof settings / sizeof settings[0]; i++) {
        configure(whole, settings[i].rate_hz, settings[i].fs);
        start(whole);
        whole_board_run_ms(whole, 4000);
        uint32_t scheduled = stop(whole);
        assert_int_equal(whole_board_count(whole, BOARD_FRAME_DATA), scheduled);
        for (uint32_t n = 0; n < scheduled; n++) {
            struct data_frame data = whole_board_data(whole, n);
            assert_int_equal(data.valid_mask, ALL_VALID);
            assert_int_equal(data.flags, 0);
        }
        whole_board_forget(whole);
    }
    struct health_frame health = whole_board_counters(whole);
    assert_int_equal(health.adc_sequence_errors, 0);
    assert_int_equal(health.adc_temperature_code, 0x100006);
    assert_int_equal(health.supply_code, 0x100006);
}

// The ADC stalls in the middle of a scan, so that the next begins at another channel: that one is
// marked, and the one behind it is whole.
static void a_sequence_out_of_step_costs_one_scan_more(void **state)
{
    struct whole_board *whole = *state;
    for (uint32_t channel = 1; channel < BOARD_CHANNEL_COUNT; channel++) {
        whole->adc.sequence_goes_on = true;
        struct start_response response = start(whole);
        uint64_t tick = response.first_tick + 3 * response.period_ticks;
        whole_board_run_until(whole, tick + channel * 2184 + 300);
        whole->adc.position = (uint8_t)channel; // as after a glitch on SYNC
        whole->adc.started = hal_host.time;
        whole->adc.conversions_read = 0;
        whole->adc.stalled = true;
        whole_board_run_until(whole, tick + response.period_ticks + 100);
        whole->adc.stalled = false;
        whole->adc.started = hal_host.time;
        whole_board_run_ms(whole, 8 * PERIOD_MS);
        stop(whole);
        assert_int_equal(marked_in_a_row(whole, 0), 2);
        whole_board_forget(whole);
    }
}

// Behind a conversion that came too soon all others of the scan do, also one that is read so late that its
// own time does not tell.
static void a_conversion_out_of_step_is_not_taken_however_late_it_is_read(void **state)
{
    struct whole_board *whole = *state;
    const uint32_t conversion = 2184;
    whole->adc.sequence_goes_on = true;
    struct start_response response = start(whole);
    uint64_t tick = response.first_tick + 3 * response.period_ticks;
    whole_board_run_until(whole, tick - 1000); // at rest
    whole->adc.position = 1;                   // as after a glitch on SYNC
    whole_board_run_until(whole, tick + 2 * conversion - 50);
    hal_host_advance(conversion - 200); // conversion 2 is read when 3 is nearly there
    whole_board_run_ms(whole, 3 * PERIOD_MS);
    stop(whole);
    struct data_frame hit = whole_board_data(whole, 3);
    assert_int_equal(hit.flags, BOARD_FLAG_ADC_ERROR);
    assert_int_equal(hit.valid_mask, 0);
    assert_int_equal(marked_in_a_row(whole, 0), 1);
}

static void a_stall_within_a_scan_keeps_what_was_read(void **state)
{
    struct whole_board *whole = *state;
    struct start_response response = start(whole);
    whole_board_run_until(whole, response.first_tick + 7644); // 3.5 conversions of 1.092 ms
    whole->adc.stalled = true;
    whole_board_run_ms(whole, PERIOD_MS);
    whole->adc.stalled = false;
    whole_board_run_ms(whole, 2 * PERIOD_MS);
    struct data_frame cut = whole_board_data(whole, 0);
    assert_int_equal(cut.valid_mask, 0x07);
    assert_int_equal(cut.flags, BOARD_FLAG_OVERRUN);
    struct data_frame last =
        whole_board_data(whole, whole_board_count(whole, BOARD_FRAME_DATA) - 1);
    assert_int_equal(last.valid_mask, ALL_VALID);
}

static void ticks_missed_by_a_sleeping_main_loop_are_counted_and_marked(void **state)
{
    struct whole_board *whole = *state;
    start(whole);
    whole_board_run_ms(whole, 5 * PERIOD_MS);
    hal_host_advance(5 * 20000); // five ticks in which the main loop does not run
    whole_board_run_ms(whole, 5 * PERIOD_MS);
    uint32_t scheduled = stop(whole);
    struct health_frame health = whole_board_counters(whole);
    assert_int_equal(health.missed_ticks, 4); // the fifth is still waiting when the loop wakes up
    size_t records = whole_board_count(whole, BOARD_FRAME_DATA);
    assert_int_equal(records, scheduled - health.missed_ticks);
    size_t marked = 0;
    for (size_t n = 1; n < records; n++) {
        struct data_frame before = whole_board_data(whole, n - 1);
        struct data_frame data = whole_board_data(whole, n);
        uint16_t step = (uint16_t)(data.sequence - before.sequence);
        assert_int_equal(data.ticks - before.ticks, step * 20000u);
        assert_int_equal((data.flags & BOARD_FLAG_MISSED_TICK) != 0, step != 1);
        marked += step != 1;
    }
    assert_int_equal(marked, 1);
}

static void stop_waits_for_the_running_scan(void **state)
{
    struct whole_board *whole = *state;
    uint32_t random = 3;
    for (uint32_t round = 0; round < 120; round++) {
        struct start_response response = start(whole);
        whole_board_run_ms(whole, 20);
        // Anywhere in the period; and up to the moment at which the third tick comes while the
        // request is read.
        uint64_t at = response.first_tick + 2 * response.period_ticks - 1 - round % 60;
        if (round >= 60)
            at -= next_random(&random) % 19000;
        if (at > hal_host.time)
            whole_board_run_until(whole, at - 50);
        hal_host_advance(at > hal_host.time ? at - hal_host.time : 0);
        uint32_t scheduled = stop(whole);
        uint32_t missed = whole_board_counters(whole).missed_ticks;
        size_t records = whole_board_count(whole, BOARD_FRAME_DATA);
        assert_int_equal(missed, 0);
        assert_int_equal(records, scheduled);
        // The last data frame comes before the response (a health frame may come at any time).
        size_t last = whole->frame_count - 1;
        while (whole->frames[last].payload[0] != (BOARD_COMMAND_STOP | BOARD_WIRE_RESPONSE_BIT)) {
            assert_int_not_equal(whole->frames[last].payload[0], BOARD_FRAME_DATA);
            assert_true(last > 0);
            last--;
        }
        assert_false(hal_host.sync_high);
        whole_board_run_ms(whole, 30);
        assert_int_equal(whole_board_count(whole, BOARD_FRAME_DATA), records);
        whole_board_forget(whole);
    }
}

static void housekeeping_is_read_once_a_second_from_each_source_in_turn(void **state)
{
    struct whole_board *whole = *state;
    start(whole);
    whole->adc.inputs[6] = 0x8AAAAA;
    whole_board_run_ms(whole, 500);
    whole->adc.inputs[6] = 0x555555;
    for (int i = 0; i < 2; i++) {
        whole_board_run_ms(whole, 900);
        struct health_frame health = whole_board_counters(whole);
        assert_int_equal(health.adc_temperature_code, 0x8AAAAA);
        assert_int_equal(health.supply_code, 0x555555);
        whole->adc.inputs[6] = 0x8AAAAA;
    }
    assert_int_equal(whole->adc.writes_while_running, 0);
    assert_int_equal(whole_board_counters(whole).scan_overruns, 0);
}

static void a_full_transmit_buffer_drops_whole_records_and_counts_them(void **state)
{
    struct whole_board *whole = *state;
    start(whole);
    whole_board_run_ms(whole, 5 * PERIOD_MS);
    hal_host.tx_space = 0;
    whole_board_run_ms(whole, 5 * PERIOD_MS);
    hal_host.tx_space = 255;
    whole_board_run_ms(whole, 5 * PERIOD_MS);
    uint32_t scheduled = stop(whole);
    uint32_t dropped = whole_board_counters(whole).dropped_frames;
    assert_in_range(dropped, 4, 6);
    assert_int_equal(whole_board_count(whole, BOARD_FRAME_DATA) + dropped, scheduled);
}

int main(void)
{
#define TEST(name)                                                                  \
    cmocka_unit_test_setup_teardown(name, whole_board_power_up_forgetful, whole_board_power_down)
    const struct CMUnitTest tests[] = {
        TEST(every_tick_becomes_one_complete_record),
        TEST(every_rate_keeps_its_period),
        TEST(channels_are_converted_in_the_order_configured),
        cmocka_unit_test(sequence_and_ticks_wrap_without_a_seam),
        TEST(encoders_are_those_at_the_tick),
        TEST(an_illegal_step_is_flagged_once),
        TEST(a_crc_error_costs_one_channel),
        TEST(random_crc_errors_never_give_a_wrong_code),
        TEST(a_left_out_channel_is_a_sequence_error),
        TEST(a_conversion_of_a_channel_that_was_read_ends_the_scan),
        TEST(conversions_of_a_later_round_are_not_taken),
        TEST(a_tick_at_any_moment_of_the_read_out_harms_neither_scan),
        TEST(a_tick_during_housekeeping_harms_neither),
        TEST(housekeeping_without_room_is_left_out),
        TEST(a_silent_adc_gives_marked_records_at_the_full_rate),
        TEST(an_adc_that_resets_itself_is_set_up_anew),
        TEST(an_adc_without_supply_comes_back_with_it),
        TEST(a_reset_that_only_status_tells_of_is_believed),
        TEST(every_flipped_bit_is_found_and_mended),
        TEST(a_bit_that_a_write_hides_spoils_no_scan_unmarked),
        TEST(a_bit_of_a_register_in_no_use_is_read_back_within_a_round),
        TEST(what_cannot_be_read_back_is_not_sent_as_valid),
        TEST(a_command_that_the_adc_could_not_take_is_counted_and_repeated),
        TEST(a_sequence_that_goes_on_from_sync_is_as_good_as_one_that_begins_anew),
        TEST(a_sequence_out_of_step_costs_one_scan_more),
        TEST(a_conversion_out_of_step_is_not_taken_however_late_it_is_read),
        TEST(a_stall_within_a_scan_keeps_what_was_read),
        TEST(ticks_missed_by_a_sleeping_main_loop_are_counted_and_marked),
        TEST(stop_waits_for_the_running_scan),
        TEST(housekeeping_is_read_once_a_second_from_each_source_in_turn),
        TEST(a_full_transmit_buffer_drops_whole_records_and_counts_them),
    };
    return cmocka_run_group_tests_name("scan", tests, NULL, NULL);
}
