// SPDX-License-Identifier: Apache-2.0
#include "self_test.h"

#include "ad7124.h"
#include "hal.h"

#define SLOTS (BOARD_SELF_TEST_SLOT_COUNT + BOARD_SELF_TEST_AXIS_COUNT)

// Three times as long as a conversion takes at the default filter.
#define PATIENCE_TICKS (BOARD_TICK_HZ / 300)

struct sum {
    uint32_t total;
    uint8_t count;
    uint32_t smallest, largest;
};

static void add(struct sum *sum, uint32_t code)
{
    if (sum->count == 0 || code < sum->smallest)
        sum->smallest = code;
    if (sum->count == 0 || code > sum->largest)
        sum->largest = code;
    sum->total += code;
    sum->count++;
}

static uint32_t mean(const struct sum *sum)
{
    return sum->count == 0 ? 0 : (sum->total + sum->count / 2u) / sum->count;
}

static bool wait_for_conversion(void)
{
    uint32_t start = (uint32_t)hal_time();
    while (!hal_adc_ready()) {
        if ((uint32_t)hal_time() - start > PATIENCE_TICKS)
            return false;
    }
    return true;
}

// Some rounds of the sequence. An ADC that stops is not waited for again.
static void measure(struct sum sums[SLOTS], struct self_test_response *result)
{
    uint8_t state = hal_lock();
    hal_adc_restart();
    hal_unlock(state);
    uint8_t left = BOARD_SELF_TEST_ROUNDS * SLOTS;
    for (; left > 0 && wait_for_conversion(); left--) {
        struct ad7124_conversion conversion;
        if (ad7124_read_conversion(&conversion) && conversion.slot < SLOTS)
            add(&sums[conversion.slot], conversion.code);
        else
            result->spi_errors++;
    }
    result->conversions_missing = (uint8_t)(result->conversions_missing + left);
    hal_adc_hold();
}

static void deflect(bool on)
{
    hal_accelerometer_self_test(on);
    hal_delay_ms(BOARD_SELF_TEST_SETTLE_MS);
}

struct self_test_response self_test_run(void)
{
    struct self_test_response result = {0};
    hal_adc_hold();
    result.adc_id = ad7124_reset();
    if (result.adc_id == 0)
        return result;
    result.spi_errors = ad7124_echo_errors();
    if (!ad7124_set_up_self_test()) {
        result.spi_errors++;
        result.conversions_missing = 2 * BOARD_SELF_TEST_ROUNDS * SLOTS;
        return result;
    }
    struct sum rest[SLOTS] = {0}, deflected[SLOTS] = {0};
    measure(rest, &result);
    deflect(true);
    measure(deflected, &result);
    deflect(false); // the next scan must see nothing of it

    const struct sum *shorted = &rest[BOARD_SELF_TEST_SHORT];
    result.short_code = mean(shorted);
    result.short_spread = shorted->largest - shorted->smallest;
    result.known_voltage_code = mean(&rest[BOARD_SELF_TEST_KNOWN_VOLTAGE]);
    result.supply_code = mean(&rest[BOARD_SELF_TEST_SUPPLY]);
    result.supply_on_refin1_code = mean(&rest[BOARD_SELF_TEST_SUPPLY_ON_REFIN1]);
    for (uint8_t i = 0; i < BOARD_SELF_TEST_AXIS_COUNT; i++) {
        result.rest_codes[i] = mean(&rest[BOARD_SELF_TEST_SLOT_COUNT + i]);
        result.deflected_codes[i] = mean(&deflected[BOARD_SELF_TEST_SLOT_COUNT + i]);
    }
    return result;
}
