// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/sequence_layout.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <mutex>
#include <set>
#include <string_view>

#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

namespace fs = std::filesystem;

std::string At(const fs::path& path, int line) {
  return "'" + path.string() + "', line " + std::to_string(line);
}

// Decides which images of a list are used: those whose time is later than that of every image before them. A
// recorder that stamps two images alike spoils no recording, but a list that is mostly out of order is wrong.
class TimeFilter {
 public:
  explicit TimeFilter(const fs::path& path) : path_(path) {}

  // Whether the image of this line is used. Throws Error for a time that is centuries away: differences of
  // such times do not fit into 64 bits.
  bool Use(Timestamp time, int line) {
    constexpr Timestamp kFarthest = std::chrono::seconds(3'000'000'000);  // 95 years.
    if (time > kFarthest || time < -kFarthest) {
      throw Error(At(path_, line) + ": the time " + FormatSeconds(time) +
                  " s is more than 95 years away from 0.");
    }
    if (!latest_ || time > *latest_) {
      latest_ = time;
      ++used_;
      return true;
    }
    if (left_out_++ == 0) {
      first_fault_ = At(path_, line) + ": the time " + FormatSeconds(time) +
                     " is not later than the previous time " + FormatSeconds(*latest_);
    }
    return false;
  }
  // Warns of what was left out. Throws Error if that is more than half of the images.
  void Finish() const {
    if (left_out_ == 0) return;
    if (left_out_ > used_) {
      throw Error(first_fault_ + ", and so it is at " + std::to_string(left_out_) + " of the " +
                  std::to_string(left_out_ + used_) + " images.");
    }
    if (!IsFirstWarning(path_)) return;
    spdlog::warn("{}; {} of the {} images are left out because of such times.", first_fault_, left_out_,
                 left_out_ + used_);
  }

 private:
  const fs::path path_;
  std::optional<Timestamp> latest_;
  std::size_t used_ = 0, left_out_ = 0;
  std::string first_fault_;
};

bool HasImageExtension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::array<std::string_view, 10> kKnown = {".png", ".jpg", ".jpeg", ".bmp",  ".pgm",
                                                       ".ppm", ".tif", ".tiff", ".webp", ".pnm"};
  return std::find(kKnown.begin(), kKnown.end(), extension) != kKnown.end();
}

bool HasDigit(const std::string& text) {
  return std::any_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

std::vector<fs::path> NumberedImages(const fs::path& folder) {
  std::vector<fs::path> images;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (HasImageExtension(entry.path()) && HasDigit(entry.path().stem().string()))
      images.push_back(entry.path());
  }
  if (error) throw Error("Cannot read the folder '" + folder.string() + "': " + error.message() + ".");
  std::sort(images.begin(), images.end(), [](const fs::path& a, const fs::path& b) {
    return NaturalLess(a.filename().string(), b.filename().string());
  });
  return images;
}

// The name with '#' for each run of digits, and the ending in lower case.
std::string PatternOf(const fs::path& path) {
  std::string pattern;
  for (const char c : path.stem().string()) {
    const bool digit = std::isdigit(static_cast<unsigned char>(c)) != 0;
    if (!digit || !pattern.ends_with('#')) pattern += digit ? '#' : c;
  }
  for (const char c : path.extension().string())
    pattern += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return pattern;
}

// Throws Error if the images are not those of one sequence, as colour and depth images, or left and right
// ones, side by side.
void CheckOneSequence(const fs::path& folder, const std::vector<fs::path>& images) {
  for (const fs::path& image : images) {
    if (PatternOf(image) == PatternOf(images.front())) continue;
    throw Error("The folder '" + folder.string() + "' contains numbered images of several kinds, such as '" +
                images.front().filename().string() + "' and '" + image.filename().string() +
                "'; a folder must contain the images of one sequence only.");
  }
}

}  // namespace

bool IsFirstWarning(const fs::path& path) {
  static std::mutex mutex;
  static std::set<fs::path> warned;
  const std::scoped_lock lock(mutex);
  return warned.insert(path).second;
}

