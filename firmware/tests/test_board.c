// SPDX-License-Identifier: Apache-2.0
//
// What the board does by itself: boot frame, health, host silence, watchdog.
#include "check.h"
#include "whole_board.h"

static void the_first_frame_is_the_boot_frame(void **state)
{
    struct whole_board *whole = *state;
    assert_true(whole->frame_count >= 1);
    const struct received_frame *frame = &whole->frames[0];
    assert_int_equal(frame->payload[0], BOARD_FRAME_BOOT);
    assert_int_equal(frame->length, 1 + BOOT_FRAME_SIZE);
    struct boot_frame boot;
    boot_frame_unpack(&boot, frame->payload + 1);
    assert_int_equal(boot.reset_cause, BOARD_RESET_CAUSE_EXTERNAL);
    assert_int_equal(boot.boot_count, 3);
    assert_int_equal(boot.schema_hash, BOARD_SCHEMA_HASH);
    assert_int_equal(boot.configuration_origin, BOARD_CONFIGURATION_ORIGIN_DEFAULT_EMPTY);
}

static void the_board_starts_idle_with_the_adc_held(void **state)
{
    struct whole_board *whole = *state;
    whole_board_run_ms(whole, 500);
    assert_int_equal(whole_board_count(whole, BOARD_FRAME_DATA), 0);
    assert_false(hal_host.sync_high);
}

static void health_comes_once_a_second_streaming_or_not(void **state)
{
    struct whole_board *whole = *state;
    for (int round = 0; round < 2; round++) {
        whole_board_forget(whole);
        whole_board_run_ms(whole, 4000);
        assert_int_equal(whole_board_count(whole, BOARD_FRAME_HEALTH), 4);
        struct health_frame health;
        health_frame_unpack(&health, whole_board_frame(whole, BOARD_FRAME_HEALTH, 3)->payload + 1);
        assert_int_equal(health.state, round == 0 ? BOARD_STATE_IDLE : BOARD_STATE_STREAMING);
        assert_int_equal(health.boot_count, 3);
        assert_int_equal(health.stack_low_water, 7000);
        assert_int_equal(health.configuration_origin, BOARD_CONFIGURATION_ORIGIN_DEFAULT_EMPTY);
        whole_board_request(whole, BOARD_COMMAND_START, 1, NULL, 0);
    }
    assert_in_range(hal_host.led_toggles, 8, 9);
}

static void a_silent_host_ends_the_stream_after_five_seconds(void **state)
{
    struct whole_board *whole = *state;
    whole_board_request(whole, BOARD_COMMAND_START, 1, NULL, 0);
    whole_board_run_ms(whole, 4900);
    assert_int_equal(whole_board_counters(whole).state, BOARD_STATE_STREAMING);
    whole_board_forget(whole);
    whole_board_run_ms(whole, 4900); // the counters request began the five seconds anew
    assert_in_range(whole_board_count(whole, BOARD_FRAME_DATA), 489, 491);
    whole_board_run_ms(whole, 200);
    whole_board_forget(whole);
    whole_board_run_ms(whole, 1000);
    assert_int_equal(whole_board_count(whole, BOARD_FRAME_DATA), 0);
    assert_int_equal(whole_board_counters(whole).state, BOARD_STATE_IDLE);
    assert_false(hal_host.sync_high);
}

static void noise_on_the_line_is_no_host(void **state)
{
    struct whole_board *whole = *state;
    whole_board_request(whole, BOARD_COMMAND_START, 1, NULL, 0);
    const uint8_t noise[] = {0x13, 0x57, 0x9B, 0x00};
    for (int i = 0; i < 12; i++) {
        hal_host_receive(noise, sizeof noise);
        whole_board_run_ms(whole, 500);
    }
    assert_int_equal(whole_board_counters(whole).state, BOARD_STATE_IDLE);
}

static void the_watchdog_is_kicked_often_enough_in_every_state(void **state)
{
    struct whole_board *whole = *state;
    for (int round = 0; round < 2; round++) {
        for (int i = 0; i < 10; i++) {
            uint32_t before = hal_host.watchdog_kicks;
            whole_board_run_ms(whole, BOARD_WATCHDOG_MS / 2);
            assert_true(hal_host.watchdog_kicks > before);
        }
        whole_board_set_rate(whole, 10, 6); // the slowest beat
        whole_board_request(whole, BOARD_COMMAND_START, 2, NULL, 0);
    }
}

static void a_dead_sample_timer_starves_the_watchdog(void **state)
{
    struct whole_board *whole = *state;
    whole_board_request(whole, BOARD_COMMAND_START, 1, NULL, 0);
    whole_board_run_ms(whole, 100);
    hal_host.timer_running = false;
    whole_board_run_ms(whole, 20); // what was on its way
    uint32_t before = hal_host.watchdog_kicks;
    whole_board_run_ms(whole, 2 * BOARD_WATCHDOG_MS);
    assert_int_equal(hal_host.watchdog_kicks, before);
}

int main(void)
{
#define TEST(name)                                                                  \
    cmocka_unit_test_setup_teardown(name, whole_board_power_up, whole_board_power_down)
    const struct CMUnitTest tests[] = {
        TEST(the_first_frame_is_the_boot_frame),
        TEST(the_board_starts_idle_with_the_adc_held),
        TEST(health_comes_once_a_second_streaming_or_not),
        TEST(a_silent_host_ends_the_stream_after_five_seconds),
        TEST(noise_on_the_line_is_no_host),
        TEST(the_watchdog_is_kicked_often_enough_in_every_state),
        TEST(a_dead_sample_timer_starves_the_watchdog),
    };
    return cmocka_run_group_tests_name("board", tests, NULL, NULL);
}
