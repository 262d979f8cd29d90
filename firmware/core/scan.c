// SPDX-License-Identifier: Apache-2.0
#include "scan.h"

#include "ad7124.h"
#include "configuration.h"

// The shortest conversion that a configuration may have: third order, smallest filter word, 5 % fast.
_Static_assert((3ull * 32 * BOARD_ADC_FS_MINIMUM + BOARD_ADC_FILTER_DEAD_CYCLES) * BOARD_TICK_HZ * 20 /
                       21 / BOARD_ADC_MASTER_CLOCK_HZ > SCAN_OTHER_WORK_TICKS,
               "other work must fit between two conversions");

void scan_configure(struct scan *scan, const struct configure_arguments *configuration)
{
    scan->configuration = *configuration;
    scan->channels = configuration_channels(configuration);
    scan->period = configuration_period(configuration);
    scan->latest_conversion = configuration_longest_scan(configuration);
    scan->spare_ticks = configuration_shortest_conversion(configuration) - SCAN_OTHER_WORK_TICKS;
}

void scan_init(struct scan *scan, struct transmitter *transmitter,
               const struct configure_arguments *configuration)
{
    *scan = (struct scan){.transmitter = transmitter};
    scan_configure(scan, configuration);
}

// In interrupt context.
static void on_tick(void *context, uint64_t scheduled)
{
    struct scan *scan = context;
    hal_adc_restart();
    if (scan->latch.pending)
        scan->counters.missed_ticks++;
    scan->latch.pending = true;
    scan->latch.number = scan->scheduled++;
    scan->latch.ticks = (uint32_t)scheduled;
    hal_encoders_read(&scan->latch.encoders);
}

bool scan_start(struct scan *scan, uint64_t *first)
{
    hal_adc_hold();
    if (!ad7124_set_up(&scan->configuration))
        return false;
    scan->housekeeping_selected = 0;
    scan->housekeeping_wanted = 0;
    scan->housekeeping_due = true;
    scan->converting = false;
    scan->scheduled = 0;
    scan->latch.pending = false;
    scan->reported_missed_ticks = scan->counters.missed_ticks;
    struct hal_encoders encoders;
    uint8_t state = hal_lock();
    hal_encoders_read(&encoders);
    hal_unlock(state);
    scan->reported_illegal_steps = encoders.illegal_steps;

    *first = hal_time() + scan->period;
    scan->streaming = true;
    hal_sample_timer_start(*first, scan->period, on_tick, scan);
    return true;
}

static bool take_tick(struct scan *scan, struct scan_tick *tick, uint32_t *missed_ticks)
{
    if (!scan->latch.pending)
        return false;
    uint8_t state = hal_lock();
    *tick = scan->latch;
    *missed_ticks = scan->counters.missed_ticks;
    scan->latch.pending = false;
    hal_unlock(state);
    return true;
}

static void open_record(struct scan *scan, const struct scan_tick *tick, uint32_t missed_ticks)
{
    scan->record = (struct data_frame){
        .schema = (uint8_t)BOARD_SCHEMA_HASH,
        .sequence = (uint16_t)tick->number,
        .ticks = tick->ticks,
        .crank = tick->encoders.crank,
        .carriage = tick->encoders.carriage,
    };
    if (missed_ticks != scan->reported_missed_ticks)
        scan->record.flags |= BOARD_FLAG_MISSED_TICK;
    if (tick->encoders.illegal_steps != scan->reported_illegal_steps)
        scan->record.flags |= BOARD_FLAG_ILLEGAL_STEP;
    scan->reported_missed_ticks = missed_ticks;
    scan->reported_illegal_steps = tick->encoders.illegal_steps;
    scan->slot = 0;
    scan->converting = true;
    scan->last_conversion = tick->ticks;
}

static void send_record(struct scan *scan)
{
    uint8_t payload[1 + DATA_FRAME_SIZE] = {BOARD_FRAME_DATA};
    data_frame_pack(payload + 1, &scan->record);
    transmit(scan->transmitter, payload, sizeof payload);
}

static bool channels_missing(const struct scan *scan)
{
    return scan->converting && scan->slot < scan->channels;
}

static void cut_short(struct scan *scan)
{
    scan->counters.overruns++;
    scan->record.flags |= BOARD_FLAG_OVERRUN;
    send_record(scan);
}

