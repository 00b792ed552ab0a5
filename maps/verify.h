// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "maps/database.h"

namespace docent::maps {

// Reads every row of a library, decodes and checks it, and says what is wrong, a sentence each; empty when
// all is well. The caller holds a read transaction.
std::vector<std::string> VerifyAll(const Database& database, int threads);

}  // namespace docent::maps
