// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/session/content_follower.h"
#include "content/edit_history.h"
#include "content/scene.h"
#include "engine/dense/densification.h"
#include "engine/dense/light_estimate.h"
#include "engine/map/map_snapshot.h"
#include "engine/system/map_permissions.h"
#include "maps/storage/policy.h"

namespace docent::app {

// One map of a session, whether it was read from the library or is being built. Owned by the session, which
// guards it. Snapshots and scenes are immutable once they are stored here, so copies of the pointers may be
// given out.
struct SessionMap {
  std::uint64_t key = 0;
  std::string name;
  maps::Policy policy = maps::Policy::kOpen;
  std::optional<maps::Bounds> bounds;  // only of a bounded map
  // Null while initialization is pending, or when not in memory.
  std::shared_ptr<const engine::MapSnapshot> snapshot;
  std::shared_ptr<const content::Scene> scene = std::make_shared<content::Scene>();  // never null
  content::EditHistory history;
  ContentFollower follower;

  // What the library holds of the map, or will hold once the saver has finished; null when never saved.
  std::shared_ptr<const engine::MapSnapshot> saved_snapshot;
  std::shared_ptr<const content::Scene> saved_scene;
  // Checksum of the scene's text there (maps::SceneTextChecksum). The text of the scene in memory may differ
  // from it, since signposts get the keys and names of their maps when they are read.
  std::uint64_t stored_scene = 0;

  // Content that is damaged was left out when the map was read. The library keeps it until the content is
  // edited here: content that only moved along with keyframes or names of maps counts as stored.
  bool content_left_out = false;

  // Why its content could not be stored last; empty if it could.
  std::string save_problem;

  // The mesh of its surfaces, behind which content is hidden; null while it is not known. It fits the
  // snapshot.
  std::shared_ptr<const engine::MapMesh> mesh;
  // The light that its surfaces show; null without a mesh.
  std::shared_ptr<const engine::LightEstimate> light;
  // Revision for which a mesh was computed, whether there is one or not; 0 for none.
  std::uint64_t meshed_revision = 0;

  bool in_library = false;  // when the session began; without a snapshot it is then not in memory
  bool changed = false;     // in this session: it stays in memory until the end

  // Revision for which maintenance is complete, whether it changed the map or not; 0 for none.
  std::uint64_t maintained_revision = 0;

  bool stopped = false;  // by the user: it is not extended again until it is selected by name

  bool discarded = false;
  std::uint64_t joined_into = 0;           // the map that it was joined into; 0 for none
  std::vector<std::uint64_t> joined_keys;  // keys of the maps that were joined into it

  // Replaces the snapshot by a newer one of the mapper; content moves along with its anchors, and a mesh that
  // no longer fits is dropped.
  void UpdateSnapshot(std::shared_ptr<const engine::MapSnapshot> newer);

  // Replaces the scene by one that follows from another change and is no edit of the content.
  void Follow(std::shared_ptr<const content::Scene> moved);

  // Takes a mesh and the light on it if the mesh fits the snapshot.
  void SetMesh(std::shared_ptr<const engine::MapMesh> made,
               std::shared_ptr<const engine::LightEstimate> light_on_it = nullptr);
  // Whether the mesh shows all that the snapshot does.
  bool HasCurrentMesh() const;

  // What the system may do with the map, from its policy and from what happened to it.
  engine::MapPermissions Permissions() const;
  // Which changes the policy allows, as the author's window calls it; the beginning of a sentence.
  std::string PolicyInWords() const;

  // The map ends. Reports count what it contained, so its numbers are kept; its images, which need most of
  // its memory, and its surfaces are not.
  void Discard();
  // False once the map was discarded or joined into another one.
  bool Exists() const { return !discarded && joined_into == 0; }
  bool NeedsSave() const { return snapshot && (snapshot != saved_snapshot || scene != saved_scene); }
};

// The light that the surfaces of a map show; null if none was seen. Takes a fraction of a second.
std::shared_ptr<const engine::LightEstimate> LightOn(const engine::MapSnapshot& map,
                                                     const engine::MapMesh& mesh);

}  // namespace docent::app
