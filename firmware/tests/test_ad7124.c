// SPDX-License-Identifier: Apache-2.0
#include "ad7124.h"
#include "board_protocol.h"
#include "check.h"
#include "configuration.h"
#include "fake_ad7124.h"
#include "hal_host.h"

static int connect(void **state)
{
    static struct fake_ad7124 device;
    hal_host = (struct hal_host){0};
    fake_ad7124_connect(&device);
    *state = &device;
    return 0;
}

static struct ad7124 adc;

static bool set_up_default(void)
{
    struct configure_arguments configuration = configuration_default();
    return ad7124_set_up(&adc, &configuration);
}

static void reset_finds_the_chip(void **state)
{
    struct fake_ad7124 *device = *state;
    static const uint8_t known[] = {0x14, 0x16, 0x17};
    for (size_t i = 0; i < sizeof known; i++) {
        device->id = known[i];
        assert_int_equal(ad7124_reset(), known[i]);
    }
}

static void reset_waits_the_chip_out(void **state)
{
    (void)state;
    uint64_t before = hal_host.time;
    ad7124_reset();
    assert_true(hal_host.time - before >= 4 * 2000); // 4 ms
}

static void another_chip_or_none_is_refused(void **state)
{
    struct fake_ad7124 *device = *state;
    device->id = 0x04; // an AD7124-4
    assert_int_equal(ad7124_reset(), 0);
    assert_false(set_up_default());
    device->absent = true;
    assert_int_equal(ad7124_reset(), 0);
    assert_false(set_up_default());
}

static void set_up_writes_the_registers_of_the_data_sheet(void **state)
{
    struct fake_ad7124 *device = *state;
    assert_true(set_up_default());
    const uint32_t *registers = device->registers;
    assert_int_equal(registers[0x01], 0x0780); // DATA_STATUS, CS_EN, REF_EN, full power, continuous
    assert_int_equal(registers[0x07], 0x0002E7); // all checks of registers, bus and regulators
    // Enable, setup, AINP, AINM.
    assert_int_equal(registers[0x09], 0x8000 | 0 << 12 | 0 << 5 | 1);
    assert_int_equal(registers[0x0A], 0x8000 | 1 << 12 | 2 << 5 | 3);
    assert_int_equal(registers[0x0B], 0x8000 | 2 << 12 | 4 << 5 | 17);
    assert_int_equal(registers[0x0C], 0x8000 | 3 << 12 | 5 << 5 | 17);
    assert_int_equal(registers[0x0D], 0x8000 | 4 << 12 | 6 << 5 | 17);
    assert_int_equal(registers[0x0E], 0x8000 | 5 << 12 | 7 << 5 | 17);
    for (uint8_t channel = 6; channel < 16; channel++)
        assert_int_equal(registers[0x09 + channel], 0x0001);
    // Bipolar on REFIN1 with all buffers but that of REFIN1-, which is ground; unipolar on AVDD and on the
    // internal reference; bipolar on that.
    static const uint16_t config[] = {0x0960, 0x0960, 0x0058, 0x0058, 0x0058, 0x0050, 0x0810};
    for (uint8_t setup = 0; setup < 7; setup++) {
        assert_int_equal(registers[0x19 + setup], config[setup]);
        assert_int_equal(registers[0x21 + setup], 0x460006); // sinc3, FS 6
    }
    assert_int_equal(device->writes_refused, 0);
    assert_int_equal(device->writes_while_running, 0);
}

static void set_up_fails_when_any_one_read_back_is_wrong(void **state)
{
    struct fake_ad7124 *device = *state;
    // After STATUS and ID: ERROR_EN, ADC_CONTROL, 7 × (CONFIG, FILTER, CHANNEL), 8 gains, ERROR,
    // ERROR_EN.
    const uint32_t read_backs = 2 + 7 * 3 + 8 + 2;
    for (uint32_t i = 0; i <= read_backs; i++) {
        device->corrupt_reads_after = 2 + i;
        device->corrupt_reads = 1;
        assert_int_equal(set_up_default(), i == read_backs);
        device->corrupt_reads = 0;
    }
}

