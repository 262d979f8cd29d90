// SPDX-License-Identifier: Apache-2.0
#include "fake_ad7124.h"

#include <string.h>

#include "hal_host.h"

enum {
    STATUS = 0x00,
    ADC_CONTROL = 0x01,
    DATA = 0x02,
    ID = 0x05,
    ERROR = 0x06,
    ERROR_EN = 0x07,
    CHANNEL_0 = 0x09,
    CONFIG_0 = 0x19,
    FILTER_0 = 0x21,
    OFFSET_0 = 0x29,
    GAIN_0 = 0x31,
};

uint8_t fake_ad7124_size_of(uint8_t address)
{
    static const uint8_t low[] = {1, 2, 3, 3, 2, 1, 3, 3, 1};
    if (address < CHANNEL_0)
        return low[address];
    return address < FILTER_0 ? 2 : 3; // CHANNEL and CONFIG; FILTER, OFFSET and GAIN
}

// The chip looks over all its registers 2400 times a second. What a write finds flipped goes into the
// checksum that it makes, and is never found.
#define MAP_CHECK_TICKS (2000000 / 2400)
#define MAP_CHECK_ON (1u << 1)

static void raise_error(struct fake_ad7124 *device, uint32_t error)
{
    device->registers[ERROR] |= error & device->registers[ERROR_EN];
}

static void look_over_the_map(struct fake_ad7124 *device)
{
    if (device->map_damaged && hal_host.time - device->damaged_at >= MAP_CHECK_TICKS)
        raise_error(device, MAP_CHECK_ON);
}

void fake_ad7124_flip_bit(struct fake_ad7124 *device, uint8_t address, uint8_t bit)
{
    if (address == ADC_CONTROL) // a change of mode or clock starts the sequence anew
        device->conversions_read = 0;
    device->registers[address] ^= 1u << bit;
    device->map_damaged = true;
    device->damaged_at = hal_host.time;
}

static void reset(struct fake_ad7124 *device)
{
    device->map_damaged = false;
    device->conversions_read = 0;
    device->started = hal_host.time;
    device->position = 0;
    for (uint8_t address = 0; address < FAKE_AD7124_REGISTERS; address++) {
        uint32_t value = 0;
        if (address >= CHANNEL_0 && address < CONFIG_0)
            value = address == CHANNEL_0 ? 0x8001 : 0x0001;
        else if (address >= CONFIG_0 && address < FILTER_0)
            value = 0x0860;
        else if (address >= FILTER_0 && address < OFFSET_0)
            value = 0x060180;
        else if (address >= OFFSET_0 && address < GAIN_0)
            value = 0x800000;
        else if (address >= GAIN_0)
            value = 0x500000;
        device->registers[address] = value;
    }
    device->registers[STATUS] = 0x10; // POR_FLAG
    device->registers[ID] = device->id;
    device->registers[ERROR_EN] = 0x40;
}

double fake_ad7124_conversion_ticks(const struct fake_ad7124 *device)
{
    double fs = device->registers[FILTER_0] & 0x7FF;
    static const double divider[] = {8, 4, 1, 1}; // of the master clock, by power mode
    double clocks = (3 * 32 * fs + 95) * divider[device->registers[ADC_CONTROL] >> 6 & 3];
    return clocks / 614400 * 2e6 * device->slowness;
}

static uint32_t conversions_done(const struct fake_ad7124 *device)
{
    bool continuous = (device->registers[ADC_CONTROL] >> 2 & 0xF) == 0;
    if (!device->running || device->stalled || !continuous)
        return 0;
    double elapsed = (double)(hal_host.time - device->started);
    return (uint32_t)(elapsed / fake_ad7124_conversion_ticks(device));
}

// The channel of a conversion numbered from 1 since the sequence was let go: with `position` 0 the
// first that is on, else from there on.
static uint8_t channel_of(const struct fake_ad7124 *device, uint32_t conversion)
{
    uint8_t enabled[16];
    uint8_t count = 0, first = 0;
    for (uint8_t channel = 0; channel < 16; channel++) {
        bool on = (device->registers[CHANNEL_0 + channel] & 0x8000) != 0;
        if (on && channel != device->skip_channel) {
            if (channel < device->position)
                first++;
            enabled[count++] = channel;
        }
    }
    return count == 0 ? 0 : enabled[(first + conversion - 1) % count];
}

static bool ready(void *context)
{
    struct fake_ad7124 *device = context;
    return !device->absent && conversions_done(device) > device->conversions_read;
}

static void sync_pin(void *context, bool high)
{
    struct fake_ad7124 *device = context;
    uint32_t done = conversions_done(device);
    if (done > 0)
        device->last_channel = channel_of(device, done);
    if (device->sequence_goes_on && device->running)
        device->position = channel_of(device, done + 1);
    device->running = high;
    device->started = hal_host.time;
    device->conversions_read = 0;
}

