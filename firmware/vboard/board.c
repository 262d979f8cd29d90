// SPDX-License-Identifier: GPL-3.0-or-later
//
// The board as it is wired: microcontroller, ADC on the SPI bus, encoders on interrupt pins, host on UART0.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ad7124.h"
#include "afe.h"
#include "bench_input.h"
#include "board_clock.h"
#include "bootloader.h"
#include "crank_motor.h"
#include "encoder.h"
#include "mcu.h"
#include "serial_line.h"
#include "spi_master.h"
#include "vboard.h"

typedef struct encoder_port {
    vb_board *board;
    encoder encoder;
    mcu_pin a, b;
    double edge_ns;
    int direction;
    bool level_a, level_b;  // on the pins
} encoder_port;

struct vb_board {
    vb_options options;
    vb_faults faults;
    board_clock clock;
    mcu mcu;
    bootloader bootloader;
    serial_line serial;
    spi_master spi;
    ad7124 adc;
    afe afe;
    bench_input bench;
    encoder_port encoders[ENCODER_COUNT];
    crank_motor motor;
    bench_input shaft;  // the angle of the crank's encoder, where the motor turns the crank
    double shaft_rad;
    double motor_ns;    // up to when the motor has been advanced
    mcu_pin emergency_stop;
    mcu_pin dout, ready;  // two pins on one wire
    mcu_pin self_test;    // the accelerometer's
    random_source spi_fault_source;
    bool read_began;  // the byte before opened an ADC read transaction
    uint64_t spi_errors_injected;
    uint64_t frames, frames_malformed, frames_late;
    char stop_reason[128];
};

// Instants less than half a cycle apart are the same: rounding must not postpone a call for ever.
static const double HALF_CYCLE_NS = 0.5e9 / BOARD_CLOCK_HZ;

static const int64_t LARGEST_LEAD_NS = 86400000000000;

static double now(const vb_board *board)
{
    return board_clock_ns(&board->clock, board->mcu.avr->cycle);
}

// Calls at an instant. An earlier appointment of the same callback and parameter is replaced.
static void call_at(vb_board *board, double ns, avr_cycle_timer_t callback, void *param)
{
    avr_t *avr = board->mcu.avr;
    uint64_t cycle = board_clock_cycle(&board->clock, ns);
    avr_cycle_timer_register(avr, cycle > avr->cycle ? cycle - avr->cycle : 0, callback, param);
}

// -------------------------------------------------------------------------------- encoders

static avr_cycle_count_t edge_due(avr_t *avr, avr_cycle_count_t when, void *param);

static void drive_encoder(encoder_port *port)
{
    const vb_faults *faults = &port->board->faults;
    bool is_crank = port->encoder.which == ENCODER_CRANK;
    bool unplugged = is_crank && faults->crank_encoder_unplugged;
    if (unplugged || !(is_crank && faults->crank_track_a_dead))
        port->level_a = unplugged || encoder_a(&port->encoder);
    if (unplugged || !(is_crank && faults->crank_track_b_dead))
        port->level_b = unplugged || encoder_b(&port->encoder);
    mcu_drive(port->a, port->level_a);
    mcu_drive(port->b, port->level_b);
}

static void schedule_edge(encoder_port *port)
{
    if (encoder_next_edge(&port->encoder, &port->edge_ns, &port->direction))
        call_at(port->board, port->edge_ns, edge_due, port);
    else
        avr_cycle_timer_cancel(port->board->mcu.avr, edge_due, port);
}

static avr_cycle_count_t edge_due(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)avr;
    (void)when;
    encoder_port *port = param;
    encoder_step(&port->encoder, port->edge_ns, port->direction);
    drive_encoder(port);
    schedule_edge(port);
    return 0;
}

static void schedule_edges(vb_board *board)
{
    for (int i = 0; i < ENCODER_COUNT; i++)
        schedule_edge(&board->encoders[i]);
}

// ---------------------------------------------------------------------------------- motor

static const double MOTOR_STEP_NS = 250e3;

static avr_cycle_count_t motor_due(avr_t *avr, avr_cycle_count_t when, void *param);

// A step ahead, so that the encoder has its edges in time: the duty acts a step late.
static void schedule_motor(vb_board *board)
{
    if (board->options.crank == VB_CRANK_MOTOR)
        call_at(board, board->motor_ns - MOTOR_STEP_NS, motor_due, board);
}

