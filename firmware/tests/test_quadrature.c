// SPDX-License-Identifier: Apache-2.0
#include "check.h"
#include "quadrature.h"

// Levels (A in bit 0, B in bit 1) at position n when A leads B.
static uint8_t levels_at(int32_t position)
{
    static const uint8_t sequence[] = {0, 1, 3, 2};
    return sequence[(uint32_t)position % 4];
}

static void counts_every_edge_forward_and_back(void **state)
{
    (void)state;
    struct quadrature encoder = {0};
    for (int32_t position = 1; position <= 1000; position++) {
        quadrature_step(&encoder, levels_at(position));
        assert_int_equal(encoder.count, position);
    }
    for (int32_t position = 999; position >= -1000; position--) {
        quadrature_step(&encoder, levels_at(position));
        assert_int_equal(encoder.count, position);
    }
    assert_int_equal(encoder.illegal_steps, 0);
}

static void the_same_levels_again_count_nothing(void **state)
{
    (void)state;
    for (uint8_t levels = 0; levels < 4; levels++) {
        struct quadrature encoder = {.state = levels, .count = 7};
        quadrature_step(&encoder, levels);
        assert_int_equal(encoder.count, 7);
        assert_int_equal(encoder.illegal_steps, 0);
    }
}

static void a_jump_of_two_states_is_illegal_and_counts_nothing(void **state)
{
    (void)state;
    for (int32_t position = 0; position < 4; position++) {
        struct quadrature encoder = {.state = levels_at(position), .count = 7};
        quadrature_step(&encoder, levels_at(position + 2));
        assert_int_equal(encoder.count, 7);
        assert_int_equal(encoder.illegal_steps, 1);
        // It goes on from the new state.
        quadrature_step(&encoder, levels_at(position + 3));
        assert_int_equal(encoder.count, 8);
    }
}

static void follows_a_random_walk(void **state)
{
    (void)state;
    uint32_t random = 99;
    struct quadrature encoder = {0};
    int32_t position = 0;
    for (int i = 0; i < 100000; i++) {
        position += (int32_t)(next_random(&random) % 3) - 1;
        quadrature_step(&encoder, levels_at(position));
        assert_int_equal(encoder.count, position);
    }
    assert_int_equal(encoder.illegal_steps, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(counts_every_edge_forward_and_back),
        cmocka_unit_test(the_same_levels_again_count_nothing),
        cmocka_unit_test(a_jump_of_two_states_is_illegal_and_counts_nothing),
        cmocka_unit_test(follows_a_random_walk),
    };
    return cmocka_run_group_tests_name("quadrature", tests, NULL, NULL);
}
