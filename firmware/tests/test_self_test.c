// SPDX-License-Identifier: Apache-2.0
#include "check.h"
#include "whole_board.h"

static struct self_test_response self_test(struct whole_board *whole)
{
    struct received_frame frame =
        whole_board_request(whole, BOARD_COMMAND_SELF_TEST, 1, NULL, 0);
    assert_int_equal(frame.payload[2], BOARD_STATUS_OK);
    assert_int_equal(frame.length, 3 + SELF_TEST_RESPONSE_SIZE);
    struct self_test_response response;
    self_test_response_unpack(&response, frame.payload + 3);
    return response;
}

static void it_converts_the_test_inputs_of_the_data_sheet(void **state)
{
    struct whole_board *whole = *state;
    self_test(whole);
    const uint32_t *registers = whole->adc.registers;
    // Enable, setup, AINP, AINM: a pin on itself, 20 mV, AVDD/6 twice, three axes.
    assert_int_equal(registers[0x09], 0x8000 | 0 << 12 | 0 << 5 | 0);
    assert_int_equal(registers[0x0A], 0x8000 | 1 << 12 | 28 << 5 | 29);
    assert_int_equal(registers[0x0B], 0x8000 | 2 << 12 | 20 << 5 | 21);
    assert_int_equal(registers[0x0C], 0x8000 | 3 << 12 | 20 << 5 | 21);
    assert_int_equal(registers[0x0D], 0x8000 | 4 << 12 | 4 << 5 | 17);
    assert_int_equal(registers[0x0E], 0x8000 | 5 << 12 | 5 << 5 | 17);
    assert_int_equal(registers[0x0F], 0x8000 | 6 << 12 | 6 << 5 | 17);
    assert_int_equal(registers[0x1A], 0x0875); // bipolar, buffers, internal reference, gain 32
    assert_int_equal(registers[0x1B], 0x0810); // bipolar on the internal reference …
    assert_int_equal(registers[0x1C], 0x0900); // … and on REFIN1
    assert_int_equal(whole->adc.writes_refused, 0);
    assert_int_equal(whole->adc.writes_while_running, 0);
}

static void a_sound_board_gives_what_its_inputs_are(void **state)
{
    struct whole_board *whole = *state;
    const uint32_t deflections[3] = {0x5000, 0x6000, 0x7000};
    for (int i = 0; i < 3; i++)
        whole->adc.deflections[4 + i] = deflections[i];
    whole->adc.gains[1] = 5; // the 20 mV's
    uint64_t before = hal_host.time;
    struct self_test_response response = self_test(whole);
    whole->adc.gains[1] = 0;
    assert_in_range(hal_host.time - before, 1, BOARD_WATCHDOG_MS * (BOARD_TICK_HZ / 1000));
    assert_int_equal(response.adc_id, 0x14);
    assert_int_equal(response.spi_errors, 0);
    assert_int_equal(response.conversions_missing, 0);
    assert_int_equal(response.short_code, 0x100000);
    assert_int_equal(response.short_spread, 0);
    assert_int_equal(response.known_voltage_code, 0x100001);
    assert_int_equal(response.supply_code, 0x100002);
    assert_int_equal(response.supply_on_refin1_code, 0x100003);
    for (uint32_t i = 0; i < 3; i++) {
        assert_int_equal(response.rest_codes[i], 0x100004 + i);
        assert_int_equal(response.deflected_codes[i], 0x100004 + i + deflections[i]);
    }
    // And it leaves things as it found them.
    assert_false(hal_host.accelerometer_self_test);
    assert_false(hal_host.sync_high);
    whole_board_request(whole, BOARD_COMMAND_START, 1, NULL, 0);
    whole_board_forget(whole);
    whole_board_run_ms(whole, 200);
    assert_int_equal(whole_board_data(whole, 3).valid_mask, 0x3F);
}

static void an_absent_adc_is_told_by_its_id(void **state)
{
    struct whole_board *whole = *state;
    whole->adc.absent = true;
    struct self_test_response response = self_test(whole);
    uint8_t bytes[SELF_TEST_RESPONSE_SIZE];
    self_test_response_pack(bytes, &response);
    const uint8_t nothing[SELF_TEST_RESPONSE_SIZE] = {0};
    assert_memory_equal(bytes, nothing, sizeof bytes);
}

static void a_corrupted_bus_is_counted(void **state)
{
    struct whole_board *whole = *state;
    // Behind STATUS and ID: one echo, then one conversion of the second round.
    whole->adc.corrupt_reads_after = 2 + 7;
    whole->adc.corrupt_reads = 1;
    assert_int_equal(self_test(whole).spi_errors, 1);
    // STATUS and ID, the echoes, STATUS and ID again, CRC and CONTROL, 7 × (CONFIG, FILTER, CHANNEL).
    whole->adc.corrupt_reads_after = 2 + 29 + 2 + 2 + 21 + 9;
    whole->adc.corrupt_reads = 1;
    struct self_test_response response = self_test(whole);
    assert_int_equal(response.spi_errors, 1);
    assert_int_equal(response.conversions_missing, 0);
    assert_int_equal(response.supply_code, 0x100002); // of the seven that are left
}

static void an_adc_that_stops_is_not_waited_for(void **state)
{
    struct whole_board *whole = *state;
    whole->adc.stalled = true;
    uint64_t before = hal_host.time;
    struct self_test_response response = self_test(whole);
    assert_in_range(hal_host.time - before, 1, BOARD_WATCHDOG_MS * (BOARD_TICK_HZ / 1000));
    assert_int_equal(response.adc_id, 0x14);
    assert_int_equal(response.conversions_missing, 2 * 8 * 7);
    assert_int_equal(response.known_voltage_code, 0);
}

static void it_is_refused_while_streaming(void **state)
{
    struct whole_board *whole = *state;
    whole_board_request(whole, BOARD_COMMAND_START, 1, NULL, 0);
    struct received_frame frame = whole_board_request(whole, BOARD_COMMAND_SELF_TEST, 1, NULL, 0);
    assert_int_equal(frame.payload[2], BOARD_STATUS_NOT_IDLE);
}

int main(void)
{
#define TEST(name)                                                                  \
    cmocka_unit_test_setup_teardown(name, whole_board_power_up_forgetful, whole_board_power_down)
    const struct CMUnitTest tests[] = {
        TEST(it_converts_the_test_inputs_of_the_data_sheet),
        TEST(a_sound_board_gives_what_its_inputs_are),
        TEST(an_absent_adc_is_told_by_its_id),
        TEST(a_corrupted_bus_is_counted),
        TEST(an_adc_that_stops_is_not_waited_for),
        TEST(it_is_refused_while_streaming),
    };
    return cmocka_run_group_tests_name("self-test", tests, NULL, NULL);
}