// Puts the ADC to rest until the next tick. Locked as a whole: a tick that has come already keeps
// its sequence, and a register write after it would disturb the scan that it started. Encoder edges
// wait meanwhile, so all is prepared before.
static void rest(struct scan *scan)
{
    scan->converting = false;
    uint8_t selection[AD7124_HOUSEKEEPING_SIZE];
    bool select = scan->housekeeping_selected != scan->housekeeping_wanted;
    if (select)
        ad7124_encode_housekeeping(selection, scan->housekeeping_wanted);
    uint8_t state = hal_lock();
    if (!scan->latch.pending) {
        hal_adc_hold();
        if (select) {
            hal_adc_exchange(selection, sizeof selection);
            scan->housekeeping_selected = scan->housekeeping_wanted;
        }
    }
    hal_unlock(state);
}

// Takes the conversion into the record and moves to the slot behind it.
static void take_channel(struct scan *scan, const struct ad7124_conversion *conversion)
{
    uint8_t slot = conversion->slot;
    if (slot != scan->slot) {
        scan->counters.sequence_errors++;
        scan->record.flags |= BOARD_FLAG_ADC_ERROR;
    }
    if (slot < scan->slot || slot >= scan->channels) {
        scan->slot = scan->channels; // the scan's other conversions are lost
        return;
    }
    uint8_t channel = scan->configuration.order[slot];
    scan->record.codes[channel] = conversion->code;
    scan->record.valid_mask = (uint8_t)(scan->record.valid_mask | 1u << channel);
    scan->slot = (uint8_t)(slot + 1);
}

// The ADC goes round its channels until it is held. Had the main loop slept, a conversion could be
// of a later round, at another instant than the record says.
static bool of_another_round(const struct scan *scan)
{
    return (uint32_t)hal_time() - scan->record.ticks > scan->latest_conversion;
}

// True when the record is complete and sent.
static bool read_channel(struct scan *scan)
{
    bool late = of_another_round(scan);
    struct ad7124_conversion conversion;
    bool crc_good = ad7124_read_conversion(&conversion);
    scan->last_conversion = (uint32_t)hal_time();
    if (scan->latch.pending)
        return false; // the sequence was restarted during the read, which may be of either scan
    if (late) {
        scan->counters.sequence_errors++;
        scan->record.flags |= BOARD_FLAG_ADC_ERROR;
        scan->slot = scan->channels;
    } else if (crc_good) {
        take_channel(scan, &conversion);
    } else {
        scan->counters.spi_crc_errors++;
        scan->record.flags |= BOARD_FLAG_ADC_ERROR;
        scan->slot++;
    }
    if (channels_missing(scan))
        return false;
    send_record(scan);
    if (!scan->housekeeping_due)
        rest(scan);
    return true;
}

static void read_housekeeping(struct scan *scan)
{
    struct ad7124_conversion conversion;
    if (!ad7124_read_conversion(&conversion)) {
        scan->counters.spi_crc_errors++;
    } else if (!scan->latch.pending && conversion.slot == BOARD_CHANNEL_COUNT) {
        scan->housekeeping_codes[scan->housekeeping_selected] = conversion.code;
        scan->housekeeping_wanted =
            (uint8_t)((scan->housekeeping_selected + 1u) % BOARD_HOUSEKEEPING_COUNT);
        scan->housekeeping_due = false;
    }
    rest(scan);
}

bool scan_poll(struct scan *scan)
{
    struct scan_tick tick;
    uint32_t missed_ticks;
    if (take_tick(scan, &tick, &missed_ticks)) {
        bool cut = channels_missing(scan);
        if (cut)
            cut_short(scan);
        open_record(scan, &tick, missed_ticks);
        return cut;
    }
    if (!scan->converting || !hal_adc_ready())
        return false;
    if (channels_missing(scan))
        return read_channel(scan);
    read_housekeeping(scan);
    return false;
}

bool scan_leaves_time(const struct scan *scan)
{
    if (!scan->streaming || !scan->converting)
        return true;
    uint32_t since = (uint32_t)hal_time() - scan->last_conversion;
    return since < scan->spare_ticks || since > scan->latest_conversion; // the ADC is silent
}

bool scan_unfinished(const struct scan *scan)
{
    return scan->latch.pending || channels_missing(scan);
}

void scan_end(struct scan *scan)
{
    if (channels_missing(scan))
        cut_short(scan);
    hal_adc_hold();
    scan->converting = false;
    scan->streaming = false;
}

void scan_request_housekeeping(struct scan *scan)
{
    scan->housekeeping_due = true;
}

uint32_t scan_scheduled(const struct scan *scan)
{
    uint8_t state = hal_lock();
    uint32_t scheduled = scan->scheduled;
    hal_unlock(state);
    return scheduled;
}

struct scan_counters scan_read_counters(const struct scan *scan)
{
    uint8_t state = hal_lock();
    struct scan_counters counters = scan->counters;
    hal_unlock(state);
    return counters;
}
