// SPDX-License-Identifier: Apache-2.0
#include "content/gltf/loader.h"

#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "content/gltf/animation.h"
#include "content/gltf/check.h"
#include "content/gltf/container.h"
#include "content/gltf/extensions.h"
#include "content/gltf/images.h"
#include "content/gltf/json.h"
#include "content/gltf/material.h"
#include "content/gltf/mesh.h"
#include "content/gltf/nodes.h"
#include "content/gltf/resources.h"
#include "content/gltf/schema.h"
#include "content/gltf/skinning.h"
#include "content/model_bounds.h"

namespace docent::content {
namespace {

constexpr const char* kBufferUri = "buffer";  // URI of the single buffer in tinygltf's input.

// Removes the members that are not read afterwards from tinygltf's input. tinygltf copies extras and
// extensions into its own trees, some of them once per sibling, which hostile text could use to exhaust
// memory.
Json WithoutUnreadMembers(const Json& value) {
  if (value.is_array()) {
    Json result = Json::array();
    for (const Json& entry : value) result.push_back(WithoutUnreadMembers(entry));
    return result;
  }
  if (!value.is_object()) {
    // tinygltf does not accept 3.0 as an integer. Numbers that are too large for one occur only where no
    // integer is expected.
    if (!value.is_number_float()) return value;
    const double number = value.get<double>();
    return number == std::floor(number) && std::abs(number) < 1e9 ? Json(static_cast<std::int64_t>(number))
                                                                  : value;
  }
  Json result = Json::object();
  for (const auto& [name, member] : value.items()) {
    if (name == "extras" || name == "cameras" || name == "camera") continue;
    if (name != "extensions") {
      result[name] = WithoutUnreadMembers(member);
      continue;
    }
    for (const auto& [extension, object] : member.items()) {
      if (IsDecodedExtension(extension)) result["extensions"][extension] = WithoutUnreadMembers(object);
    }
  }
  return result;
}

// Gives the indices that have no buffer view, which are all zeros (§5.1.1), zeros to view, because tinygltf
// does not read indices otherwise. The sum of their sizes was limited by CheckAccessors.
void GiveIndicesViews(Json* json, std::vector<std::uint8_t>* bin) {
  for (const Json& mesh : ArrayOf(*json, "meshes")) {
    for (const Json& primitive : mesh["primitives"]) {
      if (!primitive.contains("indices")) continue;
      Json& accessor = (*json)["accessors"][primitive["indices"].get<std::size_t>()];
      if (accessor.contains("bufferView")) continue;
      bin->resize((bin->size() + 3) / 4 * 4);
      const std::uint64_t bytes =
          accessor["count"].get<std::uint64_t>() * ComponentBytes(accessor["componentType"].get<int>());
      accessor["bufferView"] = CountOf(*json, "bufferViews");
      (*json)["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", bin->size()}, {"byteLength", bytes}});
      bin->resize(bin->size() + bytes, 0);
    }
  }
}

bool KeepEncoded(tinygltf::Image*, const int, std::string*, std::string*, int, int, const unsigned char*, int,
                 void*) {
  return true;  // Images are decoded later, and only those that a texture uses.
}

tinygltf::Model ParseText(const std::string& name, const Json& json, const std::vector<std::uint8_t>& bin) {
  tinygltf::TinyGLTF parser;
  parser.SetImageLoader(&KeepEncoded, nullptr);
  tinygltf::FsCallbacks files{};
  files.FileExists = [](const std::string& uri, void*) { return uri == kBufferUri; };
  files.ExpandFilePath = [](const std::string& uri, void*) { return uri; };
  files.ReadWholeFile = [](std::vector<unsigned char>* bytes, std::string*, const std::string& uri,
                           void* user_data) {
    if (uri != kBufferUri) return false;
    *bytes = *static_cast<const std::vector<std::uint8_t>*>(user_data);
    return true;
  };
  files.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
    return false;
  };
  files.user_data = const_cast<std::vector<std::uint8_t>*>(&bin);
  parser.SetFsCallbacks(files);
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  tinygltf::Model source;
  std::string fault, warning;
  if (!parser.LoadASCIIFromString(&source, &fault, &warning, text.data(),
                                  static_cast<unsigned int>(text.size()), "")) {
    std::replace(fault.begin(), fault.end(), '\n', ' ');
    Refuse(name, "", "the glTF cannot be read (" + fault.substr(0, 200) + ").");
  }
  return source;
}

