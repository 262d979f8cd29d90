// SPDX-License-Identifier: Apache-2.0
#include "drive.h"

#include "hal.h"

#define STEP_TICKS (BOARD_TICK_HZ / BOARD_DRIVE_CONTROL_HZ)
#define FULL_DUTY INT32_C(10000)

// Counts in 1/256 that the reference advances in a step, for each 0.01 rpm and count per revolution:
// 256 / (6000 · BOARD_DRIVE_CONTROL_HZ), in lowest terms.
#define ADVANCE_FACTOR 8u
#define ADVANCE_DIVISOR (UINT32_C(6000) * BOARD_DRIVE_CONTROL_HZ / 32u)
_Static_assert(ADVANCE_DIVISOR * 32u == UINT32_C(6000) * BOARD_DRIVE_CONTROL_HZ,
               "choose another control rate");
_Static_assert(ADVANCE_DIVISOR <= UINT16_MAX, "the remainder has 16 bits");
_Static_assert((uint64_t)BOARD_DRIVE_SPEED_MAXIMUM * INT16_MAX * ADVANCE_FACTOR +
                       ADVANCE_DIVISOR <= UINT32_MAX,
               "the reference's step has 32 bits");

// The speed's angle is in 1/32768 revolution and its time in 256 ticks; twice the speed of one in the
// other, which leaves less to rounding.
#define REVOLUTION INT32_C(32768)
#define TIME_SHIFT 8
#define TWICE_SPEED ((int32_t)(INT64_C(12000) * BOARD_TICK_HZ / (1 << TIME_SHIFT) / REVOLUTION))

// The integral's angles are in 1/10240 revolution: 40 of them are 1/256.
#define ANGLE_FACTOR 40

// Without power: until its current has faded, and the speed is measured over the time after that.
#define FADING_STEPS (BOARD_DRIVE_WINDOW_STEPS + 1u)

// The least that counts as movement: one dead track lets the count go to and fro by one.
#define LEAST_MOVEMENT 2

struct crank {
    int32_t count; // rising when the crank turns forward
    uint8_t edges;
};

static struct crank read_crank(const struct drive *drive)
{
    struct hal_encoders encoders;
    uint8_t state = hal_lock();
    hal_encoders_read(&encoders);
    hal_unlock(state);
    return (struct crank){
        // Unsigned, for a count may pass its end
        .count = drive->backwards ? (int32_t)(0u - (uint32_t)encoders.crank) : encoders.crank,
        .edges = encoders.crank_edges,
    };
}

static int32_t difference(int32_t later, int32_t earlier)
{
    return (int32_t)((uint32_t)later - (uint32_t)earlier);
}

static uint8_t place_after(uint8_t place)
{
    return place + 1u < BOARD_DRIVE_WINDOW_STEPS ? (uint8_t)(place + 1u) : 0;
}

static void enter(struct drive *drive, uint8_t state)
{
    drive->state = state;
    drive->news = true;
}

bool drive_turns(const struct drive *drive)
{
    return drive->state == BOARD_DRIVE_STATE_RUNNING || drive->state == BOARD_DRIVE_STATE_STOPPING;
}

static uint16_t magnitude(int16_t speed)
{
    return (uint16_t)(speed < 0 ? -(int32_t)speed : speed);
}

static void power_off(struct drive *drive)
{
    if (drive_turns(drive)) {
        drive->coast = drive->setpoint;
        drive->steps_to_fade = FADING_STEPS;
    }
    drive->duty = 0;
    drive->setpoint = 0;
    drive->target = 0;
    hal_drive_off();
}

static void trip(struct drive *drive, uint8_t cause)
{
    power_off(drive);
    drive->trip = cause;
    enter(drive, BOARD_DRIVE_STATE_TRIPPED);
}

void drive_init(struct drive *drive, uint32_t now)
{
    *drive = (struct drive){.last_step = now, .last_frame = now};
    power_off(drive);
}

// ---- what the host asks for

// From here on the crank has to move.
static void await_movement(struct drive *drive, struct crank crank, uint32_t now)
{
    drive->mark = crank.count;
    drive->edges = 0;
    drive->moved = false;
    drive->last_movement = now;
}

