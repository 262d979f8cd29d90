// SPDX-License-Identifier: Apache-2.0
#include "scan.h"

#include <string.h>

#include "configuration.h"

// The shortest conversion that a configuration may have: third order, smallest filter word, 5 % fast.
_Static_assert((3ull * 32 * BOARD_ADC_FS_MINIMUM + BOARD_ADC_FILTER_DEAD_CYCLES) * BOARD_TICK_HZ * 20 /
                       21 / BOARD_ADC_MASTER_CLOCK_HZ > SCAN_OTHER_WORK_TICKS,
               "other work must fit between two conversions");

// Registers that are read back in one round of the main loop.
#define READ_BACK_AT_A_TIME 6u
_Static_assert(READ_BACK_AT_A_TIME * SCAN_READ_BACK_TICKS <= SCAN_OTHER_WORK_TICKS,
               "the host's bytes must not wait longer than for other work");
_Static_assert((3ull * 32 * BOARD_ADC_FS_MINIMUM + BOARD_ADC_FILTER_DEAD_CYCLES) * BOARD_TICK_HZ * 20 /
                       21 / BOARD_ADC_MASTER_CLOCK_HZ >
                   SCAN_OTHER_WORK_TICKS + SCAN_READ_BACK_TICKS,
               "so must other work behind a register that was read when a conversion ended");

// From a write to the end of the scan behind it lies a period at the least. In it, every conversion takes a round
// of the main loop, 0.25 ms, one of them with the frame of the scan before; a step of the drive may come. What
// other loads leave over of the reading is done at the end of the scan, before it is sent.
#define CONVERSION_ROUND_TICKS (BOARD_TICK_HZ / 4000)
_Static_assert(AD7124_REGISTERS_IN_USE * SCAN_READ_BACK_TICKS +
                       (BOARD_CHANNEL_COUNT + 1) * CONVERSION_ROUND_TICKS + 2 * SCAN_OTHER_WORK_TICKS <=
                   BOARD_TICK_HZ / BOARD_RATE_MAXIMUM_HZ,
               "what a write may have hidden must be read back before the next scan ends");

void scan_configure(struct scan *scan, const struct configure_arguments *configuration)
{
    scan->configuration = *configuration;
    scan->channels = configuration_channels(configuration);
    scan->period = configuration_period(configuration);
    scan->latest_conversion = configuration_longest_scan(configuration);
    scan->shortest_conversion = configuration_shortest_conversion(configuration);
    scan->spare_ticks = scan->shortest_conversion - SCAN_OTHER_WORK_TICKS;
    scan->housekeeping_fits = configuration_housekeeping_fits(configuration);
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
    bool without_adc = scan->adc_lost;
    if (!without_adc)
        hal_adc_restart();
    if (scan->latch.pending)
        scan->counters.missed_ticks++;
    scan->latch.pending = true;
    scan->latch.without_adc = without_adc;
    scan->latch.number = scan->scheduled++;
    scan->latch.ticks = (uint32_t)scheduled;
    hal_encoders_read(&scan->latch.encoders);
}

bool scan_start(struct scan *scan, uint64_t *first)
{
    hal_adc_hold();
    scan->last_set_up = (uint32_t)hal_time();
    if (!ad7124_set_up(&scan->adc, &scan->configuration))
        return false;
    scan->adc_lost = false;
    scan->empty_scans = 0;
    scan->housekeeping_next = 0;
    scan->housekeeping_due = scan->housekeeping_fits;
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
    scan->out_of_step = false;
    scan->converting = true;
    scan->last_conversion = tick->ticks;
}

static void send_record(struct scan *scan)
{
    uint8_t payload[1 + DATA_FRAME_SIZE] = {BOARD_FRAME_DATA};
    data_frame_pack(payload + 1, &scan->record);
    transmit(scan->transmitter, payload, sizeof payload);
}

// Gives the ADC up until it is set up anew, which comes in the rounds of the main loop.
static void lose_adc(struct scan *scan)
{
    scan->adc_lost = true; // first: no tick starts the sequence from here on
    scan->adc_in_set_up = false;
    scan->converting = false;
    scan->empty_scans = 0;
    uint8_t state = hal_lock();
    hal_adc_hold();
    hal_unlock(state);
}

// Nothing of this scan can be believed.
static void discard_channels(struct scan *scan)
{
    scan->record.valid_mask = 0;
    memset(scan->record.codes, 0, sizeof scan->record.codes);
}

