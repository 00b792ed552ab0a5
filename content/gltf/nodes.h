// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tiny_gltf.h>

#include <string>
#include <vector>

#include "content/gltf/accessor.h"
#include "content/model.h"

// The node tree, the visible scene and the skins of a checked glTF (§3.5, §3.7.3).
namespace docent::content {

// Fills nodes, roots and skins of `model`, whose meshes must exist already; parents precede children. Nodes
// outside the visible scene lose their meshes but are kept, because they may be joints. Returns the new index
// of each of the file's nodes. The last row of inverse bind matrices is repaired with a warning.
std::vector<int> ReadNodes(const tinygltf::Model& source, AccessorCache* accessors, Model* model);

// Decomposes a matrix into translation, rotation and scale; returns false when it contains a shear, which
// these cannot represent.
bool Decompose(const glm::dmat4& matrix, Node* node);

}  // namespace docent::content
