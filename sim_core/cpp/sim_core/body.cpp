// SPDX-License-Identifier: Apache-2.0
#include "body.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "error.hpp"
#include "rotation.hpp"

namespace sim_core {

namespace {

/// Force and moment in body axes with their derivatives with respect to everything they depend on, each a
/// 3×3 block: relative velocity, angular velocity, acceleration, angular acceleration (all body axes), turning of
/// the body at fixed tank-axes vectors, and place of the origin (tank axes) for what varies with the place.
struct WrenchWithDerivatives {
    Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
    Mat3 force_v = Mat3::Zero(), moment_v = Mat3::Zero();
    Mat3 force_w = Mat3::Zero(), moment_w = Mat3::Zero();
    Mat3 force_a = Mat3::Zero(), moment_a = Mat3::Zero();
    Mat3 force_alpha = Mat3::Zero(), moment_alpha = Mat3::Zero();
    Mat3 force_turn = Mat3::Zero(), moment_turn = Mat3::Zero();
    Mat3 force_place = Mat3::Zero(), moment_place = Mat3::Zero();

    /// Adds the cross-flow drag k |u| u of a strip that acts at x and moves with the body's rotation as at `arm`.
    void add_cross_flow(double x, double arm, double k, double u_y, double u_z) {
        const double speed = std::sqrt(u_y * u_y + u_z * u_z);
        const double drag_y = k * speed * u_y;
        const double drag_z = k * speed * u_z;
        force.y() += drag_y;
        force.z() += drag_z;
        moment.y() -= x * drag_z;
        moment.z() += x * drag_y;
        if (speed > 0.0) {
            const double yy = k * (speed + u_y * u_y / speed);
            const double yz = k * u_y * u_z / speed;
            const double zz = k * (speed + u_z * u_z / speed);
            // d(u_y, u_z)/dv = −1; d u_y/d w_z = −arm; d u_z/d w_y = arm
            force_v(1, 1) -= yy;
            force_v(1, 2) -= yz;
            force_v(2, 1) -= yz;
            force_v(2, 2) -= zz;
            force_w(1, 1) += arm * yz;
            force_w(1, 2) -= arm * yy;
            force_w(2, 1) += arm * zz;
            force_w(2, 2) -= arm * yz;
            moment_v(1, 1) += x * yz;
            moment_v(1, 2) += x * zz;
            moment_v(2, 1) -= x * yy;
            moment_v(2, 2) -= x * yz;
            moment_w(1, 1) -= x * arm * zz;
            moment_w(1, 2) += x * arm * yz;
            moment_w(2, 1) += x * arm * yz;
            moment_w(2, 2) -= x * arm * yy;
        }
    }

    /// Adds the derivatives of a force that acts at r and scales with an immersed fraction, of which `wet_place` is the
    /// derivative with respect to the place, and `wet_turn` that with respect to turning.
    void add_wetted(const Vec3& at, const Vec3& f, const Vec3& wet_place, const Vec3& wet_turn) {
        const Vec3 m = at.cross(f);
        force_place += f * wet_place.transpose();
        moment_place += m * wet_place.transpose();
        force_turn += f * wet_turn.transpose();
        moment_turn += m * wet_turn.transpose();
    }

    /// Adds the derivatives of a force and moment that depend on a vector of which the derivatives are given.
    void add_dependence(const Mat3& force_vector, const Mat3& moment_vector, const Mat3& place, const Mat3& turn) {
        force_place += force_vector * place;
        moment_place += moment_vector * place;
        force_turn += force_vector * turn;
        moment_turn += moment_vector * turn;
    }
};

/// What the water does along a hull in the mean over its strips, and how its acceleration turns along it. What the
/// added mass, the axial drag and a table see.
struct WaterAlongHull {
    WaterMotion mean;
    Mat3 velocity_turn = Mat3::Zero(), acceleration_turn = Mat3::Zero();  // of the means, per turning of the body
    /// Rate of the rotation that fits best to the water's accelerations across the hull, body axes; and its derivatives.
    Vec3 spin_rate = Vec3::Zero();
    Mat3 spin_rate_place = Mat3::Zero(), spin_rate_turn = Mat3::Zero();

    explicit WaterAlongHull(const WaterMotion& everywhere) : mean(everywhere) {}

