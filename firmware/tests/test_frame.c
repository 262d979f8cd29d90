// SPDX-License-Identifier: Apache-2.0
#include <string.h>

#include "check.h"
#include "frame.h"
#include "hal.h"

// Feeds a frame; the result of its last byte.
static uint8_t feed(struct frame_parser *parser, const uint8_t *bytes, size_t count)
{
    uint8_t length = 0;
    for (size_t i = 0; i < count; i++)
        length = frame_parse(parser, bytes[i]);
    return length;
}

static void crc_check_values(void **state)
{
    (void)state;
    // "Check" of the catalogue of parametrised CRC algorithms, over the digits 1 to 9.
    const uint8_t digits[] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
    assert_int_equal(hal_crc16_ccitt(0xFFFF, digits, 9), 0x29B1); // CRC-16/CCITT-FALSE
    assert_int_equal(hal_crc8_ccitt(0, digits, 9), 0xF4);         // CRC-8/SMBUS
}

static void a_frame_on_the_wire(void **state)
{
    (void)state;
    // The sync request with id 0; CRC-16 0xB7A9.
    const uint8_t payload[] = {0x06, 0x00};
    const uint8_t expected[] = {0x02, 0x06, 0x03, 0xA9, 0xB7, 0x00};
    uint8_t frame[FRAME_MAXIMUM];
    assert_int_equal(frame_encode(frame, payload, 2), sizeof expected);
    assert_memory_equal(frame, expected, sizeof expected);
}

static void every_length_makes_the_round_trip(void **state)
{
    (void)state;
    uint32_t random = 77;
    struct frame_parser parser = {0};
    for (uint8_t length = 1; length <= BOARD_WIRE_MAXIMUM_PAYLOAD; length++) {
        uint8_t payload[BOARD_WIRE_MAXIMUM_PAYLOAD], frame[FRAME_MAXIMUM];
        for (uint8_t i = 0; i < length; i++)
            payload[i] = (uint8_t)(next_random(&random) >> 24);
        uint8_t size = frame_encode(frame, payload, length);
        assert_int_equal(size, length + 4);
        assert_int_equal(feed(&parser, frame, size), length);
        assert_memory_equal(parser.bytes, payload, length);
    }
    assert_int_equal(parser.bad_frames, 0);
}

static void every_single_bit_error_is_found(void **state)
{
    (void)state;
    const uint8_t payload[] = {0x02, 0x11, 100, 0, 6, 0};
    uint8_t frame[FRAME_MAXIMUM];
    uint8_t size = frame_encode(frame, payload, sizeof payload);
    for (int bit = 0; bit < 8 * (size - 1); bit++) { // without the delimiter
        struct frame_parser parser = {0};
        uint8_t damaged[FRAME_MAXIMUM];
        memcpy(damaged, frame, size);
        damaged[bit / 8] ^= (uint8_t)(1 << bit % 8);
        assert_int_equal(feed(&parser, damaged, size), 0);
        assert_true(parser.bad_frames >= 1);
    }
}

static void lost_and_doubled_bytes_are_found(void **state)
{
    (void)state;
    const uint8_t payload[] = {0x02, 0x11, 100, 0, 6, 0};
    uint8_t frame[FRAME_MAXIMUM + 1];
    uint8_t size = frame_encode(frame, payload, sizeof payload);
    for (uint8_t at = 0; at < size - 1; at++) {
        struct frame_parser parser = {0};
        for (uint8_t i = 0; i < size; i++)
            assert_int_equal(i == at ? 0 : frame_parse(&parser, frame[i]), 0);
        assert_int_equal(parser.bad_frames, 1);
        for (uint8_t i = 0; i < size; i++) {
            if (i == at)
                assert_int_equal(frame_parse(&parser, frame[i]), 0);
            assert_int_equal(frame_parse(&parser, frame[i]), 0);
        }
        assert_int_equal(parser.bad_frames, 2);
    }
}

static void bare_delimiters_mean_nothing(void **state)
{
    (void)state;
    struct frame_parser parser = {0};
    const uint8_t delimiters[5] = {0};
    assert_int_equal(feed(&parser, delimiters, sizeof delimiters), 0);
    assert_int_equal(parser.bad_frames, 0);
}

static void a_frame_without_payload_is_bad(void **state)
{
    (void)state;
    struct frame_parser parser = {0};
    const uint8_t frame[] = {0x03, 0xFF, 0xFF, 0x00}; // CRC of nothing
    assert_int_equal(feed(&parser, frame, sizeof frame), 0);
    assert_int_equal(parser.bad_frames, 1);
}

static void too_long_a_frame_is_one_bad_frame_and_the_next_is_good(void **state)
{
    (void)state;
    struct frame_parser parser = {0};
    for (int i = 0; i < 1000; i++)
        assert_int_equal(frame_parse(&parser, 0x55), 0);
    assert_int_equal(frame_parse(&parser, 0), 0);
    assert_int_equal(parser.bad_frames, 1);
    const uint8_t payload[] = {0x06, 0x01};
    uint8_t frame[FRAME_MAXIMUM];
    uint8_t size = frame_encode(frame, payload, sizeof payload);
    assert_int_equal(feed(&parser, frame, size), sizeof payload);
}

static void random_bytes_do_no_harm(void **state)
{
    (void)state;
    uint32_t random = 4711;
    struct frame_parser parser = {0};
    uint32_t good = 0, delimited = 0;
    uint8_t previous = 0;
    for (int i = 0; i < 2000000; i++) {
        uint32_t draw = next_random(&random);
        uint8_t byte = draw % 11 == 0 ? 0 : (uint8_t)(draw >> 24);
        uint8_t length = frame_parse(&parser, byte);
        assert_true(length <= BOARD_WIRE_MAXIMUM_PAYLOAD);
        good += length > 0;
        delimited += byte == 0 && previous != 0;
        previous = byte;
    }
    // Every run of bytes up to a delimiter is judged once. A random one passes the CRC with a
    // probability of 2^-16, if its COBS coding is well-formed at all: of some 160 000 runs fewer
    // than three. 20 would be wrong.
    assert_int_equal(parser.bad_frames + good, delimited);
    assert_true(delimited > 100000);
    assert_true(good < 20);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(crc_check_values),
        cmocka_unit_test(a_frame_on_the_wire),
        cmocka_unit_test(every_length_makes_the_round_trip),
        cmocka_unit_test(every_single_bit_error_is_found),
        cmocka_unit_test(lost_and_doubled_bytes_are_found),
        cmocka_unit_test(bare_delimiters_mean_nothing),
        cmocka_unit_test(a_frame_without_payload_is_bad),
        cmocka_unit_test(too_long_a_frame_is_one_bad_frame_and_the_next_is_good),
        cmocka_unit_test(random_bytes_do_no_harm),
    };
    return cmocka_run_group_tests_name("frame", tests, NULL, NULL);
}
