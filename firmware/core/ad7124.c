// SPDX-License-Identifier: Apache-2.0
#include "ad7124.h"

#include <string.h>

#include "configuration.h"
#include "hal.h"

#define READ 0x40u // bit of the communications byte

#define RESET_BYTES 8u // 64 ones
#define RESET_WAIT_MS 5u
#define ID_FAMILY 0x10u // upper half of ID; the lower half differs between revisions

// ADC_CONTROL: status behind every conversion, DOUT held until CS rises (a master samples the last
// bit at the clock edge on which DOUT would otherwise turn into RDY), internal reference on, full
// power, continuous conversion, internal clock.
#define CONTROL_DATA_STATUS (1u << 10)
#define CONTROL_CS_EN (1u << 9)
#define CONTROL_REF_EN (1u << 8)
#define CONTROL_FULL_POWER (2u << 6)
#define CONTROL (CONTROL_DATA_STATUS | CONTROL_CS_EN | CONTROL_REF_EN | CONTROL_FULL_POWER)

#define CONTROL_IDLE (4u << 2)

#define ERROR_EN_RESET 0x000040ul
#define ERROR_EN_SPI_CRC (1ul << 2)

#define CHANNEL_SETUP_SHIFT 12
#define FILTER_TYPE_SHIFT 21
#define FILTER_POST_RESET (3ul << 17) // reset value of a field that sinc filters do not use

#define STATUS_CHANNEL 0x0Fu

#define REGISTER_SIZE_MAXIMUM 3u

struct setting {
    uint8_t address;
    uint8_t size;
    uint32_t value;
};

static void put_value(uint8_t *bytes, uint32_t value, uint8_t size)
{
    for (uint8_t i = size; i > 0; i--) {
        bytes[i - 1] = (uint8_t)value;
        value >>= 8;
    }
}

// Returns the transaction's length.
static uint8_t encode_write(uint8_t *bytes, const struct setting *setting)
{
    uint8_t length = (uint8_t)(1 + setting->size);
    bytes[0] = setting->address;
    put_value(bytes + 1, setting->value, setting->size);
    bytes[length] = hal_crc8_ccitt(0, bytes, length);
    return (uint8_t)(length + 1);
}

static void write_register(const struct setting *setting)
{
    uint8_t bytes[1 + REGISTER_SIZE_MAXIMUM + 1];
    hal_adc_exchange(bytes, encode_write(bytes, setting));
}

static bool register_holds(const struct setting *setting)
{
    uint8_t bytes[1 + REGISTER_SIZE_MAXIMUM + 1] = {(uint8_t)(READ | setting->address)};
    uint8_t expected[sizeof bytes];
    uint8_t length = (uint8_t)(1 + setting->size);
    expected[0] = bytes[0]; // the CRC covers the command, too
    put_value(expected + 1, setting->value, setting->size);
    expected[length] = hal_crc8_ccitt(0, expected, length);
    hal_adc_exchange(bytes, (uint8_t)(length + 1));
    return memcmp(bytes + 1, expected + 1, length) == 0;
}

static bool write_and_verify(const struct setting *setting)
{
    write_register(setting);
    return register_holds(setting);
}

uint8_t ad7124_reset(void)
{
    uint8_t ones[RESET_BYTES];
    memset(ones, 0xFF, sizeof ones);
    hal_adc_exchange(ones, sizeof ones);
    hal_delay_ms(RESET_WAIT_MS);

    // The CRC is off after a reset.
    uint8_t status[] = {READ | AD7124_STATUS, 0}; // clears the power-on flag
    hal_adc_exchange(status, sizeof status);
    uint8_t id[] = {READ | AD7124_ID, 0};
    hal_adc_exchange(id, sizeof id);
    return (id[1] & 0xF0) == ID_FAMILY ? id[1] : 0;
}

static bool turn_crc_on(void)
{
    struct setting setting = {AD7124_ERROR_EN, 3, ERROR_EN_RESET | ERROR_EN_SPI_CRC};
    uint8_t bytes[4] = {setting.address};
    put_value(bytes + 1, setting.value, setting.size);
    hal_adc_exchange(bytes, sizeof bytes);
    return register_holds(&setting);
}

// Each slot has the setup of its own number.
static bool set_up_slot(uint8_t slot, uint16_t channel, uint16_t config, uint32_t filter)
{
    channel |= (uint16_t)(slot << CHANNEL_SETUP_SHIFT);
    return write_and_verify(&(struct setting){(uint8_t)(AD7124_CONFIG_0 + slot), 2, config}) &&
           write_and_verify(&(struct setting){(uint8_t)(AD7124_FILTER_0 + slot), 3, filter}) &&
           write_and_verify(&(struct setting){(uint8_t)(AD7124_CHANNEL_0 + slot), 2, channel});
}

