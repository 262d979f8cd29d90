// SPDX-License-Identifier: Apache-2.0
// Small fixed-size types shared by the whole library.
#pragma once

#include <Eigen/Dense>

namespace sim_core {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Mat6 = Eigen::Matrix<double, 6, 6>;
using Quat = Eigen::Quaterniond;

}  // namespace sim_core
