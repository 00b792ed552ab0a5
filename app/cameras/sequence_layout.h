// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/time.h"

// Reads the supported layouts of image sequences into a list of images. An image whose timestamp is not later
// than those before it is left out, and a warning says how many. If these are more than half of the images,
// or a timestamp is more than 95 years away from 0, an Error names the file and the line.
namespace docent::app {

struct TimedPath {
  Timestamp time{};
  std::filesystem::path path;
};

enum class SequenceLayout {
  kTum,             // rgb.txt: `seconds path`.
  kEuroc,           // mav0/cam0, cam0 or the folder itself: data.csv `nanoseconds,file`, images in data/.
  kTimedVideo,      // video.mp4 with timestamps.txt.
  kVideo,           // video.mp4 alone, with the timestamps of the container.
  kNumberedImages,  // Images in the order of the numbers in their names, which are alike but for these.
};

// The layout of the folder, or empty when it contains no sequence.
std::optional<SequenceLayout> FindLayout(const std::filesystem::path& folder);

std::vector<TimedPath> ReadTumList(const std::filesystem::path& folder);
std::vector<TimedPath> ReadEurocList(const std::filesystem::path& folder);
std::vector<TimedPath> ListNumberedImages(const std::filesystem::path& folder, double fps);
// Reads timestamps.txt: one time in seconds per line; '#' begins a comment. Empty for an image that is left
// out.
std::vector<std::optional<Timestamp>> ReadTimestamps(const std::filesystem::path& path);

// The folder of an EuRoC camera (the one with data.csv), or empty.
std::optional<std::filesystem::path> FindEurocCamera(const std::filesystem::path& folder);

// True when it is called for the first time with this path. An evaluation opens a recording for each run, but
// a warning about a file is given only once. Any thread.
bool IsFirstWarning(const std::filesystem::path& path);

// Frame rate (images per second) from the median interval; 30 for fewer than two times.
double MedianFps(const std::vector<Timestamp>& times);

}  // namespace docent::app