static void begin(struct drive *drive, uint32_t now)
{
    struct crank crank = read_crank(drive);
    for (uint8_t i = 0; i < BOARD_DRIVE_WINDOW_STEPS; i++) {
        drive->counts[i] = crank.count;
        drive->times[i] = now;
    }
    drive->last_count = crank.count;
    drive->last_edges = crank.edges;
    drive->speed = 0;
    drive->keeps_on = false;
    drive->remainder = 0;
    drive->lag = 0;
    drive->last_step = now;
    drive->last_reserve = now;
    drive->mark_speed = 0;
    await_movement(drive, crank, now);
}

// A stop is called off: on along the ramp from the speed that the crank has, if any. One that stands gets the
// time of a start for its first movement, but not again before that has been seen.
static void resume(struct drive *drive, uint32_t now)
{
    uint16_t speed = drive->speed > 0 ? (uint16_t)drive->speed : 0;
    drive->setpoint = speed < drive->setpoint ? speed : drive->setpoint;
    drive->last_reserve = now;
    if (drive->moved && !drive->keeps_on)
        await_movement(drive, read_crank(drive), now);
}

// Takes the crank's encoder: from here on a crank that turns without power is told.
static uint8_t watch(struct drive *drive, const struct drive_arguments *request, uint32_t now)
{
    int16_t counts = request->counts_per_revolution;
    uint16_t revolution = magnitude(counts);
    if (revolution < BOARD_DRIVE_MOVEMENT_PARTS || revolution > INT16_MAX)
        return BOARD_STATUS_BAD_ARGUMENT;
    if (revolution == drive->counts_per_revolution && (counts < 0) == drive->backwards)
        return BOARD_STATUS_OK;
    if (drive_turns(drive))
        return BOARD_STATUS_BAD_ARGUMENT; // another encoder, in the middle of a run
    drive->counts_per_revolution = revolution;
    drive->backwards = counts < 0;
    begin(drive, now);
    drive->steps_to_fade = FADING_STEPS; // it may coast, from whatever was before
    return BOARD_STATUS_OK;
}

static uint8_t run(struct drive *drive, const struct drive_arguments *request, uint32_t now)
{
    if (request->speed < BOARD_DRIVE_SPEED_MINIMUM || request->speed > BOARD_DRIVE_SPEED_MAXIMUM)
        return BOARD_STATUS_BAD_ARGUMENT;
    uint8_t status = watch(drive, request, now);
    if (status != BOARD_STATUS_OK)
        return status;
    if (drive->trip == BOARD_DRIVE_TRIP_NONE && !hal_emergency_stop_closed())
        trip(drive, BOARD_DRIVE_TRIP_EMERGENCY_STOP);
    if (drive->trip != BOARD_DRIVE_TRIP_NONE)
        return BOARD_STATUS_DRIVE_TRIPPED;
    if (!drive_turns(drive)) {
        begin(drive, now);
    } else if (drive->state == BOARD_DRIVE_STATE_STOPPING) {
        resume(drive, now);
    }
    drive->target = request->speed;
    drive->last_command = now;
    if (drive->state != BOARD_DRIVE_STATE_RUNNING)
        enter(drive, BOARD_DRIVE_STATE_RUNNING);
    return BOARD_STATUS_OK;
}

// The word that lets a running drive run on. It starts none: the host cannot know at once that the
// board was reset.
static uint8_t keep(struct drive *drive, uint32_t now)
{
    if (drive->trip != BOARD_DRIVE_TRIP_NONE)
        return BOARD_STATUS_DRIVE_TRIPPED;
    if (drive->state != BOARD_DRIVE_STATE_RUNNING)
        return BOARD_STATUS_DRIVE_STANDS;
    drive->last_command = now;
    return BOARD_STATUS_OK;
}

static void stop_softly(struct drive *drive)
{
    if (drive->state != BOARD_DRIVE_STATE_RUNNING)
        return;
    drive->target = 0;
    enter(drive, BOARD_DRIVE_STATE_STOPPING);
}

static uint8_t clear_trip(struct drive *drive)
{
    if (drive_turns(drive) || (drive->trip != BOARD_DRIVE_TRIP_NONE && !hal_emergency_stop_closed()) ||
        (drive->trip == BOARD_DRIVE_TRIP_RUNAWAY && magnitude(drive->speed) > BOARD_DRIVE_REST))
        return BOARD_STATUS_DRIVE_TRIPPED;
    drive->trip = BOARD_DRIVE_TRIP_NONE;
    if (drive->state != BOARD_DRIVE_STATE_STOPPED)
        enter(drive, BOARD_DRIVE_STATE_STOPPED);
    return BOARD_STATUS_OK;
}

