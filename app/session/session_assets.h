// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/files/file_stamp.h"
#include "app/script/commands.h"
#include "app/session/library_scene.h"
#include "content/asset.h"

namespace docent::app {

// A file that a command places.
struct AssetFile {
  std::string name;  // as the command has it
  content::AssetKind kind{};
};
// Empty for a command that places none.
std::optional<AssetFile> FileOf(const Command& command);

// The models, images and sounds that a session has decoded, from files and from the library; the same bytes
// are kept once. The session's mutex guards it.
class SessionAssets {
 public:
  // What a file held at the time of its stamp.
  struct Decoded {
    std::shared_ptr<content::Asset> asset;
    FileStamp stamp;
  };

  // Where relative files are searched first, before the working folder.
  void SetFolder(const std::filesystem::path& folder) { folder_ = folder; }
  // The model, image or sound in this file, which is read again only after it was written anew. Throws Error
  // when it cannot be read as that.
  std::shared_ptr<const content::Asset> Load(const std::string& file,
                                             content::AssetKind kind = content::AssetKind::kModel);
  // The same in steps, of which the second takes long and needs no mutex. Find returns null if the file has
  // to be read.
  std::shared_ptr<const content::Asset> Find(const std::string& file, content::AssetKind kind) const;
  static Decoded Decode(const std::filesystem::path& folder, const std::string& file,
                        content::AssetKind kind);
  std::shared_ptr<const content::Asset> Keep(const std::string& file, content::AssetKind kind,
                                             Decoded decoded);

  // What the files that were loaded since the last call could not be shown with, one sentence each that names
  // its file.
  std::vector<std::string> TakeWarnings() { return std::exchange(warnings_, {}); }

  const AssetCache& all() const { return assets_; }
  // Adds those that are not known yet, and takes them from `decoded`.
  void Merge(AssetCache* decoded) { assets_.merge(*decoded); }
  // Forgets what neither a map nor a file that was loaded uses.
  void EvictUnused();

 private:
  struct LoadedFile {
    std::shared_ptr<const content::Asset> asset;
    FileStamp stamp;
  };

  AssetCache assets_;  // by id
  // by file name in commands, and what it is read as
  std::map<std::pair<std::string, content::AssetKind>, LoadedFile> files_;
  std::filesystem::path folder_;
  std::vector<std::string> warnings_;
};

}  // namespace docent::app
