// SPDX-License-Identifier: Apache-2.0
#include "check.h"
#include "ring.h"

static void holds_255_bytes_and_no_more(void **state)
{
    (void)state;
    struct ring ring = {0};
    assert_int_equal(ring_space(&ring), 255);
    for (int i = 0; i < 255; i++)
        assert_true(ring_put(&ring, (uint8_t)i));
    assert_int_equal(ring_space(&ring), 0);
    assert_false(ring_put(&ring, 0xEE));
    uint8_t byte;
    for (int i = 0; i < 255; i++) {
        assert_true(ring_get(&ring, &byte));
        assert_int_equal(byte, i);
    }
    assert_false(ring_get(&ring, &byte));
}

static void many_bytes_at_once_come_out_in_order(void **state)
{
    (void)state;
    struct ring ring = {0};
    uint8_t bytes[255], byte;
    for (int i = 0; i < 255; i++)
        bytes[i] = (uint8_t)(3 * i);
    for (int round = 0; round < 10; round++) {
        ring_put_all(&ring, bytes, 100);
        ring_put_all(&ring, bytes + 100, 155);
        assert_int_equal(ring_space(&ring), 0);
        for (int i = 0; i < 255; i++) {
            assert_true(ring_get(&ring, &byte));
            assert_int_equal(byte, (uint8_t)(3 * i));
        }
    }
}

static void keeps_order_and_space_over_many_wraps(void **state)
{
    (void)state;
    struct ring ring = {0};
    uint32_t random = 5, put = 0, got = 0;
    for (int i = 0; i < 200000; i++) {
        if (next_random(&random) % 2 == 0) {
            put += ring_put(&ring, (uint8_t)put);
        } else {
            uint8_t byte;
            if (ring_get(&ring, &byte))
                assert_int_equal(byte, (uint8_t)got++);
        }
        assert_int_equal(ring_space(&ring), 255 - (put - got));
    }
    assert_true(got > 256);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(holds_255_bytes_and_no_more),
        cmocka_unit_test(many_bytes_at_once_come_out_in_order),
        cmocka_unit_test(keeps_order_and_space_over_many_wraps),
    };
    return cmocka_run_group_tests_name("ring", tests, NULL, NULL);
}
