// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/command_line/run_guide.h"
#include "app/command_line/visit_keeper.h"
#include "app/session/left_tour.h"
#include "app/session/narration.h"
#include "app/session/visitor_guide.h"
#include "app/sound/sound_director.h"
#include "app/sound/speech.h"

namespace docent::app {

// What a tour adds to the frames of its cameras: what visitors are told and shown, the stops of the tour, the
// spoken texts, and the records of visits. Its caller makes sure that no two threads use it at a time.
class VisitorHost {
 public:
  // Adds an event; one of kind "warning" is a problem that the person should know of.
  using Report = std::function<void(const Event&)>;
  // The request must not be an author's; it and the session must outlive this.
  VisitorHost(const GuideRequest& request, Session* session, std::size_t cameras, Report report);

  // Adds to a frame, which is that of the camera with this index, what the visitor is told and shown.
  void Guide(std::size_t index, const engine::CameraModel& camera, const std::shared_ptr<ShownFrame>& frame);
  // The same for a frame that was guided before, since something has changed by Lead.
  void GuideAgain(std::size_t index, const engine::CameraModel& camera,
                  const std::shared_ptr<ShownFrame>& frame);
  // Carries out a command that leads the visitor, and returns true; false for any other command. Throws Error
  // when it cannot be carried out.
  bool Lead(const Command& command, const engine::TrackedFrame& frame);
  // Somebody touched the device or pressed a key, whatever that does.
  void Use();
  // The sounds of the cards that the first camera's visitor has opened since the last call: their map and
  // their names.
  std::vector<SoundDirector::Key> TakeAskedSounds() { return std::exchange(asked_sounds_, {}); }
  // Ends the record of the present visit.
  void Finish();

 private:
  // The maps where a visitor can be: the stops of the tour, or all that the session knows. A new visitor must
  // not wait for the library.
  std::vector<std::string> PlaceNames() const;
  void Welcome(std::size_t index);
  // Begins anew when the visitor has left the device, or has finished the tour and is back at its first stop.
  void WatchForNextVisitor(const ShownFrame& frame);
  // For another visitor, or one who wants to see everything again. `why`: what is reported.
  void BeginAnew(Timestamp time, const std::string& why);
  void AddQuestion(ShownFrame* frame);
  void Narrate(const ShownFrame& frame, const engine::CameraModel& camera);
  void ReportProblem(const std::string& problem, Timestamp time) const;
  // What happened on the tour.
  void ReportRoute(Timestamp time);
  void ReportCards(std::size_t index, Timestamp time);

  const GuideRequest& request_;
  Session* const session_;
  const Report report_;
  const VisitorStrings& strings_;
  std::set<std::uint64_t> replaced_;                   // Maps of which there are newer copies.
  std::optional<RouteState> route_;                    // Only of a tour with stops.
  std::vector<std::optional<VisitorGuide>> visitors_;  // By camera.
  std::optional<Narration> narration_;  // Of the first camera; only with `narrate`, as speech_.
  std::optional<Speech> speech_;
  std::optional<LeftTour> left_tour_;  // Of the first camera; only of a kiosk, and of a tour with stops.
  std::optional<VisitKeeper> visits_;  // Of the first camera; only with a folder for their records.
  int visitors_before_ = 0;            // See ShownFrame.
  std::vector<SoundDirector::Key> asked_sounds_;
};

}  // namespace docent::app
