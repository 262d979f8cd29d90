// SPDX-License-Identifier: Apache-2.0
#include "board.h"

#include "ad7124.h"
#include "command.h"
#include "hal.h"

#define HEALTH_PERIOD_TICKS BOARD_TICK_HZ

// Bytes taken from the line in one round, so that a busy line cannot keep the scan waiting.
#define RX_BYTES_A_ROUND 16

static void send_boot(struct board *board)
{
    struct boot_frame boot = {
        .reset_cause = hal_reset_cause(),
        .boot_count = hal_boot_count(),
        .schema_hash = BOARD_SCHEMA_HASH,
        .configuration_origin = board->storage.origin,
    };
    uint8_t payload[1 + BOOT_FRAME_SIZE] = {BOARD_FRAME_BOOT};
    boot_frame_pack(payload + 1, &boot);
    transmit(&board->transmitter, payload, sizeof payload);
}

void board_init(struct board *board)
{
    *board = (struct board){0};
    struct configure_arguments configuration = storage_load(&board->storage);
    scan_init(&board->scan, &board->transmitter, &configuration);
    hal_adc_hold();
    ad7124_reset();
    board->last_host_frame = (uint32_t)hal_time();
    board->last_health = board->last_host_frame;
    drive_init(&board->drive, board->last_host_frame);
    send_boot(board);
}

struct health_frame board_health(const struct board *board)
{
    struct scan_counters scan = scan_read_counters(&board->scan);
    struct hal_encoders encoders;
    uint8_t state = hal_lock();
    hal_encoders_read(&encoders);
    hal_unlock(state);
    return (struct health_frame){
        .missed_ticks = scan.missed_ticks,
        .scan_overruns = scan.overruns,
        .spi_crc_errors = scan.spi_crc_errors,
        .adc_sequence_errors = scan.sequence_errors,
        .adc_errors = scan.adc_errors,
        .adc_restarts = scan.adc_restarts,
        .illegal_steps = encoders.illegal_steps,
        .rx_overflows = hal_serial_rx_overflows(),
        .rx_bad_frames = board->parser.bad_frames,
        .dropped_frames = board->transmitter.dropped_frames,
        .reset_cause = hal_reset_cause(),
        .boot_count = hal_boot_count(),
        .stack_low_water = hal_stack_low_water(),
        .adc_temperature_code = board->scan.housekeeping_codes[BOARD_HOUSEKEEPING_ADC_TEMPERATURE],
        .supply_code = board->scan.housekeeping_codes[BOARD_HOUSEKEEPING_SUPPLY],
        .adc_error_bits = board->scan.adc_error_bits,
        .scans_scheduled = scan_scheduled(&board->scan),
        .state = board->scan.streaming ? BOARD_STATE_STREAMING : BOARD_STATE_IDLE,
        .configuration_origin = board->storage.origin,
    };
}

static void listen(struct board *board)
{
    uint8_t byte;
    for (uint8_t i = 0; i < RX_BYTES_A_ROUND && hal_serial_read(&byte); i++) {
        uint8_t length = frame_parse(&board->parser, byte);
        if (length == 0)
            continue;
        if (command_handle(board, board->parser.bytes, length))
            board->last_host_frame = (uint32_t)hal_time();
        else
            board->parser.bad_frames++;
    }
}

static void every_second(struct board *board)
{
    struct health_frame health = board_health(board);
    uint8_t payload[1 + HEALTH_FRAME_SIZE] = {BOARD_FRAME_HEALTH};
    health_frame_pack(payload + 1, &health);
    transmit(&board->transmitter, payload, sizeof payload);
    scan_request_housekeeping(&board->scan);
    hal_led_toggle();
}

static void lead_drive(struct board *board)
{
    drive_watch(&board->drive);
    if (scan_leaves_time(&board->scan))
        drive_poll(&board->drive, &board->transmitter, (uint32_t)hal_time());
}

void board_stop(struct board *board)
{
    struct scan *scan = &board->scan;
    hal_sample_timer_stop();
    uint32_t stopped = (uint32_t)hal_time();
    while (scan_unfinished(scan) && (uint32_t)hal_time() - stopped < scan->period) {
        scan_poll(scan);
        lead_drive(board);
    }
    scan_end(scan);
}

void board_poll(struct board *board)
{
    bool time_to_spare = scan_poll(&board->scan) || !board->scan.streaming;
    listen(board);
    if (board->reset_wanted) {
        board->reset_wanted = false;
        hal_drive_off(); // it may take half a second
        hal_reset();
    }

    uint32_t now = (uint32_t)hal_time();
    if (board->scan.streaming && now - board->last_host_frame > BOARD_HOST_SILENCE_TICKS)
        board_stop(board);
    if (time_to_spare && now - board->last_health >= HEALTH_PERIOD_TICKS) {
        board->last_health += HEALTH_PERIOD_TICKS;
        every_second(board);
    } else {
        lead_drive(board);
    }
    watchdog_poll(&board->watchdog,
                  board->scan.streaming ? scan_scheduled(&board->scan) : hal_beat());
}
