// SPDX-License-Identifier: Apache-2.0
//
// The crank's drive on a shaft whose speed follows the duty with a time constant.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "drive.h"
#include "whole_board.h"

#define MS (BOARD_TICK_HZ / 1000)
#define COUNTS 4096

struct shaft {
    struct drive drive;
    struct transmitter transmitter;
    double fastest_rpm;  // at full duty
    double duty_to_move; // what friction takes
    double time_constant_s;
    int direction;       // of the counts
    bool blocked;
    bool silent;         // the encoder
    bool one_track;      // of it alone changes: the count goes to and fro by one
    bool slips;          // and tells of half
    bool driver_shorted;
    double rpm, counts;
    int32_t position; // of the encoder
};

static void set_up_at(struct shaft *shaft, int32_t start)
{
    memset(&hal_host, 0, sizeof hal_host);
    hal_host.tx_space = 255;
    *shaft = (struct shaft){.fastest_rpm = 200, .duty_to_move = 0.1, .time_constant_s = 0.4,
                            .direction = 1};
    hal_host.encoders.crank = start;
    drive_init(&shaft->drive, (uint32_t)hal_host.time);
}

static int set_up(void **state)
{
    *state = malloc(sizeof(struct shaft));
    set_up_at(*state, 0);
    return 0;
}

static int tear_down(void **state)
{
    free(*state);
    return 0;
}

static void turn_encoder(struct shaft *shaft)
{
    int32_t position = (int32_t)(shaft->direction * shaft->counts);
    int32_t turned = position - shaft->position;
    int32_t of_one_track = position / 2 - shaft->position / 2;
    shaft->position = position;
    if (shaft->silent)
        return;
    if (shaft->one_track) { // its edges are every second one
        turned = abs(of_one_track);
        for (int32_t i = 0; i < turned; i++)
            hal_host.encoders.crank += hal_host.encoders.crank % 2 == 0 ? 1 : -1;
    } else {
        hal_host.encoders.crank = (int32_t)((uint32_t)hal_host.encoders.crank + (uint32_t)turned);
    }
    hal_host.encoders.crank_edges = (uint8_t)(hal_host.encoders.crank_edges + abs(turned));
}

static void pass_ms(struct shaft *shaft, int ms)
{
    for (int i = 0; i < ms; i++) {
        double duty = shaft->driver_shorted ? 1.0 : hal_host.drive_enabled ? hal_host.drive_duty * 1e-4 : 0.0;
        double aim = duty > shaft->duty_to_move && !shaft->blocked
                         ? shaft->fastest_rpm * (duty - shaft->duty_to_move)
                         : 0.0;
        shaft->rpm = shaft->blocked ? 0.0 : shaft->rpm + (aim - shaft->rpm) * 1e-3 / shaft->time_constant_s;
        shaft->counts += shaft->rpm / 60e3 * COUNTS * (shaft->slips ? 0.5 : 1.0);
        turn_encoder(shaft);
        hal_host_advance(MS);
        bool stops = shaft->drive.state == BOARD_DRIVE_STATE_STOPPING;
        uint16_t before = hal_host.drive_duty;
        drive_watch(&shaft->drive);
        drive_poll(&shaft->drive, &shaft->transmitter, (uint32_t)hal_host.time);
        if (stops) // the duty of a stop never rises
            assert_true(hal_host.drive_duty <= before);
    }
}

static uint8_t ask(struct shaft *shaft, uint8_t action, uint16_t speed)
{
    struct drive_arguments request = {.action = action, .speed = speed,
                                      .counts_per_revolution = (int16_t)(shaft->direction * COUNTS)};
    return drive_command(&shaft->drive, &request, (uint32_t)hal_host.time);
}

// As the host does it: `run` four times a second.
static void run_ms(struct shaft *shaft, uint16_t speed, int ms)
{
    for (; ms > 0; ms -= 250) {
        assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_RUN, speed), BOARD_STATUS_OK);
        pass_ms(shaft, ms < 250 ? ms : 250);
    }
}

static void assert_off(const struct shaft *shaft, uint8_t state, uint8_t trip)
{
    assert_false(hal_host.drive_enabled);
    assert_int_equal(hal_host.drive_duty, 0);
    assert_int_equal(shaft->drive.state, state);
    assert_int_equal(shaft->drive.trip, trip);
}

static void the_motor_is_off_at_first(void **state)
{
    struct shaft *shaft = *state;
    pass_ms(shaft, 100);
    assert_off(shaft, BOARD_DRIVE_STATE_STOPPED, BOARD_DRIVE_TRIP_NONE);
}

