// SPDX-License-Identifier: Apache-2.0
#include "fuzz_target.h"

#include <stdio.h>
#include <stdlib.h>

#include "board.h"
#include "configuration.h"
#include "fake_ad7124.h"
#include "hal_host.h"

#define REQUIRE(condition)                                                                         \
    do {                                                                                           \
        if (!(condition)) {                                                                        \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition);                        \
            abort();                                                                               \
        }                                                                                          \
    } while (0)

#define CHUNK 200u // bytes given at a time, fewer than the serial line's buffer holds

static struct board board;
static struct fake_ad7124 adc;
static struct frame_parser host;
static uint32_t delimiters, responses;

static uint8_t answer_size(uint8_t command)
{
    switch (command) {
    case BOARD_COMMAND_IDENTIFY:
        return IDENTIFY_RESPONSE_SIZE;
    case BOARD_COMMAND_CONFIGURE:
        return CONFIGURE_RESPONSE_SIZE;
    case BOARD_COMMAND_START:
        return START_RESPONSE_SIZE;
    case BOARD_COMMAND_STOP:
        return STOP_RESPONSE_SIZE;
    case BOARD_COMMAND_SELF_TEST:
        return SELF_TEST_RESPONSE_SIZE;
    case BOARD_COMMAND_SYNC:
        return SYNC_RESPONSE_SIZE;
    case BOARD_COMMAND_COUNTERS:
        return HEALTH_FRAME_SIZE;
    case BOARD_COMMAND_CONFIGURATION:
        return CONFIGURE_ARGUMENTS_SIZE;
    case BOARD_COMMAND_IDENTITY:
        return IDENTITY_RESPONSE_SIZE;
    case BOARD_COMMAND_DRIVE:
        return DRIVE_RESPONSE_SIZE;
    default:
        return 0;
    }
}

static void judge_response(const uint8_t *payload, uint8_t length)
{
    responses++;
    REQUIRE(length >= 3);
    uint8_t command = payload[0] & (uint8_t)~BOARD_WIRE_RESPONSE_BIT;
    if (payload[2] == BOARD_STATUS_OK)
        REQUIRE(length == 3 + answer_size(command));
    else
        REQUIRE(length == 3 && payload[2] <= BOARD_STATUS_DRIVE_STANDS);
}

static void judge(const uint8_t *payload, uint8_t length)
{
    switch (payload[0]) {
    case BOARD_FRAME_DATA:
        REQUIRE(length == 1 + DATA_FRAME_SIZE);
        break;
    case BOARD_FRAME_HEALTH:
        REQUIRE(length == 1 + HEALTH_FRAME_SIZE);
        break;
    case BOARD_FRAME_DRIVE:
        REQUIRE(length == 1 + DRIVE_FRAME_SIZE);
        break;
    case BOARD_FRAME_BOOT:
        REQUIRE(length == 1 + BOOT_FRAME_SIZE);
        break;
    default:
        REQUIRE((payload[0] & BOARD_WIRE_RESPONSE_BIT) != 0);
        judge_response(payload, length);
    }
}

static void take_what_it_sent(void)
{
    for (size_t i = 0; i < hal_host.sent_length; i++) {
        uint8_t length = frame_parse(&host, hal_host.sent[i]);
        if (length > 0)
            judge(host.bytes, length);
    }
    REQUIRE(host.bad_frames == 0);
    hal_host.sent_length = 0;
}

static void work(uint32_t rounds)
{
    while (rounds-- > 0) {
        board_poll(&board);
        hal_host_advance(50);
        if (hal_host.resets > 0) {
            hal_host.resets = 0;
            hal_sample_timer_stop();
            board_init(&board);
        }
    }
    take_what_it_sent();
}

void fuzz_power_up(uint8_t faults)
{
    hal_host = (struct hal_host){.tx_space = 255, .eeprom_bytes_left = UINT32_MAX};
    memset(hal_host.eeprom, 0xFF, sizeof hal_host.eeprom);
    host = (struct frame_parser){0};
    delimiters = responses = 0;
    fake_ad7124_connect(&adc);
    adc.absent = (faults & 1) != 0;
    adc.stalled = (faults & 2) != 0;
    if ((faults & 4) != 0) {
        adc.corrupt_reads_after = faults >> 4;
        adc.corrupt_reads = 3;
    }
    if ((faults & 8) != 0)
        hal_host.eeprom_bytes_left = faults >> 4;
    board_init(&board);
    work(1);
}

void fuzz_receive(const uint8_t *bytes, size_t count)
{
    while (count > 0) {
        size_t chunk = count < CHUNK ? count : CHUNK;
        for (size_t i = 0; i < chunk; i++)
            delimiters += bytes[i] == BOARD_WIRE_DELIMITER;
        hal_host_receive(bytes, chunk);
        while (hal_host.received_length < hal_host.to_receive_length)
            work(1);
        work(40); // 1 ms, in which it also scans
        bytes += chunk;
        count -= chunk;
    }
    REQUIRE(responses <= delimiters);
}

void fuzz_power_down(void)
{
    static const uint8_t end[] = {BOARD_WIRE_DELIMITER};
    fuzz_receive(end, sizeof end); // of whatever has begun
    const uint8_t stop[] = {BOARD_COMMAND_STOP, 1};
    uint8_t frame[FRAME_MAXIMUM];
    uint32_t before = responses;
    fuzz_receive(frame, frame_encode(frame, stop, sizeof stop));
    REQUIRE(responses == before + 1);
    REQUIRE(!board.scan.streaming && !board.scan.converting);
    REQUIRE(configuration_check(&board.scan.configuration) == BOARD_STATUS_OK);
    REQUIRE(adc.writes_refused == 0);
    // What it would start with is what it has stored, or says that it has not.
    struct storage storage;
    struct configure_arguments stored = storage_load(&storage);
    if (board.storage.origin != BOARD_CONFIGURATION_ORIGIN_UNSTORED) {
        REQUIRE(storage.origin == board.storage.origin);
        REQUIRE(stored.rate_hz == board.scan.configuration.rate_hz);
    }
}
