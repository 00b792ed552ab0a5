// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "content/gltf/json.h"

// What Docent does with the extensions of glTF 2.0: which are read, which are left out, and what a user is
// told of those.
namespace docent::content {

// Whether extensionsUsed contains the extension.
bool UsesExtension(const Json& root, std::string_view name);

// Whether tinygltf must be given the objects of this extension, because a decoder reads them.
bool IsDecodedExtension(std::string_view name);

// Throws Error when the file requires an extension without which it would be shown wrongly.
void CheckExtensions(std::string_view file, const Json& root);

// One sentence for each extension of extensionsUsed that is left out, in the file's order. After a few it
// only counts the others, because hostile files may list many. `root` must have passed CheckSchema.
std::vector<std::string> ExtensionWarnings(const Json& root);

}  // namespace docent::content
