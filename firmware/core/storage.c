// SPDX-License-Identifier: Apache-2.0
#include "storage.h"

#include <string.h>

#include "configuration.h"
#include "hal.h"

#define SLOTS 2u
#define HEADER_SIZE 2u // version, generation
#define CRC_AT (HEADER_SIZE + CONFIGURE_ARGUMENTS_SIZE)
#define SLOT_SIZE (CRC_AT + 2u)

static const uint16_t addresses[SLOTS] = BOARD_EEPROM_CONFIGURATION_SLOTS;

enum slot_state { EMPTY, DAMAGED, OTHER_VERSION, GOOD };

static uint16_t checksum(const uint8_t bytes[SLOT_SIZE])
{
    return hal_crc16_ccitt(BOARD_WIRE_CRC16_INITIAL, bytes, CRC_AT);
}

static bool is_empty(const uint8_t bytes[SLOT_SIZE])
{
    for (size_t i = 0; i < SLOT_SIZE; i++) {
        if (bytes[i] != 0xFF)
            return false;
    }
    return true;
}

static enum slot_state read_slot(uint8_t slot, uint8_t *generation,
                                 struct configure_arguments *configuration)
{
    uint8_t bytes[SLOT_SIZE];
    hal_eeprom_read(addresses[slot], bytes, SLOT_SIZE);
    if (is_empty(bytes))
        return EMPTY;
    if (checksum(bytes) != board_get_u16(bytes + CRC_AT))
        return DAMAGED;
    if (bytes[0] != BOARD_EEPROM_CONFIGURATION_VERSION)
        return OTHER_VERSION;
    *generation = bytes[1];
    configure_arguments_unpack(configuration, bytes + HEADER_SIZE);
    // The same version, but of a firmware with other limits.
    return configuration_check(configuration) == BOARD_STATUS_OK ? GOOD : OTHER_VERSION;
}

struct configure_arguments storage_load(struct storage *storage)
{
    struct configure_arguments configurations[SLOTS];
    uint8_t generations[SLOTS];
    enum slot_state states[SLOTS];
    for (uint8_t slot = 0; slot < SLOTS; slot++)
        states[slot] = read_slot(slot, &generations[slot], &configurations[slot]);

    *storage = (struct storage){0};
    if (states[0] != GOOD && states[1] != GOOD) {
        if (states[0] == OTHER_VERSION || states[1] == OTHER_VERSION)
            storage->origin = BOARD_CONFIGURATION_ORIGIN_DEFAULT_VERSION;
        else if (states[0] == DAMAGED || states[1] == DAMAGED)
            storage->origin = BOARD_CONFIGURATION_ORIGIN_DEFAULT_DAMAGED;
        else
            storage->origin = BOARD_CONFIGURATION_ORIGIN_DEFAULT_EMPTY;
        return configuration_default();
    }
    if (states[0] == GOOD && states[1] == GOOD)
        storage->slot = (int8_t)(generations[1] - generations[0]) > 0;
    else
        storage->slot = states[1] == GOOD;
    storage->generation = generations[storage->slot];
    storage->origin = states[1 - storage->slot] == DAMAGED ? BOARD_CONFIGURATION_ORIGIN_STORED_OLDER
                                                           : BOARD_CONFIGURATION_ORIGIN_STORED;
    return configurations[storage->slot];
}

bool storage_save(struct storage *storage, const struct configure_arguments *configuration)
{
    uint8_t slot = (uint8_t)(1 - storage->slot);
    uint8_t bytes[SLOT_SIZE], written[SLOT_SIZE];
    bytes[0] = BOARD_EEPROM_CONFIGURATION_VERSION;
    bytes[1] = (uint8_t)(storage->generation + 1);
    configure_arguments_pack(bytes + HEADER_SIZE, configuration);
    board_put_u16(bytes + CRC_AT, checksum(bytes));
    hal_eeprom_write(addresses[slot], bytes, SLOT_SIZE);
    hal_eeprom_read(addresses[slot], written, SLOT_SIZE);
    if (memcmp(written, bytes, SLOT_SIZE) != 0) {
        storage->origin = BOARD_CONFIGURATION_ORIGIN_UNSTORED;
        return false;
    }
    *storage = (struct storage){slot, bytes[1], BOARD_CONFIGURATION_ORIGIN_STORED};
    return true;
}

// Serial number, calibration id and checksum lie one behind another.
#define IDENTITY_AT BOARD_EEPROM_BOARD_SERIAL
#define IDENTITY_CHECKED 8u
#define IDENTITY_SIZE (IDENTITY_CHECKED + 2u)
_Static_assert(BOARD_EEPROM_CALIBRATION_ID == IDENTITY_AT + 4u &&
                   BOARD_EEPROM_IDENTITY_CHECKSUM == IDENTITY_AT + IDENTITY_CHECKED,
               "the identity is one block");

static uint16_t identity_checksum(const uint8_t bytes[IDENTITY_SIZE])
{
    return hal_crc16_ccitt(BOARD_WIRE_CRC16_INITIAL, bytes, IDENTITY_CHECKED);
}

uint8_t storage_identity(struct identity *identity)
{
    uint8_t bytes[IDENTITY_SIZE];
    hal_eeprom_read(IDENTITY_AT, bytes, IDENTITY_SIZE);
    identity->board_serial = board_get_u32(bytes);
    identity->calibration_id = board_get_u32(bytes + 4);
    uint16_t stored = board_get_u16(bytes + IDENTITY_CHECKED);
    bool written = identity->board_serial != STORAGE_NO_NUMBER ||
                   identity->calibration_id != STORAGE_NO_NUMBER;
    if (written && stored == identity_checksum(bytes))
        return BOARD_IDENTITY_STATE_VALID;
    if (stored != UINT16_MAX)
        return BOARD_IDENTITY_STATE_DAMAGED;
    return written ? BOARD_IDENTITY_STATE_WITHOUT_CHECKSUM : BOARD_IDENTITY_STATE_UNSET;
}

bool storage_save_identity(const struct identity *identity)
{
    uint8_t bytes[IDENTITY_SIZE];
    board_put_u32(bytes, identity->board_serial);
    board_put_u32(bytes + 4, identity->calibration_id);
    board_put_u16(bytes + IDENTITY_CHECKED, identity_checksum(bytes));
    hal_eeprom_write(IDENTITY_AT, bytes, IDENTITY_SIZE);
    struct identity written;
    return storage_identity(&written) == BOARD_IDENTITY_STATE_VALID &&
           written.board_serial == identity->board_serial &&
           written.calibration_id == identity->calibration_id;
}