    WaterAlongHull(const BodyForce& force, const std::vector<WaterMotion>& along, const Mat3& R) {
        const int strips = force.body().strips;
        const double share = 1.0 / strips;
        Vec3 first = Vec3::Zero();  // moments of the accelerations and their gradients about the origin
        Mat3 first_place = Mat3::Zero(), first_turn = Mat3::Zero();
        double second = 0.0;
        for (int i = 0; i < strips; ++i) {
            const WaterMotion& local = along[i];
            const Vec3 at = force.water_place(i);
            const Mat3 place_turn = -R * skew(at);
            mean.velocity += share * local.velocity;
            mean.acceleration += share * local.acceleration;
            mean.velocity_gradient += share * local.velocity_gradient;
            mean.acceleration_gradient += share * local.acceleration_gradient;
            const Mat3 acceleration_place = local.acceleration_gradient * place_turn;
            velocity_turn += share * local.velocity_gradient * place_turn;
            acceleration_turn += share * acceleration_place;
            first += at.x() * local.acceleration;
            first_place += at.x() * local.acceleration_gradient;
            first_turn += at.x() * acceleration_place;
            second += at.x() * at.x();
        }
        if (strips == 1) return;
        const Mat3 Rt = R.transpose();
        const Mat3 fit = skew(Vec3::UnitX()) / second;  // Σ x (e_x × a) / Σ x²
        const Vec3 seen = Rt * first;
        spin_rate = fit * seen;
        spin_rate_place = fit * Rt * first_place;
        spin_rate_turn = fit * (skew(seen) + Rt * first_turn);
    }
};

/// How the impulse of the added mass changes since the water's velocity varies over the hull, in Lagrange's equations with
/// the kinetic energy ½ (v, ω)·[M Dᵀ; D J] (v, ω), v and ω relative to the water: to its mean velocity over the strips, and
/// to the rotation that fits best to the velocities along the axis. Body axes throughout. See docs/theory.md.
class VaryingWater {
  public:
    VaryingWater(const BodyForce& force, const std::vector<WaterMotion>& along, const Mat3& R) {
        const int strips = force.body().strips;
        Mat3 gradients[3] = {Mat3::Zero(), Mat3::Zero(), Mat3::Zero()};  // mean of them, times x, times x²
        Mat3 curvatures[4][3];                                           // likewise, up to x³
        for (auto& power : curvatures) {
            for (Mat3& curvature : power) curvature.setZero();
        }
        Vec3 first = Vec3::Zero();
        double second = 0.0;
        for (int i = 0; i < strips; ++i) {
            const double x = force.water_place(i).x();
            double weight = 1.0 / strips;
            first += weight * x * along[i].velocity;
            second += weight * x * x;
            for (int power = 0; power < 4; ++power) {
                if (power < 3) gradients[power] += weight * along[i].velocity_gradient;
                for (int j = 0; j < 3; ++j) curvatures[power][j] += weight * along[i].velocity_curvature[j];
                weight *= x;
            }
        }
        const Mat3 Rt = R.transpose();
        inverse_second_ = strips > 1 ? 1.0 / second : 0.0;
        first_ = Rt * first;
        for (int power = 0; power < 4; ++power) {
            if (power < 3) gradient_[power] = Rt * gradients[power] * R;
            for (int j = 0; j < 3; ++j) {
                const Mat3(&of)[3] = curvatures[power];
                curvature_[power][j] = Rt * (R(0, j) * of[0] + R(1, j) * of[1] + R(2, j) * of[2]) * R;
            }
        }
    }

