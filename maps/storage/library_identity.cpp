// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/library_identity.h"

#include <string_view>

#include "engine/base/error.h"
#include "maps/storage/byte_stream.h"

namespace docent::maps {

namespace {

constexpr std::string_view kIdentityPrefix = "library ";

}  // namespace

LibraryIdentity ReadLibraryIdentity(const Database& database) {
  Statement query = database.Prepare(
      "SELECT camera, data, checksum FROM lenses WHERE camera GLOB 'library *' ORDER BY camera");
  LibraryIdentity identity;
  while (query.Step()) {
    const std::string camera = query.Text(0);
    const Bytes data(query.Blob(1).begin(), query.Blob(1).end());
    const std::int64_t checksum = query.Integer(2);
    try {
      const StoredLens lens = CheckedLens(camera, data, checksum);
      if (!IsLibraryIdentity(lens)) continue;
      (lens.fixed ? identity.current : identity.previous) = camera.substr(kIdentityPrefix.size());
    } catch (const Error&) {
      continue;  // ReadLenses reports it.
    }
  }
  return identity;
}

void RenewLibraryIdentity(const Database& database, const std::string& identity) {
  const LibraryIdentity before = ReadLibraryIdentity(database);
  const auto name = [](const std::string& text) { return std::string(kIdentityPrefix) + text; };
  if (!before.previous.empty())
    database.Prepare("DELETE FROM lenses WHERE camera = ?").Bind(1, name(before.previous)).Run();
  if (!before.current.empty()) WriteLens(database, {name(before.current), engine::CameraModel(), 1, false});
  WriteLens(database, {name(identity), engine::CameraModel(), 1, true});
}

bool IsLibraryIdentity(const StoredLens& lens) {
  return lens.camera.starts_with(kIdentityPrefix) && lens.model.width_px() == 1 &&
         lens.model.height_px() == 1;
}

}  // namespace docent::maps
