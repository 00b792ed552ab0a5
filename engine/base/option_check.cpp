// SPDX-License-Identifier: Apache-2.0
#include "engine/base/option_check.h"

#include <cmath>
#include <sstream>

namespace docent {

namespace {

std::string Written(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

}  // namespace

OptionCheck& OptionCheck::Require(bool holds, const char* name, const std::string& range) {
  if (!holds && !fault_) fault_ = std::string("The ") + name + " must be " + range + ".";
  return *this;
}

OptionCheck& OptionCheck::Within(double value, double lowest, double highest, const char* name) {
  const bool holds = value >= lowest && value <= highest;
  return holds ? *this : Require(false, name, "from " + Written(lowest) + " to " + Written(highest));
}

OptionCheck& OptionCheck::AtLeast(double value, double lowest, const char* name) {
  const bool holds = value >= lowest && std::isfinite(value);
  return holds ? *this : Require(false, name, "at least " + Written(lowest));
}

OptionCheck& OptionCheck::Positive(double value, const char* name) {
  return value > 0 && std::isfinite(value) ? *this : Require(false, name, "above 0");
}

OptionCheck& OptionCheck::NotNegative(Timestamp value, const char* name) {
  return value >= Timestamp{} ? *this : Require(false, name, "0 or longer");
}

OptionCheck& OptionCheck::That(bool holds, const char* sentence) {
  if (!holds && !fault_) fault_ = sentence;
  return *this;
}

OptionCheck& OptionCheck::Contained(std::optional<std::string> fault) {
  if (!fault_) fault_ = std::move(fault);
  return *this;
}

}  // namespace docent