uint8_t drive_command(struct drive *drive, const struct drive_arguments *request, uint32_t now)
{
    switch (request->action) {
    case BOARD_DRIVE_ACTION_STOP:
        stop_softly(drive);
        return BOARD_STATUS_OK;
    case BOARD_DRIVE_ACTION_RUN:
        return run(drive, request, now);
    case BOARD_DRIVE_ACTION_EMERGENCY_STOP:
        trip(drive, BOARD_DRIVE_TRIP_EMERGENCY_STOP);
        return BOARD_STATUS_OK;
    case BOARD_DRIVE_ACTION_CLEAR_TRIP:
        return clear_trip(drive);
    case BOARD_DRIVE_ACTION_KEEP:
        return keep(drive, now);
    case BOARD_DRIVE_ACTION_WATCH:
        return watch(drive, request, now);
    default:
        return BOARD_STATUS_BAD_ARGUMENT;
    }
}

// ---- control

static void follow_ramp(struct drive *drive)
{
    int32_t step = (int32_t)drive->target - drive->setpoint;
    int32_t largest = BOARD_DRIVE_RAMP_A_STEP;
    step = step > largest ? largest : step < -largest ? -largest : step;
    drive->setpoint = (uint16_t)(drive->setpoint + step);
    // In a stop it is never led faster than the encoder has told: no power makes up for what it lost.
    bool stops = drive->state == BOARD_DRIVE_STATE_STOPPING;
    uint16_t speed = drive->speed > 0 ? (uint16_t)drive->speed : 0;
    uint16_t highest = speed < drive->reference ? speed : drive->reference;
    drive->reference = stops && highest < drive->setpoint ? highest : drive->setpoint;
}

// What the measured speed warrants: a motor whose encoder tells of no movement, or of too little, gets no more
// than that takes. In a stop it never rises, whatever the encoder tells.
static int32_t duty_ceiling(const struct drive *drive)
{
    int32_t speed = drive->keeps_on && drive->speed > 0 ? drive->speed : 0;
    int32_t ceiling = (int32_t)BOARD_DRIVE_CEILING_STANDING + speed * BOARD_DRIVE_CEILING_SLOPE_Q8 / 256;
    int32_t highest = drive->state == BOARD_DRIVE_STATE_STOPPING ? drive->duty : FULL_DUTY;
    return ceiling < highest ? ceiling : highest;
}

// Moves the reference on by a step and the crank by what it has turned. The lag is the speed's exact
// integral: its steps lose nothing, so that the mean speed is the setpoint to a count. It ends where the
// integral alone asks for the ceiling: more would only have to be undone. Returns it as an angle.
static int32_t follow_reference(struct drive *drive, int32_t turned, int32_t ceiling)
{
    uint32_t advance = (uint32_t)drive->reference * drive->counts_per_revolution * ADVANCE_FACTOR +
                       drive->remainder;
    drive->remainder = (uint16_t)(advance % ADVANCE_DIVISOR);
    int32_t lag = drive->lag + (int32_t)(advance / ADVANCE_DIVISOR) - turned * 256;
    drive->lag = lag < 0 ? 0 : lag;
    int32_t angle = drive->lag * ANGLE_FACTOR / drive->counts_per_revolution;
    if (angle * BOARD_DRIVE_INTEGRAL_Q8 > ceiling * 256) {
        angle = ceiling * 256 / BOARD_DRIVE_INTEGRAL_Q8;
        drive->lag = (int32_t)drive->counts_per_revolution * angle / ANGLE_FACTOR;
    }
    return angle;
}

static void control(struct drive *drive, int32_t turned, uint32_t now)
{
    int32_t ceiling = duty_ceiling(drive);
    int32_t angle = follow_reference(drive, turned, ceiling);
    int32_t error = (int32_t)drive->reference - drive->speed;
    int32_t duty = (error * BOARD_DRIVE_PROPORTIONAL_Q8 + angle * BOARD_DRIVE_INTEGRAL_Q8) / 256;
    if (duty < ceiling)
        drive->last_reserve = now;
    drive->duty = (uint16_t)(duty < 0 ? 0 : duty > ceiling ? ceiling : duty);
    hal_drive_on(drive->duty);
}