static void a_conversion_is_read_with_its_channel(void **state)
{
    struct fake_ad7124 *device = *state;
    device->inputs[0] = 0xABCDEF;
    device->inputs[1] = 0x000001;
    assert_true(set_up_default());
    hal_adc_restart();
    for (uint8_t channel = 0; channel < 2; channel++) {
        while (!hal_adc_ready())
            hal_host_advance(10);
        struct ad7124_conversion conversion;
        assert_true(ad7124_read_conversion(&conversion));
        assert_int_equal(conversion.slot, channel);
        assert_int_equal(conversion.code, device->inputs[channel]);
        assert_false(hal_adc_ready());
    }
}

static void a_conversion_with_a_wrong_crc_is_refused(void **state)
{
    struct fake_ad7124 *device = *state;
    assert_true(set_up_default());
    hal_adc_restart();
    while (!hal_adc_ready())
        hal_host_advance(10);
    device->corrupt_reads = 1;
    struct ad7124_conversion conversion;
    assert_false(ad7124_read_conversion(&conversion));
    assert_true(ad7124_read_conversion(&conversion));
}

static void select_housekeeping(uint8_t source)
{
    uint8_t bytes[AD7124_HOUSEKEEPING_SIZE];
    ad7124_encode_housekeeping(bytes, source);
    hal_adc_exchange(bytes, sizeof bytes);
}

static void housekeeping_sources_take_turns_in_channel_6(void **state)
{
    struct fake_ad7124 *device = *state;
    assert_true(set_up_default());
    select_housekeeping(1);
    assert_int_equal(device->registers[0x0F], 0x8000 | 6 << 12 | 20 << 5 | 21);
    select_housekeeping(0);
    assert_int_equal(device->registers[0x0F], 0x8000 | 6 << 12 | 16 << 5 | 17);
    select_housekeeping(AD7124_NO_HOUSEKEEPING);
    assert_int_equal(device->registers[0x0F] & 0x8000, 0);
}

static void control_is_written_before_anything_is_read_back(void **state)
{
    struct fake_ad7124 *device = *state;
    assert_true(set_up_default());
    assert_int_equal(device->reads_without_cs_en, 2); // STATUS and ID, of which the last bit is not used
}

static void the_chip_tells_its_id_in_any_state(void **state)
{
    struct fake_ad7124 *device = *state;
    assert_int_equal(ad7124_identify(), 0x14); // without a CRC …
    assert_true(set_up_default());
    assert_int_equal(ad7124_identify(), 0x14); // … and with it
    hal_adc_restart();
    while (!hal_adc_ready())
        hal_host_advance(10);
    assert_int_equal(ad7124_identify(), 0x14);
    assert_true(hal_adc_ready()); // the conversion still waits
    device->absent = true;
    assert_int_equal(ad7124_identify(), 0);
}

static void each_step_of_the_set_up_is_short(void **state)
{
    (void)state;
    struct configure_arguments configuration = configuration_default();
    ad7124_begin_set_up(&adc, &configuration);
    enum ad7124_progress progress;
    uint64_t begun = hal_host.time;
    do {
        uint64_t before = hal_host.time;
        progress = ad7124_go_on_with_set_up(&adc);
        // Six transactions at most, each of six bytes of 3 µs.
        assert_in_range(hal_host.time - before, 0, 6 * 6 * 6);
        hal_host_advance(20);
    } while (progress == AD7124_BUSY);
    assert_int_equal(progress, AD7124_DONE);
    assert_in_range(hal_host.time - begun, 5 * 2000, 8 * 2000);
}

static void an_error_is_told_with_the_conversion_and_cleared_by_reading_it(void **state)
{
    struct fake_ad7124 *device = *state;
    assert_true(set_up_default());
    hal_adc_restart();
    struct ad7124_conversion conversion;
    uint32_t errors;
    fake_ad7124_flip_bit(device, 0x19, 0);
    for (int i = 0; i < 2; i++) {
        while (!hal_adc_ready())
            hal_host_advance(10);
        assert_true(ad7124_read_conversion(&conversion));
        assert_int_equal(conversion.error, i == 0);
        assert_false(conversion.powered_on);
        assert_true(ad7124_read_errors(&errors));
        assert_int_equal(errors, i == 0 ? 0x02 : 0x00);
        device->map_damaged = false;
    }
}

