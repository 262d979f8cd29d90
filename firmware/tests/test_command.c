// SPDX-License-Identifier: Apache-2.0
#include <stdlib.h>

#include "check.h"
#include "configuration.h"
#include "whole_board.h"

static uint8_t status_of(struct whole_board *whole, uint8_t type, const uint8_t *arguments,
                         uint8_t length)
{
    return whole_board_request(whole, type, 42, arguments, length).payload[2];
}

static void identify_says_who_the_board_is(void **state)
{
    struct received_frame frame = whole_board_request(*state, BOARD_COMMAND_IDENTIFY, 7, NULL, 0);
    assert_int_equal(frame.length, 3 + IDENTIFY_RESPONSE_SIZE);
    assert_int_equal(frame.payload[2], BOARD_STATUS_OK);
    struct identify_response response;
    identify_response_unpack(&response, frame.payload + 3);
    const uint8_t version[] = BOARD_FIRMWARE_VERSION;
    assert_int_equal(response.protocol, 1);
    assert_int_equal(response.schema_hash, BOARD_SCHEMA_HASH);
    assert_memory_equal(response.firmware_version, version, sizeof version);
    assert_int_equal(response.adc_id, 0x14);
    assert_int_equal(response.clock_hz, 2000000);
    assert_int_equal(response.calibration_id, 0x0A0B0C0D);
    assert_int_equal(response.board_serial, 0x01020304);
}

static void identify_lies_on_the_wire_as_the_protocol_says(void **state)
{
    struct received_frame frame = whole_board_request(*state, BOARD_COMMAND_IDENTIFY, 7, NULL, 0);
    const uint8_t *data = frame.payload + 3;
    assert_int_equal(data[0], 1);
    assert_int_equal(data[1], BOARD_SCHEMA_HASH & 0xFF);
    assert_int_equal(data[4], BOARD_SCHEMA_HASH >> 24);
    assert_int_equal(data[8], 0x14);
    const uint8_t clock_hz[] = {0x80, 0x84, 0x1E, 0x00};
    assert_memory_equal(data + 9, clock_hz, 4);
    const uint8_t calibration_id[] = {0x0D, 0x0C, 0x0B, 0x0A};
    assert_memory_equal(data + 13, calibration_id, 4);
}

static void identify_tells_of_an_adc_that_came_later(void **state)
{
    struct whole_board *whole = *state;
    for (int present = 0; present < 2; present++) {
        whole->adc.absent = present == 0; // its supply is switched on after the board's
        struct received_frame frame =
            whole_board_request(whole, BOARD_COMMAND_IDENTIFY, 7, NULL, 0);
        assert_int_equal(frame.payload[3 + 8], present ? 0x14 : 0);
    }
}

static struct identity_response identity_of(struct whole_board *whole)
{
    struct received_frame frame = whole_board_request(whole, BOARD_COMMAND_IDENTITY, 8, NULL, 0);
    assert_int_equal(frame.length, 3 + IDENTITY_RESPONSE_SIZE);
    struct identity_response response;
    identity_response_unpack(&response, frame.payload + 3);
    return response;
}

static uint8_t set_identity(struct whole_board *whole, uint32_t serial, uint32_t calibration_id)
{
    uint8_t arguments[SET_IDENTITY_ARGUMENTS_SIZE];
    const struct set_identity_arguments numbers = {serial, calibration_id};
    set_identity_arguments_pack(arguments, &numbers);
    return status_of(whole, BOARD_COMMAND_SET_IDENTITY, arguments, sizeof arguments);
}

