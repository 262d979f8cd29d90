// SPDX-License-Identifier: GPL-3.0-or-later
//
// A series-wound DC motor behind a worm gear, which turns the crank of a slider that heaves the tow.
// Driven by a chopper in one quadrant: full supply for the duty, else the current runs on through a
// diode. The chopper's ripple is left out: the current's time constant is ten of its periods.
//
//   L di/dt = duty · U − (R + k ω_m) i,  i ≥ 0           field and armature in series: flux ∝ i
//   J dω/dt = n k i² − load − friction,  ω ≥ 0           at the crank; ω_m = n ω
//   h(φ) = r sin φ + √(l² − r² cos² φ)                   height of the slider, φ = 0: crank horizontal
//   load = h'(φ) (W + c h'ω |h'ω| + m d(h'ω)/dt)         the last part with its inertia in J
//
// A crank that stands moves when drive less load exceeds the friction at standstill.
//
// A worm gear of efficiency η passes a load on as load/η, and one that would drive it as
// load · (2 − 1/η): with η ≤ 0.5 it holds by itself. So the crank never turns backwards.
#ifndef VBOARD_CRANK_MOTOR_H
#define VBOARD_CRANK_MOTOR_H

#include <stdbool.h>

#include "vboard.h"

typedef struct crank_motor {
    vb_motor parameters;
    double current_a;
    double angle_rad;    // of the crank
    double rate_rad_s;
} crank_motor;

// Lets time pass with this duty (0 to 1). A blocked crank stands; a parted tow loads nothing; driven_n_m turns
// it on from outside.
void crank_motor_advance(crank_motor *self, double duty, bool blocked, bool parted, double driven_n_m, double seconds);

#endif
