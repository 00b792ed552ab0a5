// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "content/scene.h"

namespace docent::app {

// What a file is to be read as, by its extension in any case: .png, .jpg and .jpeg are images, .wav, .flac,
// .ogg and .oga sounds, and all others models. Reads nothing; any thread.
content::AssetKind KindOfFile(const std::filesystem::path& file);

}  // namespace docent::app
