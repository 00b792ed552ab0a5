// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/file_sources.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <opencv2/videoio.hpp>
#include <utility>

#include "app/calibration/calibration_file.h"
#include "app/cameras/decode_image.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

namespace fs = std::filesystem;

std::string Quoted(const fs::path& path) {
  return "'" + path.string() + "'";
}

std::string NameOf(const fs::path& path) {
  const fs::path whole = fs::absolute(path).lexically_normal();
  return whole.has_filename() ? whole.filename().string() : whole.parent_path().filename().string();
}

std::optional<fs::path> IfFile(const fs::path& path) {
  return fs::is_regular_file(path) ? std::optional(path) : std::nullopt;
}

// Of increasing times.
Timestamp TimeSpanOf(const std::vector<Timestamp>& times) {
  return times.empty() ? Timestamp{} : times.back() - times.front();
}

class VideoSource : public FrameSource {
 public:
  VideoSource(const fs::path& video, const std::optional<fs::path>& timestamps_path)
      : path_(video), timestamps_path_(timestamps_path) {
    if (!fs::exists(video)) throw Error("There is no file " + Quoted(video) + ".");
    if (timestamps_path) times_ = ReadTimestamps(*timestamps_path);
    if (!capture_.open(video.string(), cv::CAP_FFMPEG)) {
      throw Error(Quoted(video) + " cannot be opened as a video; it is truncated, damaged, or not a video.");
    }
    const double fps = capture_.get(cv::CAP_PROP_FPS);
    if (std::isfinite(fps) && fps > 0 && fps < 10000) info_.nominal_fps = fps;
    // Only an estimate in some containers; images that were trimmed but are still in the file count too.
    const double count = capture_.get(cv::CAP_PROP_FRAME_COUNT);
    if (std::isfinite(count) && count >= 1 && count < 1e9) announced_count_ = count;
    if (timestamps_path) {
      std::vector<Timestamp> used;
      for (const std::optional<Timestamp>& time : times_) {
        if (time) used.push_back(*time);
      }
      info_.frame_count = used.size();
      info_.nominal_fps = MedianFps(used);
      info_.duration = TimeSpanOf(used);
    } else if (announced_count_) {
      info_.frame_count = static_cast<std::uint64_t>(*announced_count_);
    }
    info_.name = NameOf(video);
  }

  void SetInfo(SourceInfo info) { info_ = std::move(info); }

  bool Next(engine::Frame* frame) override {
    if (!Grab(frame)) return false;
    cv::Mat image;
    if (!capture_.retrieve(image) || image.empty()) {
      ended_ = true;
      throw Error("Image " + std::to_string(frame->index) + " of " + Quoted(path_) + " cannot be decoded.");
    }
    frame->image = std::move(image);
    return true;
  }
  // The images after it may need it, so it is decoded, but not converted and copied.
  bool NextLate(engine::Frame* frame) override { return Grab(frame); }
  std::optional<Timestamp> NextTime() const override {
    for (std::size_t i = read_; i < times_.size(); ++i) {
      if (times_[i]) return times_[i];
    }
    return std::nullopt;
  }

 private:
  // Decodes the next image that is used and sets all but the image itself.
  bool Grab(engine::Frame* frame) {
    for (;;) {
      if (ended_) return false;
      if (!capture_.grab()) {
        ended_ = true;
        CheckEnd();
        return false;
      }
      if (timestamps_path_ && read_ == times_.size()) {
        ended_ = true;
        throw Error(Quoted(*timestamps_path_) + " has " + std::to_string(times_.size()) + " times, but " +
                    Quoted(path_) + " has more images.");
      }
      const std::size_t image = read_++;
      if (timestamps_path_ && !times_[image]) continue;
      frame->time = timestamps_path_ ? *times_[image] : ContainerTime();
      frame->index = index_++;
      return true;
    }
  }

  // The container's time if it is later than the previous one. The decoder reports no time for the images
  // that it still buffers at the end of the file, and raw streams have no times; both continue with the last
  // step.
  Timestamp ContainerTime() {
    const double milliseconds = capture_.get(cv::CAP_PROP_POS_MSEC);
    const Timestamp stamp = std::isfinite(milliseconds) && milliseconds >= 0 && milliseconds < 1e12
                                ? FromSeconds(milliseconds * 1e-3)
                                : Timestamp{};
    if (index_ == 0) {
      step_ = FromSeconds(1 / info_.nominal_fps);
      return last_time_ = stamp;
    }
    if (stamp > last_time_) {
      step_ = stamp - last_time_;
      return last_time_ = stamp;
    }
    return last_time_ += step_;
  }

