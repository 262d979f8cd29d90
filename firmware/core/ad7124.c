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

// ERROR_EN. Used: everything that tells of a chip that is not as it was set up, or of a bad
// transaction. Not used (firmware/README.md says why): what tells of the inputs and the references,
// and what needs a clean write or read to tell of the same.
#define ERROR_EN_RESET 0x000040ul // a command came while the chip was not ready for it
#define ERROR_EN_SPI_CRC (1ul << 2)
#define ERROR_EN_ROM_CRC (1ul << 0)
#define ERROR_EN_MAP_CRC (1ul << 1)    // of all registers, 2400 times a second
#define ERROR_EN_SPI_CLOCKS (1ul << 5) // not a multiple of eight while CS was low
#define ERROR_EN_ANALOG_LDO (1ul << 7)
#define ERROR_EN_DIGITAL_LDO (1ul << 9)
#define ERROR_EN                                                                                   \
    (ERROR_EN_RESET | ERROR_EN_SPI_CRC | ERROR_EN_ROM_CRC | ERROR_EN_MAP_CRC |                     \
     ERROR_EN_SPI_CLOCKS | ERROR_EN_ANALOG_LDO | ERROR_EN_DIGITAL_LDO)

#define CHANNEL_RESET 0x0001u
#define CONFIG_RESET 0x0860u
#define FILTER_RESET 0x060180ul
#define OFFSET_RESET 0x800000ul

#define CHANNEL_SETUP_SHIFT 12
#define FILTER_TYPE_SHIFT 21
#define FILTER_POST_RESET (3ul << 17) // reset value of a field that sinc filters do not use

#define STATUS_CHANNEL 0x0Fu
#define STATUS_POR (1u << 4)
#define STATUS_ERROR (1u << 6)

#define HOUSEKEEPING_SLOT BOARD_CHANNEL_COUNT
#define CHANNEL_HOUSEKEEPING (AD7124_CHANNEL_0 + HOUSEKEEPING_SLOT)

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

// False if the CRC is wrong.
static bool read_register(uint8_t address, uint8_t size, uint32_t *value)
{
    uint8_t bytes[1 + REGISTER_SIZE_MAXIMUM + 1] = {(uint8_t)(READ | address)};
    uint8_t length = (uint8_t)(1 + size);
    hal_adc_exchange(bytes, (uint8_t)(length + 1));
    bytes[0] = (uint8_t)(READ | address); // the exchange put what DOUT showed in its place
    *value = 0;
    for (uint8_t i = 1; i < length; i++)
        *value = *value << 8 | bytes[i];
    return hal_crc8_ccitt(0, bytes, (uint8_t)(length + 1)) == 0;
}

static bool register_holds(const struct setting *setting)
{
    uint32_t value;
    return read_register(setting->address, setting->size, &value) && value == setting->value;
}

// The same in a third less time: what shows the right value needs no proof by its CRC.
static bool register_shows(const struct setting *setting)
{
    uint8_t bytes[1 + REGISTER_SIZE_MAXIMUM + 1] = {(uint8_t)(READ | setting->address)};
    hal_adc_exchange(bytes, (uint8_t)(setting->size + 2));
    uint32_t value = setting->value;
    for (uint8_t i = setting->size; i > 0; i--) {
        if (bytes[i] != (uint8_t)value)
            return false;
        value >>= 8;
    }
    return true;
}

static bool write_and_verify(const struct setting *setting)
{
    write_register(setting);
    return register_holds(setting);
}

static void send_reset(void)
{
    uint8_t ones[RESET_BYTES];
    memset(ones, 0xFF, sizeof ones);
    hal_adc_exchange(ones, sizeof ones);
}

uint8_t ad7124_identify(void)
{
    uint8_t id[] = {READ | AD7124_ID, 0}; // a CRC that may come behind is left unread
    hal_adc_exchange(id, sizeof id);
    return (id[1] & 0xF0) == ID_FAMILY ? id[1] : 0;
}

