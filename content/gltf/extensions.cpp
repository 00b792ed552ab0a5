// SPDX-License-Identifier: Apache-2.0
#include "content/gltf/extensions.h"

#include <algorithm>
#include <iterator>

namespace docent::content {
namespace {

struct Extension {
  std::string_view name;
  bool decoded;              // Objects of this name are read.
  std::string_view warning;  // Empty for those that are shown as the file means them.
};

// Files that require one of these are shown.
constexpr Extension kKnownExtensions[] = {
    {"KHR_texture_transform", true, ""},
    {"KHR_materials_unlit", true, ""},
    {"KHR_materials_pbrSpecularGlossiness", true, ""},
    {"KHR_materials_emissive_strength", true, ""},
    {"KHR_materials_transmission", true, ""},
    {"KHR_mesh_quantization", false, ""},
    {"KHR_lights_punctual", false,
     "The lights of the file (KHR_lights_punctual) are left out, because the light of the room is shown."},
    {"KHR_materials_variants", false,
     "The variants of the materials (KHR_materials_variants) are left out; the default materials are shown."},
};

constexpr std::size_t kMaxNamed = 16;       // Files in use list a handful of extensions.
constexpr std::size_t kMaxNameLength = 60;  // The longest registered name has 43 letters.

const Extension* FindExtension(std::string_view name) {
  const auto found = std::find_if(std::begin(kKnownExtensions), std::end(kKnownExtensions),
                                  [&](const Extension& known) { return known.name == name; });
  return found == std::end(kKnownExtensions) ? nullptr : &*found;
}

}  // namespace

bool UsesExtension(const Json& root, std::string_view name) {
  const Json& used = ArrayOf(root, "extensionsUsed");
  return std::find(used.begin(), used.end(), Json(name)) != used.end();
}

bool IsDecodedExtension(std::string_view name) {
  const Extension* known = FindExtension(name);
  return known != nullptr && known->decoded;
}

void CheckExtensions(std::string_view file, const Json& root) {
  for (const Json& name : ArrayOf(root, "extensionsRequired")) {
    if (!name.is_string()) Refuse(file, "extensionsRequired", "is not a list of strings.");
    const std::string text = name.get<std::string>();
    if (FindExtension(text) != nullptr) continue;
    Refuse(file, "",
           "the file cannot be shown without the extension " + text.substr(0, kMaxNameLength) +
               ", which Docent does not read; export the model without it.");
  }
}

std::vector<std::string> ExtensionWarnings(const Json& root) {
  std::vector<std::string> warnings;
  std::size_t unnamed = 0;
  for (const Json& entry : ArrayOf(root, "extensionsUsed")) {
    const std::string& name = entry.get_ref<const std::string&>();
    const Extension* known = FindExtension(name);
    if (known != nullptr && known->warning.empty()) continue;
    if (warnings.size() == kMaxNamed) {
      ++unnamed;
    } else if (known != nullptr) {
      warnings.emplace_back(known->warning);
    } else {
      warnings.push_back("The extension " + name.substr(0, kMaxNameLength) +
                         " is not supported, and what it adds is left out.");
    }
  }
  if (unnamed > 0) warnings.push_back(std::to_string(unnamed) + " further extensions are not supported.");
  return warnings;
}

}  // namespace docent::content