// The lag's integral makes the mean exact: over 20 s it is the difference of two readings of a lag that is
// steady to a few counts, 8 of 6800 at 5 rpm.
static void the_mean_speed_is_the_one_asked_for(void **state)
{
    static const uint16_t speeds[] = {500, 3000, 6000};
    // Also over the end of the count, and with a count that falls
    static const int32_t starts[] = {0, INT32_MAX - 100, INT32_MIN + 100};
    for (int i = 0; i < 3; i++)
        for (int direction = -1; direction <= 1; direction += 2) {
            struct shaft *shaft = *state;
            set_up_at(shaft, starts[i]);
            shaft->direction = direction;
            run_ms(shaft, speeds[i], 15000);
            double before = shaft->counts;
            uint64_t begun = hal_host.time; // sending takes time, too
            run_ms(shaft, speeds[i], 20000);
            double revolutions = (shaft->counts - before) / COUNTS;
            double wanted = speeds[i] / 6000.0 * (double)(hal_host.time - begun) / BOARD_TICK_HZ;
            assert_true(fabs((revolutions - wanted) * COUNTS) < 8);
            // A count more or less in the window of 60 ms is 0.24 rpm; and this shaft hunts a little
            uint16_t near = (uint16_t)(48 + speeds[i] / 50);
            assert_in_range(shaft->drive.speed, speeds[i] - near, speeds[i] + near);
            assert_int_equal(shaft->drive.setpoint, speeds[i]);
        }
}

static void it_starts_and_stops_along_a_ramp(void **state)
{
    struct shaft *shaft = *state;
    run_ms(shaft, 3000, 1000);
    assert_in_range(shaft->drive.setpoint, 980, 1020); // 10 rpm/s
    run_ms(shaft, 3000, 6000);
    assert_int_equal(shaft->drive.setpoint, 3000);
    assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_STOP, 0), BOARD_STATUS_OK);
    for (int ms = 0; ms < 3100; ms += 20) {
        // At most as fast as along the ramp, but for its time constant of 0.4 s
        assert_true(shaft->rpm <= 30 - (ms - 400) * 10e-3 + 1 || ms < 400);
        if (ms == 500) {
            assert_int_equal(shaft->drive.state, BOARD_DRIVE_STATE_STOPPING);
            assert_in_range(shaft->drive.setpoint, 2480, 2520);
            assert_true(shaft->rpm > 10); // softly
        }
        pass_ms(shaft, 20);
    }
    assert_off(shaft, BOARD_DRIVE_STATE_STOPPED, BOARD_DRIVE_TRIP_NONE);
    pass_ms(shaft, 2000);
    assert_int_equal(shaft->drive.speed, 0);
}

static void another_speed_is_reached_along_the_ramp(void **state)
{
    struct shaft *shaft = *state;
    run_ms(shaft, 6000, 8000);
    run_ms(shaft, 2000, 2000);
    assert_in_range(shaft->drive.setpoint, 3980, 4020);
    run_ms(shaft, 2000, 8000);
    assert_in_range(shaft->drive.speed, 1970, 2030);
}

static void a_blocked_crank_trips(void **state)
{
    struct shaft *shaft = *state;
    shaft->blocked = true;
    run_ms(shaft, 1000, 990);
    assert_int_equal(shaft->drive.state, BOARD_DRIVE_STATE_RUNNING);
    assert_int_equal(shaft->drive.duty, BOARD_DRIVE_CEILING_STANDING);
    pass_ms(shaft, 50);
    assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_STALL);
    assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_RUN, 1000), BOARD_STATUS_DRIVE_TRIPPED);
    assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_CLEAR_TRIP, 0), BOARD_STATUS_OK);
    shaft->blocked = false;
    run_ms(shaft, 1000, 5000);
    shaft->blocked = true;
    run_ms(shaft, 1000, 340); // 1/16 of a turn at 10 rpm: 375 ms
    assert_int_equal(shaft->drive.state, BOARD_DRIVE_STATE_RUNNING);
    pass_ms(shaft, 100);
    assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_STALL);
}

static void a_crank_that_runs_away_trips(void **state)
{
    struct shaft *shaft = *state;
    run_ms(shaft, 3000, 8000);
    shaft->fastest_rpm = 20000; // the load has gone
    pass_ms(shaft, 250);
    assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_OVERSPEED);
}

static void an_encoder_that_counts_the_other_way_trips(void **state)
{
    struct shaft *shaft = *state;
    shaft->direction = -1;
    struct drive_arguments request = {BOARD_DRIVE_ACTION_RUN, 3000, COUNTS};
    assert_int_equal(drive_command(&shaft->drive, &request, (uint32_t)hal_host.time), BOARD_STATUS_OK);
    pass_ms(shaft, 950);
    assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_ENCODER);
    assert_true(shaft->counts < COUNTS / 4.0); // 1/32, and what it coasts
}

// The highest duty from now on until the motor is off, which it must be within so many ms.
static int highest_duty_until_off(struct shaft *shaft, int ms)
{
    int highest = 0;
    for (int i = 0; i < ms && hal_host.drive_enabled; i++) {
        highest = hal_host.drive_duty > highest ? hal_host.drive_duty : highest;
        pass_ms(shaft, 1);
    }
    assert_false(hal_host.drive_enabled);
    return highest;
}