// tinygltf drops entries that it cannot read from some lists, and the indices in the file would then refer to
// other entries. All decoders trust the buffer views, so those are also checked against the data that
// tinygltf has.
void CheckNothingLost(const std::string& name, const Json& json, const tinygltf::Model& source) {
  bool same =
      CountOf(json, "accessors") == source.accessors.size() &&
      CountOf(json, "bufferViews") == source.bufferViews.size() &&
      CountOf(json, "meshes") == source.meshes.size() && CountOf(json, "nodes") == source.nodes.size() &&
      CountOf(json, "materials") == source.materials.size() &&
      CountOf(json, "textures") == source.textures.size() &&
      CountOf(json, "images") == source.images.size() &&
      CountOf(json, "samplers") == source.samplers.size() && CountOf(json, "skins") == source.skins.size() &&
      CountOf(json, "scenes") == source.scenes.size() &&
      CountOf(json, "animations") == source.animations.size();
  for (std::size_t i = 0; same && i < source.animations.size(); ++i) {
    const Json& animation = json["animations"][i];
    same = CountOf(animation, "samplers") == source.animations[i].samplers.size();
  }
  for (const tinygltf::BufferView& view : source.bufferViews) {
    const std::size_t buffer = static_cast<std::size_t>(view.buffer);
    same = same && buffer < source.buffers.size() && view.byteOffset <= source.buffers[buffer].data.size() &&
           view.byteLength <= source.buffers[buffer].data.size() - view.byteOffset;
  }
  if (!same) Refuse(name, "", "the glTF cannot be read: a part of it is not valid.");
}

tinygltf::Model Parse(const std::string& name, const PackedGltf& packed) {
  Json json = WithoutUnreadMembers(packed.json);
  std::vector<std::uint8_t> bin = packed.bin;
  GiveIndicesViews(&json, &bin);
  if (!bin.empty()) json["buffers"] = Json::array({{{"byteLength", bin.size()}, {"uri", kBufferUri}}});
  tinygltf::Model source = ParseText(name, json, bin);
  CheckNothingLost(name, json, source);
  return source;
}

// Decodes the images that textures use. An image that is damaged costs its textures and a warning. Returns
// the index in Model::images of each of the file's images.
std::vector<int> ReadImages(const std::string& name, const tinygltf::Model& source, const LoadLimits& limits,
                            Model* model) {
  const std::vector<bool> used = UsedImages(source);
  std::vector<int> place_of(used.size(), -1);
  std::uint64_t pixels_left = limits.max_image_pixels;
  for (std::size_t i = 0; i < used.size(); ++i) {
    const tinygltf::BufferView& view =
        source.bufferViews[static_cast<std::size_t>(source.images[i].bufferView)];
    const std::span<const std::uint8_t> bytes(source.buffers[static_cast<std::size_t>(view.buffer)].data);
    const std::span<const std::uint8_t> encoded = bytes.subspan(view.byteOffset, view.byteLength);
    std::optional<std::string> fault = ImageFault(encoded);
    if (!fault && used[i]) {
      std::optional<Image> image = DecodeImage(name, Place("images", i), encoded, limits, &pixels_left);
      if (image) {
        place_of[i] = static_cast<int>(model->images.size());
        model->images.push_back(std::move(*image));
      } else {
        fault = "is a damaged image";
      }
    }
    // What only an extension shows, such as a WebP image beside its PNG, costs no texture.
    const char* const loss = used[i] ? ", and its textures are left out." : ", and is left out.";
    if (fault) model->warnings.push_back(Place("images", i) + " " + *fault + loss);
  }
  return place_of;
}

