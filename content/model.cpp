// SPDX-License-Identifier: Apache-2.0
#include "content/model.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

namespace docent::content {
namespace {

using Channel = AnimationChannel;

// The position of a time among a channel's keyframes: between key and key + 1, at fraction t of their
// distance in seconds. Before the first and after the last keyframe t and the distance are 0.
struct Span {
  std::size_t key = 0;
  float t = 0, seconds = 0;
};

Span FindSpan(const std::vector<float>& times, float time) {
  if (time <= times.front()) return {0, 0, 0};
  if (time >= times.back()) return {times.size() - 1, 0, 0};
  const auto after = std::upper_bound(times.begin(), times.end(), time);
  const auto key = static_cast<std::size_t>(after - times.begin()) - 1;
  const float seconds = times[key + 1] - times[key];
  return {key, (time - times[key]) / seconds, seconds};
}

glm::quat ToQuaternion(const glm::vec4& v) {
  return glm::quat(v.w, v.x, v.y, v.z);
}
glm::vec4 ToVector(const glm::quat& q) {
  return glm::vec4(q.x, q.y, q.z, q.w);
}

// Cubic Hermite spline, glTF 2.0 appendix C.5: triples of in-tangent, value, out-tangent.
glm::vec4 SampleSpline(const Channel& channel, const Span& span) {
  const glm::vec4 from = channel.values[3 * span.key + 1];
  if (span.seconds == 0) return from;
  const glm::vec4 out_tangent = span.seconds * channel.values[3 * span.key + 2];
  const glm::vec4 in_tangent = span.seconds * channel.values[3 * (span.key + 1)];
  const glm::vec4 to = channel.values[3 * (span.key + 1) + 1];
  const float t = span.t, t2 = t * t, t3 = t2 * t;
  return (2 * t3 - 3 * t2 + 1) * from + (t3 - 2 * t2 + t) * out_tangent + (-2 * t3 + 3 * t2) * to +
         (t3 - t2) * in_tangent;
}

glm::vec4 Sample(const Channel& channel, float time) {
  const Span span = FindSpan(channel.times, time);
  if (channel.interpolation == Channel::Interpolation::kCubicSpline) return SampleSpline(channel, span);
  const glm::vec4 from = channel.values[span.key];
  if (channel.interpolation == Channel::Interpolation::kStep || span.seconds == 0) return from;
  const glm::vec4 to = channel.values[span.key + 1];
  if (channel.target != Channel::Target::kRotation) return glm::mix(from, to, span.t);
  return ToVector(glm::slerp(ToQuaternion(from), ToQuaternion(to), span.t));
}

// A node's pose relative to its parent at one time.
struct Pose {
  glm::vec3 translation;
  glm::quat rotation;
  glm::vec3 scale;
};

void Apply(const Channel& channel, float time, Pose* node) {
  if (channel.times.empty()) return;
  const glm::vec4 value = Sample(channel, time);
  switch (channel.target) {
    case Channel::Target::kTranslation:
      node->translation = glm::vec3(value);
      break;
    case Channel::Target::kScale:
      node->scale = glm::vec3(value);
      break;
    case Channel::Target::kRotation: {
      const float length = glm::length(value);
      // A spline may pass through zero; then the node keeps its static rotation.
      if (length > 0 && std::isfinite(length)) node->rotation = ToQuaternion(value / length);
      break;
    }
  }
}

glm::mat4 LocalMatrix(const Pose& pose) {
  glm::mat4 matrix = glm::mat4_cast(pose.rotation);
  for (int k = 0; k < 3; ++k) matrix[k] *= pose.scale[k];
  matrix[3] = glm::vec4(pose.translation, 1);
  return matrix;
}

}  // namespace

std::vector<glm::mat4> NodeMatrices(const Model& model, int animation, double seconds) {
  std::vector<Pose> poses;
  poses.reserve(model.nodes.size());
  for (const Node& node : model.nodes) poses.push_back({node.translation, node.rotation, node.scale});
  if (animation >= 0 && animation < static_cast<int>(model.animations.size())) {
    const Animation& playing = model.animations[static_cast<std::size_t>(animation)];
    double time = 0;
    if (playing.duration > 0 && std::isfinite(seconds)) {
      time = std::fmod(seconds, double{playing.duration});
      if (time < 0) time += playing.duration;
    }
    for (const Channel& channel : playing.channels) {
      Apply(channel, static_cast<float>(time), &poses[static_cast<std::size_t>(channel.node)]);
    }
  }
  std::vector<glm::mat4> matrices(poses.size());
  // Parents precede children, so each parent's matrix is ready.
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const int parent = model.nodes[i].parent;
    const glm::mat4 local = LocalMatrix(poses[i]);
    matrices[i] = parent < 0 ? local : matrices[static_cast<std::size_t>(parent)] * local;
  }
  return matrices;
}

}  // namespace docent::content
