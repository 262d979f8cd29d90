// SPDX-License-Identifier: Apache-2.0
#include "command.h"

#include <string.h>

#include "ad7124.h"
#include "board.h"
#include "board_protocol.h"
#include "configuration.h"
#include "hal.h"
#include "self_test.h"

#define REQUEST_HEADER 2u  // type, request id
#define RESPONSE_HEADER 3u // type, request id, status

// A handler reads its arguments, writes the response's data and its size, and returns the status.
typedef uint8_t handler(struct board *board, const uint8_t *arguments, uint8_t *data,
                        uint8_t *size);

static uint8_t identify(struct board *board, const uint8_t *arguments, uint8_t *data, uint8_t *size)
{
    (void)board;
    (void)arguments;
    struct identity numbers;
    if (storage_identity(&numbers) != BOARD_IDENTITY_STATE_VALID)
        numbers = (struct identity){STORAGE_NO_NUMBER, STORAGE_NO_NUMBER};
    struct identify_response response = {
        .protocol = BOARD_PROTOCOL,
        .schema_hash = BOARD_SCHEMA_HASH,
        .firmware_version = BOARD_FIRMWARE_VERSION,
        .adc_id = ad7124_identify(),
        .clock_hz = BOARD_TICK_HZ,
        .calibration_id = numbers.calibration_id,
        .board_serial = numbers.board_serial,
    };
    identify_response_pack(data, &response);
    *size = IDENTIFY_RESPONSE_SIZE;
    return BOARD_STATUS_OK;
}

static uint8_t identity(struct board *board, const uint8_t *arguments, uint8_t *data, uint8_t *size)
{
    (void)board;
    (void)arguments;
    struct identity numbers;
    struct identity_response response = {.state = storage_identity(&numbers)};
    response.board_serial = numbers.board_serial;
    response.calibration_id = numbers.calibration_id;
    identity_response_pack(data, &response);
    *size = IDENTITY_RESPONSE_SIZE;
    return BOARD_STATUS_OK;
}

static uint8_t set_identity(struct board *board, const uint8_t *arguments, uint8_t *data,
                            uint8_t *size)
{
    (void)board;
    (void)data;
    (void)size;
    struct set_identity_arguments wanted;
    set_identity_arguments_unpack(&wanted, arguments);
    if (wanted.board_serial == STORAGE_NO_NUMBER || wanted.calibration_id == STORAGE_NO_NUMBER)
        return BOARD_STATUS_BAD_ARGUMENT;
    struct identity numbers = {wanted.board_serial, wanted.calibration_id};
    return storage_save_identity(&numbers) ? BOARD_STATUS_OK : BOARD_STATUS_STORAGE_FAULT;
}

static bool same(const struct configure_arguments *a, const struct configure_arguments *b)
{
    uint8_t bytes_a[CONFIGURE_ARGUMENTS_SIZE], bytes_b[CONFIGURE_ARGUMENTS_SIZE];
    configure_arguments_pack(bytes_a, a);
    configure_arguments_pack(bytes_b, b);
    return memcmp(bytes_a, bytes_b, CONFIGURE_ARGUMENTS_SIZE) == 0;
}

static uint8_t configure(struct board *board, const uint8_t *arguments, uint8_t *data,
                         uint8_t *size)
{
    struct configure_arguments wanted;
    configure_arguments_unpack(&wanted, arguments);
    uint8_t status = configuration_check(&wanted);
    if (status != BOARD_STATUS_OK)
        return status;
    // Hosts configure at every start: a write each would wear the EEPROM out.
    bool stored = board->storage.origin == BOARD_CONFIGURATION_ORIGIN_STORED &&
                  same(&wanted, &board->scan.configuration);
    scan_configure(&board->scan, &wanted);
    if (!stored && !storage_save(&board->storage, &wanted))
        return BOARD_STATUS_STORAGE_FAULT;
    struct configure_response response = {.period_ticks = board->scan.period};
    configure_response_pack(data, &response);
    *size = CONFIGURE_RESPONSE_SIZE;
    return BOARD_STATUS_OK;
}

static uint8_t start(struct board *board, const uint8_t *arguments, uint8_t *data, uint8_t *size)
{
    (void)arguments;
    struct start_response response = {.period_ticks = board->scan.period};
    if (!scan_start(&board->scan, &response.first_tick))
        return BOARD_STATUS_ADC_FAULT;
    start_response_pack(data, &response);
    *size = START_RESPONSE_SIZE;
    return BOARD_STATUS_OK;
}

static uint8_t stop(struct board *board, const uint8_t *arguments, uint8_t *data, uint8_t *size)
{
    (void)arguments;
    if (board->scan.streaming)
        board_stop(board);
    struct stop_response response = {.scans_scheduled = scan_scheduled(&board->scan)};
    stop_response_pack(data, &response);
    *size = STOP_RESPONSE_SIZE;
    return BOARD_STATUS_OK;
}

static uint8_t self_test(struct board *board, const uint8_t *arguments, uint8_t *data,
                         uint8_t *size)
{
    (void)board;
    (void)arguments;
    struct self_test_response response = self_test_run();
    self_test_response_pack(data, &response);
    *size = SELF_TEST_RESPONSE_SIZE;
    return BOARD_STATUS_OK;
}

