// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "maps/storage/database.h"

namespace docent::maps {

// Reads, decodes and checks every row of a library. Returns one sentence for each error; empty if there is
// none. The caller holds a read transaction.
std::vector<std::string> VerifyAll(const Database& database, int threads);

}  // namespace docent::maps
