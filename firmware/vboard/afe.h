// SPDX-License-Identifier: GPL-3.0-or-later
//
// The analog front end between the terminals and the ADC's pins: gain, output reference, limits of the
// amplifier's output and one pole per channel, and the bridges' reference derived from the excitation. The pole is integrated exactly over the
// straight lines between bench samples, so that sparse frames cost no accuracy.
#ifndef VBOARD_AFE_H
#define VBOARD_AFE_H

#include "ad7124.h"
#include "bench_input.h"
#include "random.h"

enum { AFE_PIN_COUNT = 16 };

typedef struct afe {
    const bench_input *input;
    random_source noise_source;
    double noise_volts[BOARD_CHANNEL_COUNT];
    double time_constant_ns[BOARD_CHANNEL_COUNT];
    double lowest_volts[BOARD_CHANNEL_COUNT];  // at the terminals: there the amplifier's output ends
    double highest_volts[BOARD_CHANNEL_COUNT];
    int channel_of_pin[AFE_PIN_COUNT];  // the channel whose signal is on this ADC pin, or -1
    double offset_of_pin[AFE_PIN_COUNT];
    double self_test_volts[BOARD_CHANNEL_COUNT];
    bool self_test;  // the accelerometer's pin is high

    uint64_t cursor;  // index of the sample at or before the filter's state
    bool settled;     // the first sample has been seen: the filter starts in its steady state
    double time_ns;
    double filtered[BOARD_CHANNEL_COUNT];  // terminal volts behind the pole, at time_ns
    uint64_t starved;
} afe;

void afe_init(afe *front_end, const bench_input *input, const double noise_volts[],
              const double self_test_volts[], uint64_t seed);

// The self-test pin changes, for what comes after the instant that afe_advance was given last.
void afe_self_test(afe *front_end, bool on);

// Brings the filters to an instant; instants must not decrease, here and below. Returns whether the input there
// is known, not held.
bool afe_advance(afe *front_end, double time_ns);

// The ADC's view at an instant, in volts against AVSS: two of its pins, 17 = AVSS, with the noise of one
// conversion on the positive one; and the reference REFIN1, whose negative pin is AVSS.
ad7124_pair afe_pin_volts(afe *front_end, unsigned positive, unsigned negative, double time_ns);
ad7124_pair afe_refin1_volts(afe *front_end, double time_ns);

#endif