// Every bit of every register that can be written, against a chip whose own check is off.
static uint8_t reads_until_verified(void)
{
    uint8_t reads = 0;
    for (; !ad7124_is_verified(&adc); reads++)
        assert_int_equal(ad7124_examine(&adc), AD7124_AS_SET_UP);
    return reads;
}

static void what_a_value_depends_on_is_read_back_first_behind_each_write(void **state)
{
    struct fake_ad7124 *device = *state;
    assert_true(set_up_default());
    assert_int_equal(reads_until_verified(), AD7124_REGISTERS_IN_USE - 5); // of housekeeping, which has no source
    uint8_t selection[AD7124_HOUSEKEEPING_SIZE];
    for (uint8_t source = 0; source <= AD7124_NO_HOUSEKEEPING; source++) {
        ad7124_encode_housekeeping(selection, source);
        hal_adc_exchange(selection, sizeof selection);
        ad7124_verify_housekeeping(&adc, source);
        assert_int_equal(reads_until_verified(),
                         AD7124_REGISTERS_IN_USE - (source == AD7124_NO_HOUSEKEEPING ? 5 : 0));
    }
    // Whether a write came through that cannot be read back, nobody knows; the others are verified all the same.
    device->corrupt_reads = 1;
    ad7124_verify_housekeeping(&adc, 0);
    assert_int_equal(reads_until_verified(), AD7124_REGISTERS_IN_USE - 5);
}

static void every_flipped_bit_is_read_back_within_a_round(void **state)
{
    struct fake_ad7124 *device = *state;
    assert_true(set_up_default());
    uint32_t good[FAKE_AD7124_REGISTERS];
    memcpy(good, device->registers, sizeof good);
    reads_until_verified();
    for (int i = 0; i < 2 * 52; i++)
        assert_int_equal(ad7124_examine(&adc), AD7124_AS_SET_UP);
    for (uint8_t address = 1; address < FAKE_AD7124_REGISTERS; address++) {
        if (address == 0x02 || address == 0x05 || address == 0x06 || address == 0x08)
            continue;
        for (uint8_t bit = 0; bit < 8 * fake_ad7124_size_of(address); bit++) {
            device->registers[address] ^= UINT32_C(1) << bit;
            int calls = 1;
            while (ad7124_examine(&adc) == AD7124_AS_SET_UP)
                calls++;
            assert_in_range(calls, 1, 52);
            memcpy(device->registers, good, sizeof good);
        }
    }
    // A wrong value may be the bus's: it is read again, under its CRC. What cannot be read then is no finding;
    // the register comes again.
    device->corrupt_reads = 1;
    assert_int_equal(ad7124_examine(&adc), AD7124_AS_SET_UP);
    device->corrupt_reads = 2;
    uint8_t examined = adc.examined;
    assert_int_equal(ad7124_examine(&adc), AD7124_UNREADABLE);
    assert_int_equal(adc.examined, examined);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(reset_finds_the_chip, connect),
        cmocka_unit_test_setup(reset_waits_the_chip_out, connect),
        cmocka_unit_test_setup(another_chip_or_none_is_refused, connect),
        cmocka_unit_test_setup(set_up_writes_the_registers_of_the_data_sheet, connect),
        cmocka_unit_test_setup(set_up_fails_when_any_one_read_back_is_wrong, connect),
        cmocka_unit_test_setup(a_conversion_is_read_with_its_channel, connect),
        cmocka_unit_test_setup(a_conversion_with_a_wrong_crc_is_refused, connect),
        cmocka_unit_test_setup(housekeeping_sources_take_turns_in_channel_6, connect),
        cmocka_unit_test_setup(control_is_written_before_anything_is_read_back, connect),
        cmocka_unit_test_setup(the_chip_tells_its_id_in_any_state, connect),
        cmocka_unit_test_setup(each_step_of_the_set_up_is_short, connect),
        cmocka_unit_test_setup(an_error_is_told_with_the_conversion_and_cleared_by_reading_it,
                               connect),
        cmocka_unit_test_setup(what_a_value_depends_on_is_read_back_first_behind_each_write, connect),
        cmocka_unit_test_setup(every_flipped_bit_is_read_back_within_a_round, connect),
    };
    return cmocka_run_group_tests_name("ad7124", tests, NULL, NULL);
}
