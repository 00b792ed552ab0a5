// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/visitor_frames.h"

#include <utility>

#include "app/session/session_state.h"

namespace docent::app {

std::shared_ptr<ShownFrame> VisitorFrames::CopyOfLast(std::size_t camera) const {
  const auto& last = cameras_[camera].last;
  return last ? std::make_shared<ShownFrame>(*last) : nullptr;
}

void VisitorFrames::SetLast(std::shared_ptr<const ShownFrame> frame) {
  auto& last = cameras_[CameraOf(frame->tracked)].last;
  last = std::move(frame);
}

void VisitorFrames::Clear() {
  for (Camera& camera : cameras_) camera.last.reset();
}

void VisitorFrames::SetTrouble(std::size_t camera, const std::string& trouble) {
  cameras_[camera].trouble = trouble;
  if (!trouble.empty()) return;
  // The next image would show the answer anew, however long ago it was given.
  cameras_[camera].refusal.clear();
  cameras_[camera].is_answer_new = false;
}

void VisitorFrames::Answer(const std::string& refusal, ShownFrame* frame) {
  Camera& camera = cameras_[CameraOf(frame->tracked)];
  if (!camera.trouble.empty()) {
    frame->message = refusal.empty() ? camera.trouble : camera.trouble + " " + refusal;
  } else {
    if (frame->message == camera.refusal) frame->message.clear();
    if (!refusal.empty()) frame->message = refusal;
  }
  camera.refusal = refusal;
  camera.is_answer_new = true;
}

std::optional<std::string> VisitorFrames::TakeAnswer(std::size_t camera) {
  if (!std::exchange(cameras_[camera].is_answer_new, false)) return std::nullopt;
  return cameras_[camera].refusal;
}

std::shared_ptr<ShownFrame> VisitorFrames::Over(const engine::Frame& image) {
  const auto index = static_cast<std::size_t>(image.camera);
  std::shared_ptr<ShownFrame> frame = CopyOfLast(index);
  if (!frame) return nullptr;
  cameras_[index].untracked = image;
  ShowWithoutPose(image, frame.get());
  return frame;
}

std::shared_ptr<const ShownFrame> VisitorFrames::OverNewest(std::shared_ptr<const ShownFrame> frame) const {
  const auto& image = cameras_[CameraOf(frame->tracked)].untracked;
  if (!image || image->time <= frame->tracked.frame.time) return frame;
  if (frame->tracked.state == engine::TrackingState::kDropped) return frame;
  auto over = std::make_shared<ShownFrame>(*frame);
  ShowWithoutPose(*image, over.get());
  return over;
}

}  // namespace docent::app
