// SPDX-License-Identifier: Apache-2.0
// The constant description of a towed system, and the builder that makes it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "block_solver.hpp"
#include "body.hpp"
#include "line.hpp"
#include "point.hpp"
#include "segment.hpp"
#include "tank.hpp"
#include "types.hpp"
#include "water.hpp"
#include "winch.hpp"

namespace sim_core {

/// Every place where forces on translations are gathered is a *site*: free nodes first, then prescribed points,
/// then the places on bodies: where lines are attached, and what of the hull may touch the tank.
struct Model {
    struct Point {
        std::string name;
        int site;
        bool prescribed;
        FreePoint properties;
    };
    struct BodyEntry {
        std::string name;
        BodyForce force;
    };
    struct Attachment {
        int body;
        Vec3 place;  ///< body axes, m
    };
    struct Line {
        std::string name;
        std::vector<LineSection> sections;
        int first_segment;
        int segments;
        std::vector<int> sites;  ///< from start to end, segments + 1
        LineEnd ends[2];         ///< as they were described
        std::vector<int> bends = {};  ///< per site, into Model::bends; −1 where the line holds no moment
        int clamps[2] = {-1, -1};  ///< of start and end, into Model::clamps

        bool bends_anywhere() const {
            return std::any_of(sections.begin(), sections.end(),
                               [](const LineSection& s) { return s.properties.bending_stiffness > 0.0; });
        }
    };
    struct Segment {
        int constants;  ///< into segment_constants
        int site[2];
        /// Slots of the 3×3 blocks of the Jacobian: [row][column] over (end a: translation, rotation; end b:
        /// translation, rotation); −1 where an end has no such unknown.
        int slot[4][4];
    };
    /// Torsion spring at an inner node of a line with bending stiffness.
    struct Bend {
        double stiffness;  ///< N·m/rad
        double length;     ///< of line that its angle belongs to, unstretched, m
        int site[3];       ///< the node and its neighbours, along the line
        int slot[6][6];    ///< as in Segment, over three sites
    };
    /// Torsion spring at the clamped end of a line.
    struct Clamp {
        double stiffness;  ///< N·m/rad
        double length;     ///< of line that its angle belongs to, unstretched, m
        Vec3 direction;    ///< unit vector from the end into the line; in body axes at a body, else in tank axes
        int site[2];       ///< the end and its neighbour
        int slot[4][4];
    };

    /// Ball joint: a stiff spring and a dashpot between two places, which may both turn about it.
    struct Joint {
        std::string name;
        LineEnd ends[2];   ///< as they were described
        double stiffness;  ///< N/m
        double damping;    ///< N·s/m
        int site[2];
        int slot[4][4];

        /// What it pulls the first place with, N.
        Vec3 pull(const Vec3& position_a, const Vec3& position_b, const Vec3& velocity_a, const Vec3& velocity_b) const {
            return stiffness * (position_b - position_a) + damping * (velocity_b - velocity_a);
        }
    };

    /// What may touch the tank, as a sphere.
    struct ContactPlace {
        std::string name;
        int site;
        ContactSize size;
    };

    Water water;
    std::vector<Point> points;
    std::vector<BodyEntry> bodies;
    std::vector<Attachment> attachments;
    std::vector<Line> lines;
    std::vector<Segment> segments;
    std::vector<SegmentConstants> segment_constants;  ///< one for each section of each line
    std::vector<Bend> bends;    ///< none for lines without bending stiffness
    std::vector<Clamp> clamps;
    std::vector<Joint> joints;
    std::vector<Winch> winches;

    std::optional<Tank> tank;
    std::vector<TankSide> tank_sides;           ///< none without a tank
    std::vector<ContactPlace> contact_places;  ///< likewise

    int free_sites = 0;
    int prescribed_sites = 0;
    int sites() const { return free_sites + prescribed_sites + static_cast<int>(attachments.size()); }
    bool is_free(int site) const { return site < free_sites; }
    bool is_attached(int site) const { return site >= free_sites + prescribed_sites; }
    int attachment_of(int site) const { return site - free_sites - prescribed_sites; }
    int first_attached_site() const { return free_sites + prescribed_sites; }

    /// Unknowns come in blocks of three: free sites, then per body its translation and its rotation.
    int blocks() const { return free_sites + 2 * static_cast<int>(bodies.size()); }
    int translation_block(int body) const { return free_sites + 2 * body; }
    int rotation_block(int body) const { return free_sites + 2 * body + 1; }

    BlockStructure structure;
    double force_scale = 1.0;        ///< N: weight in air of everything, the measure for residuals
    double stiffest_segment = 0.0;   ///< largest stiffness of a node against one segment or spring, N/m
    std::uint64_t fingerprint = 0;   ///< of the whole description: a saved state is not restored into another model

    int point_index(const std::string& name) const;
    int body_index(const std::string& name) const;
    int line_index(const std::string& name) const;
    const Point& prescribed_point(int i) const;
    /// The winch at a line's start; throws InvalidInput if there is none.
    int winch_index(const std::string& line_name) const;

    /// Where a block of unknowns is, in words for error messages.
    std::string describe_block(int block) const;
};

class ModelBuilder {
  public:
    explicit ModelBuilder(const Water& water);

    void add_prescribed_point(const std::string& name);
    void add_free_point(const std::string& name, const FreePoint& point);
    void add_body(const std::string& name, const Body& body);
    /// One or more sections, from the start to the end.
    void add_line(const std::string& name, const LineEnd& start, const LineEnd& end,
                  const std::vector<LineSection>& sections);

    /// Holds two places together (each a point or on a body, without a direction), N/m and N·s/m.
    void add_joint(const std::string& name, const LineEnd& start, const LineEnd& end, double stiffness, double damping);

    /// Puts the system into a tank. Throws InvalidInput.
    void set_tank(const Tank& tank);

    /// Puts a winch at the start of a line, with `paid_out` (m, unstretched) of it out in a new state. The
    /// line's first section can be wound up to half its last segment.
    void add_winch(const std::string& line, double paid_out);

    /// Throws InvalidInput if parts are missing or not connected to a prescribed point.
    Model build() const;

  private:
    struct PointEntry {
        std::string name;
        bool prescribed;
        FreePoint properties;
    };
    struct NamedBody {
        std::string name;
        Body body;
    };
    struct LineEntry {
        std::string name;
        LineEnd ends[2];
        std::vector<LineSection> sections;
        std::optional<double> paid_out;  ///< m; where there is a winch
    };

    struct JointEntry {
        std::string name;
        LineEnd ends[2];
        double stiffness, damping;
    };

    void require_end(const LineEnd& end, bool first, const std::string& where) const;
    bool has_point(const std::string& name) const;
    bool has_body(const std::string& name) const;
    void require_new_name(const std::string& name) const;

    Water water_;
    std::vector<PointEntry> points_;
    std::vector<NamedBody> bodies_;
    std::vector<LineEntry> lines_;
    std::vector<JointEntry> joints_;
    std::optional<Tank> tank_;
};

}  // namespace sim_core
