// SPDX-License-Identifier: Apache-2.0
#include "ui/recorder.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "engine/base/error.h"

namespace docent::ui {
namespace {

std::string EndingOf(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

// Silences OpenCV, which reports unusable codecs on standard error. Trying a codec is part of the selection,
// so a failure is no error.
class QuietOpenCv {
 public:
  QuietOpenCv() : level_(cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT)) {}
  ~QuietOpenCv() { cv::utils::logging::setLogLevel(level_); }

 private:
  cv::utils::logging::LogLevel level_;
};

}  // namespace

struct Recorder::Impl {
  std::string path;
  double frames_per_second = 30;
  cv::VideoWriter writer;
  cv::Size size;
  cv::Mat scaled, colored, last;
  std::int64_t frames = 0;
  bool closed = false;

  void Open(const cv::Mat& image) {
    size = cv::Size(image.cols / 2 * 2, image.rows / 2 * 2);
    if (size.width < 2 || size.height < 2)
      throw Error("Cannot record to '" + path + "': an image of " + std::to_string(image.cols) + " x " +
                  std::to_string(image.rows) + " pixels is too small for a video.");
    const QuietOpenCv quiet;
    const std::array<int, 2> codecs = {cv::VideoWriter::fourcc('a', 'v', 'c', '1'),
                                       cv::VideoWriter::fourcc('m', 'p', '4', 'v')};
    for (const int codec : codecs) {
      if (writer.open(path, cv::CAP_FFMPEG, codec, frames_per_second, size, true)) return;
    }
    throw Error("Cannot record to '" + path +
                "': FFmpeg has no H.264 or MPEG-4 encoder for this file format.");
  }
};

Recorder::Recorder(const std::string& path, double frames_per_second) : impl_(std::make_unique<Impl>()) {
  constexpr std::array<const char*, 4> kEndings = {".mp4", ".mkv", ".avi", ".mov"};
  if (std::find(kEndings.begin(), kEndings.end(), EndingOf(path)) == kEndings.end())
    throw Error("Cannot record to '" + path + "': the file name must end in .mp4, .mkv, .avi or .mov.");
  if (!(frames_per_second > 0 && frames_per_second <= 1000))
    throw Error("Cannot record to '" + path +
                "': the frame rate must be above 0 and at most 1000 frames per second.");
  // OpenCV's encoder does not report that it cannot open the file, so that is checked here.
  if (!std::ofstream(path, std::ios::binary | std::ios::trunc))
    throw Error("Cannot record to '" + path + "': the file cannot be written. Check that its folder exists.");
  impl_->path = path;
  impl_->frames_per_second = frames_per_second;
}

Recorder::~Recorder() {
  try {
    Close();
  } catch (const Error&) {
    // The owner did not call Close, so the failure is ignored. The file is as complete as possible.
  }
}

void Recorder::Write(const cv::Mat& image) {
  Impl& recorder = *impl_;
  const cv::Mat& source = image.empty() ? recorder.last : image;
  if (recorder.closed || source.empty()) return;
  if (source.type() != CV_8UC3 && source.type() != CV_8UC1)
    throw Error("Cannot record to '" + recorder.path + "': an image must have one or three 8-bit channels.");
  if (!recorder.writer.isOpened()) recorder.Open(source);
  cv::Mat frame = source;
  if (frame.channels() == 1) {
    cv::cvtColor(frame, recorder.colored, cv::COLOR_GRAY2BGR);
    frame = recorder.colored;
  }
  if (frame.cols / 2 * 2 == recorder.size.width && frame.rows / 2 * 2 == recorder.size.height) {
    frame = frame(cv::Rect(cv::Point(), recorder.size));
  } else {
    cv::resize(frame, recorder.scaled, recorder.size, 0, 0, cv::INTER_AREA);
    frame = recorder.scaled;
  }
  recorder.writer.write(frame);
  ++recorder.frames;
  if (!image.empty()) image.copyTo(recorder.last);
}

void Recorder::Close() {
  Impl& recorder = *impl_;
  if (recorder.closed) return;
  recorder.closed = true;
  recorder.writer.release();
  std::error_code ignored;
  if (recorder.frames == 0) {
    std::filesystem::remove(recorder.path, ignored);
    return;
  }
  // The encoder does not report failures, so the file is read back to check it. Its images are not decoded,
  // so that this takes no longer than reading the bytes.
  const QuietOpenCv quiet;
  cv::VideoCapture check(recorder.path, cv::CAP_FFMPEG);
  std::int64_t found = 0;
  if (check.isOpened()) {
    check.set(cv::CAP_PROP_FORMAT, -1);
    while (found < recorder.frames && check.grab()) ++found;
  }
  if (found < recorder.frames)
    throw Error("The recording '" + recorder.path + "' is incomplete. Check that the disk is not full.");
}

}  // namespace docent::ui
