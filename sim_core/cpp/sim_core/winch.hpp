// SPDX-License-Identifier: Apache-2.0
// A line that is wound on a drum at its start, which is a prescribed point.
//
// The model has the segments of the longest line. Those on the drum are at rest there: their nodes ride with the
// prescribed point. The segment that leaves the drum has a changing unstretched length of ½ to 1½ of the others', ℓ; beyond
// that, a node is released or taken in between two steps.
//
// Material points move with the nodes, and at the drum with the velocity of the drum's rim: the force of inertia of
// a half segment at a node is its mass times the node's own acceleration, and of what enters or leaves the line only
// the winch feels the momentum. The changing length enters the tension, the line's half of what is distributed over
// the segment, and the rate of strain.
#pragma once

#include "segment.hpp"

namespace sim_core {

/// Of a Model.
struct Winch {
    int line;
    int first_segment;     ///< of the line
    int segments;          ///< that the drum can take up: the line's first section
    double segment_length; ///< ℓ of those, unstretched, m
    double beyond;         ///< unstretched length of the rest of the line, m
    double initial;        ///< length out in a new state, m

    double shortest() const { return beyond + 0.5 * segment_length; }
    double longest() const { return beyond + segments * segment_length; }

    /// How many segments are on the drum when `paid_out` is out and nothing else is known.
    int drum_segments(double paid_out) const;
};

/// Of a State.
struct WinchState {
    double paid_out = 0.0;  ///< unstretched length that is out, m
    double rate = 0.0;      ///< m/s
    int drum = 0;           ///< segments on the drum; the next one is the changing one
    /// Where a node is taken in, the line's polygon loses a corner and gets shorter. So that the tension does not jump, the
    /// changing segment gets the same change of unstretched length, and gives it back over the next ℓ/2 of line.
    double excess = 0.0;    ///< m, when the last node was taken in
    double excess_at = 0.0; ///< m, the length out at that time

    /// Unstretched length of the changing segment, m.
    double changing_length(const Winch& winch) const;
};

/// Constants of the changing segment, from those of the same material of another length.
void set_changing_segment(const SegmentConstants& nominal, double length, double rate, SegmentConstants& changing);

}  // namespace sim_core
