// SPDX-License-Identifier: GPL-3.0-or-later
//
// Register map, reset values and behaviour: Analog Devices, AD7124-8 data sheet.
#include "ad7124.h"

#include <math.h>
#include <string.h>

#include "board_protocol.h"

enum {
    STATUS_NOT_READY = 1 << 7,
    STATUS_ERROR = 1 << 6,
    STATUS_POR = 1 << 4,

    CONTROL_DATA_STATUS = 1 << 10,
    CONTROL_CS_EN = 1 << 9,
    CONTROL_REF_EN = 1 << 8,

    ERROR_SPI_IGNORE = 1 << 6,
    ERROR_SPI_CLOCKS = 1 << 5,
    ERROR_SPI_READ = 1 << 4,
    ERROR_SPI_WRITE = 1 << 3,
    ERROR_SPI_CRC = 1 << 2,
    ERROR_MAP_CRC = 1 << 1,

    CHANNEL_ENABLE = 1 << 15,
    CONFIG_BIPOLAR = 1 << 11,
    CONFIG_REF_BUFP = 1 << 8,
    CONFIG_REF_BUFM = 1 << 7,
    CONFIG_AIN_BUFP = 1 << 6,
    CONFIG_AIN_BUFM = 1 << 5,
    CONFIG_PGA = 7,
    FILTER_SINGLE_CYCLE = 1 << 16,

    COMMAND_READ = 1 << 6,

    // Of ADC_CONTROL.MODE
    MODE_CONTINUOUS = 0,
    MODE_SINGLE = 1,
    MODE_STANDBY = 2,
    MODE_IDLE = 4,
    MODE_FIRST_CALIBRATION = 5,
    MODE_LAST_CALIBRATION = 8,

    // Of CHANNEL.AINP and AINM
    INPUT_LAST_PIN = 15,
    INPUT_TEMPERATURE = 16,
    INPUT_INTERNAL_REFERENCE = 18,
    INPUT_AVDD_SIXTH = 20,   // + ; 21 is its −
    INPUT_IOVDD_SIXTH = 22,  // + ; 23 is its −
    INPUT_20_MILLIVOLTS = 28,

    CHANNEL_COUNT = 16,
    GAIN_FACTORY = 0x555555,
    OFFSET_NEUTRAL = 0x800000,
    ID_AD7124_8 = 0x14,
};

static const double DIE_CELSIUS = 25.0;
static const double RESET_NS = 4e6;
static const double SYNC_PULSE_CYCLES = 4.0;     // of the master clock: a shorter pulse may not be seen
static const double STANDBY_WAKE_NS = 0.25e6;    // a single conversion starts this much later

// How far a pin without buffer may lie beyond AVSS and AVDD, and the least external reference: data sheet,
// "Specifications", from memory, as is the headroom of a buffer in board.yaml. That the inputs are rail to rail
// with a gain stands on its first page.
static const double PIN_BEYOND_VOLTS = 0.05;
static const double LEAST_REFERENCE_VOLTS = 1.0;
// The gain's error for a reference of nothing, less for more: the data sheet promises nothing, this is an example.
static const double LOW_REFERENCE_GAIN_ERROR = 0.1;

// All registers are looked over 2400 times a second, while the master clock runs: data sheet, "Memory map
// checksum protection", from memory. A write makes the chip compute their checksum anew, flipped bits and all.
static const double MAP_CHECK_NS = 1e9 / 2400.0;

static unsigned register_bytes(unsigned address)
{
    switch (address) {
    case AD7124_STATUS:
    case AD7124_ID:
    case AD7124_MCLK_COUNT:
        return 1;
    case AD7124_ADC_CONTROL:
    case 0x04:  // IO_CONTROL_2
        return 2;
    }
    return address >= AD7124_CHANNEL_0 && address < AD7124_FILTER_0 ? 2 : 3;
}

static bool is_read_only(unsigned address)
{
    return address == AD7124_STATUS || address == AD7124_DATA || address == AD7124_ID ||
           address == AD7124_ERROR || address == AD7124_MCLK_COUNT;
}

