// SPDX-License-Identifier: Apache-2.0
#include "content/gltf/material.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace docent::content {
namespace {

constexpr float kDielectricSpecular = 0.04f;  // Of glass and plastic (glTF 2.0 appendix B).

float NumberOr(const tinygltf::Value& object, const char* name, float fallback) {
  return object.Has(name) ? static_cast<float>(object.Get(name).GetNumberAsDouble()) : fallback;
}

template <int N>
glm::vec<N, float> VectorOr(const tinygltf::Value& object, const char* name,
                            const glm::vec<N, float>& fallback) {
  if (!object.Has(name)) return fallback;
  glm::vec<N, float> value;
  for (int k = 0; k < N; ++k) value[k] = static_cast<float>(object.Get(name).Get(k).GetNumberAsDouble());
  return value;
}

// The matrix of KHR_texture_transform: scale, then counter-clockwise rotation, then translation.
glm::mat3 UvTransform(const tinygltf::Value& transform) {
  const glm::vec2 offset = VectorOr<2>(transform, "offset", glm::vec2(0));
  const glm::vec2 scale = VectorOr<2>(transform, "scale", glm::vec2(1));
  const float angle = NumberOr(transform, "rotation", 0);
  const float c = std::cos(angle), s = std::sin(angle);
  // GLM's matrices are column-major.
  return glm::mat3(c * scale.x, -s * scale.x, 0, s * scale.y, c * scale.y, 0, offset.x, offset.y, 1);
}

class MaterialReader {
 public:
  MaterialReader(const std::vector<Texture>& textures, const std::vector<Image>& images,
                 std::vector<std::string>* warnings)
      : textures_(textures), images_(images), warnings_(*warnings) {}

  Material Read(const tinygltf::Material& source) {
    Material material;
    material.name = source.name;
    const tinygltf::PbrMetallicRoughness& pbr = source.pbrMetallicRoughness;
    for (int k = 0; k < 4 && pbr.baseColorFactor.size() == 4; ++k) {
      material.base_color[k] = static_cast<float>(pbr.baseColorFactor[static_cast<std::size_t>(k)]);
    }
    material.metallic = static_cast<float>(pbr.metallicFactor);
    material.roughness = static_cast<float>(pbr.roughnessFactor);
    for (int k = 0; k < 3 && source.emissiveFactor.size() == 3; ++k) {
      material.emissive[k] = static_cast<float>(source.emissiveFactor[static_cast<std::size_t>(k)]);
    }
    material.normal_scale = static_cast<float>(source.normalTexture.scale);
    material.occlusion_strength = static_cast<float>(source.occlusionTexture.strength);
    material.base_color_texture = Use(pbr.baseColorTexture);
    material.metallic_roughness_texture = Use(pbr.metallicRoughnessTexture);
    material.normal_texture = Use(source.normalTexture);
    material.occlusion_texture = Use(source.occlusionTexture);
    material.emissive_texture = Use(source.emissiveTexture);
    if (source.alphaMode == "MASK") material.alpha = Material::Alpha::kMask;
    if (source.alphaMode == "BLEND") material.alpha = Material::Alpha::kBlend;
    material.alpha_cutoff = static_cast<float>(source.alphaCutoff);
    material.double_sided = source.doubleSided;
    ReadExtensions(source, &material);
    return material;
  }

 private:
  template <typename Info>
  TextureUse Use(const Info& info) {
    const auto transform = info.extensions.find("KHR_texture_transform");
    return Use(info.index, info.texCoord, transform == info.extensions.end() ? nullptr : &transform->second);
  }

  TextureUse Use(int texture, int uv_set, const tinygltf::Value* transform) {
    TextureUse use;
    if (texture < 0 || textures_[static_cast<std::size_t>(texture)].image < 0) return use;
    use.uv_set = uv_set;
    if (transform != nullptr) {
      use.uv_transform = UvTransform(*transform);
      use.uv_set = static_cast<int>(NumberOr(*transform, "texCoord", static_cast<float>(uv_set)));
    }
    if (use.uv_set > 1) {
      Warn("Textures that use a third set of texture coordinates are left out.");
      return TextureUse{};
    }
    use.texture = texture;
    return use;
  }

