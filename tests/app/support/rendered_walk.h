// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "app/simulator/simulation.h"

namespace docent::app {

// The images of a simulation, rendered once and played forwards and backwards for as long as a test wants.
class RenderedWalk {
 public:
  RenderedWalk(const std::string& scene, const SimulationOptions& options)
      : frame_rate_hz_(options.frame_rate_hz) {
    const auto simulation = MakeSimulation(scene, options);
    for (int i = 0; i < simulation->frame_count(); ++i) simulation->Render(i, &images_.emplace_back());
    camera_ = std::make_shared<engine::CameraModel>(simulation->camera());
  }

  // The number of images until it plays backwards.
  std::uint64_t length() const { return images_.size(); }
  double frame_rate_hz() const { return frame_rate_hz_; }
  const std::shared_ptr<const engine::CameraModel>& camera() const { return camera_; }

  const cv::Mat& Image(std::uint64_t index) const {
    const std::uint64_t turn = index % (2 * length());
    return images_[turn < length() ? turn : 2 * length() - 1 - turn];
  }
  engine::Frame Frame(std::uint64_t index) const {
    engine::Frame frame;
    frame.index = index;
    frame.time = FromSeconds(static_cast<double>(index) / frame_rate_hz_);
    frame.image = Image(index);
    return frame;
  }

 private:
  const double frame_rate_hz_;
  std::vector<cv::Mat> images_;
  std::shared_ptr<const engine::CameraModel> camera_;
};

}  // namespace docent::app
