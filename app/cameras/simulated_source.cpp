// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/simulated_source.h"

#include <utility>

#include "app/cameras/simulated_head.h"

namespace docent::app {

namespace {

class SimulatedSource : public FrameSource {
 public:
  explicit SimulatedSource(std::shared_ptr<const Simulation> simulation)
      : simulation_(std::move(simulation)) {
    info_.name = simulation_->name();
    info_.frame_count = static_cast<std::uint64_t>(simulation_->frame_count());
    const int count = simulation_->frame_count();
    info_.duration = count > 0 ? simulation_->time(count - 1) - simulation_->time(0) : Timestamp{};
    info_.nominal_fps = simulation_->options().frame_rate_hz;
    info_.known_camera = simulation_->calibration();
    if (simulation_->scene_name() == "head") SetHead(std::make_unique<SimulatedHead>());
  }

  bool NextLate(engine::Frame* frame) override {
    if (index_ == simulation_->frame_count()) return false;
    frame->time = simulation_->time(index_);
    frame->index = static_cast<std::uint64_t>(index_++);
    return true;
  }

  std::optional<Timestamp> NextTime() const override {
    if (index_ == simulation_->frame_count()) return std::nullopt;
    return simulation_->time(index_);
  }

  bool Next(engine::Frame* frame) override {
    if (index_ == simulation_->frame_count()) return false;
    cv::Mat image;
    frame->time = simulation_->time(index_);
    if (head() != nullptr) {
      const engine::Rigid3 rotation(CarrierFromCamera(head()->At(frame->time)), Eigen::Vector3d::Zero());
      simulation_->RenderRotated(index_, rotation, &image);
    } else {
      simulation_->Render(index_, &image);
    }
    frame->index = static_cast<std::uint64_t>(index_++);
    frame->image = std::move(image);
    return true;
  }

 private:
  std::shared_ptr<const Simulation> simulation_;
  int index_ = 0;
};

}  // namespace

std::unique_ptr<FrameSource> OpenSimulation(const std::string& scene, const CameraOptions& options) {
  SimulationOptions simulation;
  simulation.seed = options.seed;
  return OpenSimulation(MakeSimulation(scene, simulation));
}

std::unique_ptr<FrameSource> OpenSimulation(std::shared_ptr<const Simulation> simulation) {
  return std::make_unique<SimulatedSource>(std::move(simulation));
}

}  // namespace docent::app
