// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "content/gltf/check.h"
#include "content/gltf/extensions.h"

namespace docent::content {
namespace {

constexpr int kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123, kUnsignedInt = 5125,
              kFloat = 5126;

const Json& AccessorAt(const Json& root, const Json& index) {
  return root["accessors"][index.get<std::size_t>()];
}

bool IsType(const Json& accessor, std::string_view type) {
  return accessor["type"] == Json(type);
}

bool HasStride(const Json& root, const Json& accessor) {
  return accessor.contains("bufferView") &&
         root["bufferViews"][accessor["bufferView"].get<std::size_t>()].contains("byteStride");
}

bool IsFloatOrNormalized(const Json& accessor, bool signed_too) {
  const int component = accessor["componentType"].get<int>();
  if (component == kFloat) return true;
  const bool is_unsigned = component == kUnsignedByte || component == kUnsignedShort;
  const bool is_signed = component == kByte || component == kShort;
  return accessor.value("normalized", false) && (is_unsigned || (signed_too && is_signed));
}

// Whether an attribute has a type that §3.7.2.1 allows, or KHR_mesh_quantization if `quantized`.
bool HasAttributeFormat(const std::string& name, const Json& accessor, bool quantized) {
  const int component = accessor["componentType"].get<int>();
  const bool small = component != kUnsignedInt;
  if (name == "POSITION") return IsType(accessor, "VEC3") && (component == kFloat || (quantized && small));
  if (name == "NORMAL") {
    return IsType(accessor, "VEC3") &&
           (component == kFloat || (quantized && IsFloatOrNormalized(accessor, true)));
  }
  if (name == "TANGENT") {
    return IsType(accessor, "VEC4") &&
           (component == kFloat || (quantized && IsFloatOrNormalized(accessor, true)));
  }
  if (name.starts_with("TEXCOORD_")) {
    return IsType(accessor, "VEC2") && (IsFloatOrNormalized(accessor, false) || (quantized && small));
  }
  if (name.starts_with("COLOR_")) {
    return (IsType(accessor, "VEC3") || IsType(accessor, "VEC4")) && IsFloatOrNormalized(accessor, false);
  }
  if (name.starts_with("JOINTS_")) {
    return IsType(accessor, "VEC4") && (component == kUnsignedByte || component == kUnsignedShort);
  }
  if (name.starts_with("WEIGHTS_")) return IsType(accessor, "VEC4") && IsFloatOrNormalized(accessor, false);
  return true;  // An application-specific attribute, which is not read.
}

// `quantized`: whether the file uses KHR_mesh_quantization.
void CheckPrimitive(std::string_view file, const Json& root, const Json& primitive, bool quantized,
                    const std::string& place) {
  const Json& attributes = primitive["attributes"];
  const std::uint64_t count = AccessorAt(root, attributes.begin().value())["count"].get<std::uint64_t>();
  for (const auto& [name, index] : attributes.items()) {
    const Json& accessor = AccessorAt(root, index);
    const std::string attribute_place = place + ".attributes." + name.substr(0, 40);
    if (!HasAttributeFormat(name, accessor, quantized)) {
      Refuse(file, attribute_place, "has a type that is not allowed for this attribute.");
    }
    if (accessor["count"].get<std::uint64_t>() != count) {
      Refuse(file, attribute_place, "has a different number of elements than the other attributes.");
    }
  }
  for (const auto& target : ArrayOf(primitive, "targets")) {
    for (const auto& [name, index] : target.items()) {
      if (AccessorAt(root, index)["count"].get<std::uint64_t>() != count) {
        Refuse(file, place + ".targets", "has a different number of elements than the attributes.");
      }
    }
  }
  for (const auto& [name, index] : attributes.items()) {
    const bool joints = name.starts_with("JOINTS_"), weights = name.starts_with("WEIGHTS_");
    if (!joints && !weights) continue;
    const std::string other = (joints ? "WEIGHTS" : "JOINTS") + name.substr(name.find('_'));
    if (!attributes.contains(other))
      Refuse(file, place, "has joints without weights, or weights without joints.");
  }
  if (!primitive.contains("indices")) return;
  const Json& indices = AccessorAt(root, primitive["indices"]);
  const int component = indices["componentType"].get<int>();
  const bool is_index =
      component == kUnsignedByte || component == kUnsignedShort || component == kUnsignedInt;
  if (!IsType(indices, "SCALAR") || !is_index || indices.value("normalized", false)) {
    Refuse(file, place + ".indices", "is not an accessor of unsigned integers.");
  }
  if (HasStride(root, indices)) Refuse(file, place + ".indices", "lies in a view with a byteStride.");
}

// Returns each node's parent, or -1; refuses a node with two parents.
std::vector<int> Parents(std::string_view file, const Json& nodes) {
  std::vector<int> parents(nodes.size(), -1);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (const Json& child : ArrayOf(nodes[i], "children")) {
      int& parent = parents[child.get<std::size_t>()];
      if (parent >= 0) Refuse(file, Place("nodes", child.get<std::size_t>()), "is the child of two nodes.");
      parent = static_cast<int>(i);
    }
  }
  return parents;
}

// Every node has at most one parent, so nodes that no root reaches form a cycle.
void CheckAcyclic(std::string_view file, const Json& nodes, const std::vector<int>& parents) {
  std::vector<std::size_t> open;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (parents[i] < 0) open.push_back(i);
  }
  std::size_t reached = 0;
  while (!open.empty()) {
    const std::size_t node = open.back();
    open.pop_back();
    ++reached;
    for (const Json& child : ArrayOf(nodes[node], "children")) open.push_back(child.get<std::size_t>());
  }
  if (reached != nodes.size()) Refuse(file, "nodes", "contain a cycle: a node is its own ancestor.");
}