static double motor_duty(const vb_board *board)
{
    bool enabled = mcu_output(&board->mcu, BOARD_PIN_DRIVE_ENABLE_PORT, BOARD_PIN_DRIVE_ENABLE_BIT);
    return enabled ? mcu_pwm_duty(&board->mcu, BOARD_PIN_DRIVE_PWM_PORT, BOARD_PIN_DRIVE_PWM_BIT) : 0.0;
}

static void advance_motor(vb_board *board)
{
    const vb_faults *faults = &board->faults;
    double before = board->motor.angle_rad;
    crank_motor_advance(&board->motor, faults->driver_shorted ? 1.0 : motor_duty(board), faults->crank_blocked,
                        faults->tow_parted, faults->crank_driven_n_m, MOTOR_STEP_NS * 1e-9);
    board->motor_ns += MOTOR_STEP_NS;
    if (!faults->crank_encoder_silent)
        board->shaft_rad += (board->motor.angle_rad - before) * (1.0 - faults->crank_encoder_slip) *
                            (faults->crank_encoder_reversed ? -1.0 : 1.0);
    bench_sample sample = {.time_ns = board->motor_ns};
    sample.angle_rad[ENCODER_CRANK] = board->shaft_rad;
    encoder_port *port = &board->encoders[ENCODER_CRANK];
    bench_input_discard_before(&board->shaft, port->encoder.cursor);
    bench_input_push(&board->shaft, &sample, now(board));
    schedule_edge(port);
}

static avr_cycle_count_t motor_due(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)avr;
    (void)when;
    vb_board *board = param;
    while (board->motor_ns - MOTOR_STEP_NS <= now(board) + HALF_CYCLE_NS)
        advance_motor(board);
    schedule_motor(board);
    return 0;
}

static void drive_emergency_stop(vb_board *board)
{
    mcu_drive(board->emergency_stop, board->faults.emergency_stop_open);
}

// ------------------------------------------------------------------------------------- ADC

static void drive_dout(vb_board *board, bool level)
{
    mcu_drive(board->dout, level);
    mcu_drive(board->ready, level);
}

static void update_dout(vb_board *board)
{
    drive_dout(board, board->faults.adc_silent || ad7124_dout(&board->adc));
}

static avr_cycle_count_t conversion_due(avr_t *avr, avr_cycle_count_t when, void *param);

static void schedule_conversion(vb_board *board)
{
    double ns = ad7124_next_ns(&board->adc);
    if (isfinite(ns))
        call_at(board, ns, conversion_due, board);
}

static avr_cycle_count_t conversion_due(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)avr;
    (void)when;
    vb_board *board = param;
    // SYNC or a register write may have moved the end since this call was arranged.
    if (ad7124_next_ns(&board->adc) <= now(board) + HALF_CYCLE_NS) {
        ad7124_finish_conversion(&board->adc);
        if (!board->faults.adc_silent && ad7124_shows_ready(&board->adc))
            drive_dout(board, true);  // RDY̅ goes up for a moment before a result that replaces an unread one
        update_dout(board);
    }
    schedule_conversion(board);
    return 0;
}

static uint8_t adc_exchange(void *device, uint8_t mosi)
{
    vb_board *board = device;
    if (board->faults.adc_silent)
        return 0xFF;
    bool reading = ad7124_reads(&board->adc);
    uint8_t miso = ad7124_exchange(&board->adc, mosi, now(board));
    if (reading && board->read_began && board->faults.spi_error_one_in &&
        random_chance(&board->spi_fault_source, 1.0 / board->faults.spi_error_one_in)) {
        miso ^= (uint8_t)(1u << (random_u64(&board->spi_fault_source) & 7));
        board->spi_errors_injected++;
    }
    board->read_began = !reading && ad7124_reads(&board->adc);
    if (reading)  // data bits pass over the wire that also carries RDY̅
        for (int bit = 7; bit >= 0; bit--)
            drive_dout(board, miso >> bit & 1);
    update_dout(board);
    schedule_conversion(board);
    return miso;
}

static void cs_changed(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    vb_board *board = param;
    ad7124_select(&board->adc, value);
    update_dout(board);
}

static void sync_changed(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    vb_board *board = param;
    ad7124_sync(&board->adc, value, now(board));
    update_dout(board);
    schedule_conversion(board);
}

static ad7124_pair adc_pin_volts(void *context, unsigned positive, unsigned negative, double time_ns)
{
    return afe_pin_volts(context, positive, negative, time_ns);
}

static ad7124_pair adc_refin1_volts(void *context, double time_ns)
{
    return afe_refin1_volts(context, time_ns);
}

