// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tiny_gltf.h>

#include <map>
#include <string>
#include <vector>

#include "content/gltf/accessor.h"
#include "content/load_limits.h"

// Joints and weights of the vertices of a checked glTF (§3.7.3.3). A vertex has four of each in every set.
namespace docent::content {

// One set as indices of accessors.
struct JointSet {
  int joints = -1, weights = -1;
};

// The sets JOINTS_0 and WEIGHTS_0, JOINTS_1 and WEIGHTS_1, and so on.
std::vector<JointSet> JointSets(const std::map<std::string, int>& attributes);

// Throws Error when a vertex has a negative weight, or a joint with weight that a skin of its mesh does not
// have. All vertices and sets count, also those that nothing shows. Throws, too, when more vertices than
// `limits.max_vertices` have joints.
void CheckSkinning(const std::string& file, const tinygltf::Model& source, const LoadLimits& limits,
                   AccessorCache* accessors);

}  // namespace docent::content
