// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/ground_truth.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

std::string At(const std::string& name, int line) {
  return name + ", line " + std::to_string(line);
}

// Differences of times that are centuries apart do not fit into 64 bits; images have the same limit.
template <typename Item>
void CheckTime(const std::vector<Item>& items, Timestamp time, const std::string& name, int line) {
  constexpr Timestamp kFarthest = std::chrono::seconds(3'000'000'000);  // 95 years.
  if (time > kFarthest || time < -kFarthest) {
    throw Error(At(name, line) + ": the time " + FormatSeconds(time) +
                " s is more than 95 years away from 0.");
  }
  if (!items.empty() && time <= items.back().time) {
    throw Error(At(name, line) + ": the time is not later than the previous one.");
  }
}

}  // namespace

std::vector<TimedPose> ParseGroundTruth(std::string_view text, const std::string& name) {
  std::vector<TimedPose> poses;
  for (const TextLine& line : ContentLines(text)) {
    const auto fields = SplitFields(line.text, " \t,");
    const auto fail = [&](const char* what) { throw Error(At(name, line.number) + ": " + what); };
    if (fields.size() != 8) fail("expected 'timestamp tx ty tz qx qy qz qw'.");
    const auto time = ParseSeconds(fields[0]);
    if (!time) fail("the time is not a number of seconds.");
    std::array<double, 7> v{};
    for (std::size_t i = 0; i < v.size(); ++i) {
      const auto value = ParseNumber(fields[i + 1]);
      if (!value || std::abs(*value) > 1e9) fail("a number of the pose is not a finite number.");
      v[i] = *value;
    }
    const Eigen::Quaterniond rotation(v[6], v[3], v[4], v[5]);
    if (std::abs(rotation.norm() - 1) > 0.01) fail("the quaternion does not have the length 1.");
    CheckTime(poses, *time, name, line.number);
    poses.push_back({*time, {engine::Rotation3(rotation), Eigen::Vector3d(v[0], v[1], v[2])}});
  }
  if (poses.empty()) throw Error(name + " contains no poses.");
  return poses;
}

std::vector<TimedPose> ReadGroundTruth(const std::filesystem::path& path) {
  return ParseGroundTruth(ReadTextFile(path), "'" + path.string() + "'");
}

std::vector<TimedLabel> ParseSegments(std::string_view text, const std::string& name) {
  std::vector<TimedLabel> labels;
  for (const TextLine& line : ContentLines(text)) {
    const auto fields = SplitFields(line.text);
    const auto time = ParseSeconds(fields[0]);
    if (fields.size() != 2 || !time) throw Error(At(name, line.number) + ": expected 'timestamp label'.");
    CheckTime(labels, *time, name, line.number);
    labels.push_back({*time, std::string(fields[1])});
  }
  return labels;
}

std::vector<TimedLabel> ReadSegments(const std::filesystem::path& path) {
  return ParseSegments(ReadTextFile(path), "'" + path.string() + "'");
}

const TimedPose* FindPose(const std::vector<TimedPose>& poses, Timestamp time, Timestamp max_difference) {
  const auto after =
      std::lower_bound(poses.begin(), poses.end(), time,
                       [](const TimedPose& pose, Timestamp wanted) { return pose.time < wanted; });
  const TimedPose* best = nullptr;
  if (after != poses.end()) best = &*after;
  if (after != poses.begin() && (!best || time - std::prev(after)->time < best->time - time))
    best = &*std::prev(after);
  if (!best || std::chrono::abs(best->time - time) > max_difference) return nullptr;
  return best;
}

std::optional<engine::Rigid3> InterpolatePose(const std::vector<TimedPose>& poses, Timestamp time,
                                              Timestamp max_difference) {
  const auto after = std::lower_bound(poses.begin(), poses.end(), time,
                                      [](const TimedPose& pose, Timestamp at) { return pose.time < at; });
  if (after != poses.end() && after != poses.begin() && after->time > time) {
    const auto before = std::prev(after);
    if (after->time - time <= max_difference && time - before->time <= max_difference) {
      const double part = ToSeconds(time - before->time) / ToSeconds(after->time - before->time);
      const engine::Rigid3 &a = before->truth_from_camera, &b = after->truth_from_camera;
      return engine::Rigid3(engine::Rotation3(a.rotation.quaternion().slerp(part, b.rotation.quaternion())),
                            (1 - part) * a.translation + part * b.translation);
    }
  }
  const TimedPose* nearest = FindPose(poses, time, max_difference);
  return nearest ? std::optional(nearest->truth_from_camera) : std::nullopt;
}

const TimedLabel* FindLabel(const std::vector<TimedLabel>& labels, Timestamp time) {
  const auto after =
      std::upper_bound(labels.begin(), labels.end(), time,
                       [](Timestamp wanted, const TimedLabel& label) { return wanted < label.time; });
  return after == labels.begin() ? nullptr : &*std::prev(after);
}

}  // namespace docent::app
