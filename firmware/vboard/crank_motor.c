// SPDX-License-Identifier: GPL-3.0-or-later
#include "crank_motor.h"

#include <math.h>

// Load at the crank without the slider's inertia, and that inertia, at an angle and rate.
static double tow_load(const vb_motor *p, double angle, double rate, double *inertia)
{
    double cosine = cos(angle), radius = p->crank_radius_m;
    double root = sqrt(p->rod_length_m * p->rod_length_m - radius * radius * cosine * cosine);
    double sine = sin(angle);
    double slope = radius * cosine + radius * radius * cosine * sine / root;
    // h'': of r sin φ, and of the root
    double numerator = radius * radius * (cosine * cosine - sine * sine);
    double curvature = -radius * sine + numerator / root -
                       pow(radius * radius * cosine * sine, 2) / (root * root * root);
    double speed = slope * rate;
    *inertia = p->tow_mass_kg * slope * slope;
    return slope * (p->tow_weight_n + p->tow_drag_n_s2_m2 * speed * fabs(speed) +
                    p->tow_mass_kg * curvature * rate * rate);
}

void crank_motor_advance(crank_motor *self, double duty, bool blocked, bool parted, double driven_n_m, double seconds)
{
    const vb_motor *p = &self->parameters;
    // The current's equation is linear in it as long as the motor's speed stands
    double resistance = p->resistance_ohm + p->flux_v_s_a * p->gear_ratio * self->rate_rad_s;
    double final = duty * p->supply_v / resistance;
    self->current_a = final + (self->current_a - final) * exp(-seconds * resistance / p->inductance_h);

    double tow_inertia = 0.0;
    double load = parted ? 0.0 : tow_load(p, self->angle_rad, self->rate_rad_s, &tow_inertia);
    load *= load > 0.0 ? 1.0 / p->gear_efficiency : 2.0 - 1.0 / p->gear_efficiency;
    double drive = p->gear_ratio * p->flux_v_s_a * self->current_a * self->current_a + driven_n_m;
    double friction = self->rate_rad_s > 0.0 ? p->friction_n_m + p->damping_n_m_s * self->rate_rad_s
                                             : fmax(p->breakaway_n_m, p->friction_n_m);
    double inertia = p->inertia_kg_m2 + tow_inertia;
    double rate = self->rate_rad_s + (drive - load - friction) / inertia * seconds;
    self->rate_rad_s = blocked ? 0.0 : fmax(rate, 0.0);
    self->angle_rad += self->rate_rad_s * seconds;
}
