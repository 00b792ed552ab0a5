// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/session/guided_view.h"
#include "app/session/session.h"
#include "app/session/visit_state.h"

namespace docent::app {

// Adds to the frames of one camera what a visitor on a tour is told and shown (VisitState). On the camera's
// thread.
class VisitorGuide {
 public:
  // `stops`: the names of the library's maps. The session must outlive this.
  VisitorGuide(Session* session, std::vector<std::string> stops)
      : session_(session), state_(std::move(stops)) {}

  // Sets the frame's `visitor`. Shortly after a loss the frame gets the content and the pose of the last frame
  // that had one.
  void Guide(const std::shared_ptr<ShownFrame>& frame);

 private:
  void FindViews(const ShownFrame& frame);

  Session* const session_;
  VisitState state_;
  std::vector<cv::Mat> views_;  // See ui::VisitorDisplay.
  std::optional<double> views_time_s_;
  std::shared_ptr<const ShownFrame> last_with_pose_;
};

}  // namespace docent::app
