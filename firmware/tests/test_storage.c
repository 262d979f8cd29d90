// SPDX-License-Identifier: Apache-2.0
#include <string.h>

#include "check.h"
#include "configuration.h"
#include "hal_host.h"
#include "storage.h"

#define SLOT_SIZE (2 + CONFIGURE_ARGUMENTS_SIZE + 2)

static const uint16_t slots[2] = BOARD_EEPROM_CONFIGURATION_SLOTS;

static int erase(void **state)
{
    (void)state;
    hal_host = (struct hal_host){.eeprom_bytes_left = UINT32_MAX};
    memset(hal_host.eeprom, 0xFF, sizeof hal_host.eeprom);
    return 0;
}

static struct configure_arguments at_rate(uint16_t rate_hz)
{
    struct configure_arguments configuration = configuration_default();
    configuration.rate_hz = rate_hz;
    return configuration;
}

// Powers up, stores, powers off.
static bool save(uint16_t rate_hz)
{
    struct storage storage;
    storage_load(&storage);
    struct configure_arguments configuration = at_rate(rate_hz);
    return storage_save(&storage, &configuration);
}

// By the bytes on the wire: the struct has padding.
static void assert_same(const struct configure_arguments *a, const struct configure_arguments *b)
{
    uint8_t bytes_a[CONFIGURE_ARGUMENTS_SIZE], bytes_b[CONFIGURE_ARGUMENTS_SIZE];
    configure_arguments_pack(bytes_a, a);
    configure_arguments_pack(bytes_b, b);
    assert_memory_equal(bytes_a, bytes_b, CONFIGURE_ARGUMENTS_SIZE);
}

static void expect(uint16_t rate_hz, uint8_t origin)
{
    struct storage storage;
    struct configure_arguments found = storage_load(&storage);
    struct configure_arguments expected = at_rate(rate_hz);
    assert_same(&found, &expected);
    assert_int_equal(storage.origin, origin);
}

static void an_empty_eeprom_gives_the_default(void **state)
{
    (void)state;
    expect(100, BOARD_CONFIGURATION_ORIGIN_DEFAULT_EMPTY);
    struct identity identity;
    assert_int_equal(storage_identity(&identity), BOARD_IDENTITY_STATE_UNSET);
    assert_int_equal(identity.board_serial, UINT32_MAX);
}

static void every_flipped_bit_of_an_identity_is_found(void **state)
{
    (void)state;
    const struct identity numbers = {17, 3};
    struct identity found;
    assert_true(storage_save_identity(&numbers));
    assert_int_equal(storage_identity(&found), BOARD_IDENTITY_STATE_VALID);
    for (uint32_t bit = 0; bit < 80; bit++) {
        hal_host.eeprom[bit / 8] ^= (uint8_t)(1u << bit % 8);
        assert_int_equal(storage_identity(&found), BOARD_IDENTITY_STATE_DAMAGED);
        hal_host.eeprom[bit / 8] ^= (uint8_t)(1u << bit % 8);
    }
}

static void power_lost_while_an_identity_is_written_leaves_none_that_is_believed(void **state)
{
    for (uint32_t bytes = 0; bytes < 10; bytes++) {
        erase(state);
        const struct identity before = {0x01020304, 0x05060708}, after = {0x11121314, 0x15161718};
        struct identity found;
        assert_true(storage_save_identity(&before));
        hal_host.eeprom_bytes_left = bytes;
        assert_false(storage_save_identity(&after));
        uint8_t state_of = storage_identity(&found);
        assert_true(state_of == BOARD_IDENTITY_STATE_DAMAGED);
    }
}

static void an_identity_of_the_old_layout_is_known_as_such(void **state)
{
    (void)state;
    board_put_u32(hal_host.eeprom + BOARD_EEPROM_BOARD_SERIAL, 17);
    board_put_u32(hal_host.eeprom + BOARD_EEPROM_CALIBRATION_ID, 3);
    struct identity found;
    assert_int_equal(storage_identity(&found), BOARD_IDENTITY_STATE_WITHOUT_CHECKSUM);
    assert_int_equal(found.board_serial, 17);
    assert_int_equal(found.calibration_id, 3);
    assert_true(storage_save_identity(&found));
    assert_int_equal(storage_identity(&found), BOARD_IDENTITY_STATE_VALID);
}

static void the_last_one_stored_is_found(void **state)
{
    (void)state;
    // More often than the generation counts: it wraps.
    for (uint16_t i = 0; i < 700; i++) {
        uint16_t rate_hz = (uint16_t)(10 + i % 90);
        assert_true(save(rate_hz));
        expect(rate_hz, BOARD_CONFIGURATION_ORIGIN_STORED);
    }
}