    /// Adds `share` of the force and moment, and `wet` times its derivatives, at a velocity v relative to the mean velocity u.
    void add(const Mat3& M, const Mat3& D, const Mat3& J, const Vec3& v, const Vec3& u, const Vec3& w, double share,
             double wet, const Mat3& v_place, const Mat3& v_turn, const Mat3& Rt, Vec3& force, Vec3& moment,
             WrenchWithDerivatives& s) const {
        const Vec3 e = Vec3::UnitX();
        const Mat3& A0 = gradient_[0];
        const Mat3& A1 = gradient_[1];
        const Mat3& A2 = gradient_[2];
        const Vec3 own = v + u;  // of the body
        const Vec3 tilt = w.cross(e);
        const Vec3 spin = inverse_second_ * e.cross(first_);  // of the water
        const Vec3 P = M * v + D.transpose() * (w - spin);
        const Vec3 Q = D * v + J * (w - spin);
        const Vec3 q = inverse_second_ * Q.cross(e);
        const Vec3 linear = D.transpose() * spin;
        const Vec3 angular = J * spin;
        // What the body's way through the water changes in u and spin
        const Vec3 u_rate = A0 * own + A1 * tilt;
        const Vec3 spin_rate = inverse_second_ * e.cross(A1 * own + A2 * tilt - w.cross(first_));
        force += share * (M * u_rate + D.transpose() * spin_rate - A0.transpose() * P - A1.transpose() * q + w.cross(linear));
        moment += share * (D * u_rate + J * spin_rate - e.cross(A1.transpose() * P + A2.transpose() * q) + first_.cross(q) +
                           w.cross(angular) + v.cross(linear));

        // Its change with that of own velocity, angular velocity, place (body axes) and attitude
        Mat3 force_by[4], moment_by[4];
        for (int column = 0; column < 12; ++column) {
            const int of = column / 3;
            const int j = column % 3;
            const Vec3 unit = Vec3::Unit(j);
            Vec3 d_own = Vec3::Zero(), d_w = Vec3::Zero(), d_first = Vec3::Zero(), d_u = Vec3::Zero();
            Mat3 d_A0 = Mat3::Zero(), d_A1 = Mat3::Zero(), d_A2 = Mat3::Zero();
            if (of == 0) d_own = unit;
            if (of == 1) d_w = unit;
            if (of == 2) {
                d_u = A0.col(j);
                d_first = A1.col(j);
                d_A0 = curvature_[0][j];
                d_A1 = curvature_[1][j];
                d_A2 = curvature_[2][j];
            }
            if (of == 3) {
                const Vec3 shift = unit.cross(e);  // of a place on the axis, per x
                d_own = own.cross(unit);
                d_u = A1 * shift - unit.cross(u);
                d_first = A2 * shift - unit.cross(first_);
                d_A0 = turned(0, shift, unit);
                d_A1 = turned(1, shift, unit);
                d_A2 = turned(2, shift, unit);
            }
            const Vec3 d_v = d_own - d_u;
            const Vec3 d_tilt = d_w.cross(e);
            const Vec3 d_spin = inverse_second_ * e.cross(d_first);
            const Vec3 d_P = M * d_v + D.transpose() * (d_w - d_spin);
            const Vec3 d_Q = D * d_v + J * (d_w - d_spin);
            const Vec3 d_q = inverse_second_ * d_Q.cross(e);
            const Vec3 d_linear = D.transpose() * d_spin;
            const Vec3 d_angular = J * d_spin;
            const Vec3 d_u_rate = d_A0 * own + A0 * d_own + d_A1 * tilt + A1 * d_tilt;
            const Vec3 d_spin_rate =
                inverse_second_ * e.cross(d_A1 * own + A1 * d_own + d_A2 * tilt + A2 * d_tilt - d_w.cross(first_) -
                                          w.cross(d_first));
            force_by[of].col(j) = M * d_u_rate + D.transpose() * d_spin_rate - d_A0.transpose() * P -
                                  A0.transpose() * d_P - d_A1.transpose() * q - A1.transpose() * d_q +
                                  d_w.cross(linear) + w.cross(d_linear);
            moment_by[of].col(j) = D * d_u_rate + J * d_spin_rate -
                                   e.cross(d_A1.transpose() * P + A1.transpose() * d_P + d_A2.transpose() * q +
                                           A2.transpose() * d_q) +
                                   d_first.cross(q) + first_.cross(d_q) + d_w.cross(angular) + w.cross(d_angular) +
                                   d_v.cross(linear) + v.cross(d_linear);
        }
        const double scale = share * wet;
        s.force_v += scale * force_by[0];
        s.moment_v += scale * moment_by[0];
        s.force_w += scale * force_by[1];
        s.moment_w += scale * moment_by[1];
        // v's own dependence on place and turn comes with force_v; here the whole is meant
        s.force_place += scale * (force_by[2] * Rt - force_by[0] * v_place);
        s.moment_place += scale * (moment_by[2] * Rt - moment_by[0] * v_place);
        s.force_turn += scale * (force_by[3] - force_by[0] * v_turn);
        s.moment_turn += scale * (moment_by[3] - moment_by[0] * v_turn);
    }

  private:
    /// Change of gradient_[power] as the body turns about `axis`, which shifts the places on its own by x `shift`.
    Mat3 turned(int power, const Vec3& shift, const Vec3& axis) const {
        const Mat3(&moved)[3] = curvature_[power + 1];
        const Mat3 cross = skew(axis);
        return shift.x() * moved[0] + shift.y() * moved[1] + shift.z() * moved[2] + gradient_[power] * cross -
               cross * gradient_[power];
    }