std::optional<fs::path> FindEurocCamera(const fs::path& folder) {
  for (const char* below : {"mav0/cam0", "cam0", "."}) {
    const fs::path camera = (folder / below).lexically_normal();
    if (fs::is_regular_file(camera / "data.csv")) return camera;
  }
  return std::nullopt;
}

std::optional<SequenceLayout> FindLayout(const fs::path& folder) {
  if (fs::is_regular_file(folder / "rgb.txt")) return SequenceLayout::kTum;
  if (FindEurocCamera(folder)) return SequenceLayout::kEuroc;
  if (fs::is_regular_file(folder / "video.mp4")) {
    return fs::is_regular_file(folder / "timestamps.txt") ? SequenceLayout::kTimedVideo
                                                          : SequenceLayout::kVideo;
  }
  if (!NumberedImages(folder).empty()) return SequenceLayout::kNumberedImages;
  return std::nullopt;
}

std::vector<TimedPath> ReadTumList(const fs::path& folder) {
  const fs::path list = folder / "rgb.txt";
  const std::string text = ReadTextFile(list);
  std::vector<TimedPath> images;
  TimeFilter filter(list);
  for (const TextLine& line : ContentLines(text)) {
    const std::size_t blank = line.text.find_first_of(" \t");
    const std::optional<Timestamp> time = ParseSeconds(line.text.substr(0, blank));
    if (!time || blank == std::string_view::npos) {
      throw Error(At(list, line.number) +
                  ": expected a time in seconds and a file, as in '1.25 rgb/1.25.png'.");
    }
    if (filter.Use(*time, line.number)) images.push_back({*time, folder / Trim(line.text.substr(blank))});
  }
  filter.Finish();
  if (images.empty()) throw Error("'" + list.string() + "' lists no images.");
  return images;
}

std::vector<TimedPath> ReadEurocList(const fs::path& folder) {
  const std::optional<fs::path> camera = FindEurocCamera(folder);
  if (!camera) throw Error("There is no data.csv in '" + folder.string() + "'.");
  const fs::path list = *camera / "data.csv";
  const std::string text = ReadTextFile(list);
  std::vector<TimedPath> images;
  TimeFilter filter(list);
  for (const TextLine& line : ContentLines(text)) {
    const std::size_t comma = line.text.find(',');
    const std::optional<std::int64_t> nanoseconds = ParseInteger(Trim(line.text.substr(0, comma)));
    if (!nanoseconds || comma == std::string_view::npos) {
      throw Error(At(list, line.number) + ": expected a time in nanoseconds, a comma and a file.");
    }
    const Timestamp time(*nanoseconds);
    if (filter.Use(time, line.number))
      images.push_back({time, *camera / "data" / Trim(line.text.substr(comma + 1))});
  }
  filter.Finish();
  if (images.empty()) throw Error("'" + list.string() + "' lists no images.");
  return images;
}

std::vector<TimedPath> ListNumberedImages(const fs::path& folder, double fps) {
  std::vector<TimedPath> images;
  std::vector<fs::path> numbered = NumberedImages(folder);
  CheckOneSequence(folder, numbered);
  for (fs::path& path : numbered) {
    const auto time = FromSeconds(static_cast<double>(images.size()) / fps);
    images.push_back({time, std::move(path)});
  }
  if (images.empty()) throw Error("There are no numbered images in '" + folder.string() + "'.");
  return images;
}

std::vector<std::optional<Timestamp>> ReadTimestamps(const fs::path& path) {
  const std::string text = ReadTextFile(path);
  std::vector<std::optional<Timestamp>> times;
  TimeFilter filter(path);
  for (const TextLine& line : ContentLines(text)) {
    const std::optional<Timestamp> time = ParseSeconds(line.text);
    if (!time) throw Error(At(path, line.number) + ": expected one time in seconds.");
    times.push_back(filter.Use(*time, line.number) ? time : std::nullopt);
  }
  if (times.empty()) throw Error("'" + path.string() + "' contains no times.");
  filter.Finish();
  return times;
}

double MedianFps(const std::vector<Timestamp>& times) {
  if (times.size() < 2) return 30;
  std::vector<Timestamp> steps;
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return 1 / ToSeconds(*middle);
}

}  // namespace docent::app
