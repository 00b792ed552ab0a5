// SPDX-License-Identifier: Apache-2.0
#include "content/gltf/resources.h"

#include <algorithm>
#include <fstream>
#include <limits>

#include "content/gltf/check.h"
#include "engine/base/base64.h"
#include "engine/base/error.h"

namespace docent::content {
namespace {

int HexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

// RFC 3986 §2.1; empty when an escape is invalid.
std::optional<std::string> PercentDecode(std::string_view text) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      decoded += text[i];
      continue;
    }
    if (i + 2 >= text.size()) return std::nullopt;
    const int high = HexDigit(text[i + 1]), low = HexDigit(text[i + 2]);
    if (high < 0 || low < 0) return std::nullopt;
    decoded += static_cast<char>(high * 16 + low);
    i += 2;
  }
  return decoded;
}

bool IsInside(const std::filesystem::path& path, const std::filesystem::path& folder) {
  const auto mismatch = std::mismatch(folder.begin(), folder.end(), path.begin(), path.end());
  return mismatch.first == folder.end();
}

// Whether a URI names another machine or a device instead of a path below the model's folder.
bool HasScheme(std::string_view uri) {
  return uri.substr(0, uri.find('/')).find(':') != std::string_view::npos;
}

bool IsOnAnotherMachine(std::string_view uri) {
  return uri.starts_with("http://") || uri.starts_with("https://");
}

// Changes the image that a texture or one of its extensions refers to; -1 removes the reference.
void MoveSource(const std::vector<int>& place_of, Json* object) {
  const auto source = object->find("source");
  if (source == object->end()) return;
  const int place = place_of[source->get<std::size_t>()];
  if (place < 0) {
    object->erase(source);
  } else {
    *source = place;
  }
}

// Removes the images that could not be read, so that the packed file refers to no other file. Their textures
// stay, without an image.
void RemoveImages(const std::vector<bool>& lost, Json* root) {
  std::vector<int> place_of(lost.size(), -1);
  Json kept = Json::array();
  for (std::size_t i = 0; i < lost.size(); ++i) {
    if (lost[i]) continue;
    place_of[i] = static_cast<int>(kept.size());
    kept.push_back(std::move((*root)["images"][i]));
  }
  (*root)["images"] = std::move(kept);
  if (!root->contains("textures")) return;
  for (Json& texture : (*root)["textures"]) {
    MoveSource(place_of, &texture);
    for (const char* extension : {"EXT_texture_webp", "KHR_texture_basisu"}) {
      if (ObjectOf(texture, "extensions").contains(extension))
        MoveSource(place_of, &texture["extensions"][extension]);
    }
  }
}

std::string Shortened(const std::string& text) {
  return text.size() <= 80 ? text : text.substr(0, 77) + "...";
}

// Builds the result of PackGltf.
class Packer {
 public:
  Packer(std::string_view file, const GltfContainer& container,
         const std::optional<std::filesystem::path>& folder, const LoadLimits& limits)
      : file_(file), container_(container), folder_(folder), limits_(limits) {}

  void PackBuffers(Json* root) {
    const std::size_t count = CountOf(*root, "buffers");
    std::vector<std::uint64_t> sizes(count), begins(count);
    std::vector<bool> used(count, false);
    for (const Json& view : ArrayOf(*root, "bufferViews")) used[view["buffer"].get<std::size_t>()] = true;
    for (std::size_t i = 0; i < count; ++i) {
      begins[i] = Align();
      sizes[i] = PackBuffer(i, used[i], &(*root)["buffers"][i]);
    }
    CheckBufferViews(file_, *root, sizes);
    if (!root->contains("bufferViews")) return;
    for (Json& view : (*root)["bufferViews"]) {
      view["byteOffset"] = UnsignedOr(view, "byteOffset", 0) + begins[view["buffer"].get<std::size_t>()];
      view["buffer"] = 0;
      // The extension's buffer index would be wrong now, and nothing reads the extension.
      if (view.contains("extensions")) view["extensions"].erase("EXT_meshopt_compression");
    }
  }

