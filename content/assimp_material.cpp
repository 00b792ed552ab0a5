// SPDX-License-Identifier: Apache-2.0
#include "content/assimp_material.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>

#include "content/gltf/images.h"
#include "content/gltf/resources.h"
#include "engine/base/error.h"

namespace docent::content {
namespace {

float UnitClamped(float value) {
  return std::isfinite(value) ? std::clamp(value, 0.0f, 1.0f) : 0.0f;
}

std::string PercentEncoded(const std::string& path) {
  constexpr char kDigits[] = "0123456789ABCDEF";
  std::string uri;
  for (const char letter : path) {
    const auto byte = static_cast<unsigned char>(letter);
    const bool plain =
        std::isalnum(byte) != 0 || letter == '/' || letter == '.' || letter == '-' || letter == '_';
    if (plain) {
      uri += letter;
    } else {
      uri += '%';
      uri += kDigits[byte >> 4];
      uri += kDigits[byte & 15];
    }
  }
  return uri;
}

std::optional<aiColor4D> ColorOf(const aiMaterial& source) {
  aiColor4D color;
  if (source.Get(AI_MATKEY_BASE_COLOR, color) == AI_SUCCESS) return color;
  if (source.Get(AI_MATKEY_COLOR_DIFFUSE, color) == AI_SUCCESS) return color;
  return std::nullopt;
}

// Converts a Blinn-Phong exponent n to roughness. Both lobes have the same width for n = 2 / roughness^2 - 2;
// the square root is taken once more because glTF squares its roughness parameter (Karis 2013, "Specular BRDF
// Reference").
float RoughnessOf(const aiMaterial& source) {
  float roughness = 0;
  if (source.Get(AI_MATKEY_ROUGHNESS_FACTOR, roughness) == AI_SUCCESS) return UnitClamped(roughness);
  float exponent = 0;
  if (source.Get(AI_MATKEY_SHININESS, exponent) != AI_SUCCESS || !(exponent >= 0)) return 0.8f;
  return UnitClamped(std::pow(2.0f / (exponent + 2.0f), 0.25f));
}

}  // namespace

int GltfBuilder::Add(const char* array, Json entry) {
  Json& list = json[array];
  if (!list.is_array()) list = Json::array();
  list.push_back(std::move(entry));
  return static_cast<int>(list.size()) - 1;
}

int GltfBuilder::AppendView(std::span<const std::uint8_t> bytes) {
  bin.resize((bin.size() + 3) / 4 * 4);
  const std::size_t begin = bin.size();
  bin.insert(bin.end(), bytes.begin(), bytes.end());
  return Add("bufferViews", {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", bytes.size()}});
}

void AssimpMaterialWriter::Write(const aiMaterial& source) {
  aiString name;
  source.Get(AI_MATKEY_NAME, name);
  float opacity = 1, metallic = 0;
  source.Get(AI_MATKEY_OPACITY, opacity);
  source.Get(AI_MATKEY_METALLIC_FACTOR, metallic);
  const aiColor4D color = ColorOf(source).value_or(aiColor4D(1, 1, 1, 1));
  const float alpha = UnitClamped(opacity);
  Json pbr{{"baseColorFactor", {UnitClamped(color.r), UnitClamped(color.g), UnitClamped(color.b), alpha}},
           {"metallicFactor", UnitClamped(metallic)},
           {"roughnessFactor", RoughnessOf(source)}};
  Json base_texture = WriteTexture(source, aiTextureType_BASE_COLOR);
  if (base_texture.is_null()) base_texture = WriteTexture(source, aiTextureType_DIFFUSE);
  if (!base_texture.is_null()) pbr["baseColorTexture"] = base_texture;
  Json material{{"name", name.C_Str()}, {"pbrMetallicRoughness", pbr}};
  const Json normal_texture = WriteTexture(source, aiTextureType_NORMALS);
  if (!normal_texture.is_null()) material["normalTexture"] = normal_texture;
  aiColor3D emissive(0, 0, 0);
  if (source.Get(AI_MATKEY_COLOR_EMISSIVE, emissive) == AI_SUCCESS) {
    material["emissiveFactor"] = {UnitClamped(emissive.r), UnitClamped(emissive.g), UnitClamped(emissive.b)};
  }
  int two_sided = 0;
  if (source.Get(AI_MATKEY_TWOSIDED, two_sided) == AI_SUCCESS && two_sided != 0)
    material["doubleSided"] = true;
  if (alpha < 1) material["alphaMode"] = "BLEND";
  builder_.Add("materials", std::move(material));
}

Json AssimpMaterialWriter::WriteTexture(const aiMaterial& source, aiTextureType type) {
  aiString path;
  unsigned int uv_set = 0;
  if (source.GetTexture(type, 0, &path, nullptr, &uv_set) != AI_SUCCESS) return nullptr;
  const auto known = textures_.find(path.C_Str());
  const int texture = known != textures_.end() ? known->second : WriteImage(path.C_Str());
  textures_[path.C_Str()] = texture;
  if (texture < 0) return nullptr;
  return {{"index", texture}, {"texCoord", std::min(uv_set, 1u)}};
}

int AssimpMaterialWriter::WriteImage(const std::string& path) {
  const aiTexture* embedded = scene_.GetEmbeddedTexture(path.c_str());
  const Json image = embedded != nullptr ? EmbeddedImage(*embedded) : ExternalImage(path);
  if (image.is_null()) {
    warnings_.push_back("The texture '" + path.substr(0, 80) +
                        "' cannot be shown: no PNG or JPEG file of that name.");
    return -1;
  }
  return builder_.Add("textures", {{"source", builder_.Add("images", image)}});
}

Json AssimpMaterialWriter::EmbeddedImage(const aiTexture& texture) {
  // These are raw texels; a height of 0 marks a complete image file of mWidth bytes.
  if (texture.mHeight != 0) return nullptr;
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(texture.pcData), texture.mWidth);
  if (!ReadImageSize(bytes)) return nullptr;
  return {{"bufferView", builder_.AppendView(bytes)},
          {"mimeType", bytes[0] == 0xFF ? "image/jpeg" : "image/png"}};
}

Json AssimpMaterialWriter::ExternalImage(const std::string& path) {
  std::string forward = path;
  std::replace(forward.begin(), forward.end(), '\\', '/');
  // Many files contain the path on their author's machine. The image then usually is in the model's folder.
  for (const std::string& candidate : {forward, std::filesystem::path(forward).filename().string()}) {
    try {
      const std::string uri = PercentEncoded(candidate);
      const std::filesystem::path found = ResolveUri("", "", uri, folder_);
      if (ReadImageSize(ReadFileBytes(found, limits_.max_file_bytes))) return {{"uri", uri}};
    } catch (const Error&) {
      continue;  // Missing or not allowed: try the next candidate; a warning follows if none is usable.
    }
  }
  return nullptr;
}

}  // namespace docent::content