  void CheckEnd() const {
    if (timestamps_path_) {
      if (read_ < times_.size()) {
        throw Error(Quoted(path_) + " is truncated at image " + std::to_string(read_) + " of the " +
                    std::to_string(times_.size()) + " that " + Quoted(*timestamps_path_) + " lists.");
      }
      return;
    }
    if (index_ == 0) throw Error(Quoted(path_) + " contains no image that can be decoded.");
    if (!announced_count_) return;
    // Some containers store their length only in seconds, so images must be missing by count and by duration.
    const double missing = *announced_count_ - static_cast<double>(index_);
    const double fps = capture_.get(cv::CAP_PROP_FPS);
    const double missing_s = *announced_count_ / fps - ToSeconds(last_time_ + step_);
    const double allowed = std::max(2.0, 0.01 * *announced_count_);
    // The decoder does not tell a file that was cut off from one whose edit list hides the missing images.
    if (missing > allowed && missing_s > allowed / fps && IsFirstWarning(path_)) {
      spdlog::warn(
          "{} ends after image {} of the {} that its header states: it was cut off, or trimmed without "
          "encoding it anew.",
          Quoted(path_), index_, static_cast<std::uint64_t>(*announced_count_));
    }
  }

  fs::path path_;
  std::optional<fs::path> timestamps_path_;
  std::vector<std::optional<Timestamp>> times_;  // Of each image of the file; empty: it is left out.
  cv::VideoCapture capture_;
  std::optional<double> announced_count_;
  std::size_t read_ = 0;     // Images of the file that were read.
  std::uint64_t index_ = 0;  // Of the next image that is delivered.
  Timestamp last_time_{}, step_{};
  bool ended_ = false;
};

class ImageListSource : public FrameSource {
 public:
  explicit ImageListSource(std::vector<TimedPath> images) : images_(std::move(images)) {
    std::vector<Timestamp> times;
    for (const TimedPath& image : images_) times.push_back(image.time);
    info_.frame_count = images_.size();
    info_.nominal_fps = MedianFps(times);
    info_.duration = TimeSpanOf(times);
  }

  void SetInfo(SourceInfo info) { info_ = std::move(info); }

  bool Next(engine::Frame* frame) override {
    if (index_ == images_.size()) return false;
    const TimedPath& next = images_[index_];
    cv::Mat image;
    try {
      image = ReadImage(next.path, &buffer_, &bits_);
      if (size_.area() == 0) size_ = image.size();
      if (image.size() != size_) {
        throw Error(Quoted(next.path) + " is " + std::to_string(image.cols) + "x" +
                    std::to_string(image.rows) + " pixels, but the images before it are " +
                    std::to_string(size_.width) + "x" + std::to_string(size_.height) + ".");
      }
    } catch (const Error&) {
      index_ = images_.size();  // No images follow after an error.
      throw;
    }
    frame->time = next.time;
    frame->index = index_++;
    frame->image = std::move(image);
    return true;
  }
  // A file that is passed over is not even read.
  bool NextLate(engine::Frame* frame) override {
    if (index_ == images_.size()) return false;
    frame->time = images_[index_].time;
    frame->index = index_++;
    return true;
  }
  std::optional<Timestamp> NextTime() const override {
    if (index_ == images_.size()) return std::nullopt;
    return images_[index_].time;
  }

 private:
  std::vector<TimedPath> images_;
  std::vector<std::uint8_t> buffer_;
  int bits_ = 0;  // Of 16-bit images; see DecodeImage.
  cv::Size size_;
  std::size_t index_ = 0;
};

template <typename Source>
std::unique_ptr<FrameSource> WithFolderInfo(std::unique_ptr<Source> source, const fs::path& folder) {
  SourceInfo info = source->info();
  info.name = NameOf(folder);
  info.calibration_path = FindCalibration(folder);
  info.ground_truth_path = IfFile(folder / "groundtruth.txt");
  info.segments_path = IfFile(folder / "segments.txt");
  source->SetInfo(std::move(info));
  return source;
}

}  // namespace

std::unique_ptr<FrameSource> OpenVideo(const fs::path& video,
                                       const std::optional<fs::path>& timestamps_path) {
  return std::make_unique<VideoSource>(video, timestamps_path);
}

std::unique_ptr<FrameSource> OpenFolder(const fs::path& folder, const CameraOptions& options) {
  const std::optional<SequenceLayout> layout = FindLayout(folder);
  if (!layout) {
    throw Error(
        "The folder " + Quoted(folder) +
        " contains no image sequence: it has no rgb.txt, mav0/cam0/data.csv, video.mp4 or numbered images.");
  }
  const fs::path video = folder / "video.mp4";
  switch (*layout) {
    case SequenceLayout::kTum:
      return WithFolderInfo(std::make_unique<ImageListSource>(ReadTumList(folder)), folder);
    case SequenceLayout::kEuroc:
      return WithFolderInfo(std::make_unique<ImageListSource>(ReadEurocList(folder)), folder);
    case SequenceLayout::kTimedVideo:
      return WithFolderInfo(std::make_unique<VideoSource>(video, folder / "timestamps.txt"), folder);
    case SequenceLayout::kVideo:
      return WithFolderInfo(std::make_unique<VideoSource>(video, std::nullopt), folder);
    case SequenceLayout::kNumberedImages:
      return WithFolderInfo(std::make_unique<ImageListSource>(ListNumberedImages(folder, options.image_fps)),
                            folder);
  }
  throw Error("The folder " + Quoted(folder) + " contains no image sequence.");
}

}  // namespace docent::app
