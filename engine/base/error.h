// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

namespace docent {

// An error outside the program, in a file, camera or device. The message is one sentence for the user that
// says what is wrong, where (file, field, line) and, if it helps, what to do. Thrown only where external data
// are read, never in the frame loop.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace docent