static void power_adc(vb_board *board)
{
    ad7124_inputs inputs = {&board->afe, adc_pin_volts, adc_refin1_volts};
    ad7124_power_on(&board->adc, &inputs,
                    board->options.adc_sequence == VB_SEQUENCE_GOES_ON ? AD7124_GOES_ON : AD7124_BEGINS_ANEW,
                    board->options.adc_clock_ppm, now(board));
}

static void self_test_changed(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    vb_board *board = param;
    // A conversion that is running sees the change from the middle of its interval on.
    afe_advance(&board->afe, fmin(now(board), ad7124_sampling_ns(&board->adc)));
    afe_self_test(&board->afe, value);
}

// ----------------------------------------------------------------------------------- reset

static avr_cycle_count_t bootloader_due(avr_t *avr, avr_cycle_count_t when, void *param);

static void schedule_bootloader(vb_board *board)
{
    call_at(board, board->bootloader.ends_ns, bootloader_due, board);
}

static avr_cycle_count_t bootloader_due(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)avr;
    (void)when;
    vb_board *board = param;
    if (board->bootloader.ends_ns <= now(board) + HALF_CYCLE_NS)
        board->mcu.held = false;
    else
        schedule_bootloader(board);
    return 0;
}

static void bootloader_byte(void *context)
{
    vb_board *board = context;
    bootloader_hear(&board->bootloader, now(board));
}

static void start_bootloader(vb_board *board)
{
    board->mcu.held = board->options.bootloader != VB_BOOTLOADER_NONE;
    if (!board->mcu.held)
        return;
    if (board->options.bootloader == VB_BOOTLOADER_SHIPPED) {
        mcu_clear_reset_flags(&board->mcu);
        mcu_stop_watchdog(&board->mcu);
    }
    bootloader_start(&board->bootloader, now(board));
    schedule_bootloader(board);
}

// avr_reset has wiped all timers and pin registers, and let CS and SYNC float up.
static void arm_all(void *context)
{
    vb_board *board = context;
    mcu_pin outputs[] = {
        mcu_input_pin(&board->mcu, BOARD_PIN_ADC_CS_PORT, BOARD_PIN_ADC_CS_BIT),
        mcu_input_pin(&board->mcu, BOARD_PIN_ADC_SYNC_PORT, BOARD_PIN_ADC_SYNC_BIT),
    };
    for (size_t i = 0; i < sizeof outputs / sizeof *outputs; i++) {
        mcu_drive(outputs[i], true);
        mcu_drive_again(outputs[i]);
    }
    mcu_drive(board->self_test, false);
    mcu_drive_again(board->self_test);
    mcu_drive_again(board->emergency_stop);
    mcu_drive_again(board->dout);
    mcu_drive_again(board->ready);
    for (int i = 0; i < ENCODER_COUNT; i++) {
        mcu_drive_again(board->encoders[i].a);
        mcu_drive_again(board->encoders[i].b);
    }
    spi_master_reset(&board->spi);
    serial_line_reset(&board->serial);
    schedule_edges(board);
    schedule_motor(board);
    schedule_conversion(board);
    start_bootloader(board);
}

int vb_reset(vb_board *board, uint8_t cause)
{
    switch (cause) {
    case BOARD_RESET_CAUSE_POWER_ON:
    case BOARD_RESET_CAUSE_BROWN_OUT:
        power_adc(board);
        break;
    case BOARD_RESET_CAUSE_EXTERNAL:
    case BOARD_RESET_CAUSE_WATCHDOG:
        break;
    default:
        return -1;
    }
    mcu_reset(&board->mcu, cause);
    update_dout(board);
    return 0;
}

int vb_disturb(vb_board *board, int how)
{
    switch (how) {
    case VB_HANGS:
    case VB_CRASHES:
        return mcu_hang(&board->mcu, how == VB_HANGS) ? 0 : -1;
    case VB_STRAY_INTERRUPT:
        mcu_stray_interrupt(&board->mcu);
        return 0;
    default:
        return -1;
    }
}

// --------------------------------------------------------------------------- open and close

