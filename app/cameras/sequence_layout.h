// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/time.h"

// The layouts in which people keep image sequences, read into one list. Times grow strictly, or an Error
// names the file and the line.
namespace docent::app {

struct TimedPath {
  Timestamp time{};
  std::filesystem::path path;
};

enum class SequenceLayout {
  kTum,             // rgb.txt: `seconds path`
  kEuroc,           // mav0/cam0, cam0 or the folder itself: data.csv `nanoseconds,file`, images in data/
  kTimedVideo,      // video.mp4 with timestamps.txt
  kVideo,           // video.mp4 alone: the container's own times
  kNumberedImages,  // images in the order of the numbers in their names
};

// Which layout the folder has, or empty when it holds no sequence.
std::optional<SequenceLayout> FindLayout(const std::filesystem::path& folder);

std::vector<TimedPath> ReadTumList(const std::filesystem::path& folder);
std::vector<TimedPath> ReadEurocList(const std::filesystem::path& folder);
std::vector<TimedPath> ListNumberedImages(const std::filesystem::path& folder, double fps);
// timestamps.txt: one time in seconds a line, '#' comments.
std::vector<Timestamp> ReadTimestamps(const std::filesystem::path& path);

// The folder of an EuRoC camera (the one with data.csv), or empty.
std::optional<std::filesystem::path> FindEurocCamera(const std::filesystem::path& folder);

// Median of the steps between times, as images a second; 30 with fewer than two times.
double MedianFps(const std::vector<Timestamp>& times);

}  // namespace docent::app
