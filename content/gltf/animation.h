// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tiny_gltf.h>

#include <string>
#include <vector>

#include "content/gltf/accessor.h"
#include "content/load_limits.h"
#include "content/model.h"

// Keyframe animations of a checked glTF (§3.11).
namespace docent::content {

// Returns Model::animations: finite ascending times, one value per time (three for splines), rotations of
// unit length. place_of is the new index of each of the file's nodes. Channels without a node and those of
// morph weights are left out, the latter with a warning.
std::vector<Animation> ReadAnimations(const std::string& file, const tinygltf::Model& source,
                                      const std::vector<int>& place_of, const LoadLimits& limits,
                                      AccessorCache* accessors, std::vector<std::string>* warnings);

}  // namespace docent::content
