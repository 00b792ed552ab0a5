// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "maps/storage/scene_tools.h"

// Exchanges maps between the library of a device and a hub (docs/hub.md). Only what differs is transferred,
// and each map is complete or not there at all on either side, whenever a transfer ends. Errors throw
// docent::Error; HubUnreachable (hub_connection.h) when the hub cannot be reached.
namespace docent::maps {

// The result of merging two changes of a scene.
struct MergedScene {
  std::string text;                    // The merged scene.
  std::vector<std::string> asset_ids;  // Its assets.
  // One sentence for each entity that both changed, of which both versions are kept.
  std::vector<std::string> conflicts;
};
// Merges two texts of a scene that were made from the same one, which is empty if it is not known. Only the
// content library can do that. Throws docent::Error if a text cannot be read.
using MergeScenes =
    std::function<MergedScene(const std::string& base, const std::string& mine, const std::string& theirs)>;

// What is exchanged.
struct SyncOptions {
  std::string hub;                    // Its address.
  std::filesystem::path library;      // The file; Pull creates it.
  SceneTools scenes;                  // Check scenes and translate their signposts.
  MergeScenes merge;                  // Without it, a scene that both sides changed makes two maps.
  std::vector<std::string> maps;      // Names; empty for all maps, and the tours.
  std::int64_t bytes_per_second = 0;  // Upper limit of the transfer on average; 0 for none.
  bool remove = false;                // Push: remove from the hub what was removed here.
  std::function<bool()> is_stopped;   // Asked between two transfers; may be empty.
  // Pull: the name on the hub of a map; it comes first, then those that signposts and tours lead to from
  // there, then the others. Empty for no preference.
  std::string near;
  // The same by the key in the library, asked before each map because the visitor goes on meanwhile; 0 where
  // it is not known, which `near` then says. May be empty.
  std::function<std::uint64_t()> near_key;
};

// What was done.
struct SyncReport {
  std::vector<std::string> lines;           // A sentence for each map and tour with which something was done.
  std::vector<std::uint64_t> changed_keys;  // Of the maps that were changed in the library.
  int problems = 0;                         // Lines that say that something was not done.
  int waiting = 0;  // Of these, those that end by themselves: an authoring session has the map open.
  std::uint64_t bytes_sent = 0, bytes_received = 0;  // Of items, without what the protocol adds.
};

// Saves the changes of the library on the hub. Changes that others have made there since are merged.
SyncReport Push(const SyncOptions& options);
// Brings the changes of the hub into the library. Changes that were made here and not pushed are kept.
SyncReport Pull(const SyncOptions& options);
// The same. If it throws, `report` says what was done until then; the library keeps that.
void Pull(const SyncOptions& options, SyncReport* report);

}  // namespace docent::maps