void vb_default_options(vb_options *options)
{
    *options = (vb_options){
        .size = sizeof *options,
        .crank_counts_per_revolution = 4096,
        .carriage_counts_per_revolution = 4096,
        .seed = 1,
        .noise_volts = BOARD_AFE_NOISE_VOLTS,
        .self_test_volts = BOARD_AFE_SELF_TEST_VOLTS,
        .motor =
            {
                .supply_v = 12.0,
                .resistance_ohm = 0.5,
                .inductance_h = 1e-3,
                .flux_v_s_a = 5e-3,
                .gear_ratio = 40.0,
                .gear_efficiency = 0.5,
                .inertia_kg_m2 = 0.4,
                .friction_n_m = 1.0,
                .breakaway_n_m = 1.5,
                .damping_n_m_s = 0.05,
                .crank_radius_m = 0.06,
                .rod_length_m = 0.30,
                .tow_weight_n = 30.0,
                .tow_drag_n_s2_m2 = 20.0,
                .tow_mass_kg = 8.0,
            },
    };
}

static const char *complaint(const vb_options *options)
{
    if (options->size != sizeof *options)
        return "the caller's vb_options do not match this library; rebuild both";
    if (options->crank_counts_per_revolution == 0 || options->carriage_counts_per_revolution == 0)
        return "counts per revolution must be positive";
    if (!(fabs(options->clock_ppm) <= 1e5) || !(fabs(options->adc_clock_ppm) <= 1e5))
        return "clock errors must lie within ±100000 ppm";
    for (unsigned i = 0; i < BOARD_CHANNEL_COUNT; i++)
        if (!(options->noise_volts[i] >= 0.0 && options->noise_volts[i] < 10.0))
            return "noise must lie within 0 and 10 V";
    for (unsigned i = 0; i < BOARD_CHANNEL_COUNT; i++)
        if (!(fabs(options->self_test_volts[i]) < 10.0))
            return "the self-test's deflection must lie within ±10 V";
    if (options->bootloader > VB_BOOTLOADER_OLD)
        return "the bootloader must be one of VB_BOOTLOADER_…";
    if (options->adc_sequence > VB_SEQUENCE_GOES_ON)
        return "the ADC's sequence must be one of VB_SEQUENCE_…";
    const vb_motor *motor = &options->motor;
    const double positive[] = {motor->supply_v,        motor->resistance_ohm, motor->inductance_h,
                               motor->flux_v_s_a,      motor->gear_ratio,     motor->gear_efficiency,
                               motor->inertia_kg_m2,   motor->crank_radius_m, motor->rod_length_m};
    const double at_least_zero[] = {motor->friction_n_m, motor->breakaway_n_m,    motor->damping_n_m_s,
                                    motor->tow_weight_n, motor->tow_drag_n_s2_m2, motor->tow_mass_kg};
    for (size_t i = 0; i < sizeof positive / sizeof *positive; i++)
        if (!(positive[i] > 0.0 && isfinite(positive[i])))
            return "the motor's supply, resistance, inductance, flux, gear, inertia and crank must be positive";
    for (size_t i = 0; i < sizeof at_least_zero / sizeof *at_least_zero; i++)
        if (!(at_least_zero[i] >= 0.0 && isfinite(at_least_zero[i])))
            return "the motor's friction and tow must not be negative";
    if (motor->gear_efficiency > 1.0 || motor->rod_length_m <= motor->crank_radius_m)
        return "the gear's efficiency must not exceed 1, and the rod must be longer than the crank";
    return NULL;
}

static void wire_encoder(vb_board *board, int which, const bench_input *input, uint32_t counts, char port,
                         uint8_t bit_a, uint8_t bit_b)
{
    encoder_port *encoder = &board->encoders[which];
    encoder->board = board;
    encoder_init(&encoder->encoder, input, which, counts);
    encoder->a = mcu_input_pin(&board->mcu, port, bit_a);
    encoder->b = mcu_input_pin(&board->mcu, port, bit_b);
    drive_encoder(encoder);
}

