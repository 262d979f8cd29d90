// SPDX-License-Identifier: Apache-2.0
#include "configuration.h"

// Time for reading the last conversion and sending the frame before the next tick.
#define READOUT_TICKS (BOARD_TICK_HZ / 5000)

#define GAIN_MAXIMUM 128u

struct configure_arguments configuration_default(void)
{
    static const uint8_t gains[BOARD_CHANNEL_COUNT] = BOARD_ADC_CHANNELS_GAIN;
    struct configure_arguments configuration = {
        .rate_hz = BOARD_RATE_DEFAULT_HZ,
        .filter_type = BOARD_ADC_FILTER_DEFAULT,
        .filter_fs = BOARD_ADC_FS_DEFAULT,
    };
    for (uint8_t i = 0; i < BOARD_CHANNEL_COUNT; i++) {
        configuration.gains[i] = gains[i];
        configuration.order[i] = i;
    }
    return configuration;
}

// 0 for a filter that the firmware does not know.
static uint8_t filter_order(uint8_t type)
{
    switch (type) {
    case BOARD_ADC_FILTER_SINC4:
        return BOARD_ADC_FILTER_SINC4_ORDER;
    case BOARD_ADC_FILTER_SINC3:
        return BOARD_ADC_FILTER_SINC3_ORDER;
    default:
        return 0;
    }
}

static bool is_gain(uint8_t gain)
{
    return gain != 0 && (gain & (gain - 1)) == 0 && gain <= GAIN_MAXIMUM;
}

// Each channel once at most, at least one, and what is left out at the end.
static bool is_order(const uint8_t order[BOARD_CHANNEL_COUNT])
{
    uint8_t seen = 0;
    for (uint8_t slot = 0; slot < BOARD_CHANNEL_COUNT; slot++) {
        uint8_t channel = order[slot];
        if (channel == CONFIGURATION_NO_CHANNEL)
            continue;
        if (channel >= BOARD_CHANNEL_COUNT || (seen >> channel & 1) != 0)
            return false;
        if (slot > 0 && order[slot - 1] == CONFIGURATION_NO_CHANNEL)
            return false;
        seen = (uint8_t)(seen | 1u << channel);
    }
    return seen != 0;
}

uint8_t configuration_channels(const struct configure_arguments *configuration)
{
    uint8_t count = 0;
    while (count < BOARD_CHANNEL_COUNT && configuration->order[count] != CONFIGURATION_NO_CHANNEL)
        count++;
    return count;
}

uint32_t configuration_period(const struct configure_arguments *configuration)
{
    return (BOARD_TICK_HZ + configuration->rate_hz / 2u) / configuration->rate_hz;
}

// Cycles of the ADC's clock, which may be 5 % off.
static uint32_t conversion_cycles(const struct configure_arguments *configuration)
{
    uint32_t filter = (uint32_t)filter_order(configuration->filter_type) * 32u;
    return filter * configuration->filter_fs + BOARD_ADC_FILTER_DEAD_CYCLES;
}

static uint32_t longest(const struct configure_arguments *configuration, uint8_t conversions)
{
    uint64_t ticks = (uint64_t)conversion_cycles(configuration) * conversions * BOARD_TICK_HZ;
    return (uint32_t)(ticks * 21 / 20 / BOARD_ADC_MASTER_CLOCK_HZ) + READOUT_TICKS;
}

uint32_t configuration_longest_scan(const struct configure_arguments *configuration)
{
    return longest(configuration, configuration_channels(configuration));
}

bool configuration_housekeeping_fits(const struct configure_arguments *configuration)
{
    uint8_t conversions = (uint8_t)(configuration_channels(configuration) + 1);
    return longest(configuration, conversions) <= configuration_period(configuration);
}

uint32_t configuration_shortest_conversion(const struct configure_arguments *configuration)
{
    uint64_t ticks = (uint64_t)conversion_cycles(configuration) * BOARD_TICK_HZ;
    return (uint32_t)(ticks * 20 / 21 / BOARD_ADC_MASTER_CLOCK_HZ);
}

uint8_t configuration_check(const struct configure_arguments *configuration)
{
    if (configuration->rate_hz < BOARD_RATE_MINIMUM_HZ ||
        configuration->rate_hz > BOARD_RATE_MAXIMUM_HZ ||
        filter_order(configuration->filter_type) == 0 ||
        configuration->filter_fs < BOARD_ADC_FS_MINIMUM ||
        configuration->filter_fs > BOARD_ADC_FS_MAXIMUM || !is_order(configuration->order))
        return BOARD_STATUS_BAD_ARGUMENT;
    for (uint8_t i = 0; i < BOARD_CHANNEL_COUNT; i++) {
        if (!is_gain(configuration->gains[i]))
            return BOARD_STATUS_BAD_ARGUMENT;
    }
    if (configuration_longest_scan(configuration) > configuration_period(configuration))
        return BOARD_STATUS_DOES_NOT_FIT;
    return BOARD_STATUS_OK;
}