  TextureUse UseOf(const tinygltf::Value& object, const char* name) {
    if (!object.Has(name)) return {};
    const tinygltf::Value& info = object.Get(name);
    const tinygltf::Value* transform = nullptr;
    if (info.Has("extensions") && info.Get("extensions").Has("KHR_texture_transform")) {
      transform = &info.Get("extensions").Get("KHR_texture_transform");
    }
    return Use(info.Get("index").GetNumberAsInt(),
               info.Has("texCoord") ? info.Get("texCoord").GetNumberAsInt() : 0, transform);
  }

  void ReadExtensions(const tinygltf::Material& source, Material* material) {
    material->unlit = source.extensions.contains("KHR_materials_unlit");
    const auto strength = source.extensions.find("KHR_materials_emissive_strength");
    if (strength != source.extensions.end()) {
      const glm::vec3 emissive = material->emissive * NumberOr(strength->second, "emissiveStrength", 1);
      material->emissive = glm::min(emissive, glm::vec3(1e6f));
    }
    const auto transmission = source.extensions.find("KHR_materials_transmission");
    if (transmission != source.extensions.end()) {
      material->transmission = NumberOr(transmission->second, "transmissionFactor", 0);
      material->transmission_texture = UseOf(transmission->second, "transmissionTexture");
    }
    const auto specular = source.extensions.find("KHR_materials_pbrSpecularGlossiness");
    if (specular != source.extensions.end()) ReadSpecularGlossiness(specular->second, material);
  }

  void ReadSpecularGlossiness(const tinygltf::Value& source, Material* material) {
    const glm::vec4 diffuse_factor = VectorOr<4>(source, "diffuseFactor", glm::vec4(1));
    const glm::vec3 specular_factor = VectorOr<3>(source, "specularFactor", glm::vec3(1));
    const TextureUse diffuse_texture = UseOf(source, "diffuseTexture");
    const TextureUse specular_texture = UseOf(source, "specularGlossinessTexture");
    const glm::vec3 diffuse = glm::vec3(diffuse_factor * MeanColor(diffuse_texture));
    const glm::vec4 mean_specular = MeanColor(specular_texture);
    const MetallicBase converted = MetallicFromSpecular(diffuse, specular_factor * glm::vec3(mean_specular));
    material->metallic = converted.metallic;
    material->roughness =
        glm::clamp(1.0f - NumberOr(source, "glossinessFactor", 1) * mean_specular.a, 0.0f, 1.0f);
    material->metallic_roughness_texture = {};
    // The colour of a metal is in its specular texture, that of other materials in the diffuse texture.
    const bool metal = converted.metallic > 0.5f;
    const TextureUse& color_texture =
        metal && specular_texture.texture >= 0 ? specular_texture : diffuse_texture;
    material->base_color_texture = color_texture;
    if (color_texture.texture < 0) {
      material->base_color = glm::vec4(converted.base_color, diffuse_factor.a);
    } else {
      material->base_color =
          metal && specular_texture.texture >= 0 ? glm::vec4(specular_factor, 1) : diffuse_factor;
    }
    if (specular_texture.texture >= 0) {
      Warn("Specular-glossiness materials are approximated by one metallic and one roughness value each.");
    }
  }

  // The mean of the texture's texels in linear light (alpha unchanged); white without a texture. Each image
  // is averaged once, because very many materials may show it.
  glm::vec4 MeanColor(const TextureUse& use) {
    if (use.texture < 0) return glm::vec4(1);
    const int index = textures_[static_cast<std::size_t>(use.texture)].image;
    const auto [entry, is_new] = mean_colors_.try_emplace(index);
    if (is_new) entry->second = MeanOf(images_[static_cast<std::size_t>(index)]);
    return entry->second;
  }