int KeyFrameComponents(const std::string& path) {
  return path == "rotation" ? 4 : 3;
}

void CheckChannel(std::string_view file, const Json& root, const Json& animation, const Json& channel,
                  const std::string& place) {
  const Json& samplers = animation["samplers"];
  const std::uint64_t number = channel["sampler"].get<std::uint64_t>();
  if (number >= samplers.size()) Refuse(file, place + ".sampler", "is not a sampler of this animation.");
  const Json& sampler = samplers[number];
  const Json& input = AccessorAt(root, sampler["input"]);
  const Json& output = AccessorAt(root, sampler["output"]);
  if (!IsType(input, "SCALAR") || input["componentType"].get<int>() != kFloat) {
    Refuse(file, place, "has times that are not floats.");
  }
  const std::string path = channel["target"]["path"].get<std::string>();
  if (path == "weights" || path == "pointer") return;
  const bool is_rotation = path == "rotation";
  const bool right_component =
      is_rotation ? IsFloatOrNormalized(output, true) : output["componentType"] == kFloat;
  if (ComponentCount(output["type"].get<std::string>()) != KeyFrameComponents(path) ||
      IsType(output, "MAT2") || !right_component) {
    Refuse(file, place, "has values of a type that is not allowed for a " + path + ".");
  }
  const bool cubic = sampler.value("interpolation", "LINEAR") == "CUBICSPLINE";
  const std::uint64_t times = input["count"].get<std::uint64_t>();
  if (output["count"].get<std::uint64_t>() != times * (cubic ? 3u : 1u)) {
    Refuse(file, place, "has a number of values that does not match its times.");
  }
  if (cubic && times < 2) Refuse(file, place, "is a cubic spline with a single keyframe.");
}

}  // namespace

void CheckMeshes(std::string_view file, const Json& root) {
  const Json& meshes = ArrayOf(root, "meshes");
  // Once for the whole file, which may list very many extensions.
  const bool quantized = UsesExtension(root, "KHR_mesh_quantization");
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const Json& primitives = meshes[i]["primitives"];
    for (std::size_t k = 0; k < primitives.size(); ++k) {
      CheckPrimitive(file, root, primitives[k], quantized, Place("meshes", i) + "." + Place("primitives", k));
    }
  }
}

void CheckNodes(std::string_view file, const Json& root, const LoadLimits& limits) {
  const Json& nodes = ArrayOf(root, "nodes");
  if (nodes.size() > limits.max_nodes) {
    Refuse(file, "", "the file has more than " + std::to_string(limits.max_nodes) + " nodes.");
  }
  const std::vector<int> parents = Parents(file, nodes);
  CheckAcyclic(file, nodes, parents);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const bool has_parts =
        nodes[i].contains("translation") || nodes[i].contains("rotation") || nodes[i].contains("scale");
    if (nodes[i].contains("matrix") && has_parts) {
      Refuse(file, Place("nodes", i), "has both a matrix and a translation, rotation or scale.");
    }
    if (nodes[i].contains("skin") && !nodes[i].contains("mesh")) {
      Refuse(file, Place("nodes", i), "has a skin but no mesh.");
    }
  }
}

void CheckSkins(std::string_view file, const Json& root) {
  const Json& skins = ArrayOf(root, "skins");
  for (std::size_t i = 0; i < skins.size(); ++i) {
    if (!skins[i].contains("inverseBindMatrices")) continue;
    const Json& accessor = AccessorAt(root, skins[i]["inverseBindMatrices"]);
    const std::string place = Place("skins", i) + ".inverseBindMatrices";
    if (!IsType(accessor, "MAT4") || accessor["componentType"].get<int>() != kFloat) {
      Refuse(file, place, "is not an accessor of float 4x4 matrices.");
    }
    if (accessor["count"].get<std::uint64_t>() < skins[i]["joints"].size()) {
      Refuse(file, place, "has fewer matrices than the skin has joints.");
    }
  }
}

void CheckAnimations(std::string_view file, const Json& root) {
  const Json& animations = ArrayOf(root, "animations");
  for (std::size_t i = 0; i < animations.size(); ++i) {
    const Json& channels = animations[i]["channels"];
    std::set<std::pair<int, std::string>> targets;
    for (std::size_t k = 0; k < channels.size(); ++k) {
      const std::string place = Place("animations", i) + "." + Place("channels", k);
      CheckChannel(file, root, animations[i], channels[k], place);
      const Json& target = channels[k]["target"];
      if (!target.contains("node")) continue;
      if (!targets.emplace(target["node"].get<int>(), target["path"].get<std::string>()).second) {
        Refuse(file, place, "animates a property that another channel of this animation already animates.");
      }
    }
  }
}

}  // namespace docent::content
