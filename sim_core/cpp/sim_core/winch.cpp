// SPDX-License-Identifier: Apache-2.0
#include "winch.hpp"

#include <algorithm>
#include <cmath>

namespace sim_core {

int Winch::drum_segments(double paid_out) const {
    const double wound = (longest() - paid_out) / segment_length;
    return std::clamp(static_cast<int>(std::ceil(wound - 0.5)), 0, segments - 1);
}

double WinchState::changing_length(const Winch& winch) const {
    const double nominal = paid_out - winch.longest() + (drum + 1) * winch.segment_length;
    const double share = 1.0 - std::abs(paid_out - excess_at) / (0.5 * winch.segment_length);
    return nominal + excess * std::max(0.0, share);
}

void set_changing_segment(const SegmentConstants& nominal, double length, double rate, SegmentConstants& changing) {
    const double ratio = length / nominal.length;
    changing = nominal;
    changing.length = length;
    changing.length_rate = rate;
    for (double* distributed : {&changing.half_mass, &changing.half_weight, &changing.half_buoyancy,
                                &changing.half_normal_drag, &changing.half_tangential_drag, &changing.half_lift,
                                &changing.half_added_mass, &changing.half_tangential_added_mass,
                                &changing.half_displaced_mass}) {
        *distributed *= ratio;
    }
}

}  // namespace sim_core
