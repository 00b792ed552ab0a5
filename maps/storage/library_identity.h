// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "maps/storage/database.h"
#include "maps/storage/lens_rows.h"

// Random texts that tell a library from every other one that has or had its name, and from what it was
// itself before its last exchange with a hub: each exchange that changes something gives it a new one. They
// go wherever the file is copied to, but not into a recovered file, which may lack maps. They are stored as
// lenses of cameras of one pixel, because older programs of this format refuse other tables, report rows that
// belong to no map, and remove assets that no scene uses; such a lens they keep, and give to no camera. The
// functions run in the caller's transaction.
namespace docent::maps {

struct LibraryIdentity {
  std::string current;   // Empty if the library has none yet.
  std::string previous;  // The one before, while a renewal may have been interrupted; empty for none.
};

// Throws docent::Error if the file cannot be read.
LibraryIdentity ReadLibraryIdentity(const Database& database);
// Gives the library a new identity; the present one becomes the previous one.
void RenewLibraryIdentity(const Database& database, const std::string& identity);
// Whether a row of the table `lenses` is an identity and no lens.
bool IsLibraryIdentity(const StoredLens& lens);

}  // namespace docent::maps
