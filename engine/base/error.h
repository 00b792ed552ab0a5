// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

namespace docent {

// The outside world's fault: a file, a camera, a device. The message is one sentence for the person at the
// keyboard that says what is wrong, where (file, field, line) and, if it helps, what to do. Thrown only where
// the outside world is read; never inside the frame loop.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace docent