void CheckDrawn(const std::string& name, const Model& model, const LoadLimits& limits) {
  std::vector<std::uint64_t> indices(model.meshes.size(), 0);
  for (std::size_t i = 0; i < indices.size(); ++i) {
    for (const Primitive& primitive : model.meshes[i].primitives) {
      indices[i] += std::max(primitive.indices.size(), primitive.vertices.size());
    }
  }
  std::uint64_t drawn = 0, primitives = 0;
  for (const Node& node : model.nodes) {
    if (node.mesh < 0) continue;
    const auto mesh = static_cast<std::size_t>(node.mesh);
    drawn += indices[mesh];
    primitives += model.meshes[mesh].primitives.size();
    if (drawn > limits.max_drawn_indices) {
      Refuse(name, "nodes", "show more than " + std::to_string(limits.max_drawn_indices / 3) + " triangles.");
    }
    if (primitives > limits.max_drawn_primitives) {
      Refuse(name, "nodes", "show more than " + std::to_string(limits.max_drawn_primitives) + " primitives.");
    }
  }
}

std::shared_ptr<Model> Convert(const std::string& name, const tinygltf::Model& source,
                               const LoadLimits& limits, std::vector<std::string> warnings) {
  auto model = std::make_shared<Model>();
  model->name = name;
  model->warnings = std::move(warnings);
  AccessorCache accessors(name, source);
  accessors.CheckFinite(limits.max_file_bytes);
  CheckSkinning(name, source, limits, &accessors);
  const std::vector<int> image_from_source = ReadImages(name, source, limits, model.get());
  model->textures = ReadTextures(source, image_from_source);
  model->materials = ReadMaterials(source, model->textures, model->images, &model->warnings);
  MeshReader meshes(name, source, model->materials, limits, &accessors, &model->warnings);
  for (std::size_t i = 0; i < source.meshes.size(); ++i) model->meshes.push_back(meshes.Read(i));
  const std::vector<int> place_of = ReadNodes(source, &accessors, model.get());
  model->animations = ReadAnimations(name, source, place_of, limits, &accessors, &model->warnings);
  CheckDrawn(name, *model, limits);
  const auto bounds = RestBounds(*model);
  if (!bounds) Refuse(name, "nodes", "move vertices beyond the range of floating-point numbers.");
  std::tie(model->bounds_min, model->bounds_max) = *bounds;
  return model;
}

}  // namespace

LoadedGltf LoadGltf(const std::string& name, std::vector<std::uint8_t> bytes,
                    const std::optional<std::filesystem::path>& folder, const LoadLimits& limits) {
  if (bytes.size() > limits.max_file_bytes) {
    Refuse(name, "", "the file is larger than " + std::to_string(limits.max_file_bytes) + " bytes.");
  }
  const GltfContainer container = SplitGltf(name, bytes);
  Json root = ParseGltfJson(name, container.json, limits);
  std::vector<std::string> warnings;
  CheckVersion(name, root, &warnings);
  CheckExtensions(name, root);
  ReplaceUnknownAccessors(&root, &warnings);
  CheckSchema(name, root);
  for (std::string& warning : ExtensionWarnings(root)) warnings.push_back(std::move(warning));
  const PackedGltf packed = PackGltf(name, std::move(root), container, folder, limits);
  warnings.insert(warnings.end(), packed.warnings.begin(), packed.warnings.end());
  CheckAccessors(name, packed.json, packed.bin.size() + container.json.size(), limits);
  CheckMeshes(name, packed.json);
  CheckNodes(name, packed.json, limits);
  CheckSkins(name, packed.json);
  CheckAnimations(name, packed.json);
  const tinygltf::Model source = Parse(name, packed);
  LoadedGltf loaded;
  loaded.model = Convert(name, source, limits, std::move(warnings));
  if (container.is_glb && packed.was_self_contained) {
    loaded.glb = std::move(bytes);
  } else {
    loaded.glb = MakeGlb(packed.json.dump(-1, ' ', false, Json::error_handler_t::replace), packed.bin);
  }
  return loaded;
}

}  // namespace docent::content