static void an_identity_is_stored_and_believed_with_its_checksum_only(void **state)
{
    struct whole_board *whole = *state;
    assert_int_equal(set_identity(whole, 17, UINT32_MAX), BOARD_STATUS_BAD_ARGUMENT);
    assert_int_equal(set_identity(whole, UINT32_MAX, 3), BOARD_STATUS_BAD_ARGUMENT);
    assert_int_equal(set_identity(whole, 17, 3), BOARD_STATUS_OK);
    board_init(&whole->board); // as after a reset
    struct identity_response found = identity_of(whole);
    assert_int_equal(found.state, BOARD_IDENTITY_STATE_VALID);
    assert_int_equal(found.board_serial, 17);
    assert_int_equal(found.calibration_id, 3);
    hal_host.eeprom[BOARD_EEPROM_CALIBRATION_ID] ^= 0x10;
    found = identity_of(whole);
    assert_int_equal(found.state, BOARD_IDENTITY_STATE_DAMAGED);
    assert_int_equal(found.calibration_id, 0x13);
    struct received_frame frame = whole_board_request(whole, BOARD_COMMAND_IDENTIFY, 7, NULL, 0);
    struct identify_response identified;
    identify_response_unpack(&identified, frame.payload + 3);
    assert_int_equal(identified.calibration_id, UINT32_MAX);
    assert_int_equal(identified.board_serial, UINT32_MAX);
    hal_host.eeprom_bytes_left = 2;
    assert_int_equal(set_identity(whole, 1000000, 5), BOARD_STATUS_STORAGE_FAULT);
    hal_host.eeprom_bytes_left = UINT32_MAX;
    assert_int_equal(status_of(whole, BOARD_COMMAND_START, NULL, 0), BOARD_STATUS_OK);
    assert_int_equal(set_identity(whole, 17, 3), BOARD_STATUS_NOT_IDLE);
}

static void the_request_id_is_echoed(void **state)
{
    for (int id = 0; id < 256; id++) {
        struct received_frame frame =
            whole_board_request(*state, BOARD_COMMAND_SYNC, (uint8_t)id, NULL, 0);
        assert_int_equal(frame.payload[0], 0x86);
        assert_int_equal(frame.payload[1], id);
        whole_board_forget(*state);
    }
}

static void unknown_commands_are_answered_as_such(void **state)
{
    static const uint8_t unknown[] = {0x00, 0x0D, 0x10, 0x7F};
    for (size_t i = 0; i < sizeof unknown; i++) {
        struct received_frame frame = whole_board_request(*state, unknown[i], 9, NULL, 0);
        assert_int_equal(frame.length, 3);
        assert_int_equal(frame.payload[0], unknown[i] | 0x80);
        assert_int_equal(frame.payload[1], 9);
        assert_int_equal(frame.payload[2], BOARD_STATUS_UNKNOWN_COMMAND);
    }
}

static void a_wrong_length_is_refused(void **state)
{
    static const uint8_t arguments[BOARD_WIRE_MAXIMUM_PAYLOAD] = {0};
    static const struct {
        uint8_t type, size;
    } commands[] = {
        {BOARD_COMMAND_IDENTIFY, 0}, {BOARD_COMMAND_CONFIGURE, 17}, {BOARD_COMMAND_START, 0},
        {BOARD_COMMAND_STOP, 0},     {BOARD_COMMAND_SYNC, 0},       {BOARD_COMMAND_COUNTERS, 0},
        {BOARD_COMMAND_CONFIGURATION, 0}, {BOARD_COMMAND_SELF_TEST, 0}, {BOARD_COMMAND_RESET, 0},
        {BOARD_COMMAND_IDENTITY, 0}, {BOARD_COMMAND_SET_IDENTITY, 8},
    };
    struct whole_board *whole = *state;
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        for (uint8_t length = 0; length <= BOARD_WIRE_MAXIMUM_PAYLOAD - 2; length++) {
            if (length == commands[i].size)
                continue;
            assert_int_equal(status_of(whole, commands[i].type, arguments, length),
                             BOARD_STATUS_BAD_LENGTH);
        }
    }
    assert_false(whole->board.scan.streaming);
}

static struct configure_arguments configuration_of(struct whole_board *whole)
{
    struct received_frame frame =
        whole_board_request(whole, BOARD_COMMAND_CONFIGURATION, 5, NULL, 0);
    assert_int_equal(frame.length, 3 + CONFIGURE_ARGUMENTS_SIZE);
    struct configure_arguments configuration;
    configure_arguments_unpack(&configuration, frame.payload + 3);
    return configuration;
}

