// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>

namespace docent {

// Whether a test that cannot run here fails instead of being skipped: where everything that ./bootstrap
// installs is there, as in the stage release of .ci/run, a skipped test would hide a fault.
inline bool MustRun() {
  return std::getenv("DOCENT_MUST_RUN") != nullptr;
}

}  // namespace docent