static void power_lost_at_any_byte_leaves_the_old_or_the_new_one(void **state)
{
    (void)state;
    for (int first_slot = 0; first_slot < 2; first_slot++) {
        for (uint32_t bytes = 0; bytes <= SLOT_SIZE; bytes++) {
            erase(NULL);
            for (int i = 0; i <= first_slot; i++)
                assert_true(save(30));
            assert_true(save(40));
            hal_host.eeprom_bytes_left = bytes;
            bool saved = save(50);
            hal_host.eeprom_bytes_left = UINT32_MAX;
            if (saved)
                expect(50, BOARD_CONFIGURATION_ORIGIN_STORED);
            else
                expect(40, BOARD_CONFIGURATION_ORIGIN_STORED_OLDER);
            // Whatever happened, the next one goes well, and not over the one in force.
            hal_host.eeprom_bytes_left = 1;
            save(60);
            hal_host.eeprom_bytes_left = UINT32_MAX;
            expect(saved ? 50 : 40, BOARD_CONFIGURATION_ORIGIN_STORED_OLDER);
            assert_true(save(70));
            expect(70, BOARD_CONFIGURATION_ORIGIN_STORED);
        }
    }
}

static void power_lost_at_the_very_first_write_leaves_the_default(void **state)
{
    (void)state;
    hal_host.eeprom_bytes_left = 7;
    assert_false(save(50));
    expect(100, BOARD_CONFIGURATION_ORIGIN_DEFAULT_DAMAGED);
}

static void a_flipped_bit_is_never_believed(void **state)
{
    (void)state;
    assert_true(save(40));
    assert_true(save(50));
    uint8_t good[HAL_HOST_EEPROM_SIZE];
    memcpy(good, hal_host.eeprom, sizeof good);
    for (int slot = 0; slot < 2; slot++) {
        for (uint32_t bit = 0; bit < 8 * SLOT_SIZE; bit++) {
            memcpy(hal_host.eeprom, good, sizeof good);
            hal_host.eeprom[slots[slot] + bit / 8] ^= (uint8_t)(1u << bit % 8);
            // The first write of all went into the second slot: 50 stands in the first.
            expect(slot == 0 ? 40 : 50, BOARD_CONFIGURATION_ORIGIN_STORED_OLDER);
        }
    }
}

static void put_slot(int slot, uint8_t version, const struct configure_arguments *configuration)
{
    uint8_t *bytes = hal_host.eeprom + slots[slot];
    bytes[0] = version;
    bytes[1] = 1;
    configure_arguments_pack(bytes + 2, configuration);
    uint8_t length = 2 + CONFIGURE_ARGUMENTS_SIZE;
    board_put_u16(bytes + length, hal_crc16_ccitt(BOARD_WIRE_CRC16_INITIAL, bytes, length));
}

static void another_version_or_what_does_not_fit_is_not_taken(void **state)
{
    (void)state;
    struct configure_arguments configuration = at_rate(50);
    put_slot(0, BOARD_EEPROM_CONFIGURATION_VERSION + 1, &configuration);
    expect(100, BOARD_CONFIGURATION_ORIGIN_DEFAULT_VERSION);
    put_slot(0, BOARD_EEPROM_CONFIGURATION_VERSION, &configuration);
    expect(50, BOARD_CONFIGURATION_ORIGIN_STORED);
    configuration.rate_hz = 200; // with FS 6
    put_slot(0, BOARD_EEPROM_CONFIGURATION_VERSION, &configuration);
    expect(100, BOARD_CONFIGURATION_ORIGIN_DEFAULT_VERSION);
}

static void all_zeros_are_damaged(void **state)
{
    (void)state;
    memset(hal_host.eeprom, 0, sizeof hal_host.eeprom);
    expect(100, BOARD_CONFIGURATION_ORIGIN_DEFAULT_DAMAGED);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(an_empty_eeprom_gives_the_default, erase),
        cmocka_unit_test_setup(the_last_one_stored_is_found, erase),
        cmocka_unit_test_setup(power_lost_at_any_byte_leaves_the_old_or_the_new_one, erase),
        cmocka_unit_test_setup(power_lost_at_the_very_first_write_leaves_the_default, erase),
        cmocka_unit_test_setup(a_flipped_bit_is_never_believed, erase),
        cmocka_unit_test_setup(another_version_or_what_does_not_fit_is_not_taken, erase),
        cmocka_unit_test_setup(all_zeros_are_damaged, erase),
        cmocka_unit_test_setup(every_flipped_bit_of_an_identity_is_found, erase),
        cmocka_unit_test_setup(power_lost_while_an_identity_is_written_leaves_none_that_is_believed,
                               erase),
        cmocka_unit_test_setup(an_identity_of_the_old_layout_is_known_as_such, erase),
    };
    return cmocka_run_group_tests_name("storage", tests, NULL, NULL);
}
