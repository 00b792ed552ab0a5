// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tiny_gltf.h>

#include <string>
#include <vector>

#include "content/model.h"

// Materials and textures of a checked glTF (§3.8, §3.9, KHR_texture_transform, KHR_materials_unlit,
// KHR_materials_emissive_strength, KHR_materials_transmission, KHR_materials_pbrSpecularGlossiness).
namespace docent::content {

// Returns Model::textures. image_from_source is the index in Model::images of each of the file's images, or
// -1 if it is unused.
std::vector<Texture> ReadTextures(const tinygltf::Model& source, const std::vector<int>& image_from_source);

// For each of the file's images, whether any texture uses it, so that only those are decoded.
std::vector<bool> UsedImages(const tinygltf::Model& source);

// Returns Model::materials. Textures with a third or later set of coordinates are left out with a warning.
// Specular-glossiness materials are approximated from the mean colours of their textures, which is why the
// images are needed.
std::vector<Material> ReadMaterials(const tinygltf::Model& source, const std::vector<Texture>& textures,
                                    const std::vector<Image>& images, std::vector<std::string>* warnings);

// Returns the metallic-roughness parameters with the same diffuse and specular reflection as a
// specular-glossiness material. With base colour b, metallic m and k = 1 - m, the two models agree if diffuse
// = b k and specular = 0.04 k + b m. Eliminating b gives 0.04 k^2 - (d + s) k + d = 0 for their brightest
// channels d and s.
struct MetallicBase {
  glm::vec3 base_color;
  float metallic;
};
MetallicBase MetallicFromSpecular(const glm::vec3& diffuse, const glm::vec3& specular);

}  // namespace docent::content