uint8_t ad7124_crc8(uint8_t crc, uint8_t byte)
{
    crc ^= byte;
    for (int bit = 0; bit < 8; bit++)
        crc = (uint8_t)(crc & 0x80 ? crc << 1 ^ 0x07 : crc << 1);
    return crc;
}

static void raise_error(ad7124 *adc, uint32_t error)
{
    adc->registers[AD7124_ERROR] |= error & adc->registers[AD7124_ERROR_EN];
}

static void look_over_the_map(ad7124 *adc, double now_ns)
{
    if (adc->map_damaged && now_ns - adc->damaged_ns >= MAP_CHECK_NS)
        raise_error(adc, ERROR_MAP_CRC);
}

static bool crc_enabled(const ad7124 *adc)
{
    return adc->registers[AD7124_ERROR_EN] & ERROR_SPI_CRC;
}

static unsigned mode(const ad7124 *adc)
{
    return adc->registers[AD7124_ADC_CONTROL] >> 2 & 0xF;
}

static void set_mode(ad7124 *adc, unsigned new_mode)
{
    adc->registers[AD7124_ADC_CONTROL] = (adc->registers[AD7124_ADC_CONTROL] & ~(0xFu << 2)) | new_mode << 2;
}

static uint8_t status(const ad7124 *adc)
{
    uint8_t value = (uint8_t)(adc->registers[AD7124_STATUS] & (STATUS_POR | 0x0F));
    if (!adc->ready)
        value |= STATUS_NOT_READY;
    if (adc->registers[AD7124_ERROR])
        value |= STATUS_ERROR;
    return value;
}

// ---------------------------------------------------------------------------------- timing

static double master_clock_hz(const ad7124 *adc)
{
    // POWER_MODE: 0 low, 1 middle, 2 and 3 full
    static const double divider[] = {8.0, 4.0, 1.0, 1.0};
    unsigned power_mode = adc->registers[AD7124_ADC_CONTROL] >> 6 & 3;
    return BOARD_ADC_MASTER_CLOCK_HZ * adc->clock_scale / divider[power_mode];
}

static unsigned setup_of(const ad7124 *adc, unsigned channel)
{
    return adc->registers[AD7124_CHANNEL_0 + channel] >> 12 & 7;
}

// Master clock cycles between two outputs of a channel's filter, and of its settled conversion.
static double output_cycles(const ad7124 *adc, unsigned channel)
{
    uint32_t fs = adc->registers[AD7124_FILTER_0 + setup_of(adc, channel)] & 0x7FF;
    return 32.0 * (fs ? fs : 1);
}

static double settled_cycles(const ad7124 *adc, unsigned channel)
{
    uint32_t type = adc->registers[AD7124_FILTER_0 + setup_of(adc, channel)] >> 21 & 7;
    // Sinc3 is type 2, sinc4 type 0; the other types are not modelled and behave as sinc4.
    double order = type == 2 ? 3.0 : 4.0;
    return order * output_cycles(adc, channel) + BOARD_ADC_FILTER_DEAD_CYCLES;
}

static double cycles_ns(const ad7124 *adc, double cycles)
{
    return cycles * 1e9 / master_clock_hz(adc);
}

static bool enabled(const ad7124 *adc, unsigned channel)
{
    return adc->registers[AD7124_CHANNEL_0 + channel] & CHANNEL_ENABLE;
}

// The first enabled channel at or behind one; the count of channels if there is none.
static unsigned enabled_from(const ad7124 *adc, unsigned channel)
{
    while (channel < CHANNEL_COUNT && !enabled(adc, channel))
        channel++;
    return channel;
}

static void begin_conversion(ad7124 *adc, unsigned channel, double now_ns)
{
    adc->converting = true;
    adc->channel = channel;
    adc->done_ns = now_ns + cycles_ns(adc, settled_cycles(adc, channel));
}