    Mat3 gradient_[3];      // of the velocity: mean over the strips of it, of x and of x² times it
    Mat3 curvature_[4][3];  // likewise, its derivatives along the three axes
    Vec3 first_;            // mean of x times the velocity
    double inverse_second_;  // of the mean of x²; 0 for a single strip
};

template <class Require>
void require_mass_matrix(const Mat6& matrix, const char* what, Require require) {
    require(matrix.allFinite() && matrix.isApprox(matrix.transpose(), 1e-9), what);
    const Eigen::SelfAdjointEigenSolver<Mat6> eigen(matrix, Eigen::EigenvaluesOnly);
    require(eigen.eigenvalues().minCoeff() >= -1e-9 * matrix.cwiseAbs().maxCoeff(), what);
}

}  // namespace

BodyForce::BodyForce(const std::string& name, const Body& body, const Water& water) : body_(body) {
    const auto require = [&name](bool holds, const char* what) {
        if (!holds) throw InvalidInput("body '" + name + "': " + what);
    };
    const auto require_finite = [&require](double value, const char* what) { require(std::isfinite(value), what); };
    require_finite(body.mass, "mass must be finite");
    require_finite(body.volume, "volume must be finite");
    require_finite(body.length, "length must be finite");
    require_finite(body.diameter, "diameter must be finite");
    require_finite(body.axial_drag, "axial_drag must be finite");
    require_finite(body.cross_flow_drag, "cross_flow_drag must be finite");
    require(body.inertia.allFinite(), "inertia must be finite");
    require(body.centre_of_gravity.allFinite(), "centre_of_gravity must be finite");
    require(body.mass > 0.0, "mass must be above 0");
    require(body.length > 0.0 && body.diameter > 0.0, "length and diameter must be above 0");
    require(body.volume >= 0.0, "volume must not be below 0");
    require(body.axial_drag >= 0.0 && body.cross_flow_drag >= 0.0, "drag coefficients must not be below 0");
    require(body.munk_moment >= 0.0 && body.munk_moment <= 1.0, "munk_moment must lie between 0 and 1");
    require(body.strips >= 1, "strips must be at least 1");
    require_mass_matrix(body.added_mass, "added_mass must be symmetric and without negative eigenvalues", require);
    require(body.inertia.isApprox(body.inertia.transpose(), 1e-9), "inertia must be symmetric");
    require(body.centre_of_buoyancy.allFinite(), "centre_of_buoyancy must be finite");
    const Vec3& g = body.centre_of_gravity;
    const Mat3 about_cg = body.inertia -
                          body.mass * (g.squaredNorm() * Mat3::Identity() - g * g.transpose());
    require(Eigen::SelfAdjointEigenSolver<Mat3>(about_cg).eigenvalues().minCoeff() > 0.0,
            "inertia about the origin is too small for the mass and centre_of_gravity");
    for (const Fin& fin : body.fins) {
        require(fin.position.allFinite(), "a fin's position must be finite");
        require(fin.normal.allFinite(), "a fin's normal must be finite");
        require_finite(fin.area, "a fin's area must be finite");
        require_finite(fin.lift_slope, "a fin's lift_slope must be finite");
        require_finite(fin.drag, "a fin's drag must be finite");
        require_finite(fin.cross_flow_drag, "a fin's cross_flow_drag must be finite");
        require(fin.area > 0.0, "a fin's area must be above 0");
        require(fin.stall_angle > 0.0 && fin.stall_angle <= 0.5 * std::numbers::pi,
                "a fin's stall_angle must lie between 0 and pi/2 rad");
        require(fin.lift_slope >= 0.0 && fin.drag >= 0.0 && fin.cross_flow_drag >= 0.0,
                "a fin's coefficients must not be below 0");
        require(!fin.aspect_ratio || *fin.aspect_ratio > 0.0, "a fin's aspect_ratio must be above 0");
        require(fin.normal.norm() > 1e-6, "a fin's normal must not be zero");
        fins_.emplace_back(fin, water.density);
    }
    added_mass_ = body.added_mass.topLeftCorner<3, 3>();
    added_coupling_ = body.added_mass.bottomLeftCorner<3, 3>();
    added_inertia_ = body.added_mass.bottomRightCorner<3, 3>();
    coupled_ = !added_coupling_.isZero(0.0);
    for (const Mat3* drag : {&body.drag_area, &body.turning_drag}) {
        require(drag->allFinite() && drag->isApprox(drag->transpose(), 1e-9) &&
                    Eigen::SelfAdjointEigenSolver<Mat3>(*drag).eigenvalues().minCoeff() >= -1e-9 * drag->norm(),
                "drag_area and turning_drag must be symmetric and without negative eigenvalues");
    }
    bluff_drag_ = 0.5 * water.density * body.drag_area;
    bluff_turning_drag_ = 0.5 * water.density * body.turning_drag;
    bluff_ = !(body.drag_area.isZero(0.0) && body.turning_drag.isZero(0.0));
    ahead_.resize(fins_.size());
    for (const Downwash& downwash : body.downwash) {
        const int count = static_cast<int>(fins_.size());
        require(downwash.front >= 0 && downwash.front < count && downwash.rear >= 0 && downwash.rear < count &&
                    downwash.front != downwash.rear,
                "downwash: front and rear must be indices of two of its fins");
        require(std::isfinite(downwash.slope), "downwash: slope must be finite");
        ahead_[downwash.rear].push_back(downwash);
    }
    if (body.hull_table) {
        require(body.axial_drag == 0.0 && body.munk_moment == 0.0,
                "the hull_table holds axial drag and Munk moment: give axial_drag=0 and munk_moment=0");
        hull_table_.emplace(*body.hull_table, water.density);
    }
    for (const auto& [place, at] : body.places) require(at.allFinite(), "places must be finite");
    strip_length_ = body.length / body.strips;
    strip_drag_ = 0.5 * water.density * body.cross_flow_drag * body.diameter * strip_length_;
    displaced_mass_ = water.density * body.volume;
    buoyancy_ = water.gravity * displaced_mass_;
    axial_drag_ = 0.5 * water.density * body.axial_drag * 0.25 * std::numbers::pi * body.diameter * body.diameter;
}

double BodyForce::drag_area() const {
    const double own = body_.drag_area(0, 0);
    if (!hull_table_) return own + body_.axial_drag * 0.25 * std::numbers::pi * body_.diameter * body_.diameter;
    HullTableForce::Coefficients c, c_attack, c_sideslip;
    hull_table_->interpolate(0.0, 0.0, c, c_attack, c_sideslip);
    return own + c[0] * body_.hull_table->area;
}

void BodyForce::turn_by_downwash(std::size_t rear, const Vec3& v, const Vec3& w, Vec3& flow, Mat3& change_v,
                                 Mat3& change_w) const {
    change_v.setZero();
    change_w.setZero();
    const FinForce& fin = fins_[rear];
    const double chordwise = -flow.dot(fin.chord());
    if (chordwise <= 0.0) return;
    const Eigen::RowVector3d chordwise_v = fin.chord().transpose();  // d flow/dv = −1
    const Eigen::RowVector3d chordwise_w = -fin.chord().transpose() * skew(fin.position());
    for (const Downwash& downwash : ahead_[rear]) {
        const FinForce& front = fins_[downwash.front];
        const Vec3& at = front.position();
        Vec3 incidence_flow;
        const double angle = downwash.slope * front.incidence(-v - w.cross(at), incidence_flow);
        const Eigen::RowVector3d angle_flow = downwash.slope * incidence_flow.transpose();
        flow -= angle * chordwise * front.normal();
        change_v += front.normal() * (chordwise * angle_flow - angle * chordwise_v);
        change_w -= front.normal() * (chordwise * angle_flow * skew(at) + angle * chordwise_w);
    }
}

void BodyForce::evaluate(const Water& water, const std::vector<WaterMotion>& along, const BodyMotion& motion,
                         Vec3& force, Vec3& moment, BodyJacobian& jacobian) const {
    const Mat3& R = motion.rotation;
    const Mat3 Rt = R.transpose();
    const Vec3& w = motion.angular_velocity;
    const Vec3& alpha = motion.angular_acceleration;
    const Vec3 a = Rt * motion.acceleration;
    const bool varies = !water.is_uniform_and_steady();
    const WaterAlongHull hull_water = varies ? WaterAlongHull(*this, along, R) : WaterAlongHull(along[0]);
    const WaterMotion& mean = hull_water.mean;
    const Vec3 v = Rt * (motion.velocity - mean.velocity);  // through the water
    const Vec3 water_a = Rt * mean.acceleration;
    const Vec3 relative_a = a - water_a;
    const Vec3 relative_alpha = alpha - hull_water.spin_rate;
    const Vec3 up = Rt.col(2);
    const Mat3 W = skew(w);
    WrenchWithDerivatives s;

    // Weight at the centre of gravity, rigid-body inertia about the origin
    const double m = body_.mass;
    const Vec3& c = body_.centre_of_gravity;
    const Mat3 C = skew(c);
    const Vec3 weight = -m * water.gravity * up;
    const Vec3 spin = w.cross(c);
    const Vec3 Iw = body_.inertia * w;
    s.force = weight - m * (a + alpha.cross(c) + w.cross(spin));
    s.moment = c.cross(weight - m * a) - body_.inertia * alpha - w.cross(Iw);
    const Mat3 weight_turn = -m * water.gravity * skew(up);
    s.force_turn += weight_turn;
    s.moment_turn += C * weight_turn;
    s.force_a = -m * Mat3::Identity();
    s.moment_a = -m * C;
    s.force_alpha = m * C;
    s.moment_alpha = -body_.inertia;
    s.force_w = m * (skew(spin) + W * C);
    s.moment_w = skew(Iw) - W * body_.inertia;

    // Strips along the hull: buoyancy, cross-flow drag, and the pull of accelerating water on what they displace
    const Vec3 buoyancy = buoyancy_ * up;  // fully immersed
    double wet = 0.0;                      // mean immersed fraction
    double wet_x = 0.0;                    // … times the mean place of what is immersed, m
    Vec3 wet_place = Vec3::Zero();         // its derivatives
    Vec3 wet_turn = Vec3::Zero();
    // Half the height of a strip: of its circle, tilted with the axis, and of its length. At any pitch above 0, so that a
    // strip of a hull that stands upright goes under smoothly.
    const double radius = 0.5 * body_.diameter;
    const double tilt = R(2, 0);  // of the axis: the rise per length
    const double half_length = 0.5 * strip_length_;
    const double half_height =
        std::sqrt(radius * radius * (1.0 - tilt * tilt) + half_length * half_length * tilt * tilt);
    const double inverse_height = 1.0 / half_height;
    // d tilt = e_z · R (δφ × e_x) = δφ · (e_x × up)
    const Vec3 height_turn =
        ((half_length * half_length - radius * radius) * tilt * inverse_height) * Vec3::UnitX().cross(up);
    const double share = 1.0 / body_.strips;
    for (int i = 0; i < body_.strips; ++i) {
        const WaterMotion& local = along[varies ? i : 0];
        const Vec3 at = water_place(i);
        const double x = at.x();
        const double depth = -(motion.position.z() - local.elevation + tilt * x) * inverse_height;
        const Wetness strip = circle_wetness(depth);
        if (strip.fraction == 0.0) continue;
        double u_y = -v.y() - w.z() * x;
        double u_z = -v.z() + w.y() * x;
        Vec3 displaced_force = share * buoyancy;  // of this strip if it is immersed
        if (varies) {
            const Vec3 extra = Rt * (local.velocity - mean.velocity);
            u_y += extra.y();
            u_z += extra.z();
            const Mat3 place_turn = -R * skew(at);
            const Mat3 force_v = s.force_v;
            const Mat3 moment_v = s.moment_v;
            s.add_cross_flow(x, x, strip_drag_ * strip.fraction, u_y, u_z);
            s.add_dependence(force_v - s.force_v, moment_v - s.moment_v,
                             Rt * (local.velocity_gradient - mean.velocity_gradient),
                             skew(extra) + Rt * (local.velocity_gradient * place_turn - hull_water.velocity_turn));
            const Vec3 displaced_at = at + body_.centre_of_buoyancy;
            const Vec3 pull = (share * displaced_mass_) * (Rt * local.acceleration);
            const Mat3 pull_place = (strip.fraction * share * displaced_mass_) * Rt * local.acceleration_gradient;
            displaced_force += pull;
            s.force += strip.fraction * pull;
            s.moment += strip.fraction * displaced_at.cross(pull);
            s.add_dependence(Mat3::Identity(), skew(displaced_at), pull_place,
                             strip.fraction * skew(pull) + pull_place * place_turn);
        } else {
            s.add_cross_flow(x, x, strip_drag_ * strip.fraction, u_y, u_z);
        }
        if (hull_table_) s.add_cross_flow(x, 0.0, -strip_drag_ * strip.fraction, -v.y(), -v.z());
        wet += share * strip.fraction;
        wet_x += share * strip.fraction * x;
        if (strip.slope != 0.0) {
            const Vec3 place = (-strip.slope * inverse_height) * local.height_slope();
            // d(n · R at) = n · R (δφ × at) = δφ · (at × Rᵀn)
            const Vec3 turn = at.cross(Rt * place) - (strip.slope * depth * inverse_height) * height_turn;
            s.add_wetted(at + body_.centre_of_buoyancy, displaced_force, place, turn);
            Vec3 drag = strip_drag_ * std::sqrt(u_y * u_y + u_z * u_z) * Vec3(0.0, u_y, u_z);
            if (hull_table_) drag += strip_drag_ * std::sqrt(v.y() * v.y() + v.z() * v.z()) * Vec3(0.0, v.y(), v.z());
            s.add_wetted(at, drag, place, turn);
            wet_place += share * place;
            wet_turn += share * turn;
        }
    }

    const Vec3 displaced = Vec3(wet_x, 0.0, 0.0) + wet * body_.centre_of_buoyancy;  // moment of the displaced volume
    const Mat3 buoyancy_turn = buoyancy_ * skew(up);
    s.force += wet * buoyancy;
    s.moment += displaced.cross(buoyancy);
    s.force_turn += wet * buoyancy_turn;
    s.moment_turn += skew(displaced) * buoyancy_turn;

    // Axial drag or table, and added mass, with the mean immersed fraction
    const double k = body_.munk_moment;
    const Mat3& Ma = added_mass_;
    const Mat3& Ja = added_inertia_;
    const Mat3 V = skew(v);
    const Vec3 turning = w.cross(v);  // the water's impulse changes with v̇ = a − turning, seen from the body
    const Vec3 P = Ma * v;            // impulse of the water
    const Vec3 Jw = Ja * w;
    Vec3 hull_force = k * (Ma * turning - w.cross(P)) - Ma * relative_a;
    hull_force.x() -= axial_drag_ * std::abs(v.x()) * v.x();
    Vec3 hull_moment = -k * v.cross(P) - w.cross(Jw) - Ja * relative_alpha;
    if (coupled_) {
        const Mat3& D = added_coupling_;
        const Vec3 impulse = D.transpose() * w;
        const Vec3 Dv = D * v;
        hull_force -= k * w.cross(impulse) + D.transpose() * relative_alpha;
        hull_moment += k * (D * turning - w.cross(Dv) - v.cross(impulse)) - D * relative_a;
        s.force_w += (wet * k) * (skew(impulse) - W * D.transpose());
        s.force_alpha -= wet * D.transpose();
        s.moment_v += (wet * k) * (D * W - W * D + skew(impulse));
        s.moment_w += (wet * k) * (skew(Dv) - D * V - V * D.transpose());
        s.moment_a -= wet * D;
    }
    const Mat3 v_place = -Rt * mean.velocity_gradient;
    const Mat3 v_turn = V - Rt * hull_water.velocity_turn;
    if (varies && feels_curvature()) {
        VaryingWater(*this, along, R).add(Ma, added_coupling_, Ja, v, Rt * mean.velocity, w, k, wet, v_place, v_turn, Rt,
                                          hull_force, hull_moment, s);
    }
    if (hull_table_) {
        Vec3 table_force, table_moment;
        Mat3 table_force_v, table_moment_v;
        hull_table_->evaluate(v, table_force, table_moment, table_force_v, table_moment_v);
        hull_force += table_force;
        hull_moment += table_moment;
        s.force_v += wet * table_force_v;
        s.moment_v += wet * table_moment_v;
    }
    if (bluff_) {
        const double speed = v.norm();
        const double spin_speed = w.norm();
        const Vec3 drag = bluff_drag_ * v;
        const Vec3 turning_drag = bluff_turning_drag_ * w;
        hull_force -= speed * drag;
        hull_moment -= spin_speed * turning_drag;
        s.force_v -= wet * speed * bluff_drag_;
        s.moment_w -= wet * spin_speed * bluff_turning_drag_;
        if (speed > 0.0) s.force_v -= (wet / speed) * drag * v.transpose();
        if (spin_speed > 0.0) s.moment_w -= (wet / spin_speed) * turning_drag * w.transpose();
    }
    s.force += wet * hull_force;
    s.moment += wet * hull_moment;
    s.force_v += (wet * k) * (Ma * W - W * Ma);
    s.force_v(0, 0) -= wet * 2.0 * axial_drag_ * std::abs(v.x());
    s.force_w += (wet * k) * (skew(P) - Ma * V);
    s.moment_v += (wet * k) * (skew(P) - V * Ma);
    s.moment_w += wet * (skew(Jw) - W * Ja);
    s.force_a -= wet * Ma;
    s.moment_alpha -= wet * Ja;
    s.force_place += hull_force * wet_place.transpose();
    s.moment_place += hull_moment * wet_place.transpose();
    s.force_turn += hull_force * wet_turn.transpose();
    s.moment_turn += hull_moment * wet_turn.transpose();
    if (varies) {
        s.add_dependence(wet * Ma, wet * added_coupling_, Rt * mean.acceleration_gradient,
                         skew(water_a) + Rt * hull_water.acceleration_turn);
        s.add_dependence(wet * added_coupling_.transpose(), wet * Ja, hull_water.spin_rate_place,
                         hull_water.spin_rate_turn);
    }

    for (std::size_t i = 0; i < fins_.size(); ++i) {
        const FinForce& fin = fins_[i];
        const Vec3& at = fin.position();
        const WaterMotion& local = along[varies ? body_.strips + static_cast<int>(i) : 0];
        const Wetness immersion =
            wetness(-(motion.position.z() - local.elevation + R.row(2).dot(at)) / fin.half_height());
        if (immersion.fraction == 0.0) continue;
        Vec3 lift;
        Mat3 lift_flow;
        const Mat3 A = skew(at);
        Vec3 flow = -v - w.cross(at);
        Mat3 downwash_v, downwash_w;
        const bool washed = !ahead_[i].empty();
        if (washed) turn_by_downwash(i, v, w, flow, downwash_v, downwash_w);
        const Vec3 extra = Rt * (local.velocity - mean.velocity);  // which no downwash turns
        fin.evaluate(flow + extra, lift, lift_flow);
        const Mat3 wetted_flow = immersion.fraction * lift_flow;
        if (varies) {
            s.add_dependence(wetted_flow, A * wetted_flow, Rt * (local.velocity_gradient - mean.velocity_gradient),
                             skew(extra) - Rt * (local.velocity_gradient * R * A + hull_water.velocity_turn));
        }
        Mat3 wetted_v = -wetted_flow;
        Mat3 wetted_w = wetted_flow * A;  // d(−w × at)/dw = skew(at)
        if (washed) {
            wetted_v += wetted_flow * downwash_v;
            wetted_w += wetted_flow * downwash_w;
        }
        s.force += immersion.fraction * lift;
        s.moment += immersion.fraction * at.cross(lift);
        s.force_v += wetted_v;
        s.moment_v += A * wetted_v;
        s.force_w += wetted_w;
        s.moment_w += A * wetted_w;
        if (immersion.slope != 0.0) {
            const Vec3 place = (-immersion.slope / fin.half_height()) * local.height_slope();
            s.add_wetted(at, lift, place, at.cross(Rt * place));
        }
    }

    force = R * s.force;
    moment = s.moment;

    // Chain rule: v and a are tank vectors seen from the body, so turning by φ changes them by v × φ;
    // the force is turned back to tank axes.
    jacobian.position.block<3, 3>(0, 0) = R * (s.force_place + s.force_v * v_place);
    jacobian.position.block<3, 3>(3, 0) = s.moment_place + s.moment_v * v_place;
    jacobian.position.block<3, 3>(0, 3) =
        R * (s.force_turn + s.force_v * v_turn + s.force_a * skew(a) - skew(s.force));
    jacobian.position.block<3, 3>(3, 3) = s.moment_turn + s.moment_v * v_turn + s.moment_a * skew(a);
    jacobian.velocity.block<3, 3>(0, 0) = R * s.force_v * Rt;
    jacobian.velocity.block<3, 3>(0, 3) = R * s.force_w;
    jacobian.velocity.block<3, 3>(3, 0) = s.moment_v * Rt;
    jacobian.velocity.block<3, 3>(3, 3) = s.moment_w;
    jacobian.acceleration.block<3, 3>(0, 0) = R * s.force_a * Rt;
    jacobian.acceleration.block<3, 3>(0, 3) = R * s.force_alpha;
    jacobian.acceleration.block<3, 3>(3, 0) = s.moment_a * Rt;
    jacobian.acceleration.block<3, 3>(3, 3) = s.moment_alpha;
}

}  // namespace sim_core
