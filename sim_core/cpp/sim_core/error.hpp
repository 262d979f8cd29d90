// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace sim_core {

/// A description or an argument that no simulation can be made of; the message says what and where.
class InvalidInput : public std::invalid_argument {
  public:
    using std::invalid_argument::invalid_argument;
};

/// The equations could not be solved; the message names the place and the time.
class ConvergenceError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

}  // namespace sim_core
