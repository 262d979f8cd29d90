// SPDX-License-Identifier: Apache-2.0
#include <stdbool.h>
#include <string.h>

#include "check.h"
#include "configuration.h"

static uint8_t check_rate(uint16_t rate_hz, uint8_t filter_type, uint16_t filter_fs)
{
    struct configure_arguments configuration = configuration_default();
    configuration.rate_hz = rate_hz;
    configuration.filter_type = filter_type;
    configuration.filter_fs = filter_fs;
    return configuration_check(&configuration);
}

#define SINC4 BOARD_ADC_FILTER_SINC4
#define SINC3 BOARD_ADC_FILTER_SINC3

static void the_default_is_good(void **state)
{
    (void)state;
    struct configure_arguments configuration = configuration_default();
    assert_int_equal(configuration_check(&configuration), BOARD_STATUS_OK);
    assert_int_equal(configuration_channels(&configuration), BOARD_CHANNEL_COUNT);
    assert_int_equal(configuration_period(&configuration), 20000);
    // 6 × (3 · 32 · 6 + 95) / 614.4 kHz · 1.05 + 0.2 ms = 7.081 ms
    assert_int_equal(configuration_longest_scan(&configuration), 14160);
}

static void a_scan_must_fit_its_period(void **state)
{
    (void)state;
    assert_int_equal(check_rate(10, SINC3, 6), BOARD_STATUS_OK);
    assert_int_equal(check_rate(200, SINC3, 3), BOARD_STATUS_OK);
    assert_int_equal(check_rate(100, SINC3, 8), BOARD_STATUS_OK);           // 8.43 ms
    assert_int_equal(check_rate(100, SINC3, 9), BOARD_STATUS_DOES_NOT_FIT); // 5 % slow 9.83 ms
    assert_int_equal(check_rate(100, SINC3, 10), BOARD_STATUS_DOES_NOT_FIT);
    assert_int_equal(check_rate(200, SINC3, 6), BOARD_STATUS_DOES_NOT_FIT); // 6.55 ms in 5 ms
    assert_int_equal(check_rate(100, SINC4, 6), BOARD_STATUS_OK);           // 8.43 ms
    assert_int_equal(check_rate(100, SINC4, 7), BOARD_STATUS_DOES_NOT_FIT); // 5 % slow 10.2 ms
    assert_int_equal(check_rate(10, SINC4, 2047), BOARD_STATUS_DOES_NOT_FIT);
}

static void values_out_of_range_are_refused(void **state)
{
    (void)state;
    assert_int_equal(check_rate(9, SINC3, 6), BOARD_STATUS_BAD_ARGUMENT);
    assert_int_equal(check_rate(201, SINC3, 3), BOARD_STATUS_BAD_ARGUMENT);
    assert_int_equal(check_rate(0, SINC3, 6), BOARD_STATUS_BAD_ARGUMENT);
    assert_int_equal(check_rate(65535, SINC3, 6), BOARD_STATUS_BAD_ARGUMENT);
    assert_int_equal(check_rate(100, SINC3, 0), BOARD_STATUS_BAD_ARGUMENT);
    assert_int_equal(check_rate(100, SINC3, 2), BOARD_STATUS_BAD_ARGUMENT);
    assert_int_equal(check_rate(10, SINC3, 2048), BOARD_STATUS_BAD_ARGUMENT);
    assert_int_equal(check_rate(10, SINC3, 65535), BOARD_STATUS_BAD_ARGUMENT);
    for (int type = 0; type < 256; type++) {
        bool known = type == SINC3 || type == SINC4;
        assert_int_equal(check_rate(10, (uint8_t)type, 6),
                         known ? BOARD_STATUS_OK : BOARD_STATUS_BAD_ARGUMENT);
    }
}

static void gains_are_the_powers_of_two_to_128(void **state)
{
    (void)state;
    for (int gain = 0; gain < 256; gain++) {
        bool good = gain == 1 || gain == 2 || gain == 4 || gain == 8 || gain == 16 || gain == 32 ||
                    gain == 64 || gain == 128;
        for (uint8_t channel = 0; channel < BOARD_CHANNEL_COUNT; channel++) {
            struct configure_arguments configuration = configuration_default();
            configuration.gains[channel] = (uint8_t)gain;
            assert_int_equal(configuration_check(&configuration),
                             good ? BOARD_STATUS_OK : BOARD_STATUS_BAD_ARGUMENT);
        }
    }
}

static void each_channel_stands_once_in_the_order_and_gaps_at_its_end(void **state)
{
    (void)state;
    static const struct {
        uint8_t order[BOARD_CHANNEL_COUNT];
        uint8_t channels; // 0: refused
    } cases[] = {
        {{5, 4, 3, 2, 1, 0}, 6},       {{2, 255, 255, 255, 255, 255}, 1},
        {{0, 1, 5, 255, 255, 255}, 3}, {{255, 255, 255, 255, 255, 255}, 0},
        {{0, 1, 2, 3, 4, 4}, 0},       {{0, 1, 2, 3, 4, 6}, 0},
        {{0, 255, 2, 3, 4, 5}, 0},     {{255, 1, 2, 3, 4, 5}, 0},
        {{0, 1, 2, 3, 4, 254}, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct configure_arguments configuration = configuration_default();
        memcpy(configuration.order, cases[i].order, sizeof configuration.order);
        assert_int_equal(configuration_check(&configuration),
                         cases[i].channels > 0 ? BOARD_STATUS_OK : BOARD_STATUS_BAD_ARGUMENT);
        if (cases[i].channels > 0)
            assert_int_equal(configuration_channels(&configuration), cases[i].channels);
    }
}

static void fewer_channels_fit_a_higher_rate(void **state)
{
    (void)state;
    struct configure_arguments configuration = configuration_default();
    configuration.rate_hz = 200;
    assert_int_equal(configuration_check(&configuration), BOARD_STATUS_DOES_NOT_FIT);
    memset(configuration.order + 4, CONFIGURATION_NO_CHANNEL, 2); // 4 × 1.09 ms
    assert_int_equal(configuration_check(&configuration), BOARD_STATUS_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_default_is_good),
        cmocka_unit_test(a_scan_must_fit_its_period),
        cmocka_unit_test(values_out_of_range_are_refused),
        cmocka_unit_test(gains_are_the_powers_of_two_to_128),
        cmocka_unit_test(each_channel_stands_once_in_the_order_and_gaps_at_its_end),
        cmocka_unit_test(fewer_channels_fit_a_higher_rate),
    };
    return cmocka_run_group_tests_name("configuration", tests, NULL, NULL);
}