static void set_up_running(struct shaft *shaft, uint16_t speed, bool stopping)
{
    set_up_at(shaft, 0);
    run_ms(shaft, speed, speed + 2000);
    if (stopping) {
        ask(shaft, BOARD_DRIVE_ACTION_STOP, 0);
        pass_ms(shaft, 200);
    }
}

// Stall: 1/16 revolution at the setpoint, half a second at most, and two control steps: it is seen in steps,
// and so is the last movement.
static int stall_ms(int speed)
{
    int part = 60000 * 100 / (int)BOARD_DRIVE_STALL_PARTS / speed;
    return (part < 500 ? part : 500) + 2 * 1000 / (int)BOARD_DRIVE_CONTROL_HZ + 1;
}

static void an_encoder_that_goes_silent_raises_no_duty(void **state)
{
    struct shaft *shaft = *state;
    for (int stopping = 0; stopping <= 1; stopping++)
        for (uint16_t speed = 2000; speed <= 6000; speed = (uint16_t)(speed + 1000)) {
            set_up_running(shaft, speed, stopping);
            int before = hal_host.drive_duty, setpoint = shaft->drive.setpoint;
            shaft->silent = true;
            pass_ms(shaft, 1000 / BOARD_DRIVE_CONTROL_HZ + 1); // a step that has seen part of a movement
            int highest = highest_duty_until_off(shaft, stall_ms(stopping ? setpoint - 100 : speed));
            assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_STALL);
            int most = BOARD_DRIVE_CEILING_STANDING;
            assert_true(highest <= (before > most || stopping ? before : most));
        }
}

static void one_dead_track_trips(void **state)
{
    struct shaft *shaft = *state;
    for (int stopping = 0; stopping <= 1; stopping++)
        for (uint16_t speed = 2000; speed <= 6000; speed = (uint16_t)(speed + 1000)) {
            set_up_running(shaft, speed, stopping);
            shaft->one_track = true;
            // 1/64 of the edges are 1/32 revolution on one track: before a stall
            highest_duty_until_off(shaft, stall_ms(2 * shaft->drive.setpoint));
            assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_ENCODER);
        }
    set_up_at(shaft, 0);
    shaft->one_track = true;
    assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_RUN, 3000), BOARD_STATUS_OK);
    pass_ms(shaft, 21);
    assert_true(highest_duty_until_off(shaft, 999) <= (int)BOARD_DRIVE_CEILING_STANDING);
    assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_ENCODER);
}

// Of 512 counts, one is the 1/512 that counts as movement: one track alone gives it again and again.
static void one_track_of_a_coarse_encoder_moves_nothing(void **state)
{
    struct shaft *shaft = *state;
    shaft->silent = true;
    struct drive_arguments request = {BOARD_DRIVE_ACTION_RUN, 500, 512};
    drive_command(&shaft->drive, &request, (uint32_t)hal_host.time);
    for (int i = 0; i < 7; i++) { // one edge short of 1/64
        pass_ms(shaft, 30);
        hal_host.encoders.crank += i % 2 == 0 ? 1 : -1;
        hal_host.encoders.crank_edges++;
    }
    pass_ms(shaft, 30);
    assert_false(shaft->drive.moved);
    hal_host.encoders.crank_edges++;
    pass_ms(shaft, 30);
    assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_ENCODER);
}

static void a_crank_that_jams_in_a_stop_trips(void **state)
{
    struct shaft *shaft = *state;
    set_up_running(shaft, 6000, true);
    int before = hal_host.drive_duty;
    shaft->blocked = true;
    assert_true(highest_duty_until_off(shaft, stall_ms(5700)) <= before);
    assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_STALL);
}

// From 10 rpm, less than the 15 from which a crank does not come to rest by itself.
static void a_crank_that_rests_before_the_end_of_its_stop_does_not_trip(void **state)
{
    struct shaft *shaft = *state;
    set_up_running(shaft, 1100, true);
    shaft->blocked = true;
    highest_duty_until_off(shaft, 541);
    assert_off(shaft, BOARD_DRIVE_STATE_STOPPED, BOARD_DRIVE_TRIP_NONE);
}

// The encoder's counts, one each ms, until a control step has seen them.
static void turn_back(struct shaft *shaft, int counts)
{
    shaft->blocked = true;
    for (; counts > 0 && hal_host.drive_enabled; counts--) {
        hal_host.encoders.crank--;
        hal_host.encoders.crank_edges++;
        pass_ms(shaft, 1);
    }
    pass_ms(shaft, 21);
}