// Lets the sequence begin at a channel or behind it, if the mode and SYNC let it run.
static void start_sequence(ad7124 *adc, unsigned channel, double now_ns)
{
    adc->converting = false;
    adc->ready = false;
    unsigned first = enabled_from(adc, channel);
    if (first == CHANNEL_COUNT)
        first = enabled_from(adc, 0);
    adc->channel = first;
    bool runs = mode(adc) <= MODE_SINGLE ||
                (mode(adc) >= MODE_FIRST_CALIBRATION && mode(adc) <= MODE_LAST_CALIBRATION);
    if (adc->sync_low || !runs || first == CHANNEL_COUNT)
        return;
    begin_conversion(adc, first, mode(adc) == MODE_SINGLE ? now_ns + STANDBY_WAKE_NS : now_ns);
}

static void restart(ad7124 *adc, double now_ns)
{
    start_sequence(adc, 0, now_ns);
}

// ---------------------------------------------------------------------------------- codes

uint32_t ad7124_ideal_code(double ratio, bool bipolar)
{
    double code = bipolar ? 0x1p23 * (ratio + 1.0) : 0x1p24 * ratio;
    if (!(code > 0.0))  // also where a missing reference makes it NaN
        return 0;
    return code < 0xFFFFFF ? (uint32_t)lround(code) : 0xFFFFFF;
}

// What a pin can be for the converter: at most what is guaranteed. A buffer is taken to stop at its limit.
static double seen(double volts, bool buffered, bool *in_range)
{
    double beyond = buffered ? -BOARD_ADC_BUFFER_HEADROOM_VOLTS : PIN_BEYOND_VOLTS;
    double nearest = fmin(fmax(volts, -beyond), BOARD_ADC_SUPPLY_VOLTS + beyond);
    *in_range = *in_range && nearest == volts;
    return nearest;
}

static double input_volts(ad7124 *adc, unsigned positive, unsigned negative, uint32_t config, double time_ns,
                          bool *in_range)
{
    if (positive <= INPUT_LAST_PIN) {
        ad7124_pair pins = adc->inputs.pin_volts(adc->inputs.context, positive, negative, time_ns);
        bool rail_to_rail = config & CONFIG_PGA;
        return seen(pins.positive, config & CONFIG_AIN_BUFP && !rail_to_rail, in_range) -
               seen(pins.negative, config & CONFIG_AIN_BUFM && !rail_to_rail, in_range);
    }
    switch (positive) {
    case INPUT_INTERNAL_REFERENCE:
        return BOARD_ADC_INTERNAL_REFERENCE_VOLTS;
    case INPUT_AVDD_SIXTH:
    case INPUT_IOVDD_SIXTH:
        return BOARD_ADC_SUPPLY_VOLTS / 6.0;
    case INPUT_20_MILLIVOLTS:
        return 0.020;
    }
    return 0.0;
}

static double reference_volts(ad7124 *adc, uint32_t config, double time_ns, bool *in_range)
{
    ad7124_pair pins = {0.0, 0.0};  // REFIN2 is not connected on this board
    switch (config >> 3 & 3) {
    case 0:
        pins = adc->inputs.refin1_volts(adc->inputs.context, time_ns);
        break;
    case 2:
        return adc->registers[AD7124_ADC_CONTROL] & CONTROL_REF_EN ? BOARD_ADC_INTERNAL_REFERENCE_VOLTS : 0.0;
    case 3:
        pins.positive = BOARD_ADC_SUPPLY_VOLTS;
        break;
    }
    double volts = seen(pins.positive, config & CONFIG_REF_BUFP, in_range) -
                   seen(pins.negative, config & CONFIG_REF_BUFM, in_range);
    if (volts >= LEAST_REFERENCE_VOLTS)
        return volts;
    *in_range = false;
    return volts * (1.0 - LOW_REFERENCE_GAIN_ERROR * (LEAST_REFERENCE_VOLTS - volts) / LEAST_REFERENCE_VOLTS);
}