static uint8_t crc8(const uint8_t *bytes, uint8_t count)
{
    uint8_t crc = 0;
    for (uint8_t i = 0; i < count; i++) {
        for (int bit = 7; bit >= 0; bit--) {
            bool carry = (crc >> 7) ^ (bytes[i] >> bit & 1);
            crc = (uint8_t)(crc << 1 ^ (carry ? 0x07 : 0));
        }
    }
    return crc;
}

static void read_register(struct fake_ad7124 *device, uint8_t address, uint8_t *bytes,
                          uint8_t count)
{
    uint8_t answer[8] = {bytes[0]};
    uint8_t length = 1;
    look_over_the_map(device);
    if ((device->registers[ADC_CONTROL] & 0x200) == 0)
        device->reads_without_cs_en++;
    uint32_t value = device->registers[address];
    bool with_status = false;
    if (address == DATA) {
        // A restarted sequence has no result yet: nobody must believe what DATA shows meanwhile.
        uint32_t done = conversions_done(device);
        uint8_t channel = done == 0 ? device->last_channel : channel_of(device, done);
        uint32_t input = device->inputs[channel];
        if (hal_host.accelerometer_self_test)
            input += device->deflections[channel];
        uint32_t setup = device->registers[CHANNEL_0 + channel] >> 12 & 7;
        input = input << (device->registers[CONFIG_0 + setup] & 7) >> device->gains[channel];
        value = done == 0 ? 0xBADBAD : input & 0xFFFFFF;
        device->conversions_read = done;
        uint8_t reported = device->reported_channel == 0xFF ? channel : device->reported_channel;
        device->registers[STATUS] = (device->registers[STATUS] & 0x10) | reported |
                                    (device->registers[ERROR] != 0 ? 0x40u : 0);
        with_status = (device->registers[ADC_CONTROL] & 0x400) != 0;
    }
    for (int shift = 8 * (fake_ad7124_size_of(address) - 1); shift >= 0; shift -= 8)
        answer[length++] = (uint8_t)(value >> shift);
    if (with_status)
        answer[length++] = (uint8_t)device->registers[STATUS];
    if ((device->registers[ERROR_EN] & 4) != 0) {
        answer[length] = crc8(answer, length);
        length++;
    }
    if (address == STATUS)
        device->registers[STATUS] &= ~0x10u;
    if (address == ERROR)
        device->registers[ERROR] = 0;
    if (device->corrupt_reads_after > 0)
        device->corrupt_reads_after--;
    else if (device->corrupt_reads > 0) {
        device->corrupt_reads--;
        answer[2] ^= 0x04;
    }
    if (device->corrupt_register_reads && address != DATA)
        answer[1] ^= 0x01;
    memset(bytes, 0xFF, count);
    memcpy(bytes + 1, answer + 1, (size_t)(length < count ? length : count) - 1);
}

static void write_register(struct fake_ad7124 *device, uint8_t address, uint8_t *bytes)
{
    uint8_t length = (uint8_t)(1 + fake_ad7124_size_of(address));
    if ((device->registers[ERROR_EN] & 4) != 0 && crc8(bytes, length) != bytes[length]) {
        device->writes_refused++;
        raise_error(device, 4);
        return;
    }
    if (device->refuse_writes > 0) {
        device->refuse_writes--;
        raise_error(device, 0x40); // SPI_IGNORE_ERR
        return;
    }
    look_over_the_map(device);
    device->map_damaged = false;
    if (device->running)
        device->writes_while_running++;
    uint32_t value = 0;
    for (uint8_t i = 1; i < length; i++)
        value = value << 8 | bytes[i];
    device->registers[address] = value;
}

static void exchange(void *context, uint8_t *bytes, uint8_t count)
{
    struct fake_ad7124 *device = context;
    static const uint8_t ones[8] = {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF};
    if (device->absent) {
        memset(bytes, 0xFF, count);
        return;
    }
    if (count == sizeof ones && memcmp(bytes, ones, sizeof ones) == 0) {
        reset(device);
        return;
    }
    uint8_t address = bytes[0] & 0x3F;
    if ((bytes[0] & 0x40) != 0)
        read_register(device, address, bytes, count);
    else
        write_register(device, address, bytes);
}

void fake_ad7124_connect(struct fake_ad7124 *device)
{
    *device = (struct fake_ad7124){
        .id = 0x14,
        .skip_channel = 0xFF,
        .reported_channel = 0xFF,
        .slowness = 1,
    };
    reset(device);
    hal_host.adc = (struct hal_host_adc){device, exchange, ready, sync_pin};
}

void fake_ad7124_dip(struct fake_ad7124 *device)
{
    reset(device);
}
