// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

namespace docent::engine {

// Expects that the default options are valid, and that after each of these changes they are refused with a
// sentence.
template <typename Options>
void ExpectRefused(const std::vector<std::function<void(Options*)>>& changes) {
  EXPECT_EQ(Options().Validate(), std::nullopt);
  for (std::size_t i = 0; i < changes.size(); ++i) {
    Options options;
    changes[i](&options);
    const auto fault = options.Validate();
    ASSERT_TRUE(fault) << "change " << i;
    EXPECT_EQ(fault->back(), '.') << *fault;
  }
}

}  // namespace docent::engine
