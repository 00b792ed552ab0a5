// SPDX-License-Identifier: Apache-2.0
#include "content/gltf/animation.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "content/gltf/json.h"

namespace docent::content {
namespace {

std::optional<AnimationChannel::Target> TargetOf(const std::string& path) {
  if (path == "translation") return AnimationChannel::Target::kTranslation;
  if (path == "rotation") return AnimationChannel::Target::kRotation;
  if (path == "scale") return AnimationChannel::Target::kScale;
  return std::nullopt;
}

AnimationChannel::Interpolation InterpolationOf(const std::string& name) {
  if (name == "STEP") return AnimationChannel::Interpolation::kStep;
  if (name == "CUBICSPLINE") return AnimationChannel::Interpolation::kCubicSpline;
  return AnimationChannel::Interpolation::kLinear;
}

std::vector<float> ReadTimes(const std::string& file, const AccessorReader& reader,
                             const std::string& place) {
  std::vector<float> times(reader.count());
  for (std::size_t i = 0; i < times.size(); ++i) {
    times[i] = reader.Float(i, 0);
    // Equal times occur in real files and are harmless: the step between them is never shown.
    if (i > 0 && times[i] < times[i - 1]) Refuse(file, place, "has times that do not ascend.");
  }
  return times;
}

void MakeUnit(const std::string& file, const std::string& place, AnimationChannel* channel) {
  const bool cubic = channel->interpolation == AnimationChannel::Interpolation::kCubicSpline;
  // In a spline's triples only the middle value is a rotation; the others are tangents.
  for (std::size_t i = cubic ? 1 : 0; i < channel->values.size(); i += cubic ? 3 : 1) {
    const float length = glm::length(channel->values[i]);
    if (!(length > 1e-3f) || !std::isfinite(length)) Refuse(file, place, "has a rotation of length zero.");
    channel->values[i] /= length;
  }
}

}  // namespace

std::vector<Animation> ReadAnimations(const std::string& file, const tinygltf::Model& source,
                                      const std::vector<int>& place_of, const LoadLimits& limits,
                                      AccessorCache* accessors, std::vector<std::string>* warnings) {
  std::vector<Animation> animations;
  std::uint64_t total = 0;
  bool morphs = false, begins_early = false;
  for (std::size_t i = 0; i < source.animations.size(); ++i) {
    const tinygltf::Animation& from = source.animations[i];
    Animation animation;
    animation.name = from.name;
    for (std::size_t k = 0; k < from.channels.size(); ++k) {
      const std::string place = Place("animations", i) + "." + Place("channels", k);
      const std::optional<AnimationChannel::Target> target = TargetOf(from.channels[k].target_path);
      morphs = morphs || !target;
      if (!target || from.channels[k].target_node < 0) continue;
      const tinygltf::AnimationSampler& sampler =
          from.samplers[static_cast<std::size_t>(from.channels[k].sampler)];
      const AccessorReader& values = accessors->Get(sampler.output);
      total += values.count();
      if (total > limits.max_key_frame_values) {
        Refuse(file, place,
               "takes the model over the limit of " + std::to_string(limits.max_key_frame_values) +
                   " keyframe values.");
      }
      AnimationChannel channel;
      channel.target = *target;
      channel.interpolation = InterpolationOf(sampler.interpolation);
      channel.node = place_of[static_cast<std::size_t>(from.channels[k].target_node)];
      channel.times = ReadTimes(file, accessors->Get(sampler.input), place);
      channel.values.resize(values.count(), glm::vec4(0));
      for (std::size_t v = 0; v < values.count(); ++v) {
        for (int c = 0; c < values.components(); ++c) channel.values[v][c] = values.Float(v, c);
      }
      begins_early = begins_early || channel.times.front() < 0;
      if (*target == AnimationChannel::Target::kRotation) MakeUnit(file, place, &channel);
      animation.duration = std::max(animation.duration, channel.times.back());
      animation.channels.push_back(std::move(channel));
    }
    animations.push_back(std::move(animation));
  }
  if (begins_early) warnings->emplace_back("The part of an animation before time zero is left out.");
  if (morphs) warnings->emplace_back("Animations of morph targets are left out.");
  return animations;
}

}  // namespace docent::content