static uint32_t convert(ad7124 *adc, unsigned channel, double time_ns)
{
    uint32_t inputs = adc->registers[AD7124_CHANNEL_0 + channel];
    unsigned setup = setup_of(adc, channel);
    uint32_t config = adc->registers[AD7124_CONFIG_0 + setup];
    bool bipolar = config & CONFIG_BIPOLAR;
    unsigned positive = inputs >> 5 & 0x1F, negative = inputs & 0x1F;

    if (positive == INPUT_TEMPERATURE)
        return (uint32_t)lround((DIE_CELSIUS + 272.5) * 13584.0 + 0x800000);
    bool in_range = true;
    double volts = input_volts(adc, positive, negative, config, time_ns, &in_range);
    double reference = reference_volts(adc, config, time_ns, &in_range);
    if (!in_range)
        adc->conversions_out_of_range++;
    double ratio = volts * (1u << (config & CONFIG_PGA)) / reference;
    // OFFSET and GAIN: neutral at their factory values; an OFFSET step weighs 1/0.75 of a bipolar code.
    double offset = ((double)adc->registers[AD7124_OFFSET_0 + setup] - OFFSET_NEUTRAL) / 0.75 / 0x1p23;
    double gain = (double)adc->registers[AD7124_GAIN_0 + setup] / GAIN_FACTORY;
    return ad7124_ideal_code((ratio - offset) * gain, bipolar);
}

double ad7124_next_ns(const ad7124 *adc)
{
    return adc->converting ? adc->done_ns : INFINITY;
}

double ad7124_sampling_ns(const ad7124 *adc)
{
    // The filter weighs the input symmetrically: its output is the input's value in the middle of its interval.
    return ad7124_next_ns(adc) - 0.5 * cycles_ns(adc, settled_cycles(adc, adc->channel));
}

void ad7124_finish_conversion(ad7124 *adc)
{
    unsigned channel = adc->channel;
    double done = adc->done_ns;
    if (mode(adc) >= MODE_FIRST_CALIBRATION) {
        // The model has no offset or gain error to find: a calibration only takes its time.
        adc->converting = false;
        adc->ready = true;
        set_mode(adc, MODE_IDLE);
        adc->map_damaged = false;  // the chip has changed registers itself, and makes its checksum anew
        return;
    }
    adc->registers[AD7124_DATA] = convert(adc, channel, ad7124_sampling_ns(adc));
    adc->registers[AD7124_STATUS] = (adc->registers[AD7124_STATUS] & ~0x0Fu) | channel;
    adc->ready = true;
    look_over_the_map(adc, done);
    adc->status = status(adc);
    adc->conversions++;

    unsigned next = enabled_from(adc, channel + 1);
    bool sequence_done = next == CHANNEL_COUNT;
    if (sequence_done)
        next = enabled_from(adc, 0);
    if (sequence_done && mode(adc) == MODE_SINGLE) {
        adc->converting = false;
        set_mode(adc, MODE_STANDBY);
        adc->map_damaged = false;  // likewise
        return;
    }
    begin_conversion(adc, next, done);
    uint32_t filter = adc->registers[AD7124_FILTER_0 + setup_of(adc, next)];
    if (next == channel && !(filter & FILTER_SINGLE_CYCLE))  // alone: the filter stays settled
        adc->done_ns = done + cycles_ns(adc, output_cycles(adc, next));
}

// ---------------------------------------------------------------------------------- SPI