// By the time that has passed, for a step may come late: the scan goes before. Returns what the crank
// has turned since the step before.
static int32_t measure_speed(struct drive *drive, struct crank crank, uint32_t now)
{
    int32_t step = difference(crank.count, drive->last_count);
    drive->last_count = crank.count;
    drive->edges = (uint16_t)(drive->edges + (uint8_t)(crank.edges - drive->last_edges));
    drive->last_edges = crank.edges;
    int32_t turned = difference(crank.count, drive->counts[drive->oldest]);
    int32_t passed = (int32_t)((now - drive->times[drive->oldest]) >> TIME_SHIFT);
    drive->counts[drive->oldest] = crank.count;
    drive->times[drive->oldest] = now;
    drive->oldest = place_after(drive->oldest);
    int32_t largest = drive->counts_per_revolution; // ten times the fastest speed
    turned = turned > largest ? largest : turned < -largest ? -largest : turned;
    // A quarter: a step may be short, one count is much of a slow one, and the tow's weight slows the crank
    drive->keeps_on = step > 0 && step * 4 * (int32_t)BOARD_DRIVE_WINDOW_STEPS > turned;
    int32_t speed = turned * REVOLUTION / drive->counts_per_revolution * TWICE_SPEED / (2 * passed);
    drive->speed = (int16_t)(speed > INT16_MAX ? INT16_MAX : speed < -INT16_MAX ? -INT16_MAX : speed);
    return step;
}

// Whether it has stood for too long: a silent encoder must not let the motor run away, which takes it the
// less time the faster it turns.
static bool stands(const struct drive *drive, uint32_t now)
{
    const uint32_t part = BOARD_TICK_HZ / BOARD_DRIVE_STALL_PARTS * 6000u; // of a revolution, at 0.01 rpm
    uint32_t passed = now - drive->last_movement;
    if (!drive->moved)
        return passed > BOARD_DRIVE_START_TICKS;
    return passed > BOARD_DRIVE_STALL_TICKS ||
           (passed >> TIME_SHIFT) * drive->setpoint > part >> TIME_SHIFT;
}

static void note_movement(struct drive *drive, struct crank crank, uint32_t now)
{
    int32_t least = drive->counts_per_revolution / (int32_t)BOARD_DRIVE_MOVEMENT_PARTS;
    if (difference(crank.count, drive->mark) < (least > LEAST_MOVEMENT ? least : LEAST_MOVEMENT))
        return;
    drive->mark = crank.count;
    drive->mark_speed = drive->speed;
    drive->edges = 0;
    drive->moved = true;
    drive->last_movement = now;
}

// The trip that the crank's movement calls for, in any state in which the motor may have power.
static uint8_t judge(const struct drive *drive, struct crank crank, uint32_t now)
{
    int32_t turned = difference(crank.count, drive->mark);
    if (turned <= -(drive->counts_per_revolution / (int32_t)BOARD_DRIVE_REVERSE_PARTS) ||
        drive->edges >= drive->counts_per_revolution / BOARD_DRIVE_EDGE_PARTS)
        return BOARD_DRIVE_TRIP_ENCODER;
    if (drive->speed > (int32_t)drive->setpoint + (int32_t)BOARD_DRIVE_OVERSPEED)
        return BOARD_DRIVE_TRIP_OVERSPEED;
    if (stands(drive, now))
        return BOARD_DRIVE_TRIP_STALL;
    if (drive->state == BOARD_DRIVE_STATE_RUNNING && drive->moved &&
        now - drive->last_reserve > BOARD_DRIVE_OVERLOAD_TICKS)
        return BOARD_DRIVE_TRIP_OVERLOAD;
    return BOARD_DRIVE_TRIP_NONE;
}

// Its duty never raised, a crank may come to rest before the end of a soft stop, and the tow's weight may swing
// it back, but not from one step to the next. One dead track swings the count by one only.
static bool comes_to_rest(const struct drive *drive, struct crank crank, uint8_t cause)
{
    bool swings_back = cause == BOARD_DRIVE_TRIP_ENCODER && drive->moved &&
                       difference(crank.count, drive->mark) < -LEAST_MOVEMENT;
    return (cause == BOARD_DRIVE_TRIP_STALL || swings_back) &&
           drive->mark_speed <= (int16_t)BOARD_DRIVE_ABRUPT;
}