// By the bytes on the wire: the struct has padding.
static void assert_same(const struct configure_arguments *a, const struct configure_arguments *b)
{
    uint8_t bytes_a[CONFIGURE_ARGUMENTS_SIZE], bytes_b[CONFIGURE_ARGUMENTS_SIZE];
    configure_arguments_pack(bytes_a, a);
    configure_arguments_pack(bytes_b, b);
    assert_memory_equal(bytes_a, bytes_b, CONFIGURE_ARGUMENTS_SIZE);
}

static void a_configuration_is_in_force_and_stored_as_a_whole(void **state)
{
    struct whole_board *whole = *state;
    struct configure_arguments wanted = configuration_default();
    const struct configure_arguments defaults = configuration_default();
    struct configure_arguments found = configuration_of(whole);
    assert_same(&found, &defaults);
    wanted.rate_hz = 50;
    wanted.filter_type = BOARD_ADC_FILTER_SINC4;
    wanted.filter_fs = 9;
    wanted.gains[1] = 32;
    wanted.order[0] = 3;
    wanted.order[3] = 0;
    assert_int_equal(whole_board_configure(whole, &wanted), BOARD_STATUS_OK);
    struct configure_arguments refused = wanted;
    refused.gains[0] = 64;
    refused.rate_hz = 200;
    assert_int_equal(whole_board_configure(whole, &refused), BOARD_STATUS_DOES_NOT_FIT);
    refused.rate_hz = 50;
    refused.gains[5] = 3;
    assert_int_equal(whole_board_configure(whole, &refused), BOARD_STATUS_BAD_ARGUMENT);
    found = configuration_of(whole);
    assert_same(&found, &wanted);

    board_init(&whole->board); // as after a reset
    found = configuration_of(whole);
    assert_same(&found, &wanted);
    assert_int_equal(whole_board_counters(whole).configuration_origin,
                     BOARD_CONFIGURATION_ORIGIN_STORED);
    // And it reaches the ADC: accel_y with sinc4, then pressure 2 with its gain of 2^5.
    assert_int_equal(status_of(whole, BOARD_COMMAND_START, NULL, 0), BOARD_STATUS_OK);
    assert_int_equal(whole->adc.registers[0x09], 0x8000 | 0 << 12 | 5 << 5 | 17);
    assert_int_equal(whole->adc.registers[0x21], 0x060009);
    assert_int_equal(whole->adc.registers[0x0A], 0x8000 | 1 << 12 | 2 << 5 | 3);
    assert_int_equal(whole->adc.registers[0x1A], 0x0965);
}

static void the_same_configuration_again_does_not_wear_the_eeprom(void **state)
{
    struct whole_board *whole = *state;
    assert_int_equal(whole_board_set_rate(whole, 100, 6), BOARD_STATUS_OK);
    hal_host.eeprom_bytes_left = 0;
    for (int i = 0; i < 10; i++)
        assert_int_equal(whole_board_set_rate(whole, 100, 6), BOARD_STATUS_OK);
}

static void an_eeprom_that_does_not_hold_it_is_a_storage_fault(void **state)
{
    struct whole_board *whole = *state;
    hal_host.eeprom_bytes_left = 5;
    assert_int_equal(whole_board_set_rate(whole, 50, 6), BOARD_STATUS_STORAGE_FAULT);
    assert_int_equal(configuration_of(whole).rate_hz, 50); // in force until the next reset
    assert_int_equal(whole_board_counters(whole).configuration_origin,
                     BOARD_CONFIGURATION_ORIGIN_UNSTORED);
    hal_host.eeprom_bytes_left = UINT32_MAX;
    assert_int_equal(whole_board_set_rate(whole, 50, 6), BOARD_STATUS_OK);
    assert_int_equal(whole_board_counters(whole).configuration_origin,
                     BOARD_CONFIGURATION_ORIGIN_STORED);
}

