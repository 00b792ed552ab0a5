// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/time.h"

namespace docent {

// Finds the first option that is out of range, and says so in one sentence for the user: "The inlier ratio
// must be from 0 to 1." NaN is out of every range. Plain value.
class OptionCheck {
 public:
  OptionCheck& Within(double value, double lowest, double highest, const char* name);
  OptionCheck& Ratio(double value, const char* name) { return Within(value, 0, 1, name); }
  // Finite, and at least `lowest`.
  OptionCheck& AtLeast(double value, double lowest, const char* name);
  OptionCheck& Positive(double value, const char* name);  // finite, and above 0
  OptionCheck& NotNegative(Timestamp value, const char* name);
  // Any other condition, with its sentence.
  OptionCheck& That(bool holds, const char* sentence);
  // What options that are contained in these say of themselves.
  OptionCheck& Contained(std::optional<std::string> fault);

  const std::optional<std::string>& fault() const { return fault_; }

 private:
  OptionCheck& Require(bool holds, const char* name, const std::string& range);
  std::optional<std::string> fault_;
};

// Returns the options, or throws Error if they are out of range. For constructors.
template <typename Options>
const Options& Checked(const Options& options) {
  if (auto fault = options.Validate()) throw Error(*std::move(fault));
  return options;
}

}  // namespace docent
