// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>

namespace docent::ui {

// Writes images as a video file: H.264 where FFmpeg can encode it, otherwise MPEG-4. One owner, one thread.
class Recorder {
 public:
  // path: its ending chooses the container (.mp4, .mkv, .avi, .mov). Throws docent::Error with one sentence
  // when the file cannot be written or the ending says nothing; a file that was there is replaced.
  Recorder(const std::string& path, double frames_per_second);
  // Closes the file; whoever wants to hear of a failure calls Close before.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // CV_8UC3 (BGR) or CV_8UC1. The first image fixes the size; later ones of another size are scaled to it.
  // An odd last row or column is left out, because the encoders take colour by two by two pixels. An empty
  // image repeats the last one. Throws docent::Error when no encoder takes it.
  void Write(const cv::Mat& image);
  // Finishes the file. Throws docent::Error when what is on disk is not what was written (a full disk).
  // Without a single image no file remains. Later calls do nothing.
  void Close();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::ui