static void configure_and_start_are_refused_while_streaming(void **state)
{
    struct whole_board *whole = *state;
    assert_int_equal(status_of(whole, BOARD_COMMAND_START, NULL, 0), BOARD_STATUS_OK);
    whole_board_run_ms(whole, 50);
    assert_int_equal(whole_board_set_rate(whole, 50, 6), BOARD_STATUS_NOT_IDLE);
    assert_int_equal(status_of(whole, BOARD_COMMAND_START, NULL, 0), BOARD_STATUS_NOT_IDLE);
    whole_board_forget(whole);
    whole_board_run_ms(whole, 100);
    assert_in_range(whole_board_count(whole, BOARD_FRAME_DATA), 9, 11); // still at 100 Hz
    assert_int_equal(status_of(whole, BOARD_COMMAND_STOP, NULL, 0), BOARD_STATUS_OK);
    assert_int_equal(whole_board_set_rate(whole, 50, 6), BOARD_STATUS_OK);
}

static void stop_may_be_repeated(void **state)
{
    struct whole_board *whole = *state;
    struct stop_response first, second;
    assert_int_equal(status_of(whole, BOARD_COMMAND_START, NULL, 0), BOARD_STATUS_OK);
    whole_board_run_ms(whole, 100);
    stop_response_unpack(&first,
                         whole_board_request(whole, BOARD_COMMAND_STOP, 1, NULL, 0).payload + 3);
    stop_response_unpack(&second,
                         whole_board_request(whole, BOARD_COMMAND_STOP, 2, NULL, 0).payload + 3);
    assert_in_range(first.scans_scheduled, 9, 11);
    assert_int_equal(second.scans_scheduled, first.scans_scheduled);
}

static void start_counts_from_zero_again(void **state)
{
    struct whole_board *whole = *state;
    for (int round = 0; round < 3; round++) {
        assert_int_equal(status_of(whole, BOARD_COMMAND_START, NULL, 0), BOARD_STATUS_OK);
        whole_board_forget(whole);
        whole_board_run_ms(whole, 50);
        assert_int_equal(whole_board_data(whole, 0).sequence, 0);
        assert_in_range(whole_board_counters(whole).scans_scheduled, 4, 6);
        assert_int_equal(status_of(whole, BOARD_COMMAND_STOP, NULL, 0), BOARD_STATUS_OK);
    }
}

static void reset_answers_before_it_resets(void **state)
{
    struct whole_board *whole = *state;
    assert_int_equal(hal_host.resets, 0);
    assert_int_equal(status_of(whole, BOARD_COMMAND_RESET, NULL, 0), BOARD_STATUS_OK);
    assert_int_equal(hal_host.resets, 1);
    assert_int_equal(status_of(whole, BOARD_COMMAND_START, NULL, 0), BOARD_STATUS_OK);
    assert_int_equal(status_of(whole, BOARD_COMMAND_RESET, NULL, 0), BOARD_STATUS_OK);
    assert_int_equal(hal_host.resets, 2);
}

static void start_without_an_adc_is_an_adc_fault(void **state)
{
    struct whole_board *whole = *state;
    whole->adc.absent = true;
    assert_int_equal(status_of(whole, BOARD_COMMAND_START, NULL, 0), BOARD_STATUS_ADC_FAULT);
    whole_board_run_ms(whole, 100);
    assert_int_equal(whole_board_count(whole, BOARD_FRAME_DATA), 0);
    whole->adc.absent = false;
    assert_int_equal(status_of(whole, BOARD_COMMAND_START, NULL, 0), BOARD_STATUS_OK);
}

static void sync_gives_reception_and_sending_in_order(void **state)
{
    struct whole_board *whole = *state;
    uint64_t sent = hal_host.time;
    struct received_frame frame = whole_board_request(whole, BOARD_COMMAND_SYNC, 1, NULL, 0);
    struct sync_response response;
    sync_response_unpack(&response, frame.payload + 3);
    assert_int_equal(response.received_ticks, sent);
    assert_in_range(response.sent_ticks - response.received_ticks, 1, 2000);
}