// The tow's weight swings back a crank that comes to rest: as a rest is, from less than 15 rpm. An encoder whose
// count turns round at a faster one, or before the crank has moved at all, has its wires exchanged.
static void a_crank_that_swings_back_in_a_stop_does_not_trip(void **state)
{
    struct shaft *shaft = *state;
    set_up_running(shaft, 1100, true);
    turn_back(shaft, COUNTS / (int)BOARD_DRIVE_REVERSE_PARTS);
    assert_off(shaft, BOARD_DRIVE_STATE_STOPPED, BOARD_DRIVE_TRIP_NONE);

    set_up_running(shaft, 6000, true);
    turn_back(shaft, COUNTS / (int)BOARD_DRIVE_REVERSE_PARTS);
    assert_int_equal(shaft->drive.state, BOARD_DRIVE_STATE_TRIPPED);

    set_up_running(shaft, 1100, true); // a track that dies, at any speed
    shaft->one_track = true;
    highest_duty_until_off(shaft, 541);
    assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_ENCODER);

    set_up_at(shaft, 0);
    shaft->blocked = true;
    assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_RUN, 3000), BOARD_STATUS_OK);
    pass_ms(shaft, 100);
    ask(shaft, BOARD_DRIVE_ACTION_STOP, 0);
    turn_back(shaft, COUNTS / (int)BOARD_DRIVE_REVERSE_PARTS);
    assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_ENCODER);
}

// Half of what it turns: it is led no faster than the encoder tells, and slows down.
static void an_encoder_that_slips_speeds_no_stop_up(void **state)
{
    struct shaft *shaft = *state;
    set_up_running(shaft, 6000, true);
    double before = shaft->rpm;
    shaft->slips = true;
    for (int ms = 0; ms < 6100; ms += 20) {
        pass_ms(shaft, 20);
        assert_true(shaft->rpm < before + 3);
    }
    assert_off(shaft, BOARD_DRIVE_STATE_STOPPED, BOARD_DRIVE_TRIP_NONE);
}

static void a_crank_that_does_not_reach_its_speed_trips(void **state)
{
    struct shaft *shaft = *state;
    shaft->fastest_rpm = 40;
    int ms = 0;
    for (; shaft->drive.state != BOARD_DRIVE_STATE_TRIPPED && ms < 10000; ms += 20) {
        ask(shaft, BOARD_DRIVE_ACTION_RUN, 6000);
        pass_ms(shaft, 20);
    }
    assert_in_range(ms, 1000, 5000);
    assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_OVERLOAD);
}

static void a_crank_that_turns_without_power_is_told(void **state)
{
    struct shaft *shaft = *state;
    for (int stopped = 0; stopped <= 1; stopped++) {
        set_up_running(shaft, 3000, false);
        if (stopped) {
            ask(shaft, BOARD_DRIVE_ACTION_STOP, 0);
            pass_ms(shaft, 5000);
            assert_off(shaft, BOARD_DRIVE_STATE_STOPPED, BOARD_DRIVE_TRIP_NONE);
        }
        shaft->driver_shorted = true;
        pass_ms(shaft, 1000);
        assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_RUNAWAY);
        assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_CLEAR_TRIP, 0), BOARD_STATUS_DRIVE_TRIPPED);
        // Whatever else is asked for, it is told again
        assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_EMERGENCY_STOP, 0), BOARD_STATUS_OK);
        pass_ms(shaft, 41);
        assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_RUNAWAY);
        shaft->driver_shorted = false; // the main switch
        pass_ms(shaft, 3000);
        assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_RUNAWAY);
        assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_CLEAR_TRIP, 0), BOARD_STATUS_OK);
        pass_ms(shaft, 1000);
        assert_off(shaft, BOARD_DRIVE_STATE_STOPPED, BOARD_DRIVE_TRIP_NONE);
    }
}

// After a reset, of which the shaft knows nothing.
static void a_crank_that_turns_is_told_once_its_encoder_is_known(void **state)
{
    struct shaft *shaft = *state;
    for (int direction = -1; direction <= 1; direction += 2) {
        set_up_at(shaft, 0);
        shaft->direction = direction;
        shaft->driver_shorted = true;
        pass_ms(shaft, 3000);
        assert_off(shaft, BOARD_DRIVE_STATE_STOPPED, BOARD_DRIVE_TRIP_NONE);
        struct drive_arguments request = {BOARD_DRIVE_ACTION_WATCH, 0, (int16_t)(direction * COUNTS)};
        assert_int_equal(drive_command(&shaft->drive, &request, (uint32_t)hal_host.time), BOARD_STATUS_OK);
        // The window of four steps, and 5 rpm of the ramp's 10 rpm/s
        pass_ms(shaft, 500);
        assert_int_equal(shaft->drive.trip, BOARD_DRIVE_TRIP_NONE);
        pass_ms(shaft, 5 * 20 + 20);
        assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_RUNAWAY);
    }
    // One that coasts is none
    set_up_running(shaft, 6000, false);
    drive_init(&shaft->drive, (uint32_t)hal_host.time);
    struct drive_arguments request = {BOARD_DRIVE_ACTION_WATCH, 0, COUNTS};
    assert_int_equal(drive_command(&shaft->drive, &request, (uint32_t)hal_host.time), BOARD_STATUS_OK);
    pass_ms(shaft, 10000);
    assert_off(shaft, BOARD_DRIVE_STATE_STOPPED, BOARD_DRIVE_TRIP_NONE);
}

