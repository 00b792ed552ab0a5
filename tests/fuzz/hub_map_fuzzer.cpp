// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <span>

#include "engine/base/error.h"
#include "maps/hub/local_library.h"
#include "maps/hub/sha256.h"
#include "maps/storage/checksum.h"
#include "maps/storage/envelope.h"
#include "tests/fuzz/small_library.h"

// Writes into a library what a hostile hub could send for a map: items with any bytes, whose hashes are
// right, and any facts that pass the checks of a list of maps. The input changes a valid map; it is a
// sequence of changes, each the number of an item (1 byte), an offset (2 bytes), a length (1 byte) and that
// many bytes. The checksums of columns are then made right, so that the decoders see the records. Numbers
// beyond the items are those of the facts; a length of 255 cuts the item off at the offset. The library must
// refuse the map with a docent::Error and be as it was, or have it, find no problem, and read it back equal.
namespace {

namespace fs = std::filesystem;
using namespace docent::maps;

constexpr std::uint64_t kMaxFact = 1 << 20;  // Numbers beyond are refused before.

LocalLibrary& Device() {
  static LocalLibrary library(docent::fuzz::TemporaryFolder() / "device.docent", CreateIfMissing::kYes, {});
  return library;
}

// The map as a hub has it, and the key that the device has for it.
LocalMap ValidMap() {
  const fs::path path = docent::fuzz::TemporaryFolder() / "author.docent";
  std::uint64_t key = 0;
  {
    Library author = Library::Open(path, Access::kReadWrite, CreateIfMissing::kYes, {});
    key = author.NewKey();
    author.Save({key, "map", Policy::kOpen, docent::fuzz::SmallMap(), docent::fuzz::SmallScene()});
  }
  LocalMap map = LocalLibrary(path, CreateIfMissing::kNo, {}).Read(key, {});
  map.facts.info.key = Device().library().NewKey();
  return map;
}

void RepairChecksum(Bytes* column) {
  if (column->size() < kEnvelopeBytes) return;
  const std::size_t end = column->size() - sizeof(std::uint64_t);
  const std::uint64_t checksum = Checksum(std::span(*column).first(end));
  std::memcpy(column->data() + end, &checksum, sizeof checksum);
}

void ChangeFacts(std::size_t which, std::span<const std::uint8_t> bytes, MapFacts* facts) {
  std::uint64_t number = 0;
  std::memcpy(&number, bytes.data(), std::min(bytes.size(), sizeof number));
  number %= kMaxFact;
  MapInfo& info = facts->info;
  switch (which % 8) {
    case 0:
      info.next_keyframe = static_cast<std::uint32_t>(number);
      break;
    case 1:
      info.next_point = static_cast<std::uint32_t>(number);
      break;
    case 2:
      info.keyframes = number;
      break;
    case 3:
      info.points = number;
      break;
    case 4:
      info.observations = number;
      break;
    case 5:
      info.revision = number;
      break;
    case 6:
      info.policy = static_cast<Policy>(number % 4);
      break;
    default:
      info.bounds =
          Bounds{Eigen::Vector3d::Constant(-1.0 * static_cast<double>(number)), Eigen::Vector3d::Ones()};
  }
}

void ApplyChanges(std::span<const std::uint8_t> input, LocalMap* map) {
  constexpr std::size_t kHead = 4;
  constexpr std::uint8_t kCut = 255;
  while (input.size() > kHead) {
    const std::size_t which = input[0], offset = input[1] | std::size_t{input[2]} << 8;
    const std::uint8_t length = input[3];
    input = input.subspan(kHead);
    const auto bytes = input.first(std::min<std::size_t>(length == kCut ? 0 : length, input.size()));
    input = input.subspan(bytes.size());
    if (which >= map->items.size()) {
      ChangeFacts(which - map->items.size(), bytes, &map->facts);
      continue;
    }
    auto item = map->items.begin();
    std::advance(item, which);
    if (length == kCut) item->second.resize(std::min(offset, item->second.size()));
    for (std::size_t i = 0; i < bytes.size() && offset + i < item->second.size(); ++i)
      item->second[offset + i] = bytes[i];
    if (!IsContentItem(item->first)) RepairChecksum(&item->second);
  }
  for (const auto& [item, bytes] : map->items) map->manifest[item] = HashOf(bytes);
}

void Demand(bool condition) {
  if (!condition) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const LocalMap valid = ValidMap();
  LocalMap map = valid;
  ApplyChanges({data, size}, &map);
  LocalLibrary& device = Device();
  const std::uint64_t key = map.facts.info.key;
  try {
    device.Write(map, {}, "");
  } catch (const docent::Error&) {
    Demand(device.StampOf(key).empty());
    return 0;
  }
  Demand(device.library().Verify().empty());
  Demand(device.Read(key, {}).manifest == map.manifest);
  device.library().Load(key);
  device.Remove(key, device.StampOf(key));
  return 0;
}
