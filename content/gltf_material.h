// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tiny_gltf.h>

#include <string>
#include <vector>

#include "content/model.h"

// Materials and textures of a checked glTF (§3.8, §3.9, KHR_texture_transform, KHR_materials_unlit,
// KHR_materials_emissive_strength, KHR_materials_pbrSpecularGlossiness).
namespace docent::content {

// Model::textures. image_from_source: place in Model::images of each of the file's images, -1 where it is not
// used.
std::vector<Texture> ReadTextures(const tinygltf::Model& source, const std::vector<int>& image_from_source);

// Whether any texture shows each of the file's images: only those are worth decoding.
std::vector<bool> UsedImages(const tinygltf::Model& source);

// Model::materials. Textures of a third or later set of coordinates are left out with a warning;
// specular-glossiness materials are approximated from the mean colours of their textures, which is why the
// images are needed.
std::vector<Material> ReadMaterials(const tinygltf::Model& source, const std::vector<Texture>& textures,
                                    const std::vector<Image>& images, std::vector<std::string>* warnings);

// The metallic-roughness parameters whose diffuse and specular reflection are those of a specular-glossiness
// material. With base colour b, metallic m and k = 1 - m the two models agree where diffuse = b k and
// specular = 0.04 k + b m; eliminating b gives 0.04 k^2 - (d + s) k + d = 0 for their brightest channels d
// and s.
struct MetallicBase {
  glm::vec3 base_color;
  float metallic;
};
MetallicBase MetallicFromSpecular(const glm::vec3& diffuse, const glm::vec3& specular);

}  // namespace docent::content