// Reading it clears the power-on flag.
static uint8_t read_status(void)
{
    uint8_t status[] = {READ | AD7124_STATUS, 0}; // likewise
    hal_adc_exchange(status, sizeof status);
    return status[1];
}

bool ad7124_was_reset(void)
{
    return ad7124_identify() != 0 && (read_status() & STATUS_POR) != 0;
}

// Once the reset is over.
static uint8_t greet(void)
{
    read_status();
    return ad7124_identify();
}

uint8_t ad7124_reset(void)
{
    send_reset();
    hal_delay_ms(RESET_WAIT_MS);
    return greet();
}

// Without a CRC, which a reset turns off.
static void write_plain(const struct setting *setting)
{
    uint8_t bytes[1 + REGISTER_SIZE_MAXIMUM] = {setting->address};
    put_value(bytes + 1, setting->value, setting->size);
    hal_adc_exchange(bytes, (uint8_t)(1 + setting->size));
}

// ADC_CONTROL comes first: it holds DOUT for the last bit of what is read back from here on.
static bool turn_crc_on(uint16_t control)
{
    struct setting settings[] = {
        {AD7124_ADC_CONTROL, 2, control},
        {AD7124_ERROR_EN, 3, ERROR_EN_RESET | ERROR_EN_SPI_CRC},
    };
    write_plain(&settings[0]);
    write_plain(&settings[1]);
    return register_holds(&settings[1]) && register_holds(&settings[0]);
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

static uint16_t housekeeping_channel(uint8_t source)
{
    if (source == AD7124_NO_HOUSEKEEPING)
        return CHANNEL_RESET;
    return (uint16_t)(housekeeping[source] | HOUSEKEEPING_SLOT << CHANNEL_SETUP_SHIFT);
}

static uint32_t channel_value(const struct ad7124 *adc, uint8_t slot)
{
    if (slot == HOUSEKEEPING_SLOT)
        return housekeeping_channel(adc->housekeeping);
    if (slot >= adc->channels)
        return CHANNEL_RESET;
    uint8_t channel = adc->configuration.order[slot];
    return (uint32_t)inputs[channel] | (uint32_t)slot << CHANNEL_SETUP_SHIFT;
}

static uint32_t config_value(const struct ad7124 *adc, uint8_t slot)
{
    if (slot == HOUSEKEEPING_SLOT)
        return BOARD_ADC_HOUSEKEEPING_CONFIG;
    if (slot >= adc->channels)
        return CONFIG_RESET;
    uint8_t channel = adc->configuration.order[slot];
    return configs[channel] | pga(adc->configuration.gains[channel]);
}

static uint32_t filter_value(const struct ad7124 *adc, uint8_t slot)
{
    return slot == HOUSEKEEPING_SLOT || slot < adc->channels ? adc->filter : FILTER_RESET;
}

// What a register that can be written holds after the set-up.
static struct setting expected(const struct ad7124 *adc, uint8_t address)
{
    if (address >= AD7124_GAIN_0)
        return (struct setting){address, 3, adc->gains[address - AD7124_GAIN_0]};
    if (address >= AD7124_OFFSET_0)
        return (struct setting){address, 3, OFFSET_RESET};
    if (address >= AD7124_FILTER_0)
        return (struct setting){address, 3, filter_value(adc, (uint8_t)(address - AD7124_FILTER_0))};
    if (address >= AD7124_CONFIG_0)
        return (struct setting){address, 2, config_value(adc, (uint8_t)(address - AD7124_CONFIG_0))};
    if (address >= AD7124_CHANNEL_0)
        return (struct setting){address, 2,
                                channel_value(adc, (uint8_t)(address - AD7124_CHANNEL_0))};
    switch (address) {
    case AD7124_ADC_CONTROL:
        return (struct setting){address, 2, CONTROL};
    case AD7124_IO_CONTROL_1:
        return (struct setting){address, 3, 0};
    case AD7124_IO_CONTROL_2:
        return (struct setting){address, 2, 0};
    default:
        return (struct setting){AD7124_ERROR_EN, 3, ERROR_EN};
    }
}

// Steps of the set-up: the reset's end; CONFIG, FILTER and CHANNEL of one slot after another, the
// housekeeping's last; the chip's gains; its checks.
#define SLOTS_AT 1u
#define GAINS_AT (SLOTS_AT + 3u * (HOUSEKEEPING_SLOT + 1u))
#define CHECKS_AT (GAINS_AT + AD7124_SETUPS)

void ad7124_begin_set_up(struct ad7124 *adc, const struct configure_arguments *configuration)
{
    adc->configuration = *configuration;
    adc->channels = configuration_channels(configuration);
    adc->filter = filter_register(configuration->filter_type, configuration->filter_fs);
    adc->housekeeping = AD7124_NO_HOUSEKEEPING;
    adc->step = 0;
    adc->examined = 0;
    adc->unverified = AD7124_ADC_CONTROL; // what was read back before the last write may have flipped before it
    send_reset();
    adc->reset_ticks = (uint32_t)hal_time();
}

static bool set_register_up(const struct ad7124 *adc, uint8_t step)
{
    static const uint8_t first[] = {AD7124_CONFIG_0, AD7124_FILTER_0, AD7124_CHANNEL_0};
    uint8_t slot = (uint8_t)((step - SLOTS_AT) / 3u);
    if (slot != HOUSEKEEPING_SLOT && slot >= adc->channels)
        return true;
    struct setting setting = expected(adc, (uint8_t)(first[(step - SLOTS_AT) % 3u] + slot));
    return write_and_verify(&setting);
}

// What the reset has left in ERROR is no error of what follows.
static bool turn_checks_on(const struct ad7124 *adc)
{
    uint32_t errors;
    struct setting setting = expected(adc, AD7124_ERROR_EN);
    return ad7124_read_errors(&errors) && write_and_verify(&setting);
}

enum ad7124_progress ad7124_go_on_with_set_up(struct ad7124 *adc)
{
    uint8_t step = adc->step++;
    bool good;
    if (step == 0) {
        if ((uint32_t)hal_time() - adc->reset_ticks < RESET_WAIT_MS * (BOARD_TICK_HZ / 1000)) {
            adc->step = 0;
            return AD7124_BUSY;
        }
        good = greet() != 0 && turn_crc_on(CONTROL);
    } else if (step < GAINS_AT) {
        good = set_register_up(adc, step);
    } else if (step < CHECKS_AT) {
        uint8_t setup = (uint8_t)(step - GAINS_AT);
        good = read_register((uint8_t)(AD7124_GAIN_0 + setup), 3, &adc->gains[setup]);
    } else {
        return turn_checks_on(adc) ? AD7124_DONE : AD7124_FAILED;
    }
    return good ? AD7124_BUSY : AD7124_FAILED;
}

bool ad7124_set_up(struct ad7124 *adc, const struct configure_arguments *configuration)
{
    enum ad7124_progress progress;
    ad7124_begin_set_up(adc, configuration);
    do
        progress = ad7124_go_on_with_set_up(adc);
    while (progress == AD7124_BUSY);
    return progress == AD7124_DONE;
}

// Each slot has the setup of its own number.
static bool set_up_slot(uint8_t slot, uint16_t channel, uint16_t config, uint32_t filter)
{
    channel |= (uint16_t)(slot << CHANNEL_SETUP_SHIFT);
    return write_and_verify(&(struct setting){(uint8_t)(AD7124_CONFIG_0 + slot), 2, config}) &&
           write_and_verify(&(struct setting){(uint8_t)(AD7124_FILTER_0 + slot), 3, filter}) &&
           write_and_verify(&(struct setting){(uint8_t)(AD7124_CHANNEL_0 + slot), 2, channel});
}

bool ad7124_set_up_self_test(void)
{
    static const uint16_t test_inputs[BOARD_SELF_TEST_SLOT_COUNT] = BOARD_SELF_TEST_REGISTERS;
    static const uint16_t test_configs[BOARD_SELF_TEST_SLOT_COUNT] = BOARD_SELF_TEST_CONFIG;
    static const uint8_t axes[BOARD_SELF_TEST_AXIS_COUNT] = BOARD_SELF_TEST_AXES;
    uint32_t filter = filter_register(BOARD_ADC_FILTER_DEFAULT, BOARD_ADC_FS_DEFAULT);

    if (ad7124_reset() == 0 || !turn_crc_on(CONTROL))
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
    return true;
}

uint8_t ad7124_echo_errors(void)
{
    // The data sheet lets OFFSET be written in idle mode only.
    uint8_t errors = (uint8_t)(2 * !turn_crc_on(CONTROL | CONTROL_IDLE));
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
    encode_write(bytes, &(struct setting){CHANNEL_HOUSEKEEPING, 2, housekeeping_channel(source)});
}

void ad7124_verify_housekeeping(struct ad7124 *adc, uint8_t source)
{
    adc->housekeeping = source;
    adc->unverified = AD7124_ADC_CONTROL;
    struct setting setting = expected(adc, CHANNEL_HOUSEKEEPING);
    if (!register_holds(&setting))
        adc->housekeeping = AD7124_UNKNOWN_HOUSEKEEPING;
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
    conversion->powered_on = (bytes[4] & STATUS_POR) != 0;
    conversion->error = (bytes[4] & STATUS_ERROR) != 0;
    return true;
}

bool ad7124_read_errors(uint32_t *errors)
{
    return read_register(AD7124_ERROR, 3, errors);
}

static bool is_writable(uint8_t address)
{
    return address != AD7124_STATUS && address != AD7124_DATA && address != AD7124_ID &&
           address != AD7124_ERROR && address != AD7124_MCLK_COUNT;
}

static uint8_t next_known(const struct ad7124 *adc, uint8_t address)
{
    bool known;
    do {
        address = (uint8_t)((address + 1u) % AD7124_REGISTERS);
        known = address != CHANNEL_HOUSEKEEPING || adc->housekeeping != AD7124_UNKNOWN_HOUSEKEEPING;
    } while (!is_writable(address) || !known);
    return address;
}

// Whether a value depends on it: it is of a slot in use, or common to all.
static bool is_in_use(const struct ad7124 *adc, uint8_t address)
{
    if (address < AD7124_CHANNEL_0)
        return is_writable(address);
    // There are 16 CHANNEL registers, and eight of each kind behind them
    uint8_t slot = (uint8_t)(address - AD7124_CHANNEL_0);
    if (address >= AD7124_CONFIG_0)
        slot = (uint8_t)(address - AD7124_CONFIG_0) % AD7124_SETUPS;
    if (slot == HOUSEKEEPING_SLOT)
        return adc->housekeeping < AD7124_NO_HOUSEKEEPING;
    return slot < adc->channels;
}

static uint8_t next_in_use(const struct ad7124 *adc, uint8_t address)
{
    do
        address++;
    while (address < AD7124_REGISTERS && !is_in_use(adc, address));
    return address;
}

bool ad7124_is_verified(const struct ad7124 *adc)
{
    return adc->unverified == AD7124_REGISTERS;
}

enum ad7124_finding ad7124_examine(struct ad7124 *adc)
{
    bool verified = ad7124_is_verified(adc);
    uint8_t address = verified ? next_known(adc, adc->examined) : adc->unverified;
    struct setting setting = expected(adc, address);
    if (!register_shows(&setting)) {
        uint32_t value;
        if (!read_register(address, setting.size, &value))
            return AD7124_UNREADABLE;
        if (value != setting.value)
            return AD7124_NOT_AS_SET_UP;
    }
    if (verified)
        adc->examined = address;
    else
        adc->unverified = next_in_use(adc, address);
    return AD7124_AS_SET_UP;
}