  // A regular sample of at most 64x64 texels is sufficient for a mean.
  static glm::vec4 MeanOf(const Image& image) {
    glm::dvec4 sum(0);
    const int steps_x = std::min(64, image.width_px), steps_y = std::min(64, image.height_px);
    for (int y = 0; y < steps_y; ++y) {
      for (int x = 0; x < steps_x; ++x) {
        const std::size_t column = static_cast<std::size_t>(x) * static_cast<std::size_t>(image.width_px) /
                                   static_cast<std::size_t>(steps_x);
        const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.height_px) /
                                static_cast<std::size_t>(steps_y);
        const std::uint8_t* texel =
            &image.rgba[(row * static_cast<std::size_t>(image.width_px) + column) * 4];
        for (int k = 0; k < 3; ++k) sum[k] += std::pow(texel[k] / 255.0, 2.2);
        sum[3] += texel[3] / 255.0;
      }
    }
    return glm::vec4(sum / (static_cast<double>(steps_x) * steps_y));
  }

  void Warn(const std::string& sentence) {
    if (std::find(warnings_.begin(), warnings_.end(), sentence) == warnings_.end())
      warnings_.push_back(sentence);
  }

  const std::vector<Texture>& textures_;
  const std::vector<Image>& images_;
  std::vector<std::string>& warnings_;
  std::map<int, glm::vec4> mean_colors_;  // Of the images for which they were needed so far.
};

}  // namespace

std::vector<Texture> ReadTextures(const tinygltf::Model& source, const std::vector<int>& image_from_source) {
  std::vector<Texture> textures;
  textures.reserve(source.textures.size());
  for (const tinygltf::Texture& from : source.textures) {
    Texture texture;
    if (from.source >= 0) texture.image = image_from_source[static_cast<std::size_t>(from.source)];
    if (from.sampler >= 0) {
      const tinygltf::Sampler& sampler = source.samplers[static_cast<std::size_t>(from.sampler)];
      texture.repeat_u = sampler.wrapS != TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
      texture.repeat_v = sampler.wrapT != TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
      texture.mirror_u = sampler.wrapS == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT;
      texture.mirror_v = sampler.wrapT == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT;
      texture.nearest = sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
    }
    textures.push_back(texture);
  }
  return textures;
}

std::vector<bool> UsedImages(const tinygltf::Model& source) {
  std::vector<bool> used(source.images.size(), false);
  for (const tinygltf::Texture& texture : source.textures) {
    if (texture.source >= 0) used[static_cast<std::size_t>(texture.source)] = true;
  }
  return used;
}

std::vector<Material> ReadMaterials(const tinygltf::Model& source, const std::vector<Texture>& textures,
                                    const std::vector<Image>& images, std::vector<std::string>* warnings) {
  MaterialReader reader(textures, images, warnings);
  std::vector<Material> materials;
  materials.reserve(source.materials.size());
  for (const tinygltf::Material& material : source.materials) materials.push_back(reader.Read(material));
  return materials;
}

MetallicBase MetallicFromSpecular(const glm::vec3& diffuse, const glm::vec3& specular) {
  const float d = std::max({diffuse.r, diffuse.g, diffuse.b});
  const float s = std::max({specular.r, specular.g, specular.b});
  float k = 1;
  if (s > kDielectricSpecular) {
    // (d + s)^2 >= 4 * 0.04 d for s > 0.04 >= 0, so that the root is real; the smaller one lies in [0, 1].
    const float sum = d + s;
    const float root = std::sqrt(std::max(0.0f, sum * sum - 4 * kDielectricSpecular * d));
    k = glm::clamp((sum - root) / (2 * kDielectricSpecular), 0.0f, 1.0f);
  }
  return {glm::clamp(diffuse + specular - kDielectricSpecular * k, 0.0f, 1.0f), 1 - k};
}

}  // namespace docent::content