  void PackImages(Json* root) {
    std::vector<bool> lost(CountOf(*root, "images"), false);
    for (std::size_t i = 0; i < lost.size(); ++i) {
      Json& image = (*root)["images"][i];
      const std::string place = Place("images", i);
      if (image.contains("uri") == image.contains("bufferView")) {
        Refuse(file_, place, "must have either a uri or a bufferView.");
      }
      if (image.contains("bufferView")) {
        if ((*root)["bufferViews"][image["bufferView"].get<std::size_t>()].contains("byteStride")) {
          Refuse(file_, place, "lies in a view with a byteStride.");
        }
        continue;
      }
      const std::vector<std::uint8_t> bytes = FetchImage(image["uri"].get<std::string>(), place);
      lost[i] = bytes.empty();
      if (lost[i]) continue;
      const std::uint64_t begin = Align();
      Append(bytes);
      image.erase("uri");
      image["bufferView"] = CountOf(*root, "bufferViews");
      if (!image.contains("mimeType")) image["mimeType"] = bytes[0] == 0xFF ? "image/jpeg" : "image/png";
      (*root)["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", begin}, {"byteLength", bytes.size()}});
    }
    if (std::find(lost.begin(), lost.end(), true) != lost.end()) RemoveImages(lost, root);
  }

  PackedGltf Finish(Json root) {
    root.erase("buffers");
    if (!bin_.empty()) root["buffers"] = Json::array({{{"byteLength", bin_.size()}}});
    return {std::move(root), std::move(bin_), self_contained_, std::move(warnings_)};
  }

 private:
  // Appends the data of a buffer and returns its size. `used` says whether a buffer view refers to it.
  std::uint64_t PackBuffer(std::size_t index, bool used, Json* buffer) {
    const std::string place = Place("buffers", index);
    const std::uint64_t claimed = (*buffer)["byteLength"].get<std::uint64_t>();
    if (buffer->contains("uri")) {
      const std::string uri = (*buffer)["uri"].get<std::string>();
      if (!used && IsOnAnotherMachine(uri)) {
        warnings_.push_back("The buffer '" + Shortened(uri) + "', which nothing uses, is left out.");
        buffer->erase("uri");
        self_contained_ = false;  // Then the packed file is kept, which does not name it.
        return 0;
      }
      const std::vector<std::uint8_t> bytes = Fetch(uri, place);
      Append(std::span(bytes).first(std::min<std::uint64_t>(claimed, bytes.size())));
      return bytes.size();
    }
    if (index == 0 && container_.is_glb) {
      if (!container_.bin) Refuse(file_, place, "has no uri, and the GLB file has no BIN chunk.");
      Append(container_.bin->first(std::min<std::uint64_t>(claimed, container_.bin->size())));
      return container_.bin->size();
    }
    if (!used) return 0;
    // The content of such a buffer is undefined (§3.6.1.1). The limit keeps a small file from claiming much
    // memory.
    if (claimed > container_.json.size()) {
      Refuse(file_, place, "names no data and claims more bytes than the whole file has.");
    }
    warnings_.push_back("The buffer " + std::to_string(index) + " names no data and is read as zeros.");
    const std::vector<std::uint8_t> zeros(claimed, 0);
    Append(zeros);
    return claimed;
  }

  // Pads to the largest alignment that glTF requires, and returns the offset of the next part.
  std::uint64_t Align() {
    bin_.resize((bin_.size() + 3) / 4 * 4);
    return bin_.size();
  }

  void Append(std::span<const std::uint8_t> bytes) {
    if (bytes.size() >
        limits_.max_file_bytes - std::min<std::uint64_t>(bin_.size(), limits_.max_file_bytes)) {
      RefuseSize();
    }
    bin_.insert(bin_.end(), bytes.begin(), bytes.end());
  }

  std::vector<std::uint8_t> Fetch(const std::string& uri, const std::string& place) {
    CheckAllowed(uri, place);
    std::vector<std::uint8_t> bytes = Read(uri, place);
    CountFetched(bytes.size());
    return bytes;
  }

  // The bytes of an image; empty with a warning when they cannot be had, which costs its textures only.
  std::vector<std::uint8_t> FetchImage(const std::string& uri, const std::string& place) {
    CheckAllowed(uri, place);
    std::string fault = "The image '" + Shortened(uri) + "' is empty.";
    std::vector<std::uint8_t> bytes;
    try {
      bytes = Read(uri, place);
    } catch (const Error& error) {
      fault = error.what();
    }
    if (bytes.empty()) warnings_.push_back(fault + " Its textures are left out.");
    CountFetched(bytes.size());
    return bytes;
  }

  // A model in a library must not refer to other files.
  void CheckAllowed(const std::string& uri, const std::string& place) {
    if (IsDataUri(uri)) return;
    self_contained_ = false;
    if (!folder_) {
      Refuse(file_, place,
             "refers to the file '" + Shortened(uri) + "', but a model in a library must be self-contained.");
    }
  }

  std::vector<std::uint8_t> Read(const std::string& uri, const std::string& place) const {
    if (!IsDataUri(uri))
      return ReadFileBytes(ResolveUri(file_, place + ".uri", uri, *folder_), limits_.max_file_bytes);
    std::optional<std::vector<std::uint8_t>> bytes = DecodeDataUri(uri);
    if (!bytes) Refuse(file_, place + ".uri", "is a data URI that cannot be decoded.");
    return std::move(*bytes);
  }

  // Files that are read but not kept count too, because many small buffers may refer to one large file.
  void CountFetched(std::uint64_t bytes) {
    fetched_bytes_ += bytes;
    if (fetched_bytes_ > limits_.max_file_bytes) RefuseSize();
  }

  [[noreturn]] void RefuseSize() const {
    Refuse(
        file_, "",
        "the model's files together are larger than " + std::to_string(limits_.max_file_bytes) + " bytes.");
  }

  std::string_view file_;
  const GltfContainer& container_;
  const std::optional<std::filesystem::path>& folder_;
  const LoadLimits& limits_;
  std::vector<std::uint8_t> bin_;
  std::uint64_t fetched_bytes_ = 0;
  bool self_contained_ = true;
  std::vector<std::string> warnings_;
};

}  // namespace