static void another_encoder_is_known_at_rest_only(void **state)
{
    struct shaft *shaft = *state;
    set_up_running(shaft, 3000, false);
    uint32_t now = (uint32_t)hal_host.time;
    struct drive_arguments same = {BOARD_DRIVE_ACTION_WATCH, 0, COUNTS};
    struct drive_arguments other = {BOARD_DRIVE_ACTION_WATCH, 0, -COUNTS};
    struct drive_arguments none = {BOARD_DRIVE_ACTION_WATCH, 0, 0};
    assert_int_equal(drive_command(&shaft->drive, &same, now), BOARD_STATUS_OK);
    assert_int_equal(drive_command(&shaft->drive, &other, now), BOARD_STATUS_BAD_ARGUMENT);
    assert_int_equal(drive_command(&shaft->drive, &none, now), BOARD_STATUS_BAD_ARGUMENT);
    run_ms(shaft, 3000, 1000);
    assert_int_equal(shaft->drive.state, BOARD_DRIVE_STATE_RUNNING);
    assert_in_range(shaft->drive.speed, 2900, 3100);
}

// Along the ramp it would take 6 s.
static void a_crank_that_coasts_is_no_runaway(void **state)
{
    struct shaft *shaft = *state;
    set_up_running(shaft, 6000, false);
    shaft->time_constant_s = 2;
    ask(shaft, BOARD_DRIVE_ACTION_EMERGENCY_STOP, 0);
    pass_ms(shaft, 10000);
    assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_EMERGENCY_STOP);
}

// Not from where the ramp is, should the crank be slower or at rest.
static void a_stop_that_is_called_off_goes_on_from_the_cranks_speed(void **state)
{
    struct shaft *shaft = *state;
    set_up_running(shaft, 6000, true);
    shaft->rpm = 20; // the tow
    pass_ms(shaft, 60);
    assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_RUN, 6000), BOARD_STATUS_OK);
    assert_in_range(shaft->drive.setpoint, 1000, 3500);
    run_ms(shaft, 6000, 8000);
    assert_int_equal(shaft->drive.state, BOARD_DRIVE_STATE_RUNNING);
    assert_in_range(shaft->drive.speed, 5900, 6100);
}

// A crank that turned had its movement judged, whatever was asked for; one that stood has a start's time once.
static void stops_that_are_called_off_hide_no_silent_encoder(void **state)
{
    struct shaft *shaft = *state;
    set_up_running(shaft, 6000, true);
    shaft->silent = true;
    assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_RUN, 6000), BOARD_STATUS_OK);
    highest_duty_until_off(shaft, stall_ms(5700));
    assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_STALL);

    set_up_at(shaft, 0);
    shaft->silent = true;
    int ms = 0;
    for (; ms < 10000 && ask(shaft, BOARD_DRIVE_ACTION_RUN, 6000) == BOARD_STATUS_OK; ms += 400) {
        pass_ms(shaft, 300);
        ask(shaft, BOARD_DRIVE_ACTION_STOP, 0);
        pass_ms(shaft, 100);
    }
    assert_int_equal(ms, 1200); // refused after the third of them, in which a second was over
    assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_STALL);
}

// The window's speed is that of a crank driven back, the last step's movement forward.
static void an_encoder_that_springs_back_raises_no_duty(void **state)
{
    struct shaft *shaft = *state;
    shaft->silent = true;
    struct drive_arguments request = {BOARD_DRIVE_ACTION_RUN, 6000, INT16_MAX};
    assert_int_equal(drive_command(&shaft->drive, &request, (uint32_t)hal_host.time), BOARD_STATUS_OK);
    pass_ms(shaft, 300);
    static const int steps[] = {-900, 1, 1};
    for (int i = 0; i < 3; i++) {
        hal_host.encoders.crank += steps[i];
        hal_host.encoders.crank_edges = (uint8_t)(hal_host.encoders.crank_edges + abs(steps[i]));
        pass_ms(shaft, 20);
        assert_in_range(hal_host.drive_duty, 0, BOARD_DRIVE_CEILING_STANDING);
    }
}

