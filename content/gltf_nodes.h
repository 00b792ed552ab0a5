// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tiny_gltf.h>

#include <string>
#include <vector>

#include "content/gltf_accessor.h"
#include "content/model.h"

// The node tree, the scene that is shown, and the skins of a checked glTF (§3.5, §3.7.3).
namespace docent::content {

// Fills nodes, roots and skins of `model`, whose meshes are there already; nodes come out parents before
// children. Meshes of nodes that the scene does not show are taken off; the nodes stay, because they may be
// joints. Returns the new place of each of the file's nodes.
std::vector<int> ReadNodes(const std::string& file, const tinygltf::Model& source, AccessorCache* accessors,
                           Model* model);

// Fills translation, rotation and scale from a matrix; false when it shears, which those three cannot say.
bool Decompose(const glm::dmat4& matrix, Node* node);

}  // namespace docent::content
