// SPDX-License-Identifier: Apache-2.0
// Complete files: valid models must load, and damaged files must be rejected with a clear message and no
// crash.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "content/asset.h"
#include "tests/support/error_of.h"

namespace docent::content {
namespace {

const std::filesystem::path kAssets = std::filesystem::path(DOCENT_SOURCE_DIR) / ".." / "shared" / "assets";

std::vector<std::filesystem::path> GltfFilesUnder(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    const std::string extension = entry.path().extension().string();
    if (extension == ".gltf" || extension == ".glb") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// What a renderer relies on (content/model.h).
void ExpectValid(const Model& model, const std::string& file) {
  const auto in = [](int index, std::size_t count) { return index >= -1 && index < static_cast<int>(count); };
  for (const Image& image : model.images) {
    EXPECT_EQ(image.rgba.size(), static_cast<std::size_t>(image.width_px * image.height_px * 4)) << file;
  }
  for (const Texture& texture : model.textures) EXPECT_TRUE(in(texture.image, model.images.size())) << file;
  for (const Material& material : model.materials) {
    for (const TextureUse* use :
         {&material.base_color_texture, &material.metallic_roughness_texture, &material.normal_texture,
          &material.occlusion_texture, &material.emissive_texture}) {
      EXPECT_TRUE(in(use->texture, model.textures.size())) << file;
      EXPECT_TRUE(use->uv_set == 0 || use->uv_set == 1) << file;
    }
  }
  for (const Mesh& mesh : model.meshes) {
    for (const Primitive& primitive : mesh.primitives) {
      EXPECT_TRUE(in(primitive.material, model.materials.size())) << file;
      EXPECT_EQ(primitive.indices.size() % 3, 0u) << file;
      const bool inside = std::all_of(primitive.indices.begin(), primitive.indices.end(),
                                      [&](std::uint32_t index) { return index < primitive.vertices.size(); });
      EXPECT_TRUE(inside) << file;
      const bool unit =
          std::all_of(primitive.vertices.begin(), primitive.vertices.end(), [](const Vertex& vertex) {
            return std::abs(glm::length(vertex.normal) - 1) < 1e-3f &&
                   std::isfinite(glm::length(vertex.tangent));
          });
      EXPECT_TRUE(unit) << file;
    }
  }
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    EXPECT_LT(model.nodes[i].parent, static_cast<int>(i)) << file;
    EXPECT_TRUE(in(model.nodes[i].mesh, model.meshes.size())) << file;
    EXPECT_TRUE(in(model.nodes[i].skin, model.skins.size())) << file;
  }
  EXPECT_TRUE(glm::all(glm::lessThanEqual(model.bounds_min, model.bounds_max))) << file;
}

// Returns the error message for a file, or an empty text when it loads.
std::string ErrorOfFile(const std::filesystem::path& path) {
  return ErrorOf([&] {
    const Asset asset = ImportAsset(path);
    ExpectValid(*asset.model, path.string());
    // The packed file must load without other files and give the same asset.
    const Asset again = AssetFromBytes(asset.name, asset.bytes);
    EXPECT_EQ(again.id, asset.id) << path;
    EXPECT_EQ(again.model->meshes.size(), asset.model->meshes.size()) << path;
  });
}

TEST(GltfFiles, EveryModelLoads) {
  if (!std::filesystem::exists(kAssets / "models")) GTEST_SKIP() << "the shared models are missing";
  int loaded = 0;
  for (const std::filesystem::path& path : GltfFilesUnder(kAssets / "models")) {
    const std::string sentence = ErrorOfFile(path);
    // The shared folder may lack one of a model's files; the message must then name a missing file.
    const std::size_t quote = sentence.find('\'');
    if (quote != std::string::npos && sentence.ends_with("which does not exist.")) {
      const std::string missing = sentence.substr(quote + 1, sentence.find('\'', quote + 1) - quote - 1);
      EXPECT_FALSE(std::filesystem::exists(path.parent_path() / missing)) << sentence;
      continue;
    }
    EXPECT_EQ(sentence, "") << path;
    ++loaded;
  }
  EXPECT_GT(loaded, 10);
}

TEST(GltfFiles, EveryEdgeCaseLoadsOrThrowsAClearError) {
  if (!std::filesystem::exists(kAssets / "gltf-edge-cases"))
    GTEST_SKIP() << "the shared edge cases are missing";
  int refused = 0, loaded = 0;
  for (const std::filesystem::path& path : GltfFilesUnder(kAssets / "gltf-edge-cases")) {
    const std::string sentence = ErrorOfFile(path);
    if (sentence.empty()) {
      ++loaded;
      continue;
    }
    ++refused;
    EXPECT_NE(sentence.find(path.filename().string()), std::string::npos) << sentence;
    EXPECT_EQ(sentence.find('\n'), std::string::npos) << sentence;
    EXPECT_LT(sentence.size(), 400u) << sentence;
  }
  EXPECT_GT(refused, 100);
  EXPECT_GT(loaded, 100);
}

// Codes of the Khronos validator for numbers that would make a reader access data out of range.
bool IsAboutRange(const std::string& code) {
  static const std::set<std::string> codes = {"UNRESOLVED_REFERENCE",
                                              "VALUE_NOT_IN_RANGE",
                                              "TYPE_MISMATCH",
                                              "ARRAY_TYPE_MISMATCH",
                                              "INVALID_JSON",
                                              "BUFFER_VIEW_TOO_LONG",
                                              "BUFFER_BYTE_LENGTH_MISMATCH",
                                              "BUFFER_MISSING_GLB_DATA",
                                              "BUFFER_VIEW_TOO_BIG_BYTE_STRIDE",
                                              "BUFFER_VIEW_INVALID_BYTE_STRIDE",
                                              "VALUE_MULTIPLE_OF",
                                              "ACCESSOR_TOO_LONG",
                                              "ACCESSOR_SMALL_BYTESTRIDE",
                                              "ACCESSOR_OFFSET_ALIGNMENT",
                                              "ACCESSOR_TOTAL_OFFSET_ALIGNMENT",
                                              "ACCESSOR_MATRIX_ALIGNMENT",
                                              "ACCESSOR_SPARSE_COUNT_OUT_OF_RANGE",
                                              "ACCESSOR_INDEX_OOB",
                                              "ACCESSOR_INDEX_PRIMITIVE_RESTART",
                                              "ACCESSOR_JOINTS_INDEX_OOB",
                                              "ACCESSOR_INVALID_FLOAT",
                                              "ACCESSOR_NORMALIZED_INVALID",
                                              "MESH_PRIMITIVE_UNEQUAL_ACCESSOR_COUNT",
                                              "MESH_PRIMITIVE_MORPH_TARGET_INVALID_ATTRIBUTE_COUNT",
                                              "MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_INVALID_FORMAT",
                                              "MESH_PRIMITIVE_INDICES_ACCESSOR_INVALID_FORMAT",
                                              "MESH_PRIMITIVE_INDICES_ACCESSOR_WITH_BYTESTRIDE",
                                              "INVALID_IBM_ACCESSOR_COUNT",
                                              "SKIN_IBM_INVALID_FORMAT",
                                              "ANIMATION_SAMPLER_OUTPUT_ACCESSOR_INVALID_COUNT",
                                              "ANIMATION_SAMPLER_OUTPUT_ACCESSOR_INVALID_FORMAT",
                                              "ANIMATION_SAMPLER_INPUT_ACCESSOR_INVALID_FORMAT",
                                              "ANIMATION_SAMPLER_INPUT_ACCESSOR_TOO_FEW_ELEMENTS",
                                              "ACCESSOR_ANIMATION_INPUT_NEGATIVE",
                                              "ACCESSOR_ANIMATION_INPUT_NON_INCREASING",
                                              "NODE_LOOP",
                                              "NODE_PARENT_OVERRIDE",
                                              "GLB_LENGTH_MISMATCH",
                                              "GLB_LENGTH_TOO_SMALL",
                                              "GLB_CHUNK_TOO_BIG",
                                              "GLB_CHUNK_LENGTH_UNALIGNED",
                                              "GLB_UNEXPECTED_END_OF_CHUNK_DATA",
                                              "GLB_UNEXPECTED_END_OF_CHUNK_HEADER",
                                              "GLB_UNEXPECTED_END_OF_HEADER",
                                              "GLB_DUPLICATE_CHUNK",
                                              "GLB_UNEXPECTED_FIRST_CHUNK",
                                              "GLB_INVALID_MAGIC",
                                              "GLB_INVALID_VERSION",
                                              "GLB_EMPTY_CHUNK",
                                              "IMAGE_UNEXPECTED_EOS",
                                              "IMAGE_DATA_INVALID",
                                              "IO_ERROR",
                                              "INVALID_URI"};
  return codes.contains(code);
}

// Cases where Docent intentionally differs from the validator.
bool DiffersOnPurpose(const std::string& file) {
  static const std::map<std::string, std::string> reasons = {
      // Accepted: the error is in data that is not read.
      {"buffer_view/invalid_stride_wrong_target.gltf", "nothing uses the view"},
      {"image/invalid_data_uri_mime_type.gltf", "the format is known from the image itself"},
      // Accepted: an image that cannot be shown costs its textures, with a warning.
      {"image/invalid_data_uri.gltf", "left out"},
      {"image/invalid_image_data.gltf", "left out"},
      {"image/invalid_uri_scheme.gltf", "left out"},
      {"image/not_found.gltf", "left out"},
      {"image/png_eos.gltf", "left out"},
      {"image/unrecognized_format.gltf", "left out"},
      {"root/extensions_non_objects.gltf", "extensions of these names are not read"},
      // Accepted: harmless.
      {"json/bom.gltf", "a byte order mark before the JSON text"},
      {"animation_data/invalid_input_values.gltf", "times before zero and equal times occur in real files"},
      {"glb/bom.glb", "a byte order mark before the JSON text"},
  };
  // Objects of these extensions are not read, so nothing in them can be out of range.
  for (const char* unread :
       {"KHR_lights_punctual", "KHR_materials_anisotropy", "KHR_materials_dispersion", "KHR_materials_ior",
        "KHR_materials_specular", "KHR_materials_variants", "KHR_materials_volume"}) {
    if (file.find(unread) != std::string::npos) return true;
  }
  return std::any_of(reasons.begin(), reasons.end(),
                     [&](const auto& entry) { return file.ends_with(entry.first); });
}

TEST(GltfFiles, AgreesWithTheKhronosValidatorOnRangesAndValidFiles) {
  const std::filesystem::path folder = kAssets / "gltf-edge-cases" / "khronos_validator" / "test";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "the validator's cases are missing";
  int out_of_range = 0, out_of_range_refused = 0, other_errors = 0, other_refused = 0, valid = 0,
      valid_loaded = 0, on_purpose = 0;
  for (const std::filesystem::path& path : GltfFilesUnder(folder)) {
    std::ifstream in(path.string() + ".report.json");
    if (!in) continue;
    const nlohmann::json report = nlohmann::json::parse(in);
    bool has_error = false, is_range = false;
    std::string codes;
    for (const nlohmann::json& message : report["issues"]["messages"]) {
      if (message["severity"] != 0) continue;
      has_error = true;
      is_range = is_range || IsAboutRange(message["code"]);
      codes += message["code"].get<std::string>() + " at " + message.value("pointer", "") + "; ";
    }
    const std::string sentence = ErrorOfFile(path);
    const bool agrees = has_error == !sentence.empty();
    if ((is_range || !has_error) && !agrees && DiffersOnPurpose(path.generic_string())) {
      ++on_purpose;
      continue;
    }
    if (is_range) {
      ++out_of_range;
      out_of_range_refused += sentence.empty() ? 0 : 1;
      if (sentence.empty())
        std::cout << "loads: " << path.lexically_relative(folder).string() << ": " << codes << "\n";
    } else if (has_error) {
      ++other_errors;
      other_refused += sentence.empty() ? 0 : 1;
    } else {
      ++valid;
      valid_loaded += sentence.empty() ? 1 : 0;
      if (!sentence.empty())
        std::cout << "refused: " << path.lexically_relative(folder).string() << ": " << sentence << "\n";
    }
  }
  std::cout << "out of range: " << out_of_range_refused << " of " << out_of_range
            << " refused; other errors: " << other_refused << " of " << other_errors
            << " refused; valid: " << valid_loaded << " of " << valid
            << " load; different by intention: " << on_purpose << "\n";
  EXPECT_GT(out_of_range, 0);
  EXPECT_EQ(out_of_range_refused, out_of_range);
  EXPECT_EQ(valid_loaded, valid);
}

}  // namespace
}  // namespace docent::content