static uint8_t sync(struct board *board, const uint8_t *arguments, uint8_t *data, uint8_t *size)
{
    (void)arguments;
    // The answer tells when it will be sent: it is taken to need as long as the one before. (The
    // first of all is stamped early by that time.)
    uint64_t now = hal_time();
    board->sync_stamp = (uint16_t)now;
    struct sync_response response = {
        .received_ticks = hal_serial_delimiter_time(),
        .sent_ticks = now + board->sync_coding_ticks,
    };
    sync_response_pack(data, &response);
    *size = SYNC_RESPONSE_SIZE;
    return BOARD_STATUS_OK;
}

static uint8_t counters(struct board *board, const uint8_t *arguments, uint8_t *data, uint8_t *size)
{
    (void)arguments;
    struct health_frame response = board_health(board);
    health_frame_pack(data, &response);
    *size = HEALTH_FRAME_SIZE;
    return BOARD_STATUS_OK;
}

static uint8_t configuration(struct board *board, const uint8_t *arguments, uint8_t *data,
                             uint8_t *size)
{
    (void)arguments;
    configure_arguments_pack(data, &board->scan.configuration);
    *size = CONFIGURE_ARGUMENTS_SIZE;
    return BOARD_STATUS_OK;
}

static uint8_t drive(struct board *board, const uint8_t *arguments, uint8_t *data, uint8_t *size)
{
    struct drive_arguments request;
    drive_arguments_unpack(&request, arguments);
    uint8_t status = drive_command(&board->drive, &request, (uint32_t)hal_time());
    if (status != BOARD_STATUS_OK)
        return status;
    struct drive_response response = {.state = board->drive.state, .trip = board->drive.trip};
    drive_response_pack(data, &response);
    *size = DRIVE_RESPONSE_SIZE;
    return BOARD_STATUS_OK;
}

// The main loop resets, once the response is on its way.
static uint8_t reset(struct board *board, const uint8_t *arguments, uint8_t *data, uint8_t *size)
{
    (void)arguments;
    (void)data;
    (void)size;
    board->reset_wanted = true;
    return BOARD_STATUS_OK;
}

// At rest: idle, with a drive that does not turn. What holds the main loop up may not run else.
enum when { ALWAYS, IDLE_ONLY, AT_REST_ONLY };

struct command {
    uint8_t type;
    uint8_t arguments_size;
    enum when when;
    handler *handle;
};

static const struct command commands[] = {
    {BOARD_COMMAND_IDENTIFY, 0, ALWAYS, identify},
    {BOARD_COMMAND_CONFIGURE, CONFIGURE_ARGUMENTS_SIZE, AT_REST_ONLY, configure},
    {BOARD_COMMAND_START, 0, IDLE_ONLY, start},
    {BOARD_COMMAND_STOP, 0, ALWAYS, stop},
    {BOARD_COMMAND_SELF_TEST, 0, AT_REST_ONLY, self_test},
    {BOARD_COMMAND_SYNC, 0, ALWAYS, sync},
    {BOARD_COMMAND_COUNTERS, 0, ALWAYS, counters},
    {BOARD_COMMAND_RESET, 0, ALWAYS, reset},
    {BOARD_COMMAND_CONFIGURATION, 0, ALWAYS, configuration},
    {BOARD_COMMAND_IDENTITY, 0, ALWAYS, identity},
    {BOARD_COMMAND_SET_IDENTITY, SET_IDENTITY_ARGUMENTS_SIZE, AT_REST_ONLY, set_identity},
    {BOARD_COMMAND_DRIVE, DRIVE_ARGUMENTS_SIZE, ALWAYS, drive},
};

static uint8_t carry_out(struct board *board, const uint8_t *payload, uint8_t length, uint8_t *data,
                         uint8_t *size)
{
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        const struct command *command = &commands[i];
        if (command->type != payload[0])
            continue;
        if (length != REQUEST_HEADER + command->arguments_size)
            return BOARD_STATUS_BAD_LENGTH;
        if (command->when != ALWAYS && board->scan.streaming)
            return BOARD_STATUS_NOT_IDLE;
        if (command->when == AT_REST_ONLY && drive_turns(&board->drive))
            return BOARD_STATUS_DRIVE_TURNS;
        return command->handle(board, payload + REQUEST_HEADER, data, size);
    }
    return BOARD_STATUS_UNKNOWN_COMMAND;
}

bool command_handle(struct board *board, const uint8_t *payload, uint8_t length)
{
    if (length < REQUEST_HEADER || (payload[0] & BOARD_WIRE_RESPONSE_BIT) != 0)
        return false;
    uint8_t response[BOARD_WIRE_MAXIMUM_PAYLOAD];
    uint8_t size = 0;
    uint8_t status = carry_out(board, payload, length, response + RESPONSE_HEADER, &size);
    response[0] = payload[0] | BOARD_WIRE_RESPONSE_BIT;
    response[1] = payload[1];
    response[2] = status;
    transmit(&board->transmitter, response, (uint8_t)(RESPONSE_HEADER + size));
    if (payload[0] == BOARD_COMMAND_SYNC && status == BOARD_STATUS_OK)
        board->sync_coding_ticks = (uint16_t)((uint16_t)hal_time() - board->sync_stamp);
    return true;
}
