// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "simulator.hpp"

namespace sim_core {

/// What a run leaves: one row per sample, row-major.
struct Recording {
    std::vector<double> time;          ///< samples
    /// samples × entries × 3, entries as in State: sites, then translation and rotation of each body. The
    /// rotation entry of `position` is unused (zero); see attitude.
    std::vector<double> position, velocity, acceleration;
    std::vector<double> attitude;      ///< samples × bodies × 4: w, x, y, z
    std::vector<double> tension;       ///< samples × segments, N
    std::vector<double> hook_load;     ///< samples × prescribed points × 3, N
    std::vector<double> end_tension;   ///< samples × lines × 2, N
    /// samples × nodes of the lines with bending stiffness, one line after the other: N·m and 1/m
    std::vector<double> bending_moment, curvature;
    std::vector<EnergyBalance> energy;      ///< samples, if the simulator counts balances; else empty
    std::vector<MomentumBalance> momentum;  ///< likewise
    std::vector<double> paid_out;      ///< samples × winches, m
};

/// Steps to `t_end` and records at the present time and every `output_step` after it (the last sample is at t_end).
Recording record_run(Simulator& simulator, const Motions& motions, double t_end, double output_step);

}  // namespace sim_core
