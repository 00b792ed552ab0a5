// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/session/guided_view.h"

namespace docent::app {

// The last frame that each camera of a tour has shown. Between two tracked images it is shown again: with the
// answer to what its visitor did, or over an image that is newer and has no pose. Its caller makes sure that
// no two threads use it at a time.
class VisitorFrames {
 public:
  explicit VisitorFrames(std::size_t cameras) : cameras_(cameras) {}

  // A copy of the last frame of a camera; null before the first one, and after Clear.
  std::shared_ptr<ShownFrame> CopyOfLast(std::size_t camera) const;
  // Replaces the last frame of its camera. It must not be one without an image.
  void SetLast(std::shared_ptr<const ShownFrame> frame);
  // Nothing is shown again.
  void Clear();

  // Why the camera delivers no images, as a sentence; empty once it does again. Answers from before are
  // forgotten then.
  void SetTrouble(std::size_t camera, const std::string& trouble);
  // Replaces the answer that a frame shows to a visitor's last step: why it was refused; empty if it was not.
  // The trouble with the camera stays before it: without it, nothing would explain the image that stays.
  void Answer(const std::string& refusal, ShownFrame* frame);
  // The last answer, if it has not been taken since.
  std::optional<std::string> TakeAnswer(std::size_t camera);

  // What the last frame of its camera says, over this image, which has no pose; null if there is no last
  // frame.
  std::shared_ptr<ShownFrame> Over(const engine::Frame& image);
  // The frame, or, if Over had an image that is newer, what the frame says over that image.
  std::shared_ptr<const ShownFrame> OverNewest(std::shared_ptr<const ShownFrame> frame) const;
  // Content is seen on its own image: OverNewest has none until Over is called again.
  void ForgetUntracked(std::size_t camera) { cameras_[camera].untracked.reset(); }

 private:
  struct Camera {
    std::shared_ptr<const ShownFrame> last;
    std::string refusal;  // Why the visitor's last step was not carried out; empty if it was.
    bool is_answer_new = false;
    std::string trouble = {};                     // See SetTrouble.
    std::optional<engine::Frame> untracked = {};  // The image of the last call of Over.
  };
  std::vector<Camera> cameras_;
};

}  // namespace docent::app