// One step towards an ADC that converts again, from the next tick on. A set-up is begun at most every
// BOARD_ADC_SET_UP_PERIOD_TICKS, whatever it comes to.
static void restore_adc(struct scan *scan)
{
    if (!scan->adc_in_set_up) {
        uint32_t now = (uint32_t)hal_time();
        if (now - scan->last_set_up < BOARD_ADC_SET_UP_PERIOD_TICKS)
            return;
        scan->last_set_up = now;
        scan->counters.adc_restarts++;
        scan->adc_in_set_up = true;
        if (ad7124_was_reset())
            scan->adc_error_bits |= BOARD_ADC_ERROR_POWER_ON;
        ad7124_begin_set_up(&scan->adc, &scan->configuration);
        return;
    }
    enum ad7124_progress progress = ad7124_go_on_with_set_up(&scan->adc);
    if (progress == AD7124_BUSY)
        return;
    scan->adc_in_set_up = false;
    if (progress == AD7124_DONE)
        scan->adc_lost = false;
}

static bool channels_missing(const struct scan *scan)
{
    return scan->converting && scan->slot < scan->channels;
}

// Sends a scan to which nothing comes any more, and counts those in a row that have nothing. None goes out
// with values of registers that have not been read back since a write.
static void finish_record(struct scan *scan)
{
    if (!ad7124_is_verified(&scan->adc)) {
        scan->record.flags |= BOARD_FLAG_ADC_ERROR;
        discard_channels(scan);
    }
    send_record(scan);
    if (scan->record.valid_mask != 0)
        scan->empty_scans = 0;
    else if (++scan->empty_scans == BOARD_ADC_EMPTY_SCANS)
        lose_adc(scan);
}

// Gives up a scan that is not sent yet, and with it the ADC.
static void give_up(struct scan *scan)
{
    scan->record.flags |= BOARD_FLAG_ADC_RESTART;
    discard_channels(scan);
    send_record(scan);
    lose_adc(scan);
}

static void cut_short(struct scan *scan)
{
    scan->counters.overruns++;
    scan->record.flags |= BOARD_FLAG_OVERRUN;
    finish_record(scan);
}

// What CHANNEL_6 has to convert behind the next scan.
static uint8_t housekeeping_wanted(const struct scan *scan)
{
    return scan->housekeeping_due ? scan->housekeeping_next : AD7124_NO_HOUSEKEEPING;
}

// Puts the ADC to rest until the next tick. Locked, because a tick that has come already keeps its sequence.
static void rest(struct scan *scan)
{
    scan->converting = false;
    uint8_t state = hal_lock();
    if (!scan->latch.pending)
        hal_adc_hold();
    hal_unlock(state);
}

// Lets an ADC at rest convert what is wanted behind the next scan. Locked likewise: a register write after the
// tick would disturb the scan that it started. Encoder edges wait meanwhile, so all is prepared before.
static void select_housekeeping(struct scan *scan)
{
    uint8_t wanted = housekeeping_wanted(scan);
    if (scan->adc.housekeeping == wanted)
        return;
    uint8_t selection[AD7124_HOUSEKEEPING_SIZE];
    ad7124_encode_housekeeping(selection, wanted);
    uint8_t state = hal_lock();
    bool rests = !scan->latch.pending;
    if (rests)
        hal_adc_exchange(selection, sizeof selection);
    hal_unlock(state);
    if (rests) // the chip may have been about its own checks: then the next rest tries again
        ad7124_verify_housekeeping(&scan->adc, wanted);
}

// Compares one register with what it was set up to: false if it differs. What the chip's own check finds shows
// in STATUS sooner; this finds what has happened to that check, and what a write has hidden from it.
static bool examine(struct scan *scan)
{
    enum ad7124_finding finding = ad7124_examine(&scan->adc);
    if (finding == AD7124_UNREADABLE)
        scan->counters.spi_crc_errors++;
    return finding != AD7124_NOT_AS_SET_UP;
}

// A few more of those that a write may have hidden a bit of, between two conversions and between two scans, as
// long as nothing else is due.
static bool go_on_verifying(struct scan *scan)
{
    if (!scan->streaming)
        return false;
    bool good = true;
    for (uint8_t n = 0; good && n < READ_BACK_AT_A_TIME && !ad7124_is_verified(&scan->adc); n++) {
        good = examine(scan);
        if (scan->latch.pending || (scan->converting && hal_adc_ready()))
            break;
    }
    if (good)
        return false;
    bool unsent = channels_missing(scan);
    if (unsent)
        give_up(scan);
    else
        lose_adc(scan);
    return unsent;
}

// What is left at the end of a scan, mostly nothing; false as above. Where the bus fails, some stay unverified.
static bool finish_verifying(struct scan *scan)
{
    bool good = true;
    for (uint8_t n = 0; good && n < AD7124_REGISTERS_IN_USE && !ad7124_is_verified(&scan->adc); n++)
        good = examine(scan);
    return good;
}

