// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "app/session/session_memory.h"
#include "app/session/session_options.h"
#include "app/session/session_saving.h"
#include "app/session/session_state.h"
#include "engine/mapping/loops/map_joining.h"
#include "engine/system/system.h"
#include "engine/system/system_event.h"

namespace docent::app {

// What a change in the system means for the session: its maps, their content, and what the user is told. With
// the session's mutex held.
class SystemEventHandler {
 public:
  // All pointers must outlive the handler.
  SystemEventHandler(const SessionOptions& options, engine::System* system, SessionState* state,
                     SessionMemory* memory, SessionSaving* saving)
      : options_(options), system_(*system), state_(*state), memory_(*memory), saving_(*saving) {}

  // Brings the session up to date with what happened in the system since the last call, in order, and adds
  // an event in words for what the user should know.
  void HandleEvents();
  // Adds an event when a relocalization of the frame's camera was rejected, with the reason.
  void ReportRejection(const engine::TrackedFrame& frame);

 private:
  void Handle(const engine::SystemEvent& event, const engine::MapEntered& what);
  void Handle(const engine::SystemEvent& event, const engine::Relocalized& what);
  void Handle(const engine::SystemEvent& event, const engine::PoseRejected& what);
  void Handle(const engine::SystemEvent& event, const engine::MapLeft& what);
  void Handle(const engine::SystemEvent& event, const engine::MapUpdated& what);
  void Handle(const engine::SystemEvent& event, const engine::MapDiscarded& what);
  void Handle(const engine::SystemEvent& event, const engine::MapStartedAfterLoss& what);
  void Handle(const engine::SystemEvent& event, const engine::KeyFrameOffered& what);
  void Handle(const engine::SystemEvent& event, const engine::JoinRequested& what);
  void Handle(const engine::SystemEvent& event, const engine::MapsJoined& what);
  void Handle(const engine::SystemEvent& event, const engine::JoinRefused& what);
  void Handle(const engine::SystemEvent& event, const engine::RigChanged& what);
  void Handle(const engine::SystemEvent& event, const engine::CalibrationMismatch& what);
  void Handle(const engine::SystemEvent& event, const engine::LensEstimated& what);
  void Handle(const engine::SystemEvent& event, const engine::MapperFailed& what);
  void Handle(const engine::SystemEvent& event, const engine::MapperEvent& what);
  // Stores the scale of a map that was determined otherwise than by an author, unless the map has one
  // already.
  void AddScale(std::uint64_t key, double metres_per_unit);
  void AbsorbMap(SessionMap* from, const engine::JoinedMap& joined, SessionMap* into);

  const SessionOptions& options_;
  engine::System& system_;
  SessionState& state_;
  SessionMemory& memory_;
  SessionSaving& saving_;
};

}  // namespace docent::app