static void reset_registers(ad7124 *adc, double now_ns)
{
    memset(adc->registers, 0, sizeof adc->registers);
    adc->registers[AD7124_STATUS] = STATUS_POR;
    adc->registers[AD7124_ID] = ID_AD7124_8;
    adc->registers[AD7124_ERROR_EN] = ERROR_SPI_IGNORE;
    for (unsigned i = 0; i < CHANNEL_COUNT; i++)
        adc->registers[AD7124_CHANNEL_0 + i] = i ? 0x0001 : 0x8001;
    for (unsigned i = 0; i < 8; i++) {
        adc->registers[AD7124_CONFIG_0 + i] = 0x0860;
        adc->registers[AD7124_FILTER_0 + i] = 0x060180;
        adc->registers[AD7124_OFFSET_0 + i] = OFFSET_NEUTRAL;
        adc->registers[AD7124_GAIN_0 + i] = GAIN_FACTORY;
    }
    adc->in_transaction = false;
    adc->holds_last_bit = false;
    adc->ones = 0;
    adc->map_damaged = false;
    adc->accessible_ns = now_ns + RESET_NS;
    restart(adc, adc->accessible_ns);
}

void ad7124_dip(ad7124 *adc, double now_ns)
{
    reset_registers(adc, now_ns);
}

bool ad7124_flip_bit(ad7124 *adc, unsigned address, unsigned bit, double now_ns)
{
    if (address >= AD7124_REGISTER_COUNT || is_read_only(address) || bit >= 8 * register_bytes(address))
        return false;
    unsigned mode_before = mode(adc);
    look_over_the_map(adc, now_ns);
    adc->registers[address] ^= 1u << bit;
    adc->map_damaged = true;
    adc->damaged_ns = now_ns;
    if (mode(adc) != mode_before)
        restart(adc, now_ns);
    return true;
}

void ad7124_power_on(ad7124 *adc, const ad7124_inputs *inputs, ad7124_sequence sequence, double clock_ppm,
                     double now_ns)
{
    uint64_t conversions = adc->conversions, out_of_range = adc->conversions_out_of_range;
    uint64_t short_pulses = adc->short_sync_pulses;
    *adc = (ad7124){
        .inputs = *inputs,
        .sequence = sequence,
        .clock_scale = 1.0 + clock_ppm * 1e-6,
        .conversions = conversions,
        .conversions_out_of_range = out_of_range,
        .short_sync_pulses = short_pulses,
    };
    reset_registers(adc, now_ns);
}

void ad7124_select(ad7124 *adc, bool cs_level)
{
    adc->selected = !cs_level;
    adc->in_transaction = false;
    adc->holds_last_bit = false;
    adc->ones = 0;
}

void ad7124_sync(ad7124 *adc, bool sync_level, double now_ns)
{
    if (sync_level != adc->sync_low)
        return;  // no edge
    adc->sync_low = !sync_level;
    if (adc->sync_low)
        adc->sync_fell_ns = now_ns;
    else if (now_ns - adc->sync_fell_ns < cycles_ns(adc, SYNC_PULSE_CYCLES))
        adc->short_sync_pulses++;
    start_sequence(adc, adc->sequence == AD7124_GOES_ON ? adc->channel : 0, now_ns);
}

bool ad7124_shows_ready(const ad7124 *adc)
{
    return adc->selected && !adc->holds_last_bit && !ad7124_reads(adc);
}

bool ad7124_dout(const ad7124 *adc)
{
    if (!adc->selected)
        return true;
    return ad7124_shows_ready(adc) ? !adc->ready : adc->last_bit;
}

bool ad7124_reads(const ad7124 *adc)
{
    return adc->selected && adc->in_transaction && adc->command & COMMAND_READ;
}

static void put_big_endian(ad7124 *adc, uint32_t value, unsigned count)
{
    while (count--)
        adc->bytes[adc->byte_count++] = (uint8_t)(value >> 8 * count);
}

static void begin_read(ad7124 *adc, unsigned address, double now_ns)
{
    look_over_the_map(adc, now_ns);
    uint32_t value = address == AD7124_STATUS ? status(adc) : adc->registers[address];
    put_big_endian(adc, value, register_bytes(address));
    if (address == AD7124_DATA && adc->registers[AD7124_ADC_CONTROL] & CONTROL_DATA_STATUS)
        put_big_endian(adc, (adc->status & ~STATUS_NOT_READY) | (status(adc) & STATUS_NOT_READY), 1);
    if (crc_enabled(adc)) {
        uint8_t crc = ad7124_crc8(0, adc->command);
        for (unsigned i = 0; i < adc->byte_count; i++)
            crc = ad7124_crc8(crc, adc->bytes[i]);
        put_big_endian(adc, crc, 1);
    }
}