static void an_open_loop_stops_the_motor_at_once(void **state)
{
    struct shaft *shaft = *state;
    run_ms(shaft, 3000, 5000);
    hal_host.emergency_stop_open = true;
    drive_watch(&shaft->drive);
    assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_EMERGENCY_STOP);
    assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_CLEAR_TRIP, 0), BOARD_STATUS_DRIVE_TRIPPED);
    hal_host.emergency_stop_open = false;
    pass_ms(shaft, 5000); // a closed loop alone starts nothing
    assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_EMERGENCY_STOP);
    assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_RUN, 3000), BOARD_STATUS_DRIVE_TRIPPED);
    assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_CLEAR_TRIP, 0), BOARD_STATUS_OK);
    assert_off(shaft, BOARD_DRIVE_STATE_STOPPED, BOARD_DRIVE_TRIP_NONE);
    run_ms(shaft, 3000, 1000);
    assert_int_equal(shaft->drive.state, BOARD_DRIVE_STATE_RUNNING);
}

static void nothing_starts_with_an_open_loop(void **state)
{
    struct shaft *shaft = *state;
    hal_host.emergency_stop_open = true;
    pass_ms(shaft, 100);
    assert_off(shaft, BOARD_DRIVE_STATE_STOPPED, BOARD_DRIVE_TRIP_NONE); // a board without a drive
    assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_RUN, 3000), BOARD_STATUS_DRIVE_TRIPPED);
    assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_EMERGENCY_STOP);
}

static void the_host_stops_the_motor_at_once(void **state)
{
    struct shaft *shaft = *state;
    run_ms(shaft, 3000, 5000);
    assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_EMERGENCY_STOP, 0), BOARD_STATUS_OK);
    assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_EMERGENCY_STOP);
}

static void a_silent_host_is_a_soft_stop(void **state)
{
    struct shaft *shaft = *state;
    run_ms(shaft, 3000, 5000);
    pass_ms(shaft, 1000 - 250 - 30); // a control step early
    assert_int_equal(shaft->drive.state, BOARD_DRIVE_STATE_RUNNING);
    pass_ms(shaft, 60);
    assert_int_equal(shaft->drive.state, BOARD_DRIVE_STATE_STOPPING);
    assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_RUN, 3000), BOARD_STATUS_DRIVE_TRIPPED);
    assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_CLEAR_TRIP, 0), BOARD_STATUS_DRIVE_TRIPPED);
    assert_true(shaft->rpm > 25);
    pass_ms(shaft, 3100);
    assert_off(shaft, BOARD_DRIVE_STATE_TRIPPED, BOARD_DRIVE_TRIP_HOST_SILENCE);
}

static void keeping_on_starts_nothing(void **state)
{
    struct shaft *shaft = *state;
    assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_KEEP, 0), BOARD_STATUS_DRIVE_STANDS);
    assert_off(shaft, BOARD_DRIVE_STATE_STOPPED, BOARD_DRIVE_TRIP_NONE);
    assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_RUN, 3000), BOARD_STATUS_OK);
    for (int i = 0; i < 20; i++) {
        pass_ms(shaft, 250);
        assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_KEEP, 0), BOARD_STATUS_OK);
    }
    assert_int_equal(shaft->drive.target, 3000);
    assert_in_range(shaft->drive.speed, 2950, 3050);
    ask(shaft, BOARD_DRIVE_ACTION_STOP, 0);
    assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_KEEP, 0), BOARD_STATUS_DRIVE_STANDS);
    assert_int_equal(shaft->drive.state, BOARD_DRIVE_STATE_STOPPING);
    ask(shaft, BOARD_DRIVE_ACTION_EMERGENCY_STOP, 0);
    assert_int_equal(ask(shaft, BOARD_DRIVE_ACTION_KEEP, 0), BOARD_STATUS_DRIVE_TRIPPED);
}

static void a_soft_stop_can_be_called_off(void **state)
{
    struct shaft *shaft = *state;
    run_ms(shaft, 3000, 5000);
    ask(shaft, BOARD_DRIVE_ACTION_STOP, 0);
    pass_ms(shaft, 1000);
    run_ms(shaft, 3000, 3000);
    assert_int_equal(shaft->drive.state, BOARD_DRIVE_STATE_RUNNING);
    assert_in_range(shaft->drive.speed, 2950, 3050);
}

static void what_cannot_be_is_refused(void **state)
{
    struct shaft *shaft = *state;
    static const struct drive_arguments requests[] = {
        {BOARD_DRIVE_ACTION_RUN, 499, COUNTS},     {BOARD_DRIVE_ACTION_RUN, 6001, COUNTS},
        {BOARD_DRIVE_ACTION_RUN, 0, COUNTS},       {BOARD_DRIVE_ACTION_RUN, 3000, 0},
        {BOARD_DRIVE_ACTION_RUN, 3000, INT16_MIN}, {BOARD_DRIVE_ACTION_WATCH, 0, 0},
        {BOARD_DRIVE_ACTION_WATCH, 0, INT16_MIN},  {6, 3000, COUNTS},
    };
    for (size_t i = 0; i < sizeof requests / sizeof requests[0]; i++) {
        assert_int_equal(drive_command(&shaft->drive, &requests[i], 0), BOARD_STATUS_BAD_ARGUMENT);
        assert_off(shaft, BOARD_DRIVE_STATE_STOPPED, BOARD_DRIVE_TRIP_NONE);
    }
    run_ms(shaft, 3000, 1000);
    struct drive_arguments other = {BOARD_DRIVE_ACTION_RUN, 3000, 2 * COUNTS};
    assert_int_equal(drive_command(&shaft->drive, &other, (uint32_t)hal_host.time),
                     BOARD_STATUS_BAD_ARGUMENT);
}

