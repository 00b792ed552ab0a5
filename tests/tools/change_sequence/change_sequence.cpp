// SPDX-License-Identifier: Apache-2.0
// Writes a part of a recorded sequence with changed images, as another visitor's camera would show them.
// Timestamps, ground truth and segments are copied, and the calibration is adapted to the changed images:
//
//   change_sequence kitchen kitchen-tele --frames 50%: --change tele:1.6
//
// --change may be repeated; the changes are applied in order. Without it the images are copied unchanged.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/calibration/calibration_file.h"
#include "app/cameras/file_sources.h"
#include "app/cameras/frame_source.h"
#include "app/files/checked_file.h"
#include "app/files/text_file.h"
#include "engine/base/error.h"
#include "tests/tools/change_sequence/sequence_changes.h"

namespace docent::testing {

namespace {

namespace fs = std::filesystem;

struct Options {
  fs::path input, output;
  std::string frames = ":";
  std::vector<std::string> changes;
  std::uint64_t seed = 1;
};

// Parses "500", or "50%" of the count; an empty text gives the default.
std::uint64_t FrameNumber(const std::string& range, std::string_view text, std::uint64_t count,
                          std::uint64_t default_number) {
  if (text.empty()) return default_number;
  const bool percent = text.ends_with('%');
  const auto number = app::ParseNumber(percent ? text.substr(0, text.size() - 1) : text);
  const double max_number = percent ? 100 : static_cast<double>(count);
  if (!number || !(*number >= 0 && *number <= max_number) || (!percent && *number != std::floor(*number))) {
    throw Error("The range '" + range + "' must be two frame numbers from 0 to " + std::to_string(count) +
                ", or percentages, separated by a colon.");
  }
  return static_cast<std::uint64_t>(
      std::llround(percent ? *number / 100 * static_cast<double>(count) : *number));
}

struct Range {
  std::uint64_t from = 0, until = 0;
};

Range RangeOf(const std::string& text, std::uint64_t count) {
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) throw Error("The range '" + text + "' needs a colon, as in 0:500 or 50%:.");
  const Range range{FrameNumber(text, std::string_view(text).substr(0, colon), count, 0),
                    FrameNumber(text, std::string_view(text).substr(colon + 1), count, count)};
  if (range.from >= range.until) throw Error("The range '" + text + "' contains no frames.");
  return range;
}

void CopyIfPresent(const std::optional<fs::path>& from, const fs::path& to) {
  if (from) fs::copy_file(*from, to, fs::copy_options::overwrite_existing);
}

class ImageWriter {
 public:
  explicit ImageWriter(const fs::path& folder) : folder_(CreateFolder(folder)), list_(folder / "rgb.txt") {
    list_.Write("# timestamp filename\n");
  }
  void Add(Timestamp time, const cv::Mat& image) {
    const std::string text = app::FormatSeconds(time), name = "rgb/" + text + ".png";
    std::vector<std::uint8_t> bytes;
    if (!cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_COMPRESSION, 1}))
      throw Error("The image '" + name + "' cannot be encoded.");
    app::CheckedFile file(folder_ / name);
    file.Write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    file.Close();
    list_.Write(text + ' ' + name + '\n');
  }
  void Close() { list_.Close(); }

 private:
  static fs::path CreateFolder(const fs::path& folder) {
    if (fs::exists(folder) && !(fs::is_directory(folder) && fs::is_empty(folder)))
      throw Error("'" + folder.string() + "' already exists and is not an empty folder.");
    app::MakeFolder(folder / "rgb");
    return folder;
  }

  fs::path folder_;
  app::CheckedFile list_;
};

void Run(const Options& options) {
  const auto source = app::OpenFolder(options.input, {});
  const app::SourceInfo& info = source->info();
  if (!info.frame_count) throw Error("The number of frames in '" + options.input.string() + "' is unknown.");
  const Range range = RangeOf(options.frames, *info.frame_count);
  if (!info.calibration_path) throw Error("'" + options.input.string() + "' has no calibration.");
  engine::CameraModel lens = app::ReadCalibration(*info.calibration_path);

  ChangeContext context{lens.width_px(), lens.height_px(),
                        static_cast<double>(range.until - range.from) / info.nominal_fps, options.seed};
  std::vector<std::unique_ptr<SequenceChange>> changes;
  for (const std::string& text : options.changes) {
    changes.push_back(MakeChange(text, context));
    lens = changes.back()->Lens(lens);
  }

  ImageWriter writer(options.output);
  engine::Frame frame;
  for (std::uint64_t i = 0; i < range.until && source->Next(&frame); ++i) {
    if (i < range.from) continue;
    app::CheckImageSize(lens, frame.image.cols, frame.image.rows, options.input.string(), "its calibration");
    cv::Mat image = frame.image;
    for (const auto& change : changes) image = change->Apply(frame.time, image);
    writer.Add(frame.time, image);
  }
  app::WriteCalibration(options.output / "calibration.yaml", lens);
  CopyIfPresent(info.ground_truth_path, options.output / "groundtruth.txt");
  CopyIfPresent(info.segments_path, options.output / "segments.txt");
  writer.Close();  // last, because this file makes the folder a sequence
  for (const auto& change : changes) {
    if (const std::string summary = change->Summary(); !summary.empty()) std::printf("%s\n", summary.c_str());
  }
}

}  // namespace

}  // namespace docent::testing

int main(int argc, char** argv) {
  docent::testing::Options options;
  CLI::App program("Writes a part of a recorded sequence with changed images.");
  program.add_option("SEQUENCE", options.input, "Folder with the sequence")->required();
  program.add_option("OUTPUT", options.output, "Output folder, new or empty")->required();
  program.add_option("--frames", options.frames,
                     "Range of frames FROM:UNTIL, as numbers or percentages, such as 0:500 or 50%:");
  program
      .add_option("--change", options.changes,
                  "blur:LENGTH_PX[@ANGLE_DEG], exposure:FACTOR, tele:FACTOR, people:RATIO, rim:DIAMETER")
      ->allow_extra_args(false);
  program.add_option("--seed", options.seed, "Seed of the people");
  CLI11_PARSE(program, argc, argv);
  try {
    docent::testing::Run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "change_sequence: %s\n", error.what());
    return 1;
  }
  return 0;
}
