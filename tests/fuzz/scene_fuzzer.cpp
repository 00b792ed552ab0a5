// SPDX-License-Identifier: Apache-2.0
// Reads any bytes as a scene: strictly, as a library does, and as recovery does, which leaves out what is
// damaged. Both must throw a docent::Error or return a scene that can be stored, and what is stored must be
// read back to the same text.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "content/scene_codec.h"
#include "engine/base/error.h"

namespace {

using namespace docent::content;

// There are assets of every kind; the first letter of the id says which.
std::shared_ptr<const Asset> FindAsset(const std::string& id) {
  const std::size_t kind = std::string_view("mis").find(id.substr(0, 1));
  if (id.empty() || kind == std::string_view::npos) return nullptr;
  auto asset = std::make_shared<Asset>();
  asset->id = id;
  asset->kind = kind == 0 ? AssetKind::kModel : kind == 1 ? AssetKind::kImage : AssetKind::kSound;
  return asset;
}

void CheckStored(const Scene& scene) {
  const std::string stored = EncodeScene(scene);  // An Error here is a finding.
  if (EncodeScene(DecodeScene(stored, "again", FindAsset)) != stored) __builtin_trap();
  if (SceneAssetIds(stored).size() > scene.entities.size()) __builtin_trap();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  Scene read;
  std::vector<std::string> problems;
  try {
    SceneAssetIds(text);
  } catch (const docent::Error&) {
  }
  try {
    read = ReadScene(text, "fuzz", FindAsset, &problems);
  } catch (const docent::Error&) {
    return 0;
  }
  CheckStored(read);
  Scene strict;
  try {
    strict = DecodeScene(text, "fuzz", FindAsset);
  } catch (const docent::Error&) {
    return 0;
  }
  CheckStored(strict);
  // What is strictly valid has nothing that is left out.
  if (!problems.empty() || strict.entities.size() != read.entities.size()) __builtin_trap();
  return 0;
}