static uint8_t ask_board(struct whole_board *whole, uint8_t action, uint16_t speed)
{
    struct drive_arguments request = {action, speed, COUNTS};
    uint8_t arguments[DRIVE_ARGUMENTS_SIZE];
    drive_arguments_pack(arguments, &request);
    struct received_frame answer =
        whole_board_request(whole, BOARD_COMMAND_DRIVE, 5, arguments, sizeof arguments);
    return answer.payload[2];
}

static void the_board_tells_how_the_drive_is(void **state)
{
    struct whole_board *whole = *state;
    whole_board_run_ms(whole, 5000);
    assert_int_equal(whole_board_count(whole, BOARD_FRAME_DRIVE), 5);
    whole_board_forget(whole);
    assert_int_equal(ask_board(whole, BOARD_DRIVE_ACTION_RUN, 3000), BOARD_STATUS_OK);
    whole_board_run_ms(whole, 900);
    assert_in_range(whole_board_count(whole, BOARD_FRAME_DRIVE), 9, 11);
    struct drive_frame frame;
    drive_frame_unpack(&frame, whole_board_frame(whole, BOARD_FRAME_DRIVE, 8)->payload + 1);
    assert_int_equal(frame.state, BOARD_DRIVE_STATE_RUNNING);
    assert_int_equal(frame.target, 3000);
    assert_in_range(frame.setpoint, 780, 900);
    assert_int_equal(frame.duty > 0, 1);
    assert_int_equal(frame.emergency_stop_closed, 1);
    hal_host.emergency_stop_open = true;
    whole_board_forget(whole);
    whole_board_run_ms(whole, 10);
    assert_int_equal(whole_board_count(whole, BOARD_FRAME_DRIVE), 1);
    drive_frame_unpack(&frame, whole_board_frame(whole, BOARD_FRAME_DRIVE, 0)->payload + 1);
    assert_int_equal(frame.trip, BOARD_DRIVE_TRIP_EMERGENCY_STOP);
    assert_int_equal(frame.emergency_stop_closed, 0);
}

// The setpoint's steps are the control's: whatever the scan does meanwhile, there are 50 a second.
static void the_drive_keeps_its_time_beside_the_scan(void **state)
{
    static const struct {
        uint16_t rate_hz, fs;
        bool silent_adc;
    } scans[] = {{10, 6, false}, {10, 90, false}, {10, 6, true},   {20, 45, false},
                 {50, 6, false}, {60, 6, false},  {100, 6, false}, {200, 3, false}, {200, 3, true}};
    for (size_t i = 0; i < sizeof scans / sizeof scans[0]; i++) {
        struct whole_board *whole = *state;
        assert_int_equal(whole_board_set_rate(whole, scans[i].rate_hz, scans[i].fs), BOARD_STATUS_OK);
        whole_board_request(whole, BOARD_COMMAND_START, 1, NULL, 0);
        whole->adc.stalled = scans[i].silent_adc;
        whole_board_forget(whole);
        assert_int_equal(ask_board(whole, BOARD_DRIVE_ACTION_RUN, 3000), BOARD_STATUS_OK);
        uint32_t begun = (uint32_t)hal_host.time;
        whole_board_run_ms(whole, 940);
        size_t frames = whole_board_count(whole, BOARD_FRAME_DRIVE);
        assert_in_range(frames, 9, 11);
        struct drive_frame frame;
        drive_frame_unpack(&frame, whole_board_frame(whole, BOARD_FRAME_DRIVE, frames - 1)->payload + 1);
        // 10 rpm/s: a step of 20 rpm/100 begun before and one not yet taken, and the answer's way
        uint32_t expected = (frame.ticks - begun) / (BOARD_TICK_HZ / 1000);
        assert_in_range(frame.setpoint, expected - 30, expected + 30);
        ask_board(whole, BOARD_DRIVE_ACTION_EMERGENCY_STOP, 0);
        ask_board(whole, BOARD_DRIVE_ACTION_CLEAR_TRIP, 0);
        struct received_frame stopped = whole_board_request(whole, BOARD_COMMAND_STOP, 2, NULL, 0);
        assert_int_equal(stopped.payload[2], BOARD_STATUS_OK);
        whole->adc.stalled = false;
    }
}

