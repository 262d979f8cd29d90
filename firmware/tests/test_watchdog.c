// SPDX-License-Identifier: Apache-2.0
#include "check.h"
#include "hal_host.h"
#include "watchdog.h"

static void kicks_once_a_beat_and_never_without_one(void **state)
{
    (void)state;
    hal_host = (struct hal_host){0};
    struct watchdog watchdog = {0};
    for (uint32_t beat = 1; beat <= 10; beat++) {
        for (int round = 0; round < 100; round++)
            watchdog_poll(&watchdog, beat);
        assert_int_equal(hal_host.watchdog_kicks, beat);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(kicks_once_a_beat_and_never_without_one)};
    return cmocka_run_group_tests_name("watchdog", tests, NULL, NULL);
}
