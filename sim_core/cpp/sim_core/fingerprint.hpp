// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "model.hpp"

namespace sim_core {

/// A number that models of the same description have in common and others do not (FNV-1a over all values): a saved
/// state belongs to one description.
std::uint64_t fingerprint(const Model& model);

}  // namespace sim_core
