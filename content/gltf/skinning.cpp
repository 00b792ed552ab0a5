// SPDX-License-Identifier: Apache-2.0
#include "content/gltf/skinning.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>

#include "content/gltf/json.h"

namespace docent::content {
namespace {

class SkinningChecker {
 public:
  SkinningChecker(const std::string& file, const LoadLimits& limits, AccessorCache* accessors)
      : file_(file), vertices_left_(limits.max_vertices), accessors_(*accessors) {}

  // Throws when a vertex of the mesh uses a joint that is not below `joints`.
  void Check(const tinygltf::Mesh& mesh, const std::string& place, std::size_t joints) {
    for (const tinygltf::Primitive& primitive : mesh.primitives) {
      for (const JointSet& set : JointSets(primitive.attributes)) {
        const std::uint64_t needed = JointsNeeded(set, place);
        if (needed <= joints) continue;
        Refuse(
            file_, place,
            "uses joint " + std::to_string(needed - 1) + " of a skin with " + std::to_string(joints) + ".");
      }
    }
  }

 private:
  // The largest joint with weight plus one. Primitives often share accessors, so each pair is read once.
  std::uint64_t JointsNeeded(const JointSet& set, const std::string& place) {
    const auto [entry, is_new] = needed_.try_emplace({set.joints, set.weights}, 0);
    if (!is_new) return entry->second;
    const AccessorReader& joints = accessors_.Get(set.joints);
    const AccessorReader& weights = accessors_.Get(set.weights);
    if (joints.count() > vertices_left_) Refuse(file_, place, "has too many vertices with joints.");
    vertices_left_ -= joints.count();
    for (std::size_t i = 0; i < joints.count(); ++i) {
      for (int k = 0; k < 4; ++k) {
        const float weight = weights.Float(i, k);
        if (weight < 0) Refuse(file_, place, "has a vertex with a negative weight.");
        if (weight > 0) entry->second = std::max(entry->second, std::uint64_t{joints.Unsigned(i, k)} + 1);
      }
    }
    return entry->second;
  }

  const std::string& file_;
  std::uint64_t vertices_left_;
  AccessorCache& accessors_;
  std::map<std::pair<int, int>, std::uint64_t> needed_;
};

}  // namespace

std::vector<JointSet> JointSets(const std::map<std::string, int>& attributes) {
  std::vector<JointSet> sets;
  for (int i = 0;; ++i) {
    const auto joints = attributes.find("JOINTS_" + std::to_string(i));
    const auto weights = attributes.find("WEIGHTS_" + std::to_string(i));
    if (joints == attributes.end() || weights == attributes.end()) return sets;
    sets.push_back({joints->second, weights->second});
  }
}

void CheckSkinning(const std::string& file, const tinygltf::Model& source, const LoadLimits& limits,
                   AccessorCache* accessors) {
  // A mesh is checked once, against the smallest of its skins.
  std::vector<std::size_t> joints(source.meshes.size(), std::numeric_limits<std::size_t>::max());
  for (const tinygltf::Node& node : source.nodes) {
    if (node.mesh < 0 || node.skin < 0) continue;
    std::size_t& least = joints[static_cast<std::size_t>(node.mesh)];
    least = std::min(least, source.skins[static_cast<std::size_t>(node.skin)].joints.size());
  }
  SkinningChecker checker(file, limits, accessors);
  for (std::size_t i = 0; i < joints.size(); ++i) {
    checker.Check(source.meshes[i], Place("meshes", i), joints[i]);
  }
}

}  // namespace docent::content
