// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/session/approach_watch.h"
#include "app/session/guided_view.h"
#include "app/session/place_claim.h"
#include "app/session/route_state.h"
#include "app/session/session.h"
#include "app/session/visit_state.h"
#include "app/session/visitor_cards.h"
#include "app/session/visitor_strings.h"

namespace docent::app {

// Adds to the frames of one camera what a visitor on a tour is told and shown (VisitState). On the camera's
// thread.
class VisitorGuide {
 public:
  // `stops`: the names of the maps where visitors can be. `strings` is one of the constants behind
  // VisitorStringsFor. `route`, which may be null, leads along a tour; it and the session must outlive this.
  // For `language` and `by_gaze` see VisitorCards.
  VisitorGuide(Session* session, std::vector<std::string> stops, const VisitorStrings& strings,
               RouteState* route = nullptr, std::string language = {}, bool by_gaze = false)
      : session_(session),
        strings_(strings),
        state_(std::move(stops), strings),
        route_(route),
        cards_(strings, std::move(language), by_gaze) {}

  // Sets the frame's `visitor`, `way` and `animation_starts`; `camera` is the lens of its image. Shortly
  // after a loss the frame gets the content and the pose of the last frame that had one. Where the place is
  // not to be claimed (PlaceClaim), the frame loses its content. A skipped image, which is not shown, changes
  // neither cards nor route, and its frame gets no card.
  void Guide(const std::shared_ptr<ShownFrame>& frame, const engine::CameraModel& camera);
  VisitorCards* cards() { return &cards_; }

 private:
  void FindViews(const ShownFrame& frame);
  void FollowRoute(bool has_pose, ShownFrame* frame);

  Session* const session_;
  const VisitorStrings& strings_;
  VisitState state_;
  RouteState* const route_;
  VisitorCards cards_;
  ApproachWatch approach_;
  PlaceClaim claim_;
  std::vector<ui::KnownView> views_;  // See ui::VisitorDisplay.
  std::optional<double> views_time_s_, finished_s_;
  std::shared_ptr<const ShownFrame> last_with_pose_;
};

// What a visitor is told about a frame so that the camera is tracked: why its place is not recognized, else
// the engine's hint. Empty for nothing, and for hints that are about building a map.
std::string VisitorHint(const RejectionMessage& rejection, engine::Hint hint, const VisitorStrings& strings);

}  // namespace docent::app