// CONFIG's code of a gain: its binary logarithm.
static uint16_t pga(uint8_t gain)
{
    uint16_t code = 0;
    while (gain >>= 1)
        code++;
    return code;
}

static uint32_t filter_register(uint8_t type, uint16_t fs)
{
    return (uint32_t)type << FILTER_TYPE_SHIFT | FILTER_POST_RESET | fs;
}

static const uint16_t inputs[BOARD_CHANNEL_COUNT] = BOARD_ADC_CHANNELS_REGISTERS;
static const uint16_t configs[BOARD_CHANNEL_COUNT] = BOARD_ADC_CHANNELS_CONFIG;
static const uint16_t housekeeping[BOARD_HOUSEKEEPING_COUNT] = BOARD_ADC_HOUSEKEEPING_REGISTERS;

bool ad7124_set_up(const struct configure_arguments *configuration)
{
    uint32_t filter = filter_register(configuration->filter_type, configuration->filter_fs);

    if (ad7124_reset() == 0 || !turn_crc_on())
        return false;
    uint8_t count = configuration_channels(configuration);
    for (uint8_t slot = 0; slot < count; slot++) {
        uint8_t channel = configuration->order[slot];
        uint16_t config = configs[channel] | pga(configuration->gains[channel]);
        if (!set_up_slot(slot, inputs[channel], config, filter))
            return false;
    }
    return set_up_slot(BOARD_CHANNEL_COUNT, housekeeping[0], BOARD_ADC_HOUSEKEEPING_CONFIG, filter) &&
           write_and_verify(&(struct setting){AD7124_ADC_CONTROL, 2, CONTROL});
}

bool ad7124_set_up_self_test(void)
{
    static const uint16_t test_inputs[BOARD_SELF_TEST_SLOT_COUNT] = BOARD_SELF_TEST_REGISTERS;
    static const uint16_t test_configs[BOARD_SELF_TEST_SLOT_COUNT] = BOARD_SELF_TEST_CONFIG;
    static const uint8_t axes[BOARD_SELF_TEST_AXIS_COUNT] = BOARD_SELF_TEST_AXES;
    uint32_t filter = filter_register(BOARD_ADC_FILTER_DEFAULT, BOARD_ADC_FS_DEFAULT);

    if (ad7124_reset() == 0 || !turn_crc_on())
        return false;
    uint8_t slot = 0;
    for (; slot < BOARD_SELF_TEST_SLOT_COUNT; slot++) {
        if (!set_up_slot(slot, test_inputs[slot], test_configs[slot], filter))
            return false;
    }
    for (uint8_t i = 0; i < BOARD_SELF_TEST_AXIS_COUNT; i++) {
        if (!set_up_slot(slot++, inputs[axes[i]], configs[axes[i]], filter))
            return false;
    }
    return write_and_verify(&(struct setting){AD7124_ADC_CONTROL, 2, CONTROL});
}

uint8_t ad7124_echo_errors(void)
{
    // The data sheet lets OFFSET be written in idle mode only.
    uint8_t errors = !turn_crc_on();
    errors = (uint8_t)(errors + !write_and_verify(&(struct setting){AD7124_ADC_CONTROL, 2,
                                                                    CONTROL | CONTROL_IDLE}));
    static const uint32_t plain[] = {0x555555, 0xAAAAAA, 0x000000};
    for (uint8_t i = 0; i < AD7124_ECHOES - 2; i++) {
        uint32_t pattern = i < 3 ? plain[i] : UINT32_C(1) << (i - 3);
        struct setting setting = {AD7124_OFFSET_0 + 7, 3, pattern};
        errors = (uint8_t)(errors + !write_and_verify(&setting));
    }
    return errors;
}

void ad7124_encode_housekeeping(uint8_t bytes[AD7124_HOUSEKEEPING_SIZE], uint8_t source)
{
    encode_write(bytes, &(struct setting){AD7124_CHANNEL_0 + BOARD_CHANNEL_COUNT, 2,
                                          housekeeping[source]});
}

bool ad7124_read_conversion(struct ad7124_conversion *conversion)
{
    uint8_t bytes[6] = {READ | AD7124_DATA}; // command, 3 data, status, CRC
    hal_adc_exchange(bytes, sizeof bytes);
    bytes[0] = READ | AD7124_DATA; // the exchange put what DOUT showed in its place
    if (hal_crc8_ccitt(0, bytes, sizeof bytes) != 0)
        return false;
    conversion->code = (uint32_t)bytes[1] << 16 | (uint16_t)(bytes[2] << 8) | bytes[3];
    conversion->slot = bytes[4] & STATUS_CHANNEL;
    return true;
}
