// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace docent::bench {

// Of a room that was mapped from all sides.
inline constexpr std::size_t kKeyFramesOfAMap = 150;

}  // namespace docent::bench
