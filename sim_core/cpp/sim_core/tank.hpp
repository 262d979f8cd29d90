// SPDX-License-Identifier: Apache-2.0
// Floor and walls of a tank: what touches them is pushed back, and the contact is reported.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "types.hpp"

namespace sim_core {

struct Model;
struct State;

/// A tank with level floor and upright walls, as far as they are given.
///
/// Each place that may touch (a node of a line, a free point, nose, middle and tail of a body's hull) is a sphere with the
/// radius of what is there. At a depth δ of the sphere behind the wall the wall pushes with
///   N = k δ (1 + a δ̇), never pulling    (Hunt & Crossley 1975, J. Appl. Mech. 42, 440–445, with a linear spring)
/// rounded off to zero within ±onset of δ = 0, and rubs with μ N against sliding faster than about `sliding_speed`.
struct Tank {
    std::optional<double> floor;                    ///< z, m
    std::optional<double> width;                    ///< m: walls at y = ± half of it
    std::optional<std::pair<double, double>> ends;  ///< x of the aft and the forward end wall, m
    double stiffness = 0.0;       ///< k, N/m, of each place that touches
    /// Of the floor, Pa/m, in addition: the modulus of subgrade reaction, k per area that a place presses on it.
    double bed_stiffness = 0.0;
    double damping = 0.0;         ///< a, s/m
    double friction = 0.0;        ///< μ
    double onset = 1e-3;          ///< m
    double sliding_speed = 0.01;  ///< m/s
};

/// A wall or the floor: its inner side is where normal · position > offset.
struct TankSide {
    const char* name;
    Vec3 normal;
    double offset;  ///< m
    double bed_stiffness;  ///< Pa/m
};

/// The sides that a tank has. Throws InvalidInput if the description is impossible.
std::vector<TankSide> tank_sides(const Tank& tank);

/// A sphere that may touch: its radius (m), and the area (m²) that it presses on a bed, that of the part which it stands for.
struct ContactSize {
    double radius, area;
};

/// What the tank does to a sphere, with its derivatives with respect to position and velocity.
struct ContactForce {
    Vec3 force;  ///< N, tank axes
    Mat3 position, velocity;
};

void contact_force(const Tank& tank, const std::vector<TankSide>& sides, const ContactSize& size, const Vec3& position,
                   const Vec3& velocity, ContactForce& contact);

/// Something touched a side of the tank.
struct ContactEvent {
    int place;      ///< index into Model::contact_places
    int side;       ///< index into Model::tank_sides
    Vec3 position;  ///< of the sphere's centre when the contact was first seen, m
    double time;    ///< s, at the end of the step in which it was first seen
    double released;  ///< s, likewise; infinite while it lasts
};

/// Keeps a record of contacts from step to step. Holds at most `kMostEvents`, for which it has room from the start: nothing
/// is allocated while stepping. Further ones are only counted.
class ContactWatch {
  public:
    static constexpr std::size_t kMostEvents = 1000;

    explicit ContactWatch(const Model& model);

    /// Looks at a state, later than the one before.
    void look(const State& state);

    /// Forgets everything, as before the first state.
    void forget();

    const std::vector<ContactEvent>& events() const { return events_; }
    /// How many events found no room.
    long lost() const { return lost_; }

  private:
    static constexpr int kNone = -1, kLost = -2;
    std::vector<int> open_;  // per place and side: the event that lasts, or kNone
    std::vector<ContactEvent> events_;
    long lost_ = 0;
};

}  // namespace sim_core
