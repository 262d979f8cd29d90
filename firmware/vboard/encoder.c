// SPDX-License-Identifier: GPL-3.0-or-later
#include "encoder.h"

#include <math.h>

// Edges that a jump in the angle would put at one instant are spread: no encoder gives them faster, and
// a decoder must see one line change at a time.
static const double MINIMUM_SPACING_NS = 20e3;

void encoder_init(encoder *self, const bench_input *input, int which, uint32_t counts_per_revolution)
{
    *self = (encoder){
        .input = input,
        .which = which,
        .counts_per_rad = counts_per_revolution / (2.0 * 3.14159265358979323846),
        .last_edge_ns = -MINIMUM_SPACING_NS,
    };
}

void encoder_restart(encoder *self)
{
    self->follows = false;
    self->cursor = self->input->end;
}

// The angle of a sample in counts of this encoder.
static double position(const encoder *self, const bench_sample *sample)
{
    return sample->angle_rad[self->which] * self->counts_per_rad;
}

bool encoder_next_edge(encoder *self, double *time_ns, int *direction)
{
    const bench_input *input = self->input;
    if (!self->follows) {
        if (self->cursor >= input->end)
            return false;
        self->cursor = input->end - 1;  // the new bench's sample, not a value held before it
        self->offset = floor(position(self, bench_input_at(input, self->cursor))) - (double)self->counts;
        self->follows = true;
    }
    while (self->cursor + 1 < input->end) {
        const bench_sample *from = bench_input_at(input, self->cursor);
        const bench_sample *to = bench_input_at(input, self->cursor + 1);
        double start = position(self, from), end = position(self, to);
        double count = (double)self->counts + self->offset;
        double target = floor(end);
        if (count == target) {
            self->cursor++;
            continue;
        }
        *direction = target > count ? 1 : -1;
        // Rising, the count changes on reaching count + 1; falling, on leaving count.
        double threshold = *direction > 0 ? count + 1.0 : count;
        double fraction = end == start ? 0.0 : (threshold - start) / (end - start);
        double crossing = from->time_ns + fmin(fmax(fraction, 0.0), 1.0) * (to->time_ns - from->time_ns);
        *time_ns = fmax(crossing, self->last_edge_ns + MINIMUM_SPACING_NS);
        return true;
    }
    return false;
}

void encoder_step(encoder *self, double time_ns, int direction)
{
    self->counts += direction;
    self->edges++;
    self->last_edge_ns = time_ns;
}
