// SPDX-License-Identifier: GPL-3.0-or-later
#include "afe.h"

#include <math.h>

static const double gain[] = BOARD_AFE_GAIN;
static const double output_reference_volts[] = BOARD_AFE_OUTPUT_REFERENCE_VOLTS;
static const double output_minimum_volts[] = BOARD_AFE_OUTPUT_MINIMUM_VOLTS;
static const double output_maximum_volts[] = BOARD_AFE_OUTPUT_MAXIMUM_VOLTS;
static const double pole_hz[] = BOARD_AFE_POLE_HZ;
static const uint16_t channel_register[] = BOARD_ADC_CHANNELS_REGISTERS;

void afe_init(afe *front_end, const bench_input *input, const double noise_volts[],
              const double self_test_volts[], uint64_t seed)
{
    *front_end = (afe){.input = input, .noise_source = random_stream(seed, 1)};
    for (int pin = 0; pin < AFE_PIN_COUNT; pin++)
        front_end->channel_of_pin[pin] = -1;
    for (unsigned i = 0; i < BOARD_CHANNEL_COUNT; i++) {
        front_end->noise_volts[i] = noise_volts[i];
        front_end->self_test_volts[i] = self_test_volts[i];
        front_end->time_constant_ns[i] = 1e9 / (2.0 * 3.14159265358979323846 * pole_hz[i]);
        front_end->lowest_volts[i] = (output_minimum_volts[i] - output_reference_volts[i]) / gain[i];
        front_end->highest_volts[i] = (output_maximum_volts[i] - output_reference_volts[i]) / gain[i];
        // Which pins a channel uses stands in its CHANNEL register.
        unsigned positive = channel_register[i] >> 5 & 0x1F;
        unsigned negative = channel_register[i] & 0x1F;
        front_end->channel_of_pin[positive] = (int)i;
        front_end->offset_of_pin[positive] = output_reference_volts[i];
        if (negative < AFE_PIN_COUNT)
            front_end->offset_of_pin[negative] = output_reference_volts[i];
    }
}

void afe_self_test(afe *front_end, bool on)
{
    front_end->self_test = on;
}

// The response of dy/dt = (u - y)/τ to u(t) = u0 + slope·t, from y0 at t = 0.
static double pole_response(double y0, double u0, double slope, double tau, double t)
{
    double lag = slope * tau;
    return u0 + slope * t - lag + (y0 - u0 + lag) * exp(-t / tau);
}

// The same for an input that stops at two limits, from one crossing of a limit to the next.
static double limited_response(double y, double u, double slope, double tau, double duration, double low,
                               double high)
{
    while (duration > 0.0) {
        bool below = u < low || (u == low && slope < 0.0);
        bool above = u > high || (u == high && slope > 0.0);
        double limit = below ? low : above ? high : slope < 0.0 ? low : high;
        double crossing = slope == 0.0 ? INFINITY : (limit - u) / slope;
        double step = crossing > 0.0 && crossing < duration ? crossing : duration;
        y = below || above ? pole_response(y, limit, 0.0, tau, step) : pole_response(y, u, slope, tau, step);
        u = limit;
        duration -= step;
    }
    return y;
}

// Moves the filters along one straight piece of input, from `from` towards `to` (NULL: held for ever).
static void integrate(afe *front_end, const bench_sample *from, const bench_sample *to, double until_ns)
{
    double start = front_end->time_ns - from->time_ns;
    double step = until_ns - front_end->time_ns;
    for (unsigned i = 0; i < BOARD_CHANNEL_COUNT; i++) {
        double slope = to ? (to->volts[i] - from->volts[i]) / (to->time_ns - from->time_ns) : 0.0;
        double u0 = from->volts[i] + slope * start;
        if (front_end->self_test)
            u0 += front_end->self_test_volts[i];
        front_end->filtered[i] =
            limited_response(front_end->filtered[i], u0, slope, front_end->time_constant_ns[i], step,
                             front_end->lowest_volts[i], front_end->highest_volts[i]);
    }
    front_end->time_ns = until_ns;
}

bool afe_advance(afe *front_end, double time_ns)
{
    const bench_input *input = front_end->input;
    if (input->end == input->first)
        return false;
    if (!front_end->settled) {
        const bench_sample *sample = bench_input_at(input, input->first);
        for (unsigned i = 0; i < BOARD_CHANNEL_COUNT; i++)
            front_end->filtered[i] =
                fmin(fmax(sample->volts[i], front_end->lowest_volts[i]), front_end->highest_volts[i]);
        front_end->cursor = input->first;
        front_end->time_ns = sample->time_ns;
        front_end->settled = true;
    }
    if (time_ns < front_end->time_ns)  // before the first sample; later instants never decrease
        return false;
    for (;;) {
        const bench_sample *from = bench_input_at(input, front_end->cursor);
        bool last = front_end->cursor + 1 == input->end;
        const bench_sample *to = last ? NULL : bench_input_at(input, front_end->cursor + 1);
        if (last || to->time_ns >= time_ns) {
            integrate(front_end, from, to, time_ns);
            return !last || from->time_ns >= time_ns;
        }
        if (to->time_ns > front_end->time_ns)
            integrate(front_end, from, to, to->time_ns);
        front_end->cursor++;
    }
}

static double pin_volts(const afe *front_end, unsigned pin)
{
    if (pin >= AFE_PIN_COUNT)
        return 0.0;  // AVSS
    int channel = front_end->channel_of_pin[pin];
    double signal = channel < 0 ? 0.0 : gain[channel] * front_end->filtered[channel];
    return front_end->offset_of_pin[pin] + signal;
}

ad7124_pair afe_pin_volts(afe *front_end, unsigned positive, unsigned negative, double time_ns)
{
    if (!afe_advance(front_end, time_ns))
        front_end->starved++;
    ad7124_pair volts = {pin_volts(front_end, positive), pin_volts(front_end, negative)};
    int channel = positive < AFE_PIN_COUNT ? front_end->channel_of_pin[positive] : -1;
    if (channel >= 0)
        volts.positive += front_end->noise_volts[channel] * random_normal(&front_end->noise_source);
    return volts;
}

ad7124_pair afe_refin1_volts(afe *front_end, double time_ns)
{
    afe_advance(front_end, time_ns);
    double volts = BOARD_ADC_REFIN1_PER_EXCITATION * front_end->filtered[BOARD_CHANNEL_EXCITATION];
    return (ad7124_pair){volts, 0.0};
}
