// SPDX-License-Identifier: GPL-3.0-or-later
//
// The virtual board's interface: the firmware binary in an emulated ATmega2560, with an AD7124-8 on
// its SPI bus, two quadrature encoders on its pins and a host on its UART.
//
// A board has no clock of its own: vb_run_until() runs it up to an instant. All times are int64
// nanoseconds on the caller's scale; the board starts at options.start_ns. One thread per board.
#ifndef VBOARD_H
#define VBOARD_H

#include <stddef.h>
#include <stdint.h>

#include "board_protocol.h"

#ifdef __cplusplus
extern "C" {
#endif

#define VB_API __attribute__((visibility("default")))

typedef struct vb_board vb_board;

// The crank's motor and what it moves; see crank_motor.h. Seen from the crank where nothing else is said.
typedef struct vb_motor {
    double supply_v;
    double resistance_ohm;     // armature, field and driver
    double inductance_h;
    double flux_v_s_a;         // back EMF per motor speed and current; torque per current squared
    double gear_ratio;         // motor turns per turn of the crank
    double gear_efficiency;    // when the motor drives
    double inertia_kg_m2;      // the rotor's through the gear, and the crank's
    double friction_n_m;       // while it turns
    double breakaway_n_m;      // friction at standstill, not less
    double damping_n_m_s;
    double crank_radius_m;
    double rod_length_m;       // longer than the radius
    double tow_weight_n;       // in water, at the slider
    double tow_drag_n_s2_m2;   // against the slider's heave
    double tow_mass_kg;        // that heaves with the slider, added mass included
} vb_motor;

enum { VB_CRANK_BENCH = 0, VB_CRANK_MOTOR = 1 };

// What a reset starts: the firmware (a board whose fuses say so), or Arduino's bootloader; see bootloader.h.
enum { VB_BOOTLOADER_NONE = 0, VB_BOOTLOADER_SHIPPED = 1, VB_BOOTLOADER_OLD = 2 };

// What the rising edge of the ADC's SYNC does to its sequence of channels; the data sheet leaves both open.
enum { VB_SEQUENCE_BEGINS_ANEW = 0, VB_SEQUENCE_GOES_ON = 1 };

typedef struct vb_options {
    uint32_t size;                            // sizeof(vb_options): a caller built for another layout is refused
    uint32_t crank_counts_per_revolution;     // after ×4 decoding
    uint32_t carriage_counts_per_revolution;  // after ×4 decoding
    int64_t start_ns;                         // the board's power-on on the caller's time scale
    uint64_t seed;                            // of noise, faults and the RAM's content at power-on
    double clock_ppm;                         // the board's crystal runs this much fast
    double adc_clock_ppm;                     // the ADC's internal oscillator runs this much fast
    double noise_volts[BOARD_CHANNEL_COUNT];  // standard deviation of one conversion, at the ADC input
    double self_test_volts[BOARD_CHANNEL_COUNT];  // added at the terminals while the self-test pin is high
    uint32_t crank;                           // what turns it: VB_CRANK_BENCH, the bench's frames, or VB_CRANK_MOTOR
    vb_motor motor;
    uint32_t bootloader;                      // one of VB_BOOTLOADER_…
    uint32_t adc_sequence;                    // one of VB_SEQUENCE_…
    const char *eeprom_path;                  // file that is the EEPROM, made if missing; NULL: a blank one
} vb_options;

// Faults are off when zero. Rates are probabilities.
typedef struct vb_faults {
    uint32_t spi_error_one_in;       // one ADC read transaction in this many has a bit flipped
    uint32_t adc_silent;             // not 0: the ADC neither answers nor converts
    double serial_bit_error_rate;    // per data bit, both directions
    double serial_byte_drop_rate;    // per byte, both directions; 1 = cable pulled
    double serial_byte_double_rate;  // per byte, both directions
    uint32_t emergency_stop_open;    // not 0: the button is pressed, or its wire broken
    uint32_t crank_blocked;          // not 0: the motor cannot turn it
    uint32_t crank_encoder_silent;   // not 0: its lines stand still
    uint32_t tow_parted;             // not 0: the slider moves alone
    uint32_t crank_encoder_unplugged;  // not 0: both lines go up, as their pull-ups have it
    uint32_t crank_track_a_dead;     // not 0: the line stays as it is
    uint32_t crank_track_b_dead;
    uint32_t crank_encoder_reversed; // not 0: A and B are exchanged
    double crank_encoder_slip;       // share of the crank's turning that its encoder does not follow, 0 to 1
    uint32_t driver_shorted;         // not 0: the motor has its supply, whatever the pins say
    double crank_driven_n_m;         // torque that turns the crank on from outside, at least 0
} vb_faults;

typedef struct vb_counters {
    uint64_t bench_frames;            // accepted
    uint64_t bench_frames_malformed;  // wrong size or magic, numbers not finite, or more than a day ahead
    uint64_t bench_frames_late;       // for an instant that the board or an earlier frame has passed
    uint64_t conversions;             // of the ADC, all channels
    uint64_t conversions_starved;     // of bench inputs, outside the frames received until then
    uint64_t conversions_out_of_range;  // with a pin or the reference beyond the ADC's guaranteed limits
    uint64_t bytes_from_host;
    uint64_t bytes_to_host;
    uint64_t resets;                  // after the first power-on
    int64_t crank_counts;             // net edges put on the pins since power-on
    int64_t carriage_counts;
    double motor_duty;                // 0 to 1: what the pins say; 0 without the enable line
    double motor_current_a;
    double crank_rate_rad_s;          // by the motor
    double crank_angle_rad;           // likewise, since power-on
    uint64_t crank_edges;
    uint64_t carriage_edges;
    uint64_t spi_misuse;              // bytes in a wrong SPI mode, too fast, or SYNC pulses too short
    uint64_t spi_errors_injected;
    uint64_t serial_bits_flipped;
    uint64_t serial_bytes_dropped;
    uint64_t serial_bytes_doubled;
} vb_counters;

enum { VB_FRAME_ACCEPTED = 0, VB_FRAME_LATE = 1, VB_FRAME_MALFORMED = 2 };

// Nominal values from board.yaml: noise on, seed 1, clocks exact, 4096 counts per revolution, blank EEPROM.
VB_API void vb_default_options(vb_options *options);

// Powers a board on with the firmware of an ELF file. NULL on failure, with one line in `error`.
VB_API vb_board *vb_open(const char *elf_path, const vb_options *options, char *error, size_t error_size);
VB_API void vb_close(vb_board *board);

// Takes one bench frame (the layout of board.yaml). The terminals see straight lines between frames.
// Returns one of VB_FRAME_…; frames that are not accepted change nothing but a counter.
VB_API int vb_push_bench(vb_board *board, const void *frame, size_t size);

// Another bench takes over: its first frame moves no encoder.
VB_API void vb_restart_bench(vb_board *board);

// Runs the board up to an instant. -1 if the firmware has stopped for good (see vb_stop_reason).
VB_API int vb_run_until(vb_board *board, int64_t time_ns);
VB_API int64_t vb_now_ns(const vb_board *board);
VB_API const char *vb_stop_reason(const vb_board *board);

// The serial line. Bytes written go out at once after another at 250 kbaud; bytes read have left the board.
VB_API size_t vb_write(vb_board *board, const uint8_t *bytes, size_t count);
VB_API size_t vb_read(vb_board *board, uint8_t *bytes, size_t capacity);

// Resets for one of BOARD_RESET_CAUSE_…; the ADC loses its power with POWER_ON and BROWN_OUT.
// -1 for another cause.
VB_API int vb_reset(vb_board *board, uint8_t cause);
// The ADC's supply dips: it resets itself, and the microcontroller runs on.
VB_API void vb_dip_adc_supply(vb_board *board);
// A bit of one of the ADC's registers flips. -1 for a register that cannot be written, or no bit of it.
VB_API int vb_flip_adc_bit(vb_board *board, uint8_t address, uint8_t bit);

// The processor goes wrong, as in a disturbance: VB_HANGS, it is in an endless loop and interrupts go on;
// VB_CRASHES, the same with interrupts off; VB_STRAY_INTERRUPT, one comes that the firmware never enabled.
// -1 for something else, or if the firmware has no endless loop.
enum { VB_HANGS = 0, VB_CRASHES = 1, VB_STRAY_INTERRUPT = 2 };
VB_API int vb_disturb(vb_board *board, int how);
VB_API void vb_set_faults(vb_board *board, const vb_faults *faults);
VB_API void vb_set_clock_ppm(vb_board *board, double clock_ppm);
VB_API void vb_get_counters(const vb_board *board, vb_counters *counters);

// Sets bytes of a variable of the firmware, for runs that begin near the end of a counter. -1, and nothing
// changed, if the ELF file has no such variable, more than one, or a shorter one.
VB_API int vb_preset(vb_board *board, const char *variable, size_t offset, const uint8_t *bytes, size_t count);

#ifdef __cplusplus
}
#endif
#endif