// Whether the registers behind a conversion are those of the set-up. Errors of the bus are counted and
// marked, and the conversion, whose own CRC is good, is taken.
static bool is_sound(struct scan *scan, const struct ad7124_conversion *conversion)
{
    if (!conversion->powered_on && !conversion->error)
        return true;
    uint32_t errors = 0;
    bool known = conversion->error && ad7124_read_errors(&errors);
    if (conversion->powered_on)
        errors |= BOARD_ADC_ERROR_POWER_ON;
    scan->counters.adc_errors++;
    scan->adc_error_bits |= errors;
    scan->record.flags |= BOARD_FLAG_ADC_ERROR;
    return known && errors != 0 && (errors & ~AD7124_BUS_ERRORS) == 0;
}

// Whether a conversion comes sooner after the tick than that of its slot can: the sequence began
// elsewhere, or left one out. An eighth of a conversion is for the board's own clock.
static bool is_early(const struct scan *scan, uint8_t slot, uint32_t since_tick)
{
    uint32_t due = (slot + 1u) * scan->shortest_conversion;
    return since_tick + scan->shortest_conversion / 8 < due;
}

// Takes the conversion into the record and moves to the slot behind it.
static void take_channel(struct scan *scan, const struct ad7124_conversion *conversion,
                         uint32_t since_tick)
{
    uint8_t slot = conversion->slot;
    // One of those behind may be read so late that its time does not tell.
    scan->out_of_step = scan->out_of_step || is_early(scan, slot, since_tick);
    bool early = scan->out_of_step || (scan->slot == 0 && slot != 0);
    if (slot != scan->slot || early) {
        scan->counters.sequence_errors++;
        scan->record.flags |= BOARD_FLAG_ADC_ERROR;
    }
    if (slot < scan->slot || slot >= scan->channels) {
        scan->slot = scan->channels; // the scan's other conversions are lost
        return;
    }
    scan->slot = (uint8_t)(slot + 1);
    if (early)
        return;
    uint8_t channel = scan->configuration.order[slot];
    scan->record.codes[channel] = conversion->code;
    scan->record.valid_mask = (uint8_t)(scan->record.valid_mask | 1u << channel);
}

// True when the record is complete and sent.
static bool read_channel(struct scan *scan)
{
    uint32_t since_tick = (uint32_t)hal_time() - scan->record.ticks;
    struct ad7124_conversion conversion;
    bool crc_good = ad7124_read_conversion(&conversion);
    scan->last_conversion = (uint32_t)hal_time();
    if (scan->latch.pending)
        return false; // the sequence was restarted during the read, which may be of either scan
    if (!crc_good) {
        scan->counters.spi_crc_errors++;
        scan->record.flags |= BOARD_FLAG_ADC_ERROR;
        scan->slot++;
    } else if (!is_sound(scan, &conversion)) {
        give_up(scan);
        return true;
    } else if (since_tick > scan->latest_conversion) {
        // The ADC goes round its channels until it is held. Had the main loop slept, a conversion could
        // be of a later round, at another instant than the record says.
        scan->counters.sequence_errors++;
        scan->record.flags |= BOARD_FLAG_ADC_ERROR;
        scan->slot = scan->channels;
    } else {
        take_channel(scan, &conversion, since_tick);
    }
    if (channels_missing(scan))
        return false;
    bool over = !scan->housekeeping_due || scan->adc.housekeeping != housekeeping_wanted(scan);
    if (over)
        rest(scan); // within a conversion, for the next one would be of another channel
    if (!finish_verifying(scan)) {
        give_up(scan);
        return true;
    }
    finish_record(scan);
    if (!scan->adc_lost && !examine(scan))
        lose_adc(scan);
    if (!scan->adc_lost && over)
        select_housekeeping(scan);
    return true;
}

static void read_housekeeping(struct scan *scan)
{
    struct ad7124_conversion conversion;
    if (!ad7124_read_conversion(&conversion)) {
        scan->counters.spi_crc_errors++;
    } else if (!scan->latch.pending && conversion.slot == BOARD_CHANNEL_COUNT) {
        if (!is_sound(scan, &conversion)) {
            lose_adc(scan);
            return;
        }
        scan->housekeeping_codes[scan->housekeeping_next] = conversion.code;
        scan->housekeeping_next = (uint8_t)((scan->housekeeping_next + 1u) % BOARD_HOUSEKEEPING_COUNT);
        scan->housekeeping_due = false;
    }
    rest(scan);
    select_housekeeping(scan);
}

// A tick without an ADC: what there is goes out at once.
static void send_without_channels(struct scan *scan)
{
    scan->converting = false;
    scan->record.flags |= BOARD_FLAG_ADC_RESTART;
    send_record(scan);
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
        if (tick.without_adc || scan->adc_lost) {
            send_without_channels(scan);
            return true;
        }
        return cut;
    }
    if (scan->streaming && scan->adc_lost) {
        restore_adc(scan);
        return false;
    }
    if (!scan->converting || !hal_adc_ready())
        return go_on_verifying(scan);
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
    scan->housekeeping_due = scan->housekeeping_fits;
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