vb_board *vb_open(const char *elf_path, const vb_options *options, char *error, size_t error_size)
{
    const char *problem = complaint(options);
    vb_board *board = problem ? NULL : calloc(1, sizeof *board);
    if (!board) {
        snprintf(error, error_size, "virtual board: %s", problem ? problem : "out of memory");
        return NULL;
    }
    board->options = *options;
    board_clock_set_ppm(&board->clock, 0, options->clock_ppm);
    if (!mcu_open(&board->mcu, elf_path, options->eeprom_path, options->seed, arm_all, board, error, error_size)) {
        free(board);
        return NULL;
    }
    afe_init(&board->afe, &board->bench, options->noise_volts, options->self_test_volts, options->seed);
    board->spi_fault_source = random_stream(options->seed, 4);
    serial_line_open(&board->serial, &board->mcu, &board->faults, options->seed, bootloader_byte, board);
    spi_master_open(&board->spi, &board->mcu, adc_exchange, board);
    board->dout = mcu_input_pin(&board->mcu, BOARD_PIN_ADC_DOUT_PORT, BOARD_PIN_ADC_DOUT_BIT);
    board->ready = mcu_input_pin(&board->mcu, BOARD_PIN_ADC_READY_PORT, BOARD_PIN_ADC_READY_BIT);
    mcu_watch_pin(&board->mcu, BOARD_PIN_ADC_CS_PORT, BOARD_PIN_ADC_CS_BIT, cs_changed, board);
    mcu_watch_pin(&board->mcu, BOARD_PIN_ADC_SYNC_PORT, BOARD_PIN_ADC_SYNC_BIT, sync_changed, board);
    board->self_test = mcu_input_pin(&board->mcu, BOARD_PIN_ACCEL_SELF_TEST_PORT, BOARD_PIN_ACCEL_SELF_TEST_BIT);
    mcu_watch_pin(&board->mcu, BOARD_PIN_ACCEL_SELF_TEST_PORT, BOARD_PIN_ACCEL_SELF_TEST_BIT, self_test_changed, board);
    board->motor.parameters = options->motor;
    board->motor_ns = MOTOR_STEP_NS;
    board->emergency_stop =
        mcu_input_pin(&board->mcu, BOARD_PIN_EMERGENCY_STOP_PORT, BOARD_PIN_EMERGENCY_STOP_BIT);
    drive_emergency_stop(board);
    wire_encoder(board, ENCODER_CRANK, options->crank == VB_CRANK_MOTOR ? &board->shaft : &board->bench,
                 options->crank_counts_per_revolution, BOARD_PIN_CRANK_A_PORT,
                 BOARD_PIN_CRANK_A_BIT, BOARD_PIN_CRANK_B_BIT);
    wire_encoder(board, ENCODER_CARRIAGE, &board->bench, options->carriage_counts_per_revolution, BOARD_PIN_CARRIAGE_A_PORT,
                 BOARD_PIN_CARRIAGE_A_BIT, BOARD_PIN_CARRIAGE_B_BIT);
    vb_reset(board, BOARD_RESET_CAUSE_POWER_ON);
    return board;
}

void vb_close(vb_board *board)
{
    if (!board)
        return;
    serial_line_close(&board->serial);
    bench_input_free(&board->bench);
    bench_input_free(&board->shaft);
    mcu_close(&board->mcu);
    free(board);
}

// ----------------------------------------------------------------------------------- bench

static bool is_well_formed(const vb_board *board, const struct bench_frame *frame)
{
    // A frame far ahead would make all that follow late. It comes from another clock than CLOCK_MONOTONIC.
    int64_t ahead;
    if (__builtin_sub_overflow(frame->time_ns, vb_now_ns(board), &ahead) || ahead > LARGEST_LEAD_NS)
        return false;
    bool finite = isfinite(frame->crank_angle_rad) && isfinite(frame->carriage_angle_rad);
    for (unsigned i = 0; i < BOARD_CHANNEL_COUNT; i++)
        finite = finite && isfinite(frame->terminal_volts[i]);
    return finite && frame->magic == BOARD_BENCH_MAGIC;
}

static void discard_old_samples(vb_board *board)
{
    // An idle ADC does not ask for inputs: move the filters along, up to what it may still ask for.
    afe_advance(&board->afe, fmin(now(board), ad7124_sampling_ns(&board->adc)));
    uint64_t needed = board->afe.cursor;
    for (int i = 0; i < ENCODER_COUNT; i++) {
        const encoder *reader = &board->encoders[i].encoder;
        if (reader->input == &board->bench && reader->cursor < needed)
            needed = reader->cursor;
    }
    bench_input_discard_before(&board->bench, needed);
}

int vb_push_bench(vb_board *board, const void *bytes, size_t size)
{
    struct bench_frame frame;
    if (size == BENCH_FRAME_SIZE)
        bench_frame_unpack(&frame, bytes);
    if (size != BENCH_FRAME_SIZE || !is_well_formed(board, &frame)) {
        board->frames_malformed++;
        return VB_FRAME_MALFORMED;
    }
    bench_sample sample = {.time_ns = (double)(frame.time_ns - board->options.start_ns)};
    memcpy(sample.volts, frame.terminal_volts, sizeof sample.volts);
    sample.angle_rad[ENCODER_CRANK] = frame.crank_angle_rad;
    sample.angle_rad[ENCODER_CARRIAGE] = frame.carriage_angle_rad;
    discard_old_samples(board);
    if (!bench_input_push(&board->bench, &sample, now(board))) {
        board->frames_late++;
        return VB_FRAME_LATE;
    }
    board->frames++;
    schedule_edges(board);
    return VB_FRAME_ACCEPTED;
}

