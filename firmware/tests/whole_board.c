// SPDX-License-Identifier: Apache-2.0
#include "whole_board.h"

#include <stdlib.h>

#include "check.h"
#include "configuration.h"

struct whole_board *whole_board_new(void)
{
    return whole_board_new_at(0);
}

struct whole_board *whole_board_new_at(uint64_t time)
{
    struct whole_board *whole = calloc(1, sizeof *whole);
    assert_non_null(whole);
    hal_host = (struct hal_host){
        .time = time,
        .tx_space = 255,
        .reset_cause = BOARD_RESET_CAUSE_EXTERNAL,
        .boot_count = 3,
        .stack_low_water = 7000,
        .eeprom_bytes_left = UINT32_MAX,
    };
    memset(hal_host.eeprom, 0xFF, sizeof hal_host.eeprom);
    board_put_u32(hal_host.eeprom + BOARD_EEPROM_BOARD_SERIAL, 0x01020304);
    board_put_u32(hal_host.eeprom + BOARD_EEPROM_CALIBRATION_ID, 0x0A0B0C0D);
    board_put_u16(hal_host.eeprom + BOARD_EEPROM_IDENTITY_CHECKSUM,
                  hal_crc16_ccitt(BOARD_WIRE_CRC16_INITIAL, hal_host.eeprom, 8));
    fake_ad7124_connect(&whole->adc);
    for (uint32_t i = 0; i < 16; i++)
        whole->adc.inputs[i] = 0x100000 + i;
    board_init(&whole->board);
    whole_board_run_ms(whole, 1);
    return whole;
}

int whole_board_power_up(void **state)
{
    *state = whole_board_new();
    return 0;
}

int whole_board_power_up_forgetful(void **state)
{
    whole_board_power_up(state);
    whole_board_forget(*state);
    return 0;
}

int whole_board_power_down(void **state)
{
    free(*state);
    return 0;
}

static void take_in(struct whole_board *whole)
{
    for (; whole->parsed < hal_host.sent_length; whole->parsed++) {
        uint8_t length = frame_parse(&whole->host_parser, hal_host.sent[whole->parsed]);
        if (length == 0)
            continue;
        assert_true(whole->frame_count < sizeof whole->frames / sizeof whole->frames[0]);
        struct received_frame *frame = &whole->frames[whole->frame_count++];
        memcpy(frame->payload, whole->host_parser.bytes, length);
        frame->length = length;
    }
    assert_int_equal(whole->host_parser.bad_frames, 0);
    whole->parsed = hal_host.sent_length = 0;
}

void whole_board_run_until(struct whole_board *whole, uint64_t time)
{
    while (hal_host.time < time) {
        board_poll(&whole->board);
        hal_host_advance(50);
    }
    take_in(whole);
}

void whole_board_run_ms(struct whole_board *whole, uint32_t milliseconds)
{
    whole_board_run_until(whole, hal_host.time + (uint64_t)milliseconds * (BOARD_TICK_HZ / 1000));
}

void whole_board_forget(struct whole_board *whole)
{
    whole->frame_count = 0;
}

struct received_frame whole_board_request(struct whole_board *whole, uint8_t type, uint8_t id,
                                          const uint8_t *arguments, uint8_t length)
{
    uint8_t payload[BOARD_WIRE_MAXIMUM_PAYLOAD] = {type, id};
    uint8_t frame[FRAME_MAXIMUM];
    if (length > 0)
        memcpy(payload + 2, arguments, length);
    hal_host_receive(frame, frame_encode(frame, payload, (uint8_t)(2 + length)));
    size_t before = whole->frame_count;
    whole_board_run_ms(whole, 1);
    for (size_t i = before; i < whole->frame_count; i++) {
        if (whole->frames[i].payload[0] == (type | BOARD_WIRE_RESPONSE_BIT))
            return whole->frames[i];
    }
    fail_msg("no response to request %02x", type);
    return (struct received_frame){0};
}

uint8_t whole_board_configure(struct whole_board *whole,
                              const struct configure_arguments *configuration)
{
    uint8_t arguments[CONFIGURE_ARGUMENTS_SIZE];
    configure_arguments_pack(arguments, configuration);
    struct received_frame response = whole_board_request(whole, BOARD_COMMAND_CONFIGURE, 98,
                                                         arguments, sizeof arguments);
    return response.payload[2];
}

uint8_t whole_board_set_rate(struct whole_board *whole, uint16_t rate_hz, uint16_t fs)
{
    struct configure_arguments configuration = configuration_default();
    configuration.rate_hz = rate_hz;
    configuration.filter_fs = fs;
    return whole_board_configure(whole, &configuration);
}

const struct received_frame *whole_board_frame(const struct whole_board *whole, uint8_t type,
                                               size_t n)
{
    for (size_t i = 0; i < whole->frame_count; i++) {
        if (whole->frames[i].payload[0] == type && n-- == 0)
            return &whole->frames[i];
    }
    return NULL;
}

size_t whole_board_count(const struct whole_board *whole, uint8_t type)
{
    size_t count = 0;
    while (whole_board_frame(whole, type, count) != NULL)
        count++;
    return count;
}

struct data_frame whole_board_data(const struct whole_board *whole, size_t n)
{
    const struct received_frame *frame = whole_board_frame(whole, BOARD_FRAME_DATA, n);
    assert_non_null(frame);
    assert_int_equal(frame->length, 1 + DATA_FRAME_SIZE);
    struct data_frame data;
    data_frame_unpack(&data, frame->payload + 1);
    return data;
}

struct health_frame whole_board_counters(struct whole_board *whole)
{
    struct received_frame response =
        whole_board_request(whole, BOARD_COMMAND_COUNTERS, 99, NULL, 0);
    assert_int_equal(response.length, 3 + HEALTH_FRAME_SIZE);
    struct health_frame health;
    health_frame_unpack(&health, response.payload + 3);
    return health;
}