static void begin_transaction(ad7124 *adc, uint8_t command, double now_ns)
{
    unsigned address = command & 0x3F;
    if (command & 0x80)
        return;  // WEN is high: not a command
    if (now_ns < adc->accessible_ns) {
        raise_error(adc, ERROR_SPI_IGNORE);
        return;
    }
    if (address >= AD7124_REGISTER_COUNT) {
        raise_error(adc, command & COMMAND_READ ? ERROR_SPI_READ : ERROR_SPI_WRITE);
        return;
    }
    adc->in_transaction = true;
    adc->command = command;
    adc->byte_index = 0;
    adc->byte_count = 0;
    if (command & COMMAND_READ)
        begin_read(adc, address, now_ns);
    else
        adc->byte_count = register_bytes(address) + (crc_enabled(adc) ? 1 : 0);
}

static void finish_write(ad7124 *adc, double now_ns)
{
    unsigned address = adc->command & 0x3F;
    unsigned count = register_bytes(address);
    if (crc_enabled(adc)) {
        uint8_t crc = ad7124_crc8(0, adc->command);
        for (unsigned i = 0; i < adc->byte_count; i++)
            crc = ad7124_crc8(crc, adc->bytes[i]);
        if (crc != 0) {
            raise_error(adc, ERROR_SPI_CRC);
            return;
        }
    }
    if (is_read_only(address)) {
        raise_error(adc, ERROR_SPI_WRITE);
        return;
    }
    uint32_t value = 0;
    for (unsigned i = 0; i < count; i++)
        value = value << 8 | adc->bytes[i];
    look_over_the_map(adc, now_ns);
    adc->map_damaged = false;
    adc->registers[address] = value;
    // A change of what or how to convert restarts the sequence. Where SYNC lets it go on, so does a change of
    // what it converts while it is held: the firmware must not rely on more than it knows.
    if (address == AD7124_ADC_CONTROL)
        restart(adc, now_ns);
    else if (address >= AD7124_CHANNEL_0)
        start_sequence(adc, adc->sequence == AD7124_GOES_ON && adc->sync_low ? adc->channel : 0, now_ns);
}

static void finish_read(ad7124 *adc)
{
    unsigned address = adc->command & 0x3F;
    if (address == AD7124_DATA)
        adc->ready = false;
    else if (address == AD7124_STATUS)
        adc->registers[AD7124_STATUS] &= ~(uint32_t)STATUS_POR;
    else if (address == AD7124_ERROR)
        adc->registers[AD7124_ERROR] = 0;
    adc->holds_last_bit = adc->registers[AD7124_ADC_CONTROL] & CONTROL_CS_EN;
}

uint8_t ad7124_exchange(ad7124 *adc, uint8_t din, double now_ns)
{
    if (!adc->selected)
        return 0xFF;
    adc->ones = din == 0xFF ? adc->ones + 8 : 0;
    if (adc->ones >= 64) {
        reset_registers(adc, now_ns);
        return 0xFF;
    }
    if (!adc->in_transaction) {
        uint8_t shown = ad7124_dout(adc) ? 0xFF : 0x00;
        adc->holds_last_bit = false;
        begin_transaction(adc, din, now_ns);
        return shown;
    }
    uint8_t dout = adc->ready ? 0x00 : 0xFF;
    bool reads = adc->command & COMMAND_READ;
    if (reads) {
        dout = adc->bytes[adc->byte_index];
        adc->last_bit = dout & 1;
    } else {
        adc->bytes[adc->byte_index] = din;
    }
    if (++adc->byte_index == adc->byte_count) {
        adc->in_transaction = false;
        if (reads)
            finish_read(adc);
        else
            finish_write(adc, now_ns);
    }
    return dout;
}
