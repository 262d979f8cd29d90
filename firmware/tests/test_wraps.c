// SPDX-License-Identifier: Apache-2.0
//
// Counters that no test and no trial reaches the end of by itself, set just before it, three times.
#include <stdlib.h>

#include "check.h"
#include "whole_board.h"

#define ROUNDS 3
#define PERIOD 20000

static void start(struct whole_board *whole)
{
    struct received_frame frame = whole_board_request(whole, BOARD_COMMAND_START, 1, NULL, 0);
    assert_int_equal(frame.payload[2], BOARD_STATUS_OK);
}

static uint32_t stop(struct whole_board *whole)
{
    struct stop_response response;
    stop_response_unpack(&response,
                         whole_board_request(whole, BOARD_COMMAND_STOP, 2, NULL, 0).payload + 3);
    return response.scans_scheduled;
}

static void every_counter_of_what_went_wrong_passes_its_end(void **state)
{
    struct whole_board *whole = *state;
    for (int round = 0; round < ROUNDS; round++) {
        struct scan_counters *counters = &whole->board.scan.counters;
        *counters = (struct scan_counters){UINT32_MAX, UINT32_MAX, UINT32_MAX,
                                           UINT32_MAX, UINT32_MAX, UINT32_MAX};
        whole->board.parser.bad_frames = UINT32_MAX;
        whole->board.transmitter.dropped_frames = UINT32_MAX;
        hal_host.rx_overflows = UINT32_MAX;
        hal_host.encoders.illegal_steps = UINT32_MAX;
        start(whole);
        whole_board_forget(whole);
        whole_board_run_ms(whole, 15); // scan 0, whole
        whole->adc.corrupt_reads = 2;
        whole_board_run_ms(whole, 10);
        whole->adc.stalled = true; // cuts a scan short, at the next tick
        whole_board_run_ms(whole, 10);
        whole->adc.stalled = false;
        whole_board_run_ms(whole, 20);
        whole->adc.skip_channel = 3;
        whole_board_run_ms(whole, 10);
        whole->adc.skip_channel = 0xFF;
        whole_board_run_ms(whole, 10);
        hal_host_advance(3 * PERIOD); // asleep over three ticks: the last is taken
        hal_host.encoders.illegal_steps += 2;
        hal_host.rx_overflows += 3;
        const uint8_t noise[] = {0x13, 0x57, 0x9B, 0x00};
        hal_host_receive(noise, sizeof noise);
        whole_board_run_ms(whole, 30);
        hal_host.tx_space = 0;
        whole_board_run_ms(whole, 10);
        hal_host.tx_space = 255;
        whole_board_run_ms(whole, 20);
        whole->adc.registers[0] |= 0x10; // STATUS tells of a reset
        whole_board_run_ms(whole, 150);
        stop(whole);
        struct health_frame health = whole_board_counters(whole);
        assert_int_equal(health.adc_errors, 0);
        assert_int_equal(health.adc_restarts, 0);
        assert_int_equal(health.missed_ticks, 1);
        assert_in_range(health.scan_overruns, 0, 1);
        assert_int_equal(health.spi_crc_errors, 1);
        assert_in_range(health.adc_sequence_errors, 0, 9); // each scan of 10 ms without channel 3
        assert_int_equal(health.illegal_steps, 1);
        assert_int_equal(health.rx_overflows, 2);
        assert_int_equal(health.rx_bad_frames, 0);
        assert_in_range(health.dropped_frames, 0, 1);
        // Each is told once in the data, by the difference and not by the value.
        int missed = 0, illegal = 0;
        for (size_t n = 0; n < whole_board_count(whole, BOARD_FRAME_DATA); n++) {
            uint8_t flags = whole_board_data(whole, n).flags;
            missed += (flags & BOARD_FLAG_MISSED_TICK) != 0;
            illegal += (flags & BOARD_FLAG_ILLEGAL_STEP) != 0;
        }
        assert_int_equal(missed, 1);
        assert_int_equal(illegal, 1);
    }
}

static void the_number_of_scans_passes_its_end(void **state)
{
    struct whole_board *whole = *state;
    for (int round = 0; round < ROUNDS; round++) {
        start(whole);
        whole_board_forget(whole);
        whole->board.scan.scheduled = UINT32_MAX - 30;
        uint32_t kicks = hal_host.watchdog_kicks;
        whole_board_run_ms(whole, 1000);
        uint32_t scheduled = stop(whole);
        assert_in_range(scheduled, 66, 70); // 100 less 31, less the first period
        assert_in_range(hal_host.watchdog_kicks - kicks, 95, 105);
        size_t count = whole_board_count(whole, BOARD_FRAME_DATA);
        assert_int_equal(count, scheduled + 31);
        for (size_t n = 0; n < count; n++) {
            assert_int_equal(whole_board_data(whole, n).sequence, (uint16_t)(UINT32_MAX - 30 + n));
            assert_int_equal(whole_board_data(whole, n).flags, 0);
        }
        whole_board_forget(whole);
    }
}

static void health_and_silence_keep_their_time_over_the_end_of_32_bits(void **state)
{
    (void)state;
    for (uint64_t round = 1; round <= ROUNDS; round++) {
        // 2.5 s before the lower half of the time passes its end.
        struct whole_board *whole = whole_board_new_at((round << 32) - 5000000);
        start(whole);
        whole_board_forget(whole);
        whole_board_run_ms(whole, 4800);
        assert_in_range(whole_board_count(whole, BOARD_FRAME_HEALTH), 4, 5);
        assert_true(whole->board.scan.streaming);
        whole_board_run_ms(whole, 400); // silent for more than 5 s
        assert_false(whole->board.scan.streaming);
        free(whole);
    }
}

int main(void)
{
#define TEST(name)                                                                  \
    cmocka_unit_test_setup_teardown(name, whole_board_power_up, whole_board_power_down)
    const struct CMUnitTest tests[] = {
        TEST(every_counter_of_what_went_wrong_passes_its_end),
        TEST(the_number_of_scans_passes_its_end),
        cmocka_unit_test(health_and_silence_keep_their_time_over_the_end_of_32_bits),
    };
    return cmocka_run_group_tests_name("wraps", tests, NULL, NULL);
}
