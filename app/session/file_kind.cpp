// SPDX-License-Identifier: Apache-2.0
#include "app/session/file_kind.h"

#include <algorithm>
#include <string>

namespace docent::app {

content::AssetKind KindOfFile(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c); });
  for (const char* image : {".png", ".jpg", ".jpeg"}) {
    if (extension == image) return content::AssetKind::kImage;
  }
  for (const char* sound : {".wav", ".flac", ".ogg", ".oga"}) {
    if (extension == sound) return content::AssetKind::kSound;
  }
  return content::AssetKind::kModel;
}

}  // namespace docent::app
