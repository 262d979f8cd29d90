// SPDX-License-Identifier: Apache-2.0
// Laws that can be read back: what a law computes with is not always what it was made of.
#pragma once

#include <cstddef>
#include <tuple>

namespace sim_core::python {

/// A law and the arguments of its constructor, so that Python can read, compare and pickle it.
template <class Law, class... Values>
struct Kept : Law {
    explicit Kept(const Values&... given) : Law(given...), values(given...) {}
    std::tuple<Values...> values;
};

/// The getter of one of them.
template <class Law, std::size_t index>
auto value(const Law& law) {
    return std::get<index>(law.values);
}

}  // namespace sim_core::python