std::vector<std::uint8_t> ReadFileBytes(const std::filesystem::path& path, std::uint64_t max_bytes) {
  std::error_code code;
  // Reading another kind of file (a pipe, a device) might never end or might block.
  if (!std::filesystem::is_regular_file(path, code)) {
    throw Error(path.string() + ": " +
                (std::filesystem::exists(path, code) ? "is not a file." : "no such file."));
  }
  const std::uintmax_t size = std::filesystem::file_size(path, code);
  if (code) throw Error(path.string() + ": cannot be read (" + code.message() + ").");
  if (size > max_bytes) {
    throw Error(path.string() + ": is larger than " + std::to_string(max_bytes) + " bytes.");
  }
  std::vector<std::uint8_t> bytes(size);
  std::ifstream in(path, std::ios::binary);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!in || in.gcount() != static_cast<std::streamsize>(size))
    throw Error(path.string() + ": cannot be read.");
  return bytes;
}

std::filesystem::path ResolveUri(std::string_view file, std::string_view place, const std::string& uri,
                                 const std::filesystem::path& folder) {
  const std::string quoted = "'" + Shortened(uri) + "'";
  const std::optional<std::string> decoded = PercentDecode(uri);
  if (!decoded || decoded->empty() || decoded->find('\0') != std::string::npos)
    Refuse(file, place, "is not a file name: " + quoted + ".");
  const std::filesystem::path relative(*decoded);
  const bool climbs = std::find(relative.begin(), relative.end(), "..") != relative.end();
  if (HasScheme(*decoded) || climbs || relative.is_absolute() || decoded->find('\\') != std::string::npos) {
    Refuse(file, place, "points outside the model's folder: " + quoted + ".");
  }
  std::error_code code;
  const std::filesystem::path base = std::filesystem::canonical(folder.empty() ? "." : folder, code);
  if (code) Refuse(file, place, "cannot be found: the model's folder cannot be read.");
  const std::filesystem::path target = std::filesystem::canonical(base / relative, code);
  if (code) Refuse(file, place, "refers to " + quoted + ", which does not exist.");
  if (!IsInside(target, base))
    Refuse(file, place, "leads outside the model's folder by a link: " + quoted + ".");
  return target;
}

bool IsDataUri(std::string_view uri) {
  return uri.substr(0, 5) == "data:";
}

std::optional<std::vector<std::uint8_t>> DecodeDataUri(std::string_view uri) {
  // data:TYPE,PERCENT-ENCODED or data:TYPE;base64,DIGITS
  const std::size_t comma = uri.substr(0, 256).find(',');
  if (!IsDataUri(uri) || comma == std::string_view::npos) return std::nullopt;
  const std::string_view head = uri.substr(0, comma);
  const std::string_view text = uri.substr(comma + 1);
  if (head.find(";;") != std::string_view::npos) return std::nullopt;
  if (!head.ends_with(";base64")) {
    const std::optional<std::string> plain = PercentDecode(text);
    if (!plain) return std::nullopt;
    return std::vector<std::uint8_t>(plain->begin(), plain->end());
  }
  return DecodeBase64(text);
}

PackedGltf PackGltf(std::string_view file, Json root, const GltfContainer& container,
                    const std::optional<std::filesystem::path>& folder, const LoadLimits& limits) {
  Packer packer(file, container, folder, limits);
  packer.PackBuffers(&root);
  packer.PackImages(&root);
  return packer.Finish(std::move(root));
}

}  // namespace docent::content
