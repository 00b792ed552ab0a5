// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>

namespace docent {

// Whether a test that cannot run here fails instead of being skipped: where everything that ./bootstrap
// installs is there, as in the stage release of .ci/run, a skipped test would hide a fault.
inline bool MustRun() {
  return std::getenv("DOCENT_MUST_RUN") != nullptr;
}

}  // namespace docent

// Ends a test, or a SetUp, that cannot run here because something is missing that ./bootstrap installs: it is
// skipped, or fails where it must run.
#define SKIP_OR_FAIL(why)                     \
  do {                                        \
    if (::docent::MustRun()) FAIL() << (why); \
    GTEST_SKIP() << (why);                    \
  } while (false)
