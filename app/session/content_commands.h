// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "app/script/commands.h"
#include "app/script/scene_commands.h"
#include "app/session/session_assets.h"
#include "app/session/session_options.h"
#include "app/session/session_state.h"
#include "content/alignment.h"
#include "content/edits.h"
#include "content/placement.h"
#include "engine/system/system.h"
#include "engine/tracking/tracked_frame.h"

namespace docent::app {

// Executes the commands that change the content of the map that a frame shows. Each throws Error with one
// sentence when it cannot be executed; then nothing has changed. With the session's mutex held.
class ContentCommands {
 public:
  // All pointers must outlive this.
  ContentCommands(const SessionOptions& options, engine::System* system, SessionState* state,
                  SessionAssets* assets)
      : options_(options), system_(*system), state_(*state), assets_(*assets) {}

  void Apply(const PlaceModel& command, const engine::TrackedFrame& frame);
  void Apply(const PlaceSignpost& command, const engine::TrackedFrame& frame);
  void Apply(const PlaceLabel& command, const engine::TrackedFrame& frame);
  void Apply(const PlaceImage& command, const engine::TrackedFrame& frame);
  void Apply(const PlaceSound& command, const engine::TrackedFrame& frame);
  void Apply(const PlaceTrail& command, const engine::TrackedFrame& frame);
  void Apply(const ExtendTrail& command, const engine::TrackedFrame& frame);
  void Apply(const PlaceOccluder& command, const engine::TrackedFrame& frame);
  void Apply(const MoveEntity& command, const engine::TrackedFrame& frame);
  void Apply(const SetSignpostTarget& command, const engine::TrackedFrame& frame);
  void Apply(const SetSignpostDirection& command, const engine::TrackedFrame& frame);
  void Apply(const PasteEntities& command, const engine::TrackedFrame& frame);
  void Apply(const AlignEntity& command, const engine::TrackedFrame& frame);
  void Apply(const BendEntity& command, const engine::TrackedFrame& frame);
  void Apply(const SetMapUp& command, const engine::TrackedFrame& frame);
  void Apply(const SetMapScale& command, const engine::TrackedFrame& frame);
  void Apply(const SetMapEntrance& command, const engine::TrackedFrame& frame);
  void Apply(const Undo& command, const engine::TrackedFrame& frame);
  void Apply(const Redo& command, const engine::TrackedFrame& frame);
  // The commands that need nothing but the scene.
  template <SceneCommand C>
  void Apply(const C& command, const engine::TrackedFrame& frame) {
    SessionMap& map = MapToEdit(frame);
    Edit(&map, EditFor(*map.scene, command));
  }

 private:
  SessionMap& MapToEdit(const engine::TrackedFrame& frame);
  void Edit(SessionMap* map, content::SceneChange change);
  // In the map as it is now.
  content::SurfaceHit SurfaceFor(const engine::TrackedFrame& frame, const Eigen::Vector2d& pixel) const;
  // How the map has been adjusted around a place since the frame was tracked: a frozen view shows an old one.
  engine::Sim3 MotionSince(const engine::TrackedFrame& frame, const Eigen::Vector3d& place) const;
  std::vector<content::Correspondence> Correspondences(const engine::TrackedFrame& frame,
                                                       const std::vector<PointPair>& pairs) const;
  // The point with the normal of its surface; of coordinates, the map's up direction.
  content::SurfaceHit PlaceFor(const engine::TrackedFrame& frame, const MapPoint& point) const;
  std::uint64_t TargetKey(const SessionMap& map, const std::string& to_map);

  const SessionOptions& options_;
  engine::System& system_;
  SessionState& state_;
  SessionAssets& assets_;
};

}  // namespace docent::app
