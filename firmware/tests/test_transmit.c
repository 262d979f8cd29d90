// SPDX-License-Identifier: Apache-2.0
#include "check.h"
#include "frame.h"
#include "hal_host.h"
#include "transmit.h"

static void a_frame_goes_out_whole_or_not_at_all(void **state)
{
    (void)state;
    const uint8_t payload[] = {0x12, 1, 2, 3};
    uint8_t frame[FRAME_MAXIMUM];
    uint8_t size = frame_encode(frame, payload, sizeof payload);
    struct transmitter transmitter = {0};

    hal_host = (struct hal_host){.tx_space = (uint8_t)(size - 1)};
    transmit(&transmitter, payload, sizeof payload);
    assert_int_equal(hal_host.sent_length, 0);
    assert_int_equal(transmitter.dropped_frames, 1);

    hal_host.tx_space = size;
    transmit(&transmitter, payload, sizeof payload);
    assert_int_equal(hal_host.sent_length, size);
    assert_memory_equal(hal_host.sent, frame, size);
    assert_int_equal(transmitter.dropped_frames, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_frame_goes_out_whole_or_not_at_all)};
    return cmocka_run_group_tests_name("transmit", tests, NULL, NULL);
}
