// SPDX-License-Identifier: Apache-2.0
#include "maps/exchange/exchange.h"

#include <algorithm>
#include <set>
#include <system_error>
#include <utility>

#include "engine/base/error.h"

namespace docent::maps {

namespace {

MapRecord RecordOf(StoredMap map, std::uint64_t key, std::string name) {
  MapRecord record;
  record.key = key;
  record.name = std::move(name);
  record.policy = map.info.policy;
  record.bounds = map.info.bounds;
  record.snapshot = std::move(map.snapshot);
  record.scene = std::make_shared<const SceneRecord>(std::move(map.scene));
  return record;
}

std::string FreeName(const std::string& name, const std::set<std::string>& taken) {
  if (!taken.contains(name)) return name;
  for (int number = 2;; ++number) {
    const std::string suffix = " (" + std::to_string(number) + ")";
    // Cuts only between whole UTF-8 characters: bytes 10xxxxxx continue the one before.
    std::size_t length = std::min(name.size(), kMaxMapNameBytes - suffix.size());
    while (length < name.size() && length > 0 && (static_cast<unsigned char>(name[length]) & 0xC0) == 0x80)
      --length;
    if (std::string free = name.substr(0, length) + suffix; !taken.contains(free)) return free;
  }
}

}  // namespace

void ExportMap(const Library& library, std::uint64_t key, const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::exists(path, error))
    throw Error(path.string() + " exists already; choose a new file name for the map");
  StoredMap map = library.Load(key);
  try {
    Library target = Library::Open(path, Access::kReadWrite, CreateIfMissing::kYes);
    const std::string name = map.info.name;
    target.Save(RecordOf(std::move(map), target.NewKey(), name));
  } catch (const Error&) {
    for (const char* suffix : {"", "-wal", "-shm", "-journal"})
      std::filesystem::remove(path.string() + suffix, error);
    throw;
  }
}

std::vector<ImportedMap> ImportMaps(const Library& from, const std::filesystem::path& path) {
  const std::vector<MapInfo> infos = from.List();
  if (infos.empty()) throw Error(from.file() + " contains no map to import");
  for (const MapInfo& info : infos) from.Load(info.key);
  Library to = Library::Open(path, Access::kReadWrite, CreateIfMissing::kYes);
  std::set<std::string> taken;
  for (const MapInfo& info : to.List()) taken.insert(info.name);
  std::vector<ImportedMap> imported;
  for (const MapInfo& info : infos) {
    std::string name = FreeName(info.name, taken);
    to.Save(RecordOf(from.Load(info.key), to.NewKey(), name));
    taken.insert(name);
    imported.push_back({std::move(name), info.name});
  }
  return imported;
}

}  // namespace docent::maps