static void sync_has_all_64_bits(void **state)
{
    (void)state;
    struct whole_board *whole = whole_board_new_at(UINT64_C(0x123456789A));
    uint64_t sent = hal_host.time;
    struct received_frame frame = whole_board_request(whole, BOARD_COMMAND_SYNC, 1, NULL, 0);
    struct sync_response response;
    sync_response_unpack(&response, frame.payload + 3);
    assert_int_equal(response.received_ticks, sent);
    free(whole);
}

static void what_is_no_request_is_a_bad_frame_without_answer(void **state)
{
    struct whole_board *whole = *state;
    static const uint8_t one_byte[] = {BOARD_COMMAND_IDENTIFY};
    static const uint8_t a_response[] = {BOARD_COMMAND_IDENTIFY | 0x80, 1, 0};
    uint8_t frame[FRAME_MAXIMUM];
    hal_host_receive(frame, frame_encode(frame, one_byte, sizeof one_byte));
    hal_host_receive(frame, frame_encode(frame, a_response, sizeof a_response));
    whole_board_run_ms(whole, 5);
    assert_int_equal(whole->frame_count, 0);
    assert_int_equal(whole_board_counters(whole).rx_bad_frames, 2);
}

static void random_bytes_and_random_requests_leave_the_board_answering(void **state)
{
    struct whole_board *whole = *state;
    uint32_t random = 31;
    for (int round = 0; round < 3000; round++) {
        uint8_t bytes[60], frame[FRAME_MAXIMUM];
        uint8_t length = (uint8_t)(1 + next_random(&random) % sizeof bytes);
        for (uint8_t i = 0; i < length; i++)
            bytes[i] = (uint8_t)(next_random(&random) >> 24);
        bytes[0] &= 0x0F; // mostly real commands, with random arguments and lengths
        if (round % 2 == 0)
            hal_host_receive(frame, frame_encode(frame, bytes, length));
        else
            hal_host_receive(bytes, length);
        whole_board_run_ms(whole, 1);
        whole_board_forget(whole);
    }
    const uint8_t delimiter[1] = {0};
    hal_host_receive(delimiter, 1);
    assert_int_equal(status_of(whole, BOARD_COMMAND_STOP, NULL, 0), BOARD_STATUS_OK);
    assert_int_equal(whole_board_set_rate(whole, 100, 6), BOARD_STATUS_OK);
    assert_int_equal(status_of(whole, BOARD_COMMAND_START, NULL, 0), BOARD_STATUS_OK);
}

int main(void)
{
#define TEST(name)                                                                  \
    cmocka_unit_test_setup_teardown(name, whole_board_power_up_forgetful, whole_board_power_down)
    const struct CMUnitTest tests[] = {
        TEST(identify_says_who_the_board_is),
        TEST(identify_lies_on_the_wire_as_the_protocol_says),
        TEST(identify_tells_of_an_adc_that_came_later),
        TEST(an_identity_is_stored_and_believed_with_its_checksum_only),
        TEST(the_request_id_is_echoed),
        TEST(unknown_commands_are_answered_as_such),
        TEST(a_wrong_length_is_refused),
        TEST(a_configuration_is_in_force_and_stored_as_a_whole),
        TEST(the_same_configuration_again_does_not_wear_the_eeprom),
        TEST(an_eeprom_that_does_not_hold_it_is_a_storage_fault),
        TEST(configure_and_start_are_refused_while_streaming),
        TEST(stop_may_be_repeated),
        TEST(start_counts_from_zero_again),
        TEST(reset_answers_before_it_resets),
        TEST(start_without_an_adc_is_an_adc_fault),
        TEST(sync_gives_reception_and_sending_in_order),
        cmocka_unit_test(sync_has_all_64_bits),
        TEST(what_is_no_request_is_a_bad_frame_without_answer),
        TEST(random_bytes_and_random_requests_leave_the_board_answering),
    };
    return cmocka_run_group_tests_name("command", tests, NULL, NULL);
}