static void end_stop(struct drive *drive)
{
    power_off(drive);
    enter(drive, drive->trip == BOARD_DRIVE_TRIP_NONE ? BOARD_DRIVE_STATE_STOPPED
                                                      : BOARD_DRIVE_STATE_TRIPPED);
}

// A crank without power loses speed faster than along the ramp, once what the motor gave it last has been
// measured.
static void watch_rest(struct drive *drive)
{
    uint16_t speed = magnitude(drive->speed);
    uint16_t step = drive->coast < BOARD_DRIVE_RAMP_A_STEP ? drive->coast : BOARD_DRIVE_RAMP_A_STEP;
    drive->coast = (uint16_t)(drive->coast - step);
    if (drive->steps_to_fade > 0) {
        drive->steps_to_fade--;
        drive->coast = speed > drive->coast ? speed : drive->coast;
    } else if (drive->trip != BOARD_DRIVE_TRIP_RUNAWAY &&
               speed > (uint32_t)drive->coast + BOARD_DRIVE_REST) {
        trip(drive, BOARD_DRIVE_TRIP_RUNAWAY);
    }
}

static void control_step(struct drive *drive, uint32_t now)
{
    struct crank crank = read_crank(drive);
    int32_t turned = measure_speed(drive, crank, now);
    if (!drive_turns(drive)) {
        watch_rest(drive);
        return;
    }
    if (drive->state == BOARD_DRIVE_STATE_RUNNING &&
        now - drive->last_command > BOARD_DRIVE_COMMAND_TIMEOUT_TICKS) {
        drive->trip = BOARD_DRIVE_TRIP_HOST_SILENCE;
        stop_softly(drive);
    }
    note_movement(drive, crank, now);
    uint8_t cause = judge(drive, crank, now);
    bool rests = drive->state == BOARD_DRIVE_STATE_STOPPING && comes_to_rest(drive, crank, cause);
    if (cause != BOARD_DRIVE_TRIP_NONE && !rests) {
        trip(drive, cause);
        return;
    }
    follow_ramp(drive);
    if (rests || (drive->setpoint == 0 && drive->target == 0))
        end_stop(drive);
    else
        control(drive, turned, now);
}

static void send(struct drive *drive, struct transmitter *transmitter, uint32_t now)
{
    struct drive_frame frame = {
        .ticks = now,
        .state = drive->state,
        .trip = drive->trip,
        .target = drive->target,
        .setpoint = drive->setpoint,
        .speed = drive->speed,
        .duty = drive->duty,
        .emergency_stop_closed = hal_emergency_stop_closed(),
    };
    uint8_t payload[1 + DRIVE_FRAME_SIZE] = {BOARD_FRAME_DRIVE};
    drive_frame_pack(payload + 1, &frame);
    transmit(transmitter, payload, sizeof payload);
    drive->last_frame = now;
    drive->news = false;
}

void drive_watch(struct drive *drive)
{
    if (drive_turns(drive) && !hal_emergency_stop_closed())
        trip(drive, BOARD_DRIVE_TRIP_EMERGENCY_STOP);
}

void drive_poll(struct drive *drive, struct transmitter *transmitter, uint32_t now)
{
    bool turns = drive_turns(drive) || drive->trip == BOARD_DRIVE_TRIP_RUNAWAY;
    uint32_t frame_ticks = turns ? BOARD_DRIVE_FRAME_MOVING_TICKS : BOARD_DRIVE_FRAME_STANDING_TICKS;
    bool knows_encoder = drive->counts_per_revolution != 0; // also at rest: a tow may turn the crank
    if (knows_encoder && now - drive->last_step >= STEP_TICKS) {
        // By whole steps, so that the reference keeps the board's time. A main loop that was held up
        // leaves steps out and does not make up for them.
        drive->last_step += (now - drive->last_step) / STEP_TICKS * STEP_TICKS;
        control_step(drive, now);
    } else if (drive->news || now - drive->last_frame >= frame_ticks) {
        send(drive, transmitter, now);
    }
}
