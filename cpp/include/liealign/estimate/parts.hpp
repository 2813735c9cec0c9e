// Work in parts: made by several threads, taken by one, in order.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

namespace liealign {

// `part` counts all of them, `slot` is the place where a part lies between its make and its take.
using PartWork = std::function<void(std::size_t part, std::size_t slot)>;

// Slots that in_order() uses.
std::size_t part_slots();

// make() for every part, several at a time; take() for each, in order. The first exception, in the order of parts, comes
// out of it after those that were made beside it.
void in_order(std::size_t parts, const PartWork& make, const PartWork& take);

}  // namespace liealign