// A stop waits for the running scan, which a silent ADC draws out to its period.
static void the_drive_is_led_on_while_a_stream_ends(void **state)
{
    struct whole_board *whole = *state;
    assert_int_equal(whole_board_set_rate(whole, 10, 6), BOARD_STATUS_OK);
    whole_board_request(whole, BOARD_COMMAND_START, 1, NULL, 0);
    whole->adc.stalled = true;
    assert_int_equal(ask_board(whole, BOARD_DRIVE_ACTION_RUN, 3000), BOARD_STATUS_OK);
    whole_board_run_ms(whole, 205);
    whole_board_forget(whole);
    uint64_t asked = hal_host.time;
    hal_host.emergency_stop_open = true;
    struct received_frame stopped = whole_board_request(whole, BOARD_COMMAND_STOP, 2, NULL, 0);
    assert_int_equal(stopped.payload[2], BOARD_STATUS_OK);
    assert_true(hal_host.time - asked > 50 * MS);
    struct drive_frame frame;
    drive_frame_unpack(&frame, whole_board_frame(whole, BOARD_FRAME_DRIVE, 0)->payload + 1);
    assert_int_equal(frame.trip, BOARD_DRIVE_TRIP_EMERGENCY_STOP);
    assert_true(frame.ticks - (uint32_t)asked < 5 * MS);
    hal_host.emergency_stop_open = false;
}

static void what_holds_the_main_loop_up_waits_for_the_drive(void **state)
{
    struct whole_board *whole = *state;
    ask_board(whole, BOARD_DRIVE_ACTION_RUN, 3000);
    struct received_frame answer =
        whole_board_request(whole, BOARD_COMMAND_SELF_TEST, 6, NULL, 0);
    assert_int_equal(answer.payload[2], BOARD_STATUS_DRIVE_TURNS);
    assert_int_equal(whole_board_set_rate(whole, 50, 6), BOARD_STATUS_DRIVE_TURNS);
    ask_board(whole, BOARD_DRIVE_ACTION_EMERGENCY_STOP, 0);
    assert_int_equal(whole_board_set_rate(whole, 50, 6), BOARD_STATUS_OK);
}

static void a_reset_takes_the_motors_power_first(void **state)
{
    struct whole_board *whole = *state;
    ask_board(whole, BOARD_DRIVE_ACTION_RUN, 3000);
    whole_board_run_ms(whole, 300);
    assert_true(hal_host.drive_enabled);
    whole_board_request(whole, BOARD_COMMAND_RESET, 6, NULL, 0);
    whole_board_run_ms(whole, 1);
    assert_int_equal(hal_host.resets, 1);
    assert_false(hal_host.drive_enabled);
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
#define BOARD_TEST(name)                                                            \
    cmocka_unit_test_setup_teardown(name, whole_board_power_up_forgetful, whole_board_power_down)
    const struct CMUnitTest tests[] = {
        TEST(the_motor_is_off_at_first),
        TEST(the_mean_speed_is_the_one_asked_for),
        TEST(it_starts_and_stops_along_a_ramp),
        TEST(another_speed_is_reached_along_the_ramp),
        TEST(a_blocked_crank_trips),
        TEST(a_crank_that_runs_away_trips),
        TEST(an_encoder_that_counts_the_other_way_trips),
        TEST(an_encoder_that_goes_silent_raises_no_duty),
        TEST(one_dead_track_trips),
        TEST(one_track_of_a_coarse_encoder_moves_nothing),
        TEST(a_crank_that_jams_in_a_stop_trips),
        TEST(a_crank_that_rests_before_the_end_of_its_stop_does_not_trip),
        TEST(a_crank_that_swings_back_in_a_stop_does_not_trip),
        TEST(an_encoder_that_slips_speeds_no_stop_up),
        TEST(a_crank_that_does_not_reach_its_speed_trips),
        TEST(a_crank_that_turns_without_power_is_told),
        TEST(a_crank_that_turns_is_told_once_its_encoder_is_known),
        TEST(another_encoder_is_known_at_rest_only),
        TEST(a_crank_that_coasts_is_no_runaway),
        TEST(a_stop_that_is_called_off_goes_on_from_the_cranks_speed),
        TEST(stops_that_are_called_off_hide_no_silent_encoder),
        TEST(an_encoder_that_springs_back_raises_no_duty),
        TEST(an_open_loop_stops_the_motor_at_once),
        TEST(nothing_starts_with_an_open_loop),
        TEST(the_host_stops_the_motor_at_once),
        TEST(a_silent_host_is_a_soft_stop),
        TEST(keeping_on_starts_nothing),
        TEST(a_soft_stop_can_be_called_off),
        TEST(what_cannot_be_is_refused),
        BOARD_TEST(the_board_tells_how_the_drive_is),
        BOARD_TEST(the_drive_keeps_its_time_beside_the_scan),
        BOARD_TEST(the_drive_is_led_on_while_a_stream_ends),
        BOARD_TEST(what_holds_the_main_loop_up_waits_for_the_drive),
        BOARD_TEST(a_reset_takes_the_motors_power_first),
    };
    return cmocka_run_group_tests_name("drive", tests, NULL, NULL);
}
