// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "maps/storage/database.h"
#include "maps/storage/lens_rows.h"

// A random text that tells a library from every other one that has or had its name. It goes wherever the file
// is copied to, but not into a recovered file, which may lack maps. It is stored as the lens of a camera of
// one pixel, because older programs of this format refuse other tables, report rows that belong to no map,
// and remove assets that no scene uses; such a lens they keep, and give to no camera. The functions run in
// the caller's transaction.
namespace docent::maps {

// Empty if the library has none yet. Throws docent::Error if the file cannot be read.
std::string ReadLibraryIdentity(const Database& database);
// Gives an identity to a library that has none.
void WriteLibraryIdentity(const Database& database, const std::string& identity);
// Whether a row of the table `lenses` is the identity and no lens.
bool IsLibraryIdentity(const StoredLens& lens);

}  // namespace docent::maps
