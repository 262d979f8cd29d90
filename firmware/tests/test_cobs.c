// SPDX-License-Identifier: Apache-2.0
#include <string.h>

#include "check.h"
#include "cobs.h"

struct vector {
    uint8_t message[8], coded[8];
    uint8_t length;
};

static void known_vectors(void **state)
{
    (void)state;
    static const struct vector vectors[] = {
        {{0x00}, {0x01, 0x01}, 1},
        {{0x00, 0x00}, {0x01, 0x01, 0x01}, 2},
        {{0x11, 0x22, 0x00, 0x33}, {0x03, 0x11, 0x22, 0x02, 0x33}, 4},
        {{0x11, 0x22, 0x33, 0x44}, {0x05, 0x11, 0x22, 0x33, 0x44}, 4},
        {{0x11, 0x00, 0x00, 0x00}, {0x02, 0x11, 0x01, 0x01, 0x01}, 4},
    };
    for (size_t i = 0; i < sizeof vectors / sizeof vectors[0]; i++) {
        uint8_t coded[8];
        uint8_t length = cobs_encode(coded, vectors[i].message, vectors[i].length);
        assert_int_equal(length, vectors[i].length + 1);
        assert_memory_equal(coded, vectors[i].coded, length);
        assert_true(cobs_decode(coded, &length));
        assert_int_equal(length, vectors[i].length);
        assert_memory_equal(coded, vectors[i].message, length);
    }
}

static void longest_message_without_zero(void **state)
{
    (void)state;
    uint8_t message[COBS_MAXIMUM], coded[COBS_MAXIMUM + 1];
    memset(message, 0xA5, sizeof message);
    uint8_t length = cobs_encode(coded, message, sizeof message);
    assert_int_equal(length, 255);
    assert_int_equal(coded[0], 0xFF);
    assert_true(cobs_decode(coded, &length));
    assert_int_equal(length, COBS_MAXIMUM);
    assert_memory_equal(coded, message, length);
}

static void random_messages_survive_and_hold_no_zero(void **state)
{
    (void)state;
    uint32_t random = 20011;
    for (int round = 0; round < 20000; round++) {
        uint8_t message[COBS_MAXIMUM], coded[COBS_MAXIMUM + 1];
        uint8_t length = (uint8_t)(next_random(&random) % (COBS_MAXIMUM + 1));
        uint8_t zeros_one_in = (uint8_t)(1 + next_random(&random) % 20);
        for (uint8_t i = 0; i < length; i++) {
            uint32_t draw = next_random(&random);
            message[i] = draw % zeros_one_in == 0 ? 0 : (uint8_t)(draw >> 16);
        }
        uint8_t coded_length = cobs_encode(coded, message, length);
        assert_int_equal(coded_length, length + 1);
        assert_null(memchr(coded, 0, coded_length));
        assert_true(cobs_decode(coded, &coded_length));
        assert_int_equal(coded_length, length);
        assert_memory_equal(coded, message, length);
    }
}

static void malformed_codes_are_refused(void **state)
{
    (void)state;
    uint8_t length = 0;
    uint8_t nothing[1] = {0};
    assert_false(cobs_decode(nothing, &length));
    uint8_t past_the_end[] = {5, 1, 2};
    length = sizeof past_the_end;
    assert_false(cobs_decode(past_the_end, &length));
    uint8_t one_past_the_end[] = {4, 1, 2};
    length = sizeof one_past_the_end;
    assert_false(cobs_decode(one_past_the_end, &length));
    uint8_t zero_as_data[] = {3, 0, 2};
    length = sizeof zero_as_data;
    assert_false(cobs_decode(zero_as_data, &length));
    uint8_t zero_as_code[] = {2, 7, 0, 2};
    length = sizeof zero_as_code;
    assert_false(cobs_decode(zero_as_code, &length));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(known_vectors),
        cmocka_unit_test(longest_message_without_zero),
        cmocka_unit_test(random_messages_survive_and_hold_no_zero),
        cmocka_unit_test(malformed_codes_are_refused),
    };
    return cmocka_run_group_tests_name("cobs", tests, NULL, NULL);
}
