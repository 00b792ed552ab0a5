// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>

namespace docent::ui {

// Writes images to a video file: H.264 if FFmpeg can encode it, otherwise MPEG-4. Single owner, single
// thread.
class Recorder {
 public:
  // The extension of `path` selects the container (.mp4, .mkv, .avi, .mov). An existing file is replaced.
  // Throws docent::Error with a one-sentence message when the file cannot be written or the extension is
  // unknown.
  Recorder(const std::string& path, double frames_per_second);
  // Closes the file and ignores failures; call Close first to be told of them.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // `image` is CV_8UC3 (BGR) or CV_8UC1. The first image sets the video's size; later images of other sizes
  // are scaled to it. An odd last row or column is left out, because the encoders subsample colour in blocks
  // of two by two pixels. An empty image repeats the last one. Throws docent::Error when no encoder accepts
  // the image.
  void Write(const cv::Mat& image);
  // Finishes the file. Throws docent::Error when the file on disk is incomplete, for instance because the
  // disk is full. If no image was written, no file remains. Further calls do nothing.
  void Close();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::ui