void vb_restart_bench(vb_board *board)
{
    for (int i = 0; i < ENCODER_COUNT; i++)
        if (board->encoders[i].encoder.input == &board->bench)
            encoder_restart(&board->encoders[i].encoder);
    schedule_edges(board);
}

// ------------------------------------------------------------------------------ run, serial

int vb_run_until(vb_board *board, int64_t time_ns)
{
    double ns = (double)(time_ns - board->options.start_ns);
    if (mcu_run_until(&board->mcu, board_clock_cycle(&board->clock, ns)))
        return 0;
    snprintf(board->stop_reason, sizeof board->stop_reason, "the firmware stopped at address 0x%05x after %.6f s (%s)",
             (unsigned)board->mcu.avr->pc, now(board) * 1e-9,
             board->mcu.avr->state == cpu_Done ? "asleep with interrupts off" : "invalid instruction or address");
    return -1;
}

int64_t vb_now_ns(const vb_board *board)
{
    return board->options.start_ns + (int64_t)now(board);
}

const char *vb_stop_reason(const vb_board *board)
{
    return board->stop_reason;
}

size_t vb_write(vb_board *board, const uint8_t *bytes, size_t count)
{
    return serial_line_write(&board->serial, bytes, count);
}

size_t vb_read(vb_board *board, uint8_t *bytes, size_t capacity)
{
    return serial_line_read(&board->serial, bytes, capacity);
}

// --------------------------------------------------------------------- faults and counters

void vb_set_faults(vb_board *board, const vb_faults *faults)
{
    board->faults = *faults;
    update_dout(board);
    drive_emergency_stop(board);
    drive_encoder(&board->encoders[ENCODER_CRANK]);
}

static void adc_changed(vb_board *board)
{
    update_dout(board);
    schedule_conversion(board);
}

void vb_dip_adc_supply(vb_board *board)
{
    ad7124_dip(&board->adc, now(board));
    adc_changed(board);
}

int vb_flip_adc_bit(vb_board *board, uint8_t address, uint8_t bit)
{
    bool flipped = ad7124_flip_bit(&board->adc, address, bit, now(board));
    adc_changed(board);
    return flipped ? 0 : -1;
}

void vb_set_clock_ppm(vb_board *board, double clock_ppm)
{
    board_clock_set_ppm(&board->clock, board->mcu.avr->cycle, clock_ppm);
    schedule_edges(board);
    schedule_motor(board);
    schedule_conversion(board);
    if (board->mcu.held)
        schedule_bootloader(board);
}

int vb_preset(vb_board *board, const char *variable, size_t offset, const uint8_t *bytes, size_t count)
{
    return mcu_preset(&board->mcu, variable, offset, bytes, count) ? 0 : -1;
}

void vb_get_counters(const vb_board *board, vb_counters *counters)
{
    const encoder *crank = &board->encoders[ENCODER_CRANK].encoder;
    const encoder *carriage = &board->encoders[ENCODER_CARRIAGE].encoder;
    *counters = (vb_counters){
        .bench_frames = board->frames,
        .bench_frames_malformed = board->frames_malformed,
        .bench_frames_late = board->frames_late,
        .conversions = board->adc.conversions,
        .conversions_starved = board->afe.starved,
        .conversions_out_of_range = board->adc.conversions_out_of_range,
        .bytes_from_host = board->serial.bytes_from_host,
        .bytes_to_host = board->serial.bytes_to_host,
        .resets = board->mcu.resets - 1,
        .crank_counts = crank->counts,
        .carriage_counts = carriage->counts,
        .motor_duty = motor_duty(board),
        .motor_current_a = board->motor.current_a,
        .crank_rate_rad_s = board->motor.rate_rad_s,
        .crank_angle_rad = board->motor.angle_rad,
        .crank_edges = crank->edges,
        .carriage_edges = carriage->edges,
        .spi_misuse = board->spi.misuse + board->adc.short_sync_pulses,
        .spi_errors_injected = board->spi_errors_injected,
        .serial_bits_flipped = board->serial.bits_flipped,
        .serial_bytes_dropped = board->serial.bytes_dropped,
        .serial_bytes_doubled = board->serial.bytes_doubled,
    };
}
